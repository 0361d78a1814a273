# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine agrees with cvxpy, follows any change, and rejects answers that fail the optimality conditions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.palette.cases.hard import hard_problem
from benchmarks.palette.palette_speed import coupled_palette
from spectral_core.palette import Cell, PaletteReflectance, solve_palette
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import initial_state
from spectral_core.palette.explain.exact_sets import smallest_conflict
from spectral_core.palette.presets import split_light
from spectral_core.palette.qp import engine as engine_module
from spectral_core.palette.qp.answer import Check, checked
from spectral_core.palette.qp.arrow import Arrow
from spectral_core.palette.qp.backends import PiqpAnswer, by_piqp, nearest_miss
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.engine import Engine, solve
from spectral_core.palette.qp.general import reflectances_by_cvxpy
from spectral_core.palette.qp.interior_point import interior_point
from spectral_core.palette.qp.quadratic import Quadratic

SIZE = (4, 3, 31)
SHARP = {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11}


def side_of(problem, side="reflectances", **how):
    assembler = Assembler(problem, compiled_requests(problem))
    return assembler.assembled(side, initial_state(problem), **how)


def rows_of(problem, i, j):
    """A cell's term of the objective, implemented independently: weight² / 3 × squared distance."""
    return problem.cells[i][j].weight ** 2 / 3


def test_the_engine_agrees_with_cvxpy(rng):
    problem = coupled_palette(SIZE, rng)
    answer = solve(side_of(problem).quadratic)
    assert answer.check.passed
    stated = reflectances_by_cvxpy(problem, **SHARP)
    state = initial_state(problem)
    shown = [state.with_values("reflectances", dict(enumerate(each))).colors() for each in (answer.values, stated)]
    assert np.abs(shown[0] - shown[1]).max() < 1e-6


@pytest.mark.parametrize("weight", [1e-3, 30.0, 1e3])
def test_exact_metamers_and_any_weight_agree_with_cvxpy(rng, weight):
    problem = coupled_palette(SIZE, rng)
    cells = {(i, 0): Cell.same_as((0, 0), weight=4.0, exact=True) for i in range(1, 4)}
    cells[2, 1] = Cell.fixed((0.3, 0.4, 0.2), weight=weight)
    problem = problem.with_cells(cells)
    answer = solve(side_of(problem).quadratic)
    assert answer.check.passed
    stated = reflectances_by_cvxpy(problem, **SHARP)
    state = initial_state(problem)
    ours, theirs = (
        state.with_values("reflectances", dict(enumerate(each))).colors() for each in (answer.values, stated)
    )
    seen = np.ones((4, 3), dtype=bool)
    seen[2, 1] = weight >= 1
    assert np.abs(ours - theirs)[seen].max() < 1e-5
    assert np.abs(ours[:, 0] - ours[0, 0]).max() < 1e-9


def test_the_assembled_objective_is_that_of_the_cells(rng):
    """Weights, groups, given reflectances and the roughness of both sides, compared with a plain sum over cells."""
    problem = coupled_palette(SIZE, rng)
    given = solve_palette(problem, explain=False).reflectances[3]
    lights = tuple(replace(light, free=j > 0) if j else light for j, light in enumerate(split_light().lights))
    problem = replace(problem, reflectances=(*problem.reflectances[:3], PaletteReflectance("given", given)))
    problem = problem.with_cells({(1, 1): Cell.constant((1, 2), weight=2.0), (2, 2): Cell.black(weight=3.0)})
    assembled = side_of(problem)
    values = [rng.uniform(size=31) for _ in range(3)]
    state = initial_state(problem).with_values("reflectances", dict(enumerate(values)))
    shown = state.colors()
    colors = rng.uniform(size=(len(assembled.group_conditions), 3))
    from spectral_core.palette.assemble.criteria import second_differences

    rough = problem.smoothness * second_differences(problem.grid)
    scale = compiled_requests(problem).weight_scale
    total = sum(float(np.sum((rough @ each) ** 2)) for each in values)
    metamers, constant = 0, 1
    for i in range(4):
        total += 16 / 3 * float(np.sum((shown[i, 0] - colors[metamers]) ** 2))
        for j in (1, 2):
            cell = problem.cells[i][j]
            if (i, j) in ((1, 1), (1, 2)):
                total += 4 / 3 * float(np.sum((shown[i, j] - colors[constant]) ** 2))
            if cell.mode in ("fixed", "black") and i < 3:
                wanted = np.zeros(3) if cell.target is None else cell.target
                total += cell.weight**2 / 3 * float(np.sum((shown[i, j] - wanted) ** 2))
    quadratic = assembled.quadratic
    assert quadratic.objective(quadratic.joined(colors, values)) * scale**2 == pytest.approx(total / 2, rel=1e-9)
    assert lights  # the next test checks the roughness of lights


def test_the_roughness_of_lights_counts_power_per_10_nm():
    problem = split_light()
    quadratic = side_of(problem, "lights").quadratic
    x = np.zeros(problem.grid.size)
    x[20] = 0.1
    from spectral_core.palette.assemble.criteria import second_differences

    scale = compiled_requests(problem).weight_scale
    rough = 10.0 * problem.smoothness / scale * second_differences(problem.grid)
    assert x @ quadratic.blocks[0].gram @ x == pytest.approx(float(np.sum((rough @ x) ** 2)), rel=1e-12)


def test_gradients_equal_differences_of_the_objective(rng):
    problem = coupled_palette(SIZE, rng).with_cell((2, 2), Cell.black())
    for side, free in (("reflectances", False), ("lights", True)):
        if free:
            lights = tuple(replace(light, free=True) if light.spectrum.grid.same_as(problem.grid) else light
                           for light in problem.lights)  # fmt: skip
            problem = replace(problem, lights=lights)
        quadratic = side_of(problem, side).quadratic
        x, step = rng.uniform(size=quadratic.size), rng.normal(size=quadratic.size) * 1e-5
        slope = (quadratic.objective(x + step) - quadratic.objective(x - step)) / 2
        assert quadratic.gradient(x, quadratic.forces(x)) @ step == pytest.approx(slope, rel=1e-6)


def test_the_engine_follows_changes_of_any_type(rng):
    problem = coupled_palette(SIZE, rng)
    warm = Engine()
    for _ in range(25):
        cell = (int(rng.integers(4)), int(rng.integers(1, 3)))
        weight, exact = float(10 ** rng.uniform(-2, 3)), bool(rng.random() < 0.2)
        problem = problem.with_cell(cell, Cell.fixed(rng.uniform(0.2, 0.5, 3), weight=weight, exact=exact))
        quadratic = side_of(problem).quadratic
        answer, fresh = warm.solve(quadratic), solve(quadratic)
        assert answer.infeasible == fresh.infeasible
        assert answer.check.passed and fresh.check.passed
        if not answer.infeasible:
            values = [quadratic.objective(quadratic.joined(each.colors, each.values)) for each in (answer, fresh)]
            assert values[0] == pytest.approx(values[1], rel=1e-7, abs=1e-11)


def test_warm_edits_need_few_steps(rng):
    """Counts active-set steps instead of times: a drag needs few, also for a weight of 1000 and back."""
    problem = coupled_palette((6, 6, 31), rng)
    warm = Engine()
    warm.solve(side_of(problem).quadratic)
    steps = []
    for number in range(40):
        cell = (number % 6, 1 + number % 5)
        old = problem.cells[cell[0]][cell[1]].target
        color = np.clip(old + rng.normal(scale=0.05, size=3), 0, 1)
        problem = problem.with_cell(cell, Cell.fixed(color, weight=1000.0 if number % 4 == 1 else 1.0))
        answer = warm.solve(side_of(problem).quadratic, [cell[0]])
        assert answer.engines == ("active set",)
        steps.append(warm.steps)
    assert np.median(steps) <= 12
    assert max(steps) < 200


def test_a_wrong_answer_fails_its_check(rng):
    quadratic = side_of(coupled_palette(SIZE, rng)).quadratic
    right = solve(quadratic)
    x = quadratic.joined(right.colors, right.values)
    assert checked(quadratic, x, right.forces).kkt < 1e-9
    for wrong in (x + 1e-3, x * 0.99, np.full(quadratic.size, np.nan)):
        moved = np.clip(wrong, quadratic.lower, quadratic.upper)
        assert not checked(quadratic, moved, quadratic.forces(moved)).passed
        assert not checked(quadratic, moved, right.forces).passed
    outside = x.copy()
    outside[np.isfinite(quadratic.upper)] += 1e-6
    assert checked(quadratic, outside, right.forces).bounds > 1e-9
    assert not Check(0.0, 1e-6, 0.0).passed
    assert not Check(0.0, 0.0, 1e-5).passed
    assert not Check(1e-5, 0.0, 0.0).passed


def test_the_check_detects_an_error_of_the_smallest_weight_beside_a_large_one():
    rows = np.array([[1.0, 0.0], [0.0, 1.0]])
    none, zero = np.zeros((2, 0)), np.zeros((2, 2))
    block = Block(rows, np.array([0.3, 0.4]), none, np.array([1e6, 1e-6]), zero, zero, np.zeros(2), np.ones(2))
    quadratic = Quadratic((block,), np.zeros((0, 3)), np.zeros((0, 3)))
    assert solve(quadratic).check.passed
    wrong = np.array([0.3, 0.5])
    assert checked(quadratic, wrong, quadratic.forces(wrong)).kkt > 0.05


def test_a_failing_engine_is_replaced_by_piqp(rng, monkeypatch):
    monkeypatch.setattr(engine_module, "lone_spectra", lambda arrow: None)
    monkeypatch.setattr(
        engine_module, "interior_point", lambda arrow: (np.full(arrow.problem.size, np.nan), np.ones(1, dtype=bool))
    )
    quadratic = side_of(coupled_palette(SIZE, rng)).quadratic
    monkeypatch.setattr(Engine, "_from_guess", lambda self, problem: None)
    answer = solve(quadratic)
    assert answer.engines == ("piqp",)
    assert answer.check.passed


def test_no_answer_is_solved_if_every_engine_is_wrong(rng, monkeypatch):
    def lie(problem, most=0):
        return PiqpAnswer(np.full(problem.size, 0.3), [np.zeros(0)] * len(problem.blocks), True, False)

    monkeypatch.setattr(engine_module, "by_piqp", lie)
    monkeypatch.setattr(Engine, "_from_guess", lambda self, problem: None)
    monkeypatch.setattr(Engine, "_sharpened", lambda self, *given: None)
    solution = solve_palette(coupled_palette(SIZE, rng), explain=False)
    assert solution.status == "inaccurate"
    assert "is not reliable" in solution.remedy
    assert solution.kkt_residual > 1e-6


def test_piqp_and_the_engine_agree(rng):
    quadratic = side_of(coupled_palette(SIZE, rng)).quadratic
    x = by_piqp(quadratic).x
    answer = solve(quadratic)
    assert quadratic.objective(x) == pytest.approx(
        quadratic.objective(quadratic.joined(answer.colors, answer.values)), rel=1e-6
    )


def test_the_smallest_set_of_conflicting_exact_rows_is_found(rng):
    problem = coupled_palette((3, 5, 31), rng)
    free = {(0, j): Cell.fixed((0.3, 0.3, 0.3), exact=True) for j in (1, 2, 3)}
    problem = problem.with_cells({**free, (0, 4): Cell.fixed((0.0, 0.9, 0.9), exact=True)})
    side = side_of(problem)
    assert nearest_miss(side.quadratic) > 1e-3
    answer = solve(side.quadratic)
    assert answer.infeasible
    cells = smallest_conflict(problem, side)
    assert 1 <= len(cells) <= 4
    for released in cells:  # without any one of them the others can be satisfied
        fewer = {cell: problem.cells[cell[0]][cell[1]] for cell in cells if cell != released}
        only = {(0, j): fewer.get((0, j), Cell.ignore()) for j in (1, 2, 3, 4)}
        assert not solve(side_of(problem.with_cells(only)).quadratic).infeasible


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_wrong_answers_of_hard_palettes_are_never_accepted(first):
    for seed in range(first, first + 20):
        problem, traps = hard_problem(seed)
        if problem.grid.size > 100:
            continue  # as in the benchmark
        solution = solve_palette(problem, explain=False, seconds=0.2)
        assert solution.status == "solved" or solution.remedy, traps
        if solution.status.trusted:
            assert solution.kkt_residual <= 1e-6, traps
            assert solution.bound_violation <= 1e-9, traps


def test_the_best_color_in_a_box_under_a_metric_is_not_the_clipped_one(rng):
    """The channels depend on each other under a metric; the minimum over the box is compared with a fine search."""
    metric = np.array([[1.0, 0.9, 0.2], [0.1, 1.0, 0.8], [0.3, 0.2, 1.0]])
    shown = np.array([0.9, 0.2, 0.6])
    block = Block(metric, np.zeros(3), metric, np.ones(3), np.zeros((0, 3)), np.zeros((3, 3)), np.zeros(3), np.ones(3))
    problem = Quadratic((block,), np.zeros((1, 3)), np.full((1, 3), 0.5), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    found = problem.best_colors([shown])
    axis = np.linspace(0, 0.5, 26)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    searched = min(problem.objective(problem.joined(color[None], [shown])) for color in grid)
    assert problem.objective(problem.joined(found, [shown])) <= searched + 1e-12


@pytest.mark.parametrize("seed", [284, 322, 357, 442])
def test_palettes_whose_wrong_answers_were_once_accepted(seed):
    """Nearly dependent exact rows; groups with boxes under the perceptual metric; a small side."""
    pytest.importorskip("cvxpy")
    from benchmarks.palette.checks.optimality import side_gains

    solution = solve_palette(hard_problem(seed)[0], explain=False)
    if solution.status.trusted:
        gains = side_gains(solution)
        assert gains.pop("exact") < 1e-6
        assert max(gains.values(), default=0.0) < 1e-6


def test_a_step_limited_by_color_boxes_does_not_fail():
    """A hard case whose Newton step in the free colors was only rounding error, which led to a division by zero."""
    assert solve_palette(hard_problem(188)[0], explain=False).status.value != "inaccurate"


def test_the_interior_point_by_itself_ends_near_the_optimum(rng):
    """No other method corrects the result here. Colors that need reflectances of 0 and 1 make both bounds active."""
    problem = coupled_palette(SIZE, rng)
    bright = {(0, 1): Cell.fixed((4.0, 4.0, 0.0)), (1, 2): Cell.fixed((0.0, 3.0, 5.0)), (2, 1): Cell.fixed((0, 0, 5))}
    quadratic = side_of(problem.with_cells(bright)).quadratic
    x, free, arrived = interior_point(Arrow(quadratic))
    assert arrived
    right = solve(quadratic)
    best = quadratic.joined(right.colors, right.values)
    low, high = best <= quadratic.lower + 1e-9, best >= quadratic.upper - 1e-9
    assert low.sum() > 10 and high.sum() > 10
    np.testing.assert_allclose(x, best, atol=1e-4)
    # Nearly all bounds that it reports as active are active.
    assert np.mean(free == ~(low | high)) > 0.97
