# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments of a wrong type are named in one line, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from spectral_core import lattice
from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteSession, presets, solve_palette

PROBLEM = presets.metamer_pair()
SQUARE = lattice.box([0, 0], [1, 1])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: replace(PROBLEM, grid=[400, 500]), r"the grid of a palette is \[400, 500\]; expected a SpectralGrid"),
        (
            lambda: replace(PROBLEM, lights=(PROBLEM.lights[0].spectrum,) * 2),
            r"lights\[0\] is Illuminant\('HP1', .*\); expected a PaletteLight$",
        ),
        (lambda: solve_palette(PROBLEM, warm=PROBLEM), "warm is of type PaletteProblem; expected a PaletteSolution"),
        (lambda: PaletteSession(PROBLEM).edit((0.0, 0), Cell.ignore()), r"a cell is at \(0.0, 0\); expected"),
        (lambda: presets.most_distinct(2.5), "count is 2.5; expected a whole number"),  # type: ignore[arg-type]
        (lambda: lattice.progressive_fill(SQUARE, "5"), "the number of points is '5'; expected a whole number"),
        (lambda: lattice.progressive_fill([[0, 0], [1, 1]], 5), "the region is of type list; expected a Region"),
    ],
)
def test_a_wrong_type_is_named(call: Callable[[], object], said: str) -> None:
    """These ended in an AttributeError or a TypeError of some inner line, or printed every sample of a spectrum."""
    with pytest.raises(InvalidInputError, match=said) as raised:
        call()
    assert "\n" not in str(raised.value)
