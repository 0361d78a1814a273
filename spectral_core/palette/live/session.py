# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette that answers while it is edited: compiled once, solved again from where it was after every change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.compiled import is_simple
from spectral_core.palette.assemble.phase import PhaseBuilder
from spectral_core.palette.assemble.wishes import Wishes, compiled_wishes
from spectral_core.palette.cell_errors import CellErrors
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.live.solver import LiveSolver
from spectral_core.palette.live.state import PaletteState, initial_state
from spectral_core.palette.problem import Cell, CellIndex, PaletteProblem
from spectral_core.palette.report import reported, state_errors
from spectral_core.palette.solution import PaletteSolution
from spectral_core.palette.solve import SolveTrace, alternate, solve_palette

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LivePalette:
    """The answer to one edit. Spectra are in ``state``; errors are computed when they are looked at."""

    problem: PaletteProblem
    state: PaletteState
    actual_linear_rgb: Array
    """(R, L, 3)."""
    kkt_residual: float
    trusted: bool
    """Whether every solve of this edit passed its check."""
    engines: tuple[str, ...]
    seconds: float

    @cached_property
    def errors(self) -> CellErrors:
        """What every cell misses."""
        return state_errors(self.problem, compiled_wishes(self.problem), self.state)

    @property
    def target_linear_rgb(self) -> Array:
        """(R, L, 3): wanted colors, NaN where none."""
        return self.errors.target_linear_rgb

    @property
    def delta_e_2000(self) -> Array:
        """(R, L): error of each cell, NaN where nothing is wanted."""
        return self.errors.delta_e_2000


class PaletteSession:
    """Live editing of one palette.

    Usual palettes (spectra on the grid, one observer, linear match) are kept compiled and take well under a frame per
    edit; others go through the general engines, from the last state on. ``rounds_per_edit``: alternations after each
    edit where lights are designed too; ``refine`` does more when there is time. Lights are brightened to fit
    (``scale_lights``) once, when the session begins.
    """

    def __init__(self, problem: PaletteProblem, *, rounds_per_edit: int = 1) -> None:
        self.rounds_per_edit = rounds_per_edit
        self._problem: PaletteProblem
        self._live: LiveSolver | None
        self._wishes_now: Wishes | None
        self._solution = solve_palette(problem, explain=False)
        self._state: PaletteState = self._solution.state
        self._adopt(problem)
        self._resolve(1, perf_counter())

    @property
    def problem(self) -> PaletteProblem:
        """The problem as edited so far."""
        return self._problem

    @property
    def state(self) -> PaletteState:
        """The present spectra."""
        return self._state

    def edit(self, cell: CellIndex, wish: Cell) -> LivePalette:
        """Replace one cell's wish and solve again."""
        return self.edit_cells({cell: wish})

    def edit_cells(self, wishes: Mapping[CellIndex, Cell]) -> LivePalette:
        """Replace several cells' wishes and solve again. Raises InvalidInputError as PaletteProblem does."""
        started = perf_counter()
        before, self._problem = self._problem, self._problem.with_cells(wishes)
        live = self._live
        if live is None or not live.edit_targets(before, wishes):
            self._wishes_now = None
            simple = is_simple(self._problem, self._wishes)
            if simple and live is not None:
                live.load(self._problem, self._wishes)
            else:
                self._live = LiveSolver(self._problem, self._wishes) if simple else None
        else:
            self._wishes_now = None
        return self._resolve(self.rounds_per_edit, started)

    def change(self, **settings: Any) -> LivePalette:
        """Replace settings of the problem (``smoothness``, ``match``, ``lights``, …) and solve again."""
        started = perf_counter()
        self._adopt(replace(self._problem, **settings))
        return self._resolve(self.rounds_per_edit, started)

    def refine(self, rounds: int = 5) -> LivePalette:
        """More rounds from here, for when there is time."""
        return self._resolve(rounds, perf_counter())

    def solution(self) -> PaletteSolution:
        """The present state in full, with status, remedy and residuals."""
        if wants_distinct(self._problem):
            return self._solution
        return reported(PhaseBuilder(self._problem, self._wishes), self._state, self._trace)

    @property
    def _wishes(self) -> Wishes:
        """The wishes of the present problem, read when they are needed."""
        if self._wishes_now is None:
            self._wishes_now = compiled_wishes(self._problem)
        return self._wishes_now

    def _adopt(self, problem: PaletteProblem) -> None:
        """Take a problem whose grid, lights or settings may differ; unknowns of unchanged shape are kept."""
        self._problem = problem
        self._wishes_now = None
        self._state = initial_state(problem, self._state)
        self._trace = SolveTrace()
        self._live = None
        if is_simple(problem, self._wishes):
            self._live = LiveSolver(problem, self._wishes)

    def _resolve(self, rounds: int, started: float) -> LivePalette:
        if wants_distinct(self._problem):
            return self._resolve_distinct(started)
        answers = None
        if self._live is not None:
            answers = self._live.solve(self._problem, self._state, rounds)
        if answers is not None:
            self._state, checks, actual = answers
            self._trace = SolveTrace(answers=dict(checks), rounds=rounds)
        else:
            self._trace = SolveTrace(notes=list(self._wishes.notes))
            self._state = alternate(PhaseBuilder(self._problem, self._wishes), self._state, self._trace, rounds)
            actual = self._state.colors()
        done = self._trace.answers.values()
        engines = tuple(engine for answer in done for engine in answer.engines)
        seconds = perf_counter() - started
        self._trace.engines.update(engines)
        self._trace.timings = {"total": seconds}
        return LivePalette(
            self._problem,
            self._state,
            actual,
            max((answer.check.kkt for answer in done), default=0.0),
            all(answer.check.passed for answer in done),
            engines,
            seconds,
        )

    def _resolve_distinct(self, started: float) -> LivePalette:
        """Distinct cells are not convex: searched from the present spectra, in tens to hundreds of milliseconds."""
        self._solution = solve_palette(self._problem, warm=self._solution, explain=False)
        self._state = self._solution.state
        return LivePalette(
            self._problem,
            self._state,
            self._solution.actual_linear_rgb,
            self._solution.kkt_residual,
            self._solution.status.trusted,
            self._solution.engines,
            perf_counter() - started,
        )
