# SPDX-License-Identifier: GPL-3.0-or-later
"""``solve_palette``: alternate between reflectances and lights until the wishes are met or nothing improves.

Each half of a round is a convex problem (section 5.3); the alternation is not in the thesis, which does one round.
It moves its limit of 7×7 colors for 31 samples to past 9×9.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.compiled import is_simple
from spectral_core.palette.assemble.phase import Phase, PhaseBuilder, Side
from spectral_core.palette.assemble.phase_solve import PhaseAnswer, solve_phase
from spectral_core.palette.assemble.wishes import compiled_wishes
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.live.solver import LiveSolver
from spectral_core.palette.live.state import PaletteState, initial_state
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.report import reported
from spectral_core.palette.solution import PaletteSolution
from spectral_core.palette.worst_case import RowKey, worst_case_shares

Array = NDArray[np.float64]

CONVERGED_RMS = 1e-6
"""Root mean square of the color rows, in linear RGB, at which a palette is exact to any eye."""
STALLED = 1e-3
"""Relative change of sum of squares and of color error in a round, below which the rounds stop."""
LINEAR_ROUNDS = 3
"""Rounds in linear RGB before CIELAB is linearized: far from the target its Jacobian misleads."""


@dataclass
class SolveTrace:
    """What happened on the way, for the report."""

    answers: dict[Side, PhaseAnswer] = field(default_factory=dict)
    engines: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)
    rounds: int = 0
    worst_case_left: float | None = None
    """By how much the largest robust error may still exceed the least possible, relative; None where not asked."""
    live: LiveSolver | None = None
    """The compiled way, where the palette allows it."""
    timings: dict[str, float] = field(default_factory=dict)

    def add(self, side: Side, answer: PhaseAnswer, seconds: float) -> None:
        self.answers[side] = answer
        self.engines.update(answer.engines)
        self.notes.extend(note for note in answer.notes if note not in self.notes)
        self.timings[side] = self.timings.get(side, 0.0) + seconds


def solve_palette(
    problem: PaletteProblem, *, warm: PaletteSolution | None = None, explain: bool = True
) -> PaletteSolution:
    """Spectra that come as near to all wishes as the bounds allow.

    ``warm``: an earlier solution of a like problem; where the unknowns have the same shapes its spectra are the start.
    ``explain``: look for the cells that conflict where wishes are missed; takes some tens of solves.
    Never raises for a hopeless wish: the solution's ``status``, ``remedy`` and ``conflicts`` say so.
    """
    if wants_distinct(problem):
        from spectral_core.palette.distinct.search import solve_distinct  # which itself solves with this module

        return solve_distinct(problem, warm=warm)
    started = perf_counter()
    wishes = compiled_wishes(problem)
    builder = PhaseBuilder(problem, wishes)
    state = initial_state(problem, None if warm is None else warm.state)
    trace = SolveTrace(notes=list(wishes.notes))
    if problem.scale_lights:
        state = brightened_to_fit(builder, state, trace)
    state = alternate(builder, state, trace)
    trace.timings["total"] = perf_counter() - started
    solution = reported(builder, state, trace)
    if not explain:
        return solution
    from spectral_core.palette.conflicts import with_conflicts

    return with_conflicts(solution)


def brightened_to_fit(builder: PhaseBuilder, state: PaletteState, trace: SolveTrace) -> PaletteState:
    """All lights times the largest reflectance that a design without upper bound has, if above it (section 5.5)."""
    low, high = builder.problem.reflectance_bounds
    open_ended = PhaseBuilder(replace(builder.problem, reflectance_bounds=(low, np.inf)), builder.wishes)
    answer = solve_phase(open_ended.build("reflectances", state, soft=True).problem)
    largest = max((float(values.max()) for values in answer.blocks), default=0.0)
    if not np.isfinite(high) or largest <= high:
        return state
    trace.notes.append(
        f"all lights were made {largest / high:.3g} times brighter so that reflectances fit below {high:g}"
    )
    return state.brightened(largest / high)


def alternate(builder: PhaseBuilder, state: PaletteState, trace: SolveTrace, rounds: int | None = None) -> PaletteState:
    """Rounds of reflectances, then lights."""
    sides: list[Side] = [side for side in ("reflectances", "lights") if builder.free_items(side)]
    perceptual = builder.problem.match == "perceptual"
    trace.live = LiveSolver(builder.problem, builder.wishes) if is_simple(builder.problem, builder.wishes) else None
    previous = (np.inf, np.inf)
    for number in range(1, (builder.problem.rounds if rounds is None else rounds) + 1):
        jacobians = perceptual and (number > LINEAR_ROUNDS or (len(sides) == 1 and number > 1))
        objective = color = 0.0
        for side in sides:
            state, squares, color = half_round(builder, side, state, trace, perceptual=jacobians)
            objective += squares
        trace.rounds = number
        if not sides or (len(sides) == 1 and not perceptual):
            break
        if perceptual and number == LINEAR_ROUNDS:
            previous = (np.inf, np.inf)  # the measure changes here
            continue
        if color < CONVERGED_RMS or (_stalled(previous[0], objective) and _stalled(previous[1], color)):
            break
        previous = (objective, color)
    return state


def _stalled(before: float, after: float) -> bool:
    return bool(np.isfinite(before)) and abs(before - after) <= STALLED * before


def half_round(
    builder: PhaseBuilder, side: Side, state: PaletteState, trace: SolveTrace, *, perceptual: bool
) -> tuple[PaletteState, float, float]:
    """One phase: the new state, its sum of squares, and the root mean square of its color rows."""
    started = perf_counter()
    quick = trace.live.half_round(side, builder.problem, state) if trace.live is not None else None
    if quick is not None:
        answer, state, squares = quick
        trace.add(side, answer, perf_counter() - started)
        return state, squares, builder.color_rms(state)
    solved = [_solved(builder, side, state, perceptual=perceptual)]
    if builder.problem.robustness == "worst_case" and len(builder.wishes.conditions) > 1:

        def again() -> dict[RowKey, float]:
            solved[0] = _solved(builder, side, state, perceptual=perceptual)
            phase, answer, found = solved[0]
            return builder.robust_rows(phase, answer.colors, found)

        left = worst_case_shares(again, builder.shares)
        trace.worst_case_left = left if left is not None else trace.worst_case_left
    phase, answer, state = solved[0]
    squares = 2 * phase.problem.objective(np.concatenate([answer.colors.ravel(), *answer.blocks]))
    trace.add(side, answer, perf_counter() - started)
    return state, squares, builder.color_rms(state)


def _solved(
    builder: PhaseBuilder, side: Side, state: PaletteState, *, perceptual: bool
) -> tuple[Phase, PhaseAnswer, PaletteState]:
    """The phase, its answer and the state with it; exact cells as rows where they cannot all hold."""
    phase = builder.build(side, state, perceptual=perceptual)
    answer = solve_phase(phase.problem, start=builder.last_colors.get(side))
    builder.last_colors[side] = answer.colors
    if not answer.check.passed and phase.problem.has_equalities:
        phase = builder.build(side, state, perceptual=perceptual, soft=True)
        elastic = solve_phase(phase.problem)
        answer = replace(elastic, infeasible=True, notes=(*answer.notes, *elastic.notes))
    values = dict(zip(phase.items, answer.blocks, strict=True))
    found = state.with_reflectances(values) if side == "reflectances" else state.with_lights(values)
    return phase, answer, found
