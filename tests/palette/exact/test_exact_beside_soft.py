# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact cells beside soft requests, at the end of what a lamp can show, and the smallest sets that cannot all hold.

Whether exact cells hold is decided by linear programs of this file, on integrals by Simpson's rule.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.conflicts import conflicting_cells
from spectral_core.palette.presets import design_grid, metamer_pair
from spectral_core.palette.reach.possible import possible_colors
from spectral_core.spectra.catalogue import color_matching_functions, illuminant
from spectral_core.spectra.color import RGB_FROM_XYZ, lab_from_linear_rgb
from spectral_core.spectra.observer import normalized

GRID = design_grid()


def rows_of(light) -> np.ndarray:
    """(3, n) from a reflectance on the grid to linear sRGB."""
    knots, table = color_matching_functions("cie_1931_2deg")
    edges = np.unique(np.concatenate([knots, light.grid.wavelengths_nm, GRID.wavelengths_nm]))
    edges = edges[(edges >= 380) & (edges <= 780)]
    found = np.zeros((3, GRID.size))
    for at, share in ((0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6)):
        points = edges[:-1] + at * np.diff(edges)
        power = np.interp(points, light.grid.wavelengths_nm, light.values) * np.diff(edges) * share
        hats = np.stack([np.interp(points, GRID.wavelengths_nm, hat) for hat in np.eye(GRID.size)], axis=1)
        found += RGB_FROM_XYZ @ (np.stack([np.interp(points, knots, row) for row in table]) * power) @ hats
    return found


def least_miss(problem: PaletteProblem, only=None) -> float:
    """The least possible error of the worst exact cell of designed materials, of some or all cells."""
    n = GRID.size
    by_light = [rows_of(light.spectrum) for light in problem.lights]

    def color(cell) -> np.ndarray:
        wide = np.zeros((3, n * len(problem.reflectances)))
        wide[:, n * cell[0] : n * (cell[0] + 1)] = by_light[cell[1]]
        return wide

    matrices, low, high = [], [], []
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if not cell.exact or (only is not None and (i, j) not in only):
                continue
            asked = [(color((i, j)) - color(other), np.zeros(3), np.zeros(3)) for other in cell.others]
            asked += [] if cell.target is None else [(color((i, j)), cell.target, cell.target)]
            asked += [] if cell.box is None else [(color((i, j)), *cell.box)]
            for matrix, least, most in asked:
                matrices.append(matrix)
                low.append(least)
                high.append(most)
    if not matrices:
        return 0.0
    matrix, least, most = (np.concatenate(each) for each in (matrices, low, high))
    one = -np.ones((len(matrix), 1))
    answer = linprog(
        np.append(np.zeros(matrix.shape[1]), 1.0),
        A_ub=np.block([[1e3 * matrix, one], [-1e3 * matrix, one]]),
        b_ub=1e3 * np.concatenate([most, -least]),
        bounds=[(0, 1)] * matrix.shape[1] + [(0, None)],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    return float(answer.x[-1] / 1e3)


def palette(lamps, *rows, luminance=1.0, **settings) -> PaletteProblem:
    lights = tuple(PaletteLight(normalized(illuminant(name), luminance=luminance)) for name in lamps)
    names = tuple(PaletteReflectance(f"m{number}") for number in range(len(rows)))
    return PaletteProblem(GRID, lights, names, rows, **settings)


def test_a_soft_range_does_not_break_an_exact_match() -> None:
    """Two materials can match in every color; that no blue in the range exists was called a conflict of the match."""
    preset = metamer_pair(box=((0.05, 0.1, 1.3), (0.35, 0.45, 1.5)))
    problem = preset.with_cell((0, 1), replace(preset.cells[0][1], exact=False))
    assert least_miss(problem) < 1e-10
    solution = solve_palette(problem)
    assert solution.status == "compromise"
    shown = solution.actual_linear_rgb[:, 1]
    assert np.abs(shown[0] - shown[1]).max() < 1e-9
    assert solution.delta_e_2000[1, 1] < 1e-6 and solution.delta_e_2000[0, 1] > 1.0
    # The exact range cannot hold, and is named.
    held = solve_palette(preset)
    assert held.status == "exact_conflict" and (0, 1) in conflicting_cells(held)


def test_a_soft_link_between_exact_matches_stays_soft() -> None:
    """Two exact pairs, one red and one blue in daylight, and a soft request that they be alike."""
    lamps = normalized(illuminant("D65")), normalized(illuminant("HP1"))
    row = rows_of(lamps[0]), rows_of(lamps[1])
    # Colors of smooth reflectances, so that they can hold.
    waves = GRID.wavelengths_nm
    warm, cold = 0.5 + 0.3 * np.tanh((waves - 580) / 60), 0.5 - 0.3 * np.tanh((waves - 520) / 60)
    near = replace(lamps[0], values=lamps[0].values * (1 + 1e-7 * np.sin(waves.size + np.arange(lamps[0].values.size))))
    lights = PaletteLight(lamps[0]), PaletteLight(near), PaletteLight(lamps[1])
    cells = (
        (Cell.ignore(), Cell.fixed(row[0] @ warm, exact=True), Cell.ignore()),
        (Cell.same_as((0, 0), exact=True), Cell.ignore(), Cell.fixed(row[1] @ warm, exact=True)),
        (Cell.same_as((1, 0), weight=0.5), Cell.fixed(row[0] @ cold), Cell.ignore()),
        (Cell.same_as((2, 0), exact=True), Cell.fixed(row[0] @ cold, exact=True), Cell.ignore()),
    )
    names = tuple(PaletteReflectance(each) for each in "abcd")
    problem = PaletteProblem(GRID, lights, names, cells)
    assert least_miss(problem) < 1e-10
    solution = solve_palette(problem, explain=False)
    shown = solution.actual_linear_rgb[:, 0]
    assert solution.status == "compromise", solution.remedy
    assert np.abs(shown[0] - shown[1]).max() < 1e-9 and np.abs(shown[2] - shown[3]).max() < 1e-9
    assert np.abs(shown[1] - shown[2]).max() > 0.05


def test_cells_of_a_conflict_are_a_smallest_set() -> None:
    """One of the three named cells only referred to a cell that another one connects with the conflict."""
    warm = (0.9, 0.2, 0.1)
    problem = palette(
        ("LED-RGB1", "A"),
        (Cell.same_as((2, 0), exact=True), Cell.fixed(warm, exact=True)),
        (Cell.ignore(), Cell.ignore()),
        (Cell.same_as((0, 1), exact=True), Cell.fixed((0.1, 0.4, 0.5))),
        (Cell.same_as((0, 0), exact=True), Cell.ignore()),
    ).with_cell((2, 1), Cell.fixed((0.05, 0.5, 0.6), exact=True))
    _is_smallest(problem)


@pytest.mark.parametrize("color", [(0.489, 0.365, 0.17), (0.7, 0.3, 0.1), (0.1, 0.3, 0.5)])
def test_a_constant_cell_beside_its_target_is_named(color) -> None:
    """No cell was named where rows of a target and of a link are equal."""
    cells = (Cell.fixed(color, exact=True), Cell.constant((0, 0), exact=True))
    _is_smallest(palette(("D65", "LED-B1"), cells))


def _is_smallest(problem: PaletteProblem) -> None:
    assert least_miss(problem) > 1e-4
    solution = solve_palette(problem)
    assert solution.status == "exact_conflict"
    named = conflicting_cells(solution)
    assert named and least_miss(problem, named) > 1e-9
    for cell in named:
        assert least_miss(problem, set(named) - {cell}) < 1e-8


def test_constant_with_a_black_cell_is_no_conflict_of_black() -> None:
    """Black is what the cell asks for, and was called the only color in which it can hold."""
    problem = palette(
        ("HP1", "D65"),
        (Cell.constant((0, 1), exact=True), Cell.black(exact=True)),
        (Cell.fixed((0.3, 0.2, 0.0)), Cell.constant((1, 0), exact=True)),
    )
    remedy = solve_palette(problem).remedy
    assert "“m1” under “HP1”" in remedy and "“m0”" not in remedy


@pytest.mark.parametrize("edge", [450.0, 520.0, 600.0])
@pytest.mark.parametrize("lamp", ["FL7", "HP1", "LED-RGB1"])
def test_the_nearest_color_beside_an_optimal_one_is_found(lamp, edge) -> None:
    """The exact color is that of an edge of 3 nm, which leaves hardly any other reflectance; it ended in an error."""
    lamps = ("D65", lamp)
    own = 1 / (1 + np.exp((edge - GRID.wavelengths_nm) / 3))
    rows = [rows_of(normalized(illuminant(name))) for name in lamps]
    problem = palette(lamps, (Cell.ignore(), Cell.fixed(rows[1] @ own, exact=True)))
    for wanted in ((0.4, 0.3, 0.2), (0.1, 0.1, 0.9), (0.9, 0.9, 0.9)):
        found = possible_colors(problem, (0, 0)).nearest(wanted)
        assert np.abs(rows[1] @ found.reflectance - rows[1] @ own).max() < 1e-6
        # That of the edge itself is possible, and no nearer.
        lab = lab_from_linear_rgb(np.array([wanted, found.color, rows[0] @ own]))
        assert np.linalg.norm(lab[1] - lab[0]) <= np.linalg.norm(lab[2] - lab[0]) + 1e-3
