# SPDX-License-Identifier: GPL-3.0-or-later
"""Engines agree with each other and with cvxpy, and no answer is believed that does not satisfy the conditions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks._palette_hard_cases import hard_problem
from benchmarks.palette_hard import _engine_difference
from benchmarks.palette_speed import coupled_palette
from spectral_core.errors import InvalidInputError
from spectral_core.palette import Cell, solve_palette
from spectral_core.palette.assemble.compiled import Known, WishArrays, compiled
from spectral_core.palette.assemble.phase import PhaseBuilder
from spectral_core.palette.assemble.phase_solve import solve_phase
from spectral_core.palette.assemble.wishes import compiled_wishes
from spectral_core.palette.live.state import initial_state
from spectral_core.palette.presets import hidden_mark
from spectral_core.palette.qp.engines import ENGINES, solve_bvls, solve_checked
from spectral_core.palette.qp.general import reflectances_by_cvxpy
from spectral_core.palette.qp.least_squares import Check
from spectral_core.palette.qp.optimality import checked
from spectral_core.palette.qp.tied import TiedSolver, tied_from_links

SIZE = (4, 3, 31)


def phase_of(problem, side="reflectances", **how):
    builder = PhaseBuilder(problem, compiled_wishes(problem))
    return builder.build(side, initial_state(problem), **how)


@pytest.mark.parametrize("engine", list(ENGINES))
def test_every_engine_finds_what_cvxpy_finds(engine, rng):
    problem = coupled_palette(SIZE, rng)
    answer = solve_phase(phase_of(problem).problem, engine)
    assert answer.check.passed
    stated = reflectances_by_cvxpy(problem, tol_gap_abs=1e-11, tol_gap_rel=1e-11, tol_feas=1e-11)
    state = initial_state(problem)
    shown = [state.with_reflectances(dict(enumerate(each))).colors() for each in (answer.blocks, stated)]
    assert np.abs(shown[0] - shown[1]).max() < 1e-6


@pytest.mark.parametrize("engine", ["piqp", "daqp"])
def test_exact_metamers_agree_with_cvxpy(engine, rng):
    problem = coupled_palette(SIZE, rng)
    cells = {(i, 0): Cell.same_as((0, 0), weight=4.0, exact=True) for i in range(1, 4)}
    problem = problem.with_cells(cells)
    answer = solve_phase(phase_of(problem).problem, engine)
    assert answer.check.passed
    stated = reflectances_by_cvxpy(problem, tol_gap_abs=1e-11, tol_gap_rel=1e-11, tol_feas=1e-11)
    state = initial_state(problem)
    shown = [state.with_reflectances(dict(enumerate(each))).colors() for each in (answer.blocks, stated)]
    assert np.abs(shown[0] - shown[1]).max() < 2e-6
    assert np.abs(shown[0][:, 0] - shown[0][0, 0]).max() < 1e-9


def test_the_compiled_problem_is_the_assembled_one(rng):
    problem = coupled_palette(SIZE, rng)
    problem = problem.with_cell((1, 1), Cell.constant((1, 2), weight=2.0)).with_cell((2, 2), Cell.black())
    wishes, state = compiled_wishes(problem), initial_state(problem)
    assembled = tied_from_links(phase_of(problem).problem)
    _, fast = compiled(
        problem, wishes, WishArrays.of(problem, wishes), Known.of(state, "reflectances"), state, "reflectances"
    )
    for name in ("hessians", "linear", "ties", "color_hessian", "color_linear"):
        np.testing.assert_allclose(getattr(fast, name), getattr(assembled, name), atol=1e-13, err_msg=name)


def test_tied_solver_follows_changes_of_any_kind(rng):
    problem = coupled_palette(SIZE, rng)
    quadratics = tied_from_links(phase_of(problem).problem)
    solver = TiedSolver(*quadratics.linear.shape)
    everything, none = np.arange(4), np.arange(0)
    solver.solve(quadratics, everything, everything)
    for step in range(20):
        k = int(rng.integers(4))
        linear, hessians = quadratics.linear.copy(), quadratics.hessians.copy()
        linear[k] *= rng.uniform(0.5, 1.5)
        reshaped = none
        if step % 2:
            hessians[k] = hessians[k] * rng.uniform(0.8, 1.3)
            reshaped = np.array([k])
        quadratics = replace(quadratics, linear=linear, hessians=hessians)
        values, colors = solver.solve(quadratics, np.array([k]), reshaped)
        assert quadratics.kkt(values, colors) < 1e-9
        _, fresh_colors = TiedSolver(*linear.shape).solve(quadratics, everything, everything)
        np.testing.assert_allclose(colors, fresh_colors, atol=1e-8)


def test_a_wrong_answer_fails_its_check(rng):
    problem = phase_of(coupled_palette(SIZE, rng)).problem
    right = solve_checked(problem, ["tied"])
    assert right.check.good
    for wrong in (right.x + 1e-3, right.x * 0.99, np.full(problem.size, np.nan)):
        assert not checked(problem, np.clip(wrong, problem.lower, problem.upper)).passed
    assert not Check(0.0, 1e-6, 0.0).passed
    assert not Check(0.0, 0.0, 1e-5).passed


def test_a_failing_engine_is_replaced_and_that_is_said(rng, monkeypatch):
    monkeypatch.setitem(ENGINES, "tied", lambda problem, start=None: (np.full(problem.size, 0.3), None, False))
    monkeypatch.setattr("spectral_core.palette.qp.engines.polished", lambda problem, x: (x, checked(problem, x)))
    monkeypatch.setattr("spectral_core.palette.live.solver.LiveSolver.half_round", lambda *given: None)
    solution = solve_palette(coupled_palette(SIZE, rng))
    assert solution.engines == ("piqp",)
    assert solution.status.trusted
    assert any(note.startswith("tied gave an answer that failed its check; piqp") for note in solution.notes)


def test_nothing_is_called_solved_when_every_engine_lies(rng, monkeypatch):
    for name in list(ENGINES):
        monkeypatch.setitem(ENGINES, name, lambda problem, start=None: (np.full(problem.size, 0.3), None, False))
    monkeypatch.setattr("spectral_core.palette.qp.engines.polished", lambda problem, x: (x, checked(problem, x)))
    monkeypatch.setattr("spectral_core.palette.live.solver.LiveSolver.half_round", lambda *given: None)
    solution = solve_palette(coupled_palette(SIZE, rng), explain=False)
    assert solution.status == "inaccurate"
    assert "do not rely on it" in solution.remedy
    assert solution.kkt_residual > 1e-6


def test_bvls_says_that_it_knows_no_equalities():
    with pytest.raises(InvalidInputError, match="knows no equalities; use piqp"):
        solve_bvls(phase_of(hidden_mark()).problem)


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_hard_palettes_are_never_called_right_when_wrong(first):
    for seed in range(first, first + 20):
        problem, traps = hard_problem(seed)
        if problem.grid.size > 100:
            continue  # in the benchmark
        solution = solve_palette(problem, explain=False)
        assert solution.status == "solved" or solution.remedy, traps
        if solution.status.trusted:
            assert solution.kkt_residual <= 1e-6, traps
            assert solution.bound_violation <= 1e-9, traps


@pytest.mark.parametrize("seed", range(0, 28, 4))
def test_engines_that_claim_success_agree_on_hard_palettes(seed):
    problem, traps = hard_problem(seed)
    difference = _engine_difference(problem)
    assert difference is None or difference < 1e-6, traps
