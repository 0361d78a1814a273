# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments of a wrong type are named in one line, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from spectral_core import lattice
from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, PaletteSession, presets, solve_palette
from spectral_core.palette.alternatives import alternatives
from spectral_core.palette.files import write_solution
from spectral_core.palette.paint.fluorescent_design import solve_fluorescent
from spectral_core.palette.paint.mixtures import (
    absorption_from_reflectance,
    additive_mixture,
    paint_mixture,
    reflectance_from_absorption,
    tint_differences,
)
from spectral_core.palette.paint.tints import TintCriterion, solve_with_tints
from spectral_core.palette.reach.possible import possible_colors
from spectral_core.palette.reach.reachable import CellReach
from spectral_core.palette.recipe.material import Colorants
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.spectrum import Reflectance

PROBLEM = presets.metamer_pair()
SQUARE = lattice.box([0, 0], [1, 1])
GRID = presets.design_grid(20.0)
LAMP, HALF = illuminant("D65"), np.full(GRID.size, 0.5)
GRAY = Reflectance("gray", GRID, HALF)
PAINTS = Colorants("paints", ("a", "b"), GRID, np.stack([0.2 * HALF, HALF]))
SOLUTION = solve_palette(PROBLEM)
POSSIBLE = possible_colors(PROBLEM, (0, 0))
NAN = float("nan")


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: paint_mixture([0.5, 0.5], [HALF, NAN * HALF]), "21 value.s. that are not finite"),
        (lambda: paint_mixture([0.5, 0.5], [HALF, -HALF]), "span -0.5 to 0.5; Kubelka-Munk needs 0 to 1"),
        (lambda: paint_mixture([0.5, 0.5], [HALF, HALF], [1, NAN]), "scattering holds 1 value"),
        (lambda: paint_mixture([0.5, 0.5], [HALF, HALF], [1, 1, 1]), r"scattering has shape \(3,\); expected \(2,\)"),
        (lambda: additive_mixture([0.5, 0.5], [HALF, NAN * HALF]), "that are not finite"),
        (lambda: absorption_from_reflectance([0.5, NAN]), "that are not finite"),
        (lambda: reflectance_from_absorption([1.0, -1.0]), "K/S is -1 at least; expected it from 0"),
        (lambda: reflectance_from_absorption(NAN), "K/S holds 1 value"),
        (lambda: tint_differences(SOLUTION, [(0, 1)], base=-1), "the base of tints span -1 to -1"),
        (lambda: tint_differences(SOLUTION, [(0, 1)], base=NAN), "the base of tints holds 1 value"),
        (lambda: tint_differences(SOLUTION, [(0, 2)]), r"a pair is \(0, 2\); expected two numbers .* from 0 to 1"),
        (lambda: tint_differences(SOLUTION, iter([(0, 2)])), r"a pair is \(0, 2\)"),
        (lambda: solve_fluorescent(PROBLEM, {0: iter([GRAY])}), "a dye of reflectance 0 is .* a FluorescentDye"),
        (lambda: TintCriterion(base=2.5), "Kubelka-Munk needs 0 to 1"),
        (lambda: TintCriterion(levels=()), "at least one level"),
        (lambda: solve_with_tints(PROBLEM, iterations=2.5), "iterations is 2.5; expected a whole number"),
        (lambda: solve_fluorescent(PROBLEM, {0: [GRAY]}), "a dye of reflectance 0 is .* expected a FluorescentDye"),
        (lambda: solve_fluorescent(PROBLEM, {}, start=[LAMP]), "start has 1 light; expected 2"),
        (lambda: presets.split_light(grid=5.0), "the grid of a palette is '5.0', of type float"),
        (lambda: presets.color_constancy(changing=[(0.1, 0.2, 0.3)]), r"changing has shape \(1, 3\); expected 2×3"),
        (lambda: presets.hidden_mark(conceal=[]), "name of an illuminant is"),
        (lambda: possible_colors(PROBLEM, (-1, 0)), r"cell \(-1, 0\) is outside the table of 2×2 cells"),
        (lambda: possible_colors(PROBLEM, (0, 0), lights=[LAMP]), "1 light; expected 2"),
        (lambda: POSSIBLE.without((7, 7), (0.1, 0.1, 0.1)), r"cell \(7, 7\) is not among the exact cells"),
        (lambda: POSSIBLE.section(NAN), "the lightness of a section is nan"),
        (lambda: CellReach(LAMP, GRID, bounds=(1.0, 0.0)), r"are \(1.0, 0.0\); expected the lower one first"),
        (lambda: alternatives(PROBLEM, locked={9: GRAY}), "reflectance 9 is locked; expected numbers from 0 to 1"),
        (lambda: PaletteSession(PROBLEM, rounds_per_edit="x"), "rounds_per_edit is x, a text; expected a number"),
        (lambda: replace(PAINTS, scattering=(1, -1)), "scattering is -1 at least; expected it above 0"),
        (lambda: PAINTS.reflectance((0, 0)), r"amounts are \[0.0, 0.0\]; expected at least 0, and some above"),
        (lambda: write_solution("x.json", PROBLEM), "of type PaletteProblem; expected a PaletteSolution"),
        (lambda: replace(PROBLEM, grid=[400, 500]), r"the grid of a palette is \[400, 500\]; expected a SpectralGrid"),
        (
            lambda: replace(PROBLEM, lights=(PROBLEM.lights[0].spectrum,) * 2),
            r"lights\[0\] is Illuminant\('HP1', .*\); expected a PaletteLight$",
        ),
        (lambda: solve_palette(PROBLEM, warm=PROBLEM), "warm is of type PaletteProblem; expected a PaletteSolution"),
        (lambda: PaletteSession(PROBLEM).edit((0.0, 0), Cell.ignore()), r"a cell refers to \(0.0, 0\); expected"),
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


def test_values_that_can_be_read_once_count() -> None:
    """The check of a generator's pairs used them up, and the result had none.

    The last digits of a product of matrices depend on where the arrays lie in memory.
    """
    once = tint_differences(SOLUTION, iter([(0, 1)]))
    np.testing.assert_allclose(once, tint_differences(SOLUTION, [(0, 1)]), rtol=1e-9)
