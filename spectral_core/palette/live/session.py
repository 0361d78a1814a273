# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette that is solved after every edit: assembled once, then solved again from its last solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.blas_threads import on_one_thread
from spectral_core.checks import require_kind, require_whole
from spectral_core.palette.assemble.requests import WEIGHT_RATIO, Target, compiled_requests
from spectral_core.palette.assemble.side import Assembled, Assembler
from spectral_core.palette.assemble.state import PaletteState, initial_state
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.brightness_unit import (
    brightness_unit,
    cell_in_unit,
    depends_on_colors,
    from_unit,
    in_unit,
    multiplied,
    state_from_unit,
)
from spectral_core.palette.cell_errors import CellErrors
from spectral_core.palette.design.decided import Decision, decided
from spectral_core.palette.design.orthogonal import refined
from spectral_core.palette.design.rounds import Rounds, SolveTrace
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.problem import Cell, CellIndex, CellMode, PaletteProblem
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.report import reported, state_errors
from spectral_core.palette.solution import PaletteSolution
from spectral_core.palette.solve import solve_palette

Array = NDArray[np.float64]

FIRST_SECONDS = 0.5
"""Time budget of the first solve of a session."""
TARGET_MODES = (CellMode.FIXED, CellMode.BLACK)


@dataclass(frozen=True, eq=False)
class LivePalette:
    """The answer to one edit. Spectra are in ``state``; errors are computed on access."""

    problem: PaletteProblem
    state: PaletteState
    actual_linear_rgb: Array
    """(R, L, 3)."""
    kkt_residual: float
    trusted: bool
    """True if every solve of this edit passed its check."""
    engines: tuple[str, ...]
    seconds: float
    unit: float = 1.0
    """Brightness in which ΔE is counted (``brightness_unit``)."""

    @cached_property
    def errors(self) -> CellErrors:
        """Errors of all cells."""
        problem, state = self.problem, self.state
        if self.unit != 1:
            problem = in_unit(problem, self.unit)
            state = state_from_unit(state, problem, 1 / self.unit)
        errors = state_errors(problem, compiled_requests(problem), state)
        return replace(errors, target_linear_rgb=self.unit * errors.target_linear_rgb)

    @property
    def target_linear_rgb(self) -> Array:
        """(R, L, 3): targets, NaN without a target."""
        return self.errors.target_linear_rgb

    @property
    def delta_e_2000(self) -> Array:
        """(R, L): error of each cell, NaN without a request."""
        return self.errors.delta_e_2000


class PaletteSession:
    """Live editing of one palette.

    An edit of a cell's target or weight assembles and solves one spectrum again, with those that depend on it; other
    edits assemble the palette again and continue from the last spectra. ``rounds_per_edit``: rounds after each edit if
    lights are designed too; ``refine`` does more when there is time. Lights are brightened to fit (``scale_lights``)
    once, when the session begins.
    """

    @on_one_thread
    def __init__(self, problem: PaletteProblem, *, rounds_per_edit: int = 1) -> None:
        self.rounds_per_edit = require_whole("rounds_per_edit", rounds_per_edit, 0, 100_000)
        require_kind("the palette", problem, PaletteProblem)
        self._given, self._problem, self._unit = problem, problem, brightness_unit(problem)
        """The problem as it is given, as it is solved, and the brightness in which it is solved."""
        self._solution = solve_palette(in_unit(problem, self._unit), explain=False, seconds=FIRST_SECONDS)
        self._state: PaletteState = self._solution.state
        self._answered: tuple[Side, Assembled, Answer] | None = None
        """The side of a palette with one side, and the answer that ``state`` holds."""
        self._decision: Decision | None = None
        self._adopt(problem)
        self._resolve(1, perf_counter())

    @property
    def problem(self) -> PaletteProblem:
        """The problem as edited so far."""
        return self._given

    @property
    def state(self) -> PaletteState:
        """The present spectra."""
        return self._state if self._unit == 1 else state_from_unit(self._state, self._given, self._unit)

    def edit(self, index: CellIndex, cell: Cell) -> LivePalette:
        """Replace one cell and solve again."""
        return self.edit_cells({index: cell})

    @on_one_thread
    def edit_cells(self, cells: Mapping[CellIndex, Cell]) -> LivePalette:
        """Replace several cells and solve again. Raises the same InvalidInputError as PaletteProblem."""
        started = perf_counter()
        given = self._given.with_cells(cells)
        if self._unit_depends_on_colors:
            if brightness_unit(given) != self._unit:
                self._adopt(given)
                return self._resolve(self.rounds_per_edit, started)
            cells = {index: cell_in_unit(cell, self._unit) for index, cell in cells.items()}
        before, problem = self._problem, self._problem.with_cells(cells)
        changed = None
        if len(cells) == 1:
            ((index, cell),) = cells.items()
            changed = self._quick(before, problem, index, cell)
        self._given, self._problem = given, problem
        if changed is None:
            self._take(problem)
        return self._resolve(self.rounds_per_edit, started, changed)

    @on_one_thread
    def change(self, **settings: Any) -> LivePalette:
        """Replace settings of the problem (``smoothness``, ``match``, ``lights``, …) and solve again."""
        started = perf_counter()
        self._adopt(replace(self._given, **settings))
        return self._resolve(self.rounds_per_edit, started)

    @on_one_thread
    def refine(self, rounds: int = 5) -> LivePalette:
        """More rounds from here, for when there is time; 1 to 1,000. Raises InvalidInputError for another number."""
        return self._resolve(require_whole("rounds of refine", rounds, 1, 1000), perf_counter())

    @on_one_thread
    def solution(self, *, quick: bool = False) -> PaletteSolution:
        """The present state in full, with status, remedy and residuals.

        ``quick``: with the digits of the last edit, for a picture while an artist drags. Large weights hide the
        smoothness from them, so that spectra, and the colors of cells without a request, may differ from the optimum.
        """
        if wants_distinct(self._problem):
            return self._solution
        if self._answered:
            # The state is this answer, which was checked; a solve of the same side would only lose the engine's place.
            side, assembled, answer = self._answered
            if not quick:
                answer = refined(assembled.quadratic, answer)
                self._answered = side, assembled, answer
                self._state = self._state.with_values(side, dict(zip(assembled.items, answer.values, strict=True)))
            self._rounds.trace.settle(side, assembled, answer)
        else:
            self._rounds.check(self._state, perceptual=self._problem.match == "perceptual")
        found = reported(self._rounds.assembler, self._state, self._rounds.trace)
        return found if self._unit == 1 else from_unit(found, self._given, self._unit)

    # -- effects of an edit --------------------------------------------------------------------------------------------

    def _adopt(self, problem: PaletteProblem) -> None:
        """Replace the problem by one with another grid, lights or settings; unknowns of unchanged shape are kept."""
        unit = brightness_unit(problem)
        before = self._state if unit == self._unit else multiplied(self._state, self._unit / unit)
        self._unit_depends_on_colors = depends_on_colors(problem)
        self._given, self._unit = problem, unit
        self._problem = problem = in_unit(problem, unit)
        self._state = initial_state(problem, before)
        self._requests = compiled_requests(problem)
        """Those of the last assembly: groups, conditions and scales, which ``_quick`` leaves as they are."""
        self._rounds = Rounds(Assembler(problem, self._requests), SolveTrace(), live=True)
        self._assembled: Assembled | None = None

    def _take(self, problem: PaletteProblem) -> None:
        """Replace the problem by one with other cells; the engines continue from their last answers."""
        engines = self._rounds.engines
        self._requests = compiled_requests(problem)
        self._rounds = Rounds(Assembler(problem, self._requests), SolveTrace(), live=True)
        self._rounds.engines = engines
        self._assembled = None

    def _quick(self, before: PaletteProblem, problem: PaletteProblem, index: CellIndex, cell: Cell) -> int | None:
        """Apply an edit of one target, or of its weight: the index of the changed block; None if more changes."""
        assembled, assembler = self._assembled, self._rounds.assembler
        if assembled is None or problem.match != "linear" or problem.subspace is not None:
            return None
        old = before.cells[index[0]][index[1]]
        requests = self._requests
        weight = cell.weight / requests.weight_scale
        if cell.weight != old.weight:
            weights = [weight, *(each.weight for each in assembler.requests.targets)]
            weights += [each for group in requests.groups for each in group.weights]
            least, most = min(weights), max(weights)
            if least <= 0 or most > WEIGHT_RATIO * least:
                return None  # weights are capped
        if cell.weight == 0 or old.weight == 0:
            return None  # a cell has no request any more
        if cell.mode not in TARGET_MODES or old.mode not in TARGET_MODES:
            return None
        if assembler.in_group(index) or len(requests.conditions) > 1 or requests.notes:
            return None
        color = np.zeros(3) if cell.target is None else cell.target
        assembler.with_target(problem, Target(index, color, weight, cell.exact))
        item = index[0] if assembled.side == "reflectances" else index[1]
        if item not in assembled.items:
            return None
        self._assembled = assembler.reassembled(assembled, index)
        return assembled.items.index(item)

    # -- solving -------------------------------------------------------------------------------------------------------

    def _resolve(self, rounds: int, started: float, changed: int | None = None) -> LivePalette:
        # An edit of one target leaves it a target.
        if changed is None and wants_distinct(self._problem):
            return self._resolve_distinct(started)
        both, perceptual = len(self._rounds.sides) == 2, self._problem.match == "perceptual"
        matrices = self._answered = None
        trace = self._rounds.trace = SolveTrace(notes=list(self._requests.notes))
        if both or perceptual or self._problem.robustness == "worst_case" or not self._rounds.sides:
            for _ in range(rounds):
                self._state = self._rounds.round(self._state, perceptual=perceptual)
        else:
            side = self._rounds.sides[0]
            if self._assembled is None:
                self._assembled, changed = self._rounds.assembler.assembled(side, self._state), None
            quadratic = self._assembled.quadratic
            answer = self._rounds.engines[side].solve(quadratic, None if changed is None else [changed])
            decision = self._decision = decided(quadratic, answer, self._decision)
            answer = decision.answer
            values = dict(zip(self._assembled.items, answer.values, strict=True))
            self._state = self._state.with_values(side, values)
            trace.add(side, answer, perf_counter() - started)
            self._answered = side, self._assembled, answer
            if side == "reflectances":
                matrices = self._assembled.view.known_matrices()
        actual = self._state.colors(matrices=matrices)
        done = list(trace.answers.values())
        seconds = perf_counter() - started
        trace.timings = {"total": seconds}
        return LivePalette(
            self._given,
            self.state,
            self._unit * actual,
            max((answer.check.kkt for answer in done), default=0.0),
            all(answer.check.passed and not answer.infeasible for answer in done),
            tuple(engine for answer in done for engine in answer.engines),
            seconds,
            self._unit,
        )

    def _resolve_distinct(self, started: float) -> LivePalette:
        """Distinct cells are not convex: searched from the present spectra, in tens to hundreds of milliseconds; if
        lights are designed too, these are first designed for the other cells, which may take two seconds.
        """
        present = replace(self._solution, state=self._state, actual_linear_rgb=self._state.colors())
        self._solution = solve_palette(self._problem, warm=present, explain=False)
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
