# SPDX-License-Identifier: GPL-3.0-or-later
"""The smallest conflict of a long chain of equal cells is the whole chain, and few programs prove it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, presets, solve_palette
from spectral_core.palette.conflicts import conflicting_cells
from spectral_core.palette.explain import exact_sets
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized


def chain(count: int, order: np.ndarray, extra: bool) -> tuple[PaletteProblem, set[tuple[int, int]]]:
    """Materials that all equal the one before, a dark one at one end and a bright one at the other."""
    rows = [[Cell.ignore(), Cell.ignore()] for _ in range(count)]
    rows[order[0]][0] = Cell.fixed((0.1, 0.1, 0.1), exact=True)
    for before, at in pairwise(order):
        rows[at][0] = Cell.same_as((int(before), 0), exact=True)
    rows[order[-1]][1] = Cell.fixed((0.4, 0.4, 0.4), exact=True)
    cells = {(int(at), 0) for at in order} | {(int(order[-1]), 1)}
    if extra:  # cells that hold beside the chain
        rows[order[count // 2]][1] = Cell.free(((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), exact=True)
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in ("D65", "D50"))
    surfaces = tuple(PaletteReflectance(f"r{number}") for number in range(count))
    return PaletteProblem(presets.design_grid(), lights, surfaces, tuple(map(tuple, rows))), cells


@pytest.mark.parametrize("extra", [False, True])
@pytest.mark.parametrize("shuffled", [False, True])
def test_a_chain_is_proved_by_few_programs(shuffled, extra, rng, monkeypatch):
    count = 24
    problem, cells = chain(count, rng.permutation(count) if shuffled else np.arange(count), extra)
    solution = solve_palette(problem, explain=False)
    assert solution.status == "exact_conflict"
    sizes, program = [], exact_sets._in_conflict
    monkeypatch.setattr(exact_sets, "_in_conflict", lambda q, r: sizes.append(len(r)) or program(q, r))
    assert set(conflicting_cells(solution)) == cells
    # Without sets that are known to hold there are as many programs as cells, each of nearly the whole chain.
    assert sum(size > count // 2 for size in sizes) <= 4
