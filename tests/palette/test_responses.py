# SPDX-License-Identifier: GPL-3.0-or-later
"""Responses to a request that is dropped: those of a dense least-squares problem with the same bounds held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.palette_joint import generated_palette
from benchmarks.palette.palette_speed import coupled_palette
from spectral_core.palette import Cell, PaletteProblem, solve_palette
from spectral_core.palette.conflicts import find_conflicts
from spectral_core.palette.responses import NEAR, Responses


def with_given_lights(problem: PaletteProblem) -> PaletteProblem:
    return replace(problem, lights=tuple(replace(light, free=False) for light in problem.lights))


def dense_changes(solution, cell, released):
    """Change of a cell's color by the release of each other cell, from all rows as one least-squares problem."""
    assembled, answer = solution.state.record["reflectances"]
    quadratic = assembled.quadratic
    x = quadratic.joined(answer.colors, answer.values)
    free = (x > quadratic.lower + NEAR) & (x < quadratic.upper - NEAR)

    def colors_without(other):
        left = quadratic
        for k, block in enumerate(quadratic.blocks):
            of_cell = [number == other for _, number in block.keys]
            dropped = np.concatenate([np.repeat(of_cell, 3), np.zeros(len(block.weights) - 3 * len(of_cell), bool)])
            left = left.with_block(k, replace(block, weights=np.where(dropped, 0.0, block.weights)))
        matrix, target = left.least_squares()
        matrix = matrix.toarray()
        found = x.copy()
        found[free] = np.linalg.lstsq(matrix[:, free], target - matrix[:, ~free] @ x[~free], rcond=1e-12)[0]
        spectra = dict(zip(assembled.items, left.split(found)[1], strict=True))
        return solution.state.with_values("reflectances", spectra).colors()[cell]

    return np.array([colors_without(other) - colors_without(None) for other in released])


# Boxes whose ends hold a free color (7, 8, 23), given surfaces, Same As and Constant among other requests.
PROBLEMS = [with_given_lights(generated_palette(9000 + seed)) for seed in (0, 2, 7, 8, 22, 23)]
PROBLEMS += [coupled_palette((4, 5, 31), np.random.default_rng(seed)) for seed in (1, 2)]


@pytest.mark.parametrize("number", range(len(PROBLEMS)))
def test_the_change_by_a_release_is_that_of_a_dense_problem(number):
    problem = PROBLEMS[number]
    cells = tuple(tuple(replace(cell, exact=False) for cell in row) for row in problem.cells)
    solution = solve_palette(replace(problem, cells=cells), explain=False)
    assembled, answer = solution.state.record["reflectances"]
    asked = list(dict.fromkeys(cell for block in assembled.quadratic.blocks for _, cell in block.keys))
    responses = Responses.of(assembled, answer, set(asked))
    compared = 0
    for cell in asked:
        others = [other for other in asked if other != cell and other[0] == cell[0]]
        (found,) = responses.moved([cell], others)
        np.testing.assert_allclose(found, dense_changes(solution, cell, others), rtol=2e-3, atol=2e-5)
        compared += len(others)
    assert compared > 2


def test_a_perceptual_match_moves_colors_by_linear_rgb(rng):
    """Rows in CIELAB are converted back: the first-order change by a small release equals that of a new solve."""
    problem = replace(coupled_palette((2, 4, 31), rng), match="perceptual")
    light = Cell.fixed(problem.cells[0][1].target, weight=1e-3)
    problem = problem.with_cell((0, 1), light)
    solution = solve_palette(problem, explain=False)
    assembled, answer = solution.state.record["reflectances"]
    assert assembled.view.metric is not None
    others = [(0, 1)]
    responses = Responses.of(assembled, answer, {(0, 1), (0, 2), (0, 3)})
    moved = responses.moved([(0, 2), (0, 3)], others)[:, 0]
    np.testing.assert_allclose(moved[0], dense_changes(solution, (0, 2), others)[0], rtol=1e-2, atol=1e-8)
    np.testing.assert_allclose(moved[1], dense_changes(solution, (0, 3), others)[0], rtol=1e-2, atol=1e-8)
    assert np.abs(moved).max() > 1e-7


def test_a_free_color_at_an_end_of_its_box_does_not_move_with_the_release():
    """The first request of surface 4 is a box; the error of the second was said to rise to 136 without it."""
    problem = with_given_lights(replace(generated_palette(9009), rounds=3))
    solution = solve_palette(problem, explain=False)
    (conflict,) = [each for each in find_conflicts(solution) if each.cell == (4, 1)]
    assert conflict.relieved_by[0] == (4, 0)
    released = solve_palette(problem.with_cell((4, 0), Cell.ignore()), explain=False)
    assert conflict.delta_e_without == pytest.approx(released.delta_e_2000[4, 1], abs=0.05)


def test_a_cell_with_a_target_and_a_link_is_released_as_one():
    """Both requests of a cell are dropped: six rows."""
    problem = coupled_palette((3, 3, 31), np.random.default_rng(4))
    problem = problem.with_cell((1, 0), Cell.fixed((0.4, 0.5, 0.3))).with_cell((2, 0), Cell.same_as((1, 0)))
    problem = problem.with_cell((0, 0), Cell.ignore())
    solution = solve_palette(problem, explain=False)
    assembled, answer = solution.state.record["reflectances"]
    cells = {(1, j) for j in range(3)} | {(2, 0)}
    responses = Responses.of(assembled, answer, cells)
    twice = [cell for cell in cells if len(responses.rows.get(cell, [])) == 2]
    assert twice == [(1, 0)]
    (found,) = responses.moved([(1, 1)], [(1, 0)])
    np.testing.assert_allclose(found, dense_changes(solution, (1, 1), [(1, 0)]), rtol=1e-3, atol=1e-6)
    assert np.abs(found).max() > 1e-4
