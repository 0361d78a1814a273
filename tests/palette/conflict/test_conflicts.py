# SPDX-License-Identifier: GPL-3.0-or-later
"""Conflicts: errors predicted from multipliers equal those of a new solve, and conflicts are sorted by their relief."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.palette_joint import generated_palette
from benchmarks.palette.palette_speed import coupled_palette
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, presets, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.conflicts import conflicting_cells
from spectral_core.palette.design.lights import LightDescent, outer_side
from spectral_core.palette.design.rounds import Rounds, SolveTrace
from spectral_core.palette.live.session import PaletteSession
from spectral_core.palette.presets import split_light
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.observer import normalized


def given_lights(rng):
    """Figure 5.2 with given lights: targets under different lights conflict."""
    asked = split_light(luminance=4.0)
    return replace(asked, lights=tuple(PaletteLight(light.spectrum) for light in asked.lights))


def test_the_predicted_relief_is_near_that_of_a_new_solve(rng):
    problem = given_lights(rng)
    solution = solve_palette(problem)
    assert solution.status == "compromise"
    predicted, solved = [], []
    for conflict in solution.conflicts:
        assert conflict.relieved_by
        released = problem.with_cell(conflict.relieved_by[0], Cell.ignore())
        predicted.append(conflict.delta_e_without)
        solved.append(solve_palette(released, explain=False).delta_e_2000[conflict.cell])
        assert solved[-1] < conflict.delta_e_2000
    # The prediction ignores that bounds become inactive, so it is not exact.
    missed = np.array([conflict.delta_e_2000 for conflict in solution.conflicts])
    assert np.all(np.abs(np.subtract(predicted, solved)) < 0.5 * missed)


def test_conflicts_are_sorted_by_their_relief(rng):
    problem = given_lights(rng)
    solution = solve_palette(problem)
    worst = solution.conflicts[0]
    assert len(worst.relieved_by) > 1
    errors = [
        solve_palette(problem.with_cell(cell, Cell.ignore()), explain=False).delta_e_2000[worst.cell]
        for cell in (worst.relieved_by[0], worst.relieved_by[-1])
    ]
    assert errors[0] < errors[1]


def test_the_smallest_conflicting_set_is_complete(rng):
    problem = coupled_palette((2, 5, 31), rng)
    exact = {(0, j): Cell.fixed((0.3, 0.3, 0.3), exact=True) for j in (1, 2)}
    solution = solve_palette(problem.with_cells({**exact, (0, 4): Cell.fixed((0.0, 0.9, 0.9), exact=True)}))
    assert solution.status == "exact_conflict"
    cells = conflicting_cells(solution)
    assert (0, 4) in cells
    if len(cells) > 1:
        assert "cannot all be exact" in solution.remedy


def pair(*rows, lamps=("Triphosphor FL", "Luxeon WW 2880", "Metal Halide"), **settings):
    lights = tuple(PaletteLight(normalized(illuminant(name))) for name in lamps)
    surfaces = tuple(PaletteReflectance(f"r{number}") for number in range(len(rows)))
    return PaletteProblem(presets.design_grid(), lights, surfaces, rows, **settings)


def released(problem, cell):
    """The palette in which one cell is as it is, and not exact."""
    return problem.with_cell(cell, replace(problem.cells[cell[0]][cell[1]], exact=False))


CONFLICTS = {
    "a target that need not hold beside a shared color": pair(
        (
            Cell.constant((0, 1), exact=True),
            Cell.fixed((0.387, 0.199, 0.077), exact=True),
            Cell.fixed((1.028, 1.077, 0.959), exact=True),
        )
    ),
    "a cell that is exact because another refers to it": pair(
        (Cell.free(), Cell.ignore(), Cell.fixed((0.9, 0.1, 0.1), exact=True)),
        (Cell.same_as((0, 0), exact=True), Cell.fixed((0.2, 0.7, 0.7), exact=True), Cell.ignore()),
        (Cell.same_as((0, 0), exact=True), Cell.fixed((0.9, 0.1, 0.1)), Cell.ignore()),
    ),
    "one request alone": pair(
        (Cell.constant((0, 1), exact=True), Cell.ignore()), lamps=("D50", "C"), reflectance_bounds=(0.05, 0.8)
    ),
}


@pytest.mark.parametrize("which", CONFLICTS)
def test_to_release_any_of_the_conflicting_cells_ends_their_conflict(which) -> None:
    """Cells were named that are not exact, and of those that are some that could be released in vain."""
    problem = CONFLICTS[which]
    solution = solve_palette(problem)
    assert solution.status == "exact_conflict"
    cells = conflicting_cells(solution)
    assert cells and all(problem.cells[i][j].exact for i, j in cells)
    assert ("cannot all be exact" if len(cells) > 1 else "cannot be exact.") in solution.remedy
    others = {(i, j) for i, row in enumerate(problem.cells) for j, cell in enumerate(row) if cell.exact} - set(cells)
    alone = problem
    for cell in others:
        alone = released(alone, cell)
    assert solve_palette(alone, explain=False).status == "exact_conflict"
    for cell in cells:
        assert solve_palette(released(alone, cell), explain=False).status != "exact_conflict"


# -- requests of cells in the solved problem --------------------------------------------------------------------------


def quadratic_of(problem, side="reflectances"):
    return Assembler(problem, compiled_requests(problem)).assembled(side, initial_state(problem)).quadratic


def test_a_group_member_has_the_largest_weight_that_refers_to_it(rng):
    problem = coupled_palette((3, 3, 31), rng)
    cells = {(1, 0): Cell.same_as((0, 0), weight=2.0), (2, 0): Cell.same_as((0, 0), weight=7.0)}
    (group,) = compiled_requests(problem.with_cells({(0, 0): Cell.free(), **cells})).groups
    by_cell = dict(zip(group.members, group.weights, strict=True))
    assert by_cell[0, 0] / by_cell[1, 0] == pytest.approx(3.5)


def test_a_given_member_of_a_group_counts_with_its_own_weight(rng):
    """One designed and one measured surface share a color: the common color is their weighted mean."""
    problem = coupled_palette((2, 2, 31), rng)
    given = solve_palette(problem, explain=False).reflectances[1]
    surfaces = (PaletteReflectance("designed"), PaletteReflectance("given", given))
    cells = (
        (Cell.free(), Cell.fixed((0.9, 0.1, 0.1), weight=50.0)),
        # The median weight is that of the colors, so that the group's weight is not 1 after scaling.
        (Cell.same_as((0, 0), weight=3.0), Cell.fixed((0.5, 0.2, 0.2), weight=50.0)),
    )
    problem = replace(problem, reflectances=surfaces, cells=cells)
    session = PaletteSession(problem)
    answer = session.edit((0, 1), Cell.fixed((0.85, 0.1, 0.1), weight=50.0))
    quadratic = quadratic_of(problem)
    assert quadratic.known_weights == pytest.approx(quadratic.blocks[0].weights[:3])
    assert quadratic.known_weights == pytest.approx(np.full(3, (3.0 / 50.0) ** 2 / 3))
    fresh = solve_palette(session.problem, explain=False)
    np.testing.assert_allclose(answer.actual_linear_rgb, fresh.actual_linear_rgb, atol=1e-7)


def test_live_edits_of_capped_weights_equal_a_new_solve(rng):
    session = PaletteSession(coupled_palette((3, 3, 31), rng))
    session.edit((0, 1), Cell.fixed((0.3, 0.3, 0.3), weight=1e9))
    for weight in (1.0, 1e-7, 20.0):
        answer = session.edit((1, 1), Cell.fixed((0.5, 0.2, 0.2), weight=weight))
        fresh = solve_palette(session.problem, explain=False)
        np.testing.assert_allclose(answer.actual_linear_rgb[:2, 1], fresh.actual_linear_rgb[:2, 1], atol=1e-6)


def test_a_cell_that_is_compared_with_another_is_relieved_by_what_opposes_it(rng):
    """The other colors of its spectrum under an equal light, or the other cell; little weight does nothing."""
    base = coupled_palette((2, 3, 31), rng)
    lights = tuple(PaletteLight(base.lights[k].spectrum) for k in (0, 0, 1))
    cells = (
        (Cell.fixed((0.3, 0.2, 0.1), weight=10.0), Cell.ignore(), Cell.ignore()),
        (Cell.same_as((0, 0)), Cell.fixed((0.1, 0.3, 0.1), weight=3.0), Cell.fixed((0.2, 0.25, 0.1), weight=0.01)),
    )
    solution = solve_palette(replace(base, lights=lights, cells=cells))
    conflict = next(each for each in solution.conflicts if each.cell == (1, 0))
    assert set(conflict.relieved_by) == {(0, 0), (1, 1)}
    released = solve_palette(solution.problem.with_cell(conflict.relieved_by[0], Cell.ignore()))
    assert conflict.delta_e_without == pytest.approx(released.delta_e_2000[1, 0], abs=0.1 * conflict.delta_e_2000)


@pytest.mark.parametrize(
    ("robustness", "several", "expected"),
    [("soft", False, "lights"), ("soft", True, "lights"), ("worst_case", False, "lights"), ("worst_case", True, None)],
)
def test_the_worst_case_over_observers_has_no_outer_side(robustness, several, expected):
    """φ would need the largest error, which has no gradient; one observer leaves the sum of squares."""
    observers = ("cie_1931_2deg", "cie_1964_10deg")[: 1 + several]
    problem = replace(generated_palette(9), robustness=robustness, observers=observers)
    cells = {
        (i, j): Cell.fixed((0.2, 0.3, 0.1))
        for i in range(len(problem.reflectances))
        for j in range(len(problem.lights))
    }
    problem = problem.with_cells(cells)
    assert outer_side(problem, compiled_requests(problem)) == expected


@pytest.mark.parametrize("seed", [1, 4, 9, 15])
def test_the_gradient_of_variable_projection_equals_differences_of_phi(seed, rng):
    problem = generated_palette(seed)
    requests = compiled_requests(problem)
    assembler = Assembler(problem, requests)
    outer = outer_side(problem, requests)
    if outer is None or not all(assembler.free_items(side) for side in ("reflectances", "lights")):
        pytest.skip("nothing to project")
    state = Rounds(assembler, SolveTrace()).round(initial_state(problem))
    descent = LightDescent(assembler, state, outer)
    begin = np.concatenate([getattr(state, outer)[k] for k in assembler.free_items(outer)]) + 0.02
    step = 1e-5 * rng.normal(size=begin.size)
    _, gradient, _ = descent._phi(descent._with_lights(state, begin))
    high, low = (descent._phi(descent._with_lights(state, begin + sign * step))[0] for sign in (1, -1))
    assert gradient @ step == pytest.approx((high - low) / 2, rel=2e-3, abs=1e-13)


def test_designed_lights_are_optimal_for_both_sides():
    """Clarabel improves neither side from the returned point."""
    pytest.importorskip("cvxpy")
    from benchmarks.palette.checks.optimality import side_gains

    for seed in range(5):
        solution = solve_palette(generated_palette(seed), explain=False)
        if solution.status.trusted:
            gains = side_gains(solution)
            assert gains.pop("exact") < 1e-6
            assert max(gains.values(), default=0.0) < 1e-6
