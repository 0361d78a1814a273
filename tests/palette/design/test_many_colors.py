# SPDX-License-Identifier: GPL-3.0-or-later
"""Palettes with more shared colors than a block counts with: every spectrum depends on a few of them."""

import tracemalloc

import numpy as np
import pytest

from benchmarks.palette.checks.optimality import side_gains
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, PaletteSession, solve_palette
from spectral_core.palette.presets import design_grid
from spectral_core.palette.qp.squares import MOST_DENSE
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import linear_rgb_from_product, normalized


def constant_palette(count: int, rng: np.random.Generator) -> PaletteProblem:
    """Materials of random colors under two lights, and the first of these colors again under a third light."""
    grid = design_grid(20.0)
    lights = [normalized(illuminant(name), luminance=2.0) for name in ("D65", "A", "FL11")]
    knots = np.linspace(380.0, 780.0, 6)
    cells = []
    for i in range(count):
        smooth = np.interp(grid.wavelengths_nm, knots, rng.uniform(0.05, 0.45, 6))
        first, second = (Cell.fixed(linear_rgb_from_product(light, grid) @ smooth) for light in lights[:2])
        cells.append((first, second, Cell.constant((i, 0))))
    return PaletteProblem(
        grid,
        tuple(map(PaletteLight, lights)),
        tuple(PaletteReflectance(f"paint {i}") for i in range(count)),
        tuple(cells),
        smoothness=0.05,
    )


def test_many_shared_colors_are_solved_in_little_memory(rng):
    """Arrays of all colors for each material took 3.6 GB and half a minute for 200 materials."""
    problem = constant_palette(50, rng)
    solve_palette(problem.with_cell((0, 0), Cell.ignore()), explain=False)  # imports
    tracemalloc.start()
    solution = solve_palette(problem, explain=False)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 30e6
    assert solution.status.trusted
    gains = side_gains(solution)
    assert max(gains.values()) < 1e-6


@pytest.mark.parametrize("exact", [False, True])
def test_edits_beside_many_shared_colors_give_a_new_solution(rng, exact):
    """Links that come and go change the colors that a spectrum depends on."""
    problem = constant_palette(MOST_DENSE // 3 + 1, rng)
    session = PaletteSession(problem)
    edits = [
        ((1, 0), Cell.fixed((0.3, 0.2, 0.1), exact=exact)),
        ((3, 0), Cell.same_as((2, 0), exact=exact)),
        ((4, 2), Cell.same_as((1, 2), weight=30.0)),
        ((3, 0), Cell.fixed((0.2, 0.3, 0.2), weight=700.0)),
        ((4, 2), Cell.free()),
        ((2, 1), Cell.fixed((0.1, 0.2, 0.05), weight=0.01)),
    ]
    for cell, wanted in edits:
        answer = session.edit(cell, wanted)
        problem = problem.with_cell(cell, wanted)
        fresh = solve_palette(problem, explain=False)
        assert fresh.status.trusted
        shown = np.array([[fresh.actual_linear_rgb[i, j] for j in range(2)] for i in range(5)])
        np.testing.assert_allclose(answer.actual_linear_rgb[:5, :2], shown, atol=1e-5)
