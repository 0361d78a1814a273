# SPDX-License-Identifier: GPL-3.0-or-later
"""Rounds: reflectances under the present lights, then lights on the new reflectances, each side by the engine.

Each side is a convex problem (section 5.3). Alternating between them is not in the thesis, which does one round.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from time import perf_counter, thread_time

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.requests import Requests
from spectral_core.palette.assemble.side import Assembled, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.design.decided import Decision, decided
from spectral_core.palette.design.orthogonal import CHANGES, LIVE, THOROUGH, refined
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.qp.answer import PERFECT, Answer, Check
from spectral_core.palette.qp.block import RowKey
from spectral_core.palette.qp.engine import Engine
from spectral_core.palette.worst_case import worst_case_shares

Array = NDArray[np.float64]

SETTLED = 7e-7
"""Relative decrease of a side's objective when it alone is solved again, below which a palette counts as optimal: a
millionth, minus the tolerance of the solver that measures it.
"""
NOTHING = 1e-16
"""Decrease of an objective that counts as none: a millionth of 1e-10, where colors agree within 1e-5 in linear RGB."""
ROUNDING = 1e-30
"""Objective that is 0 except for the rounding of colors and spectra near 1, for weights near the median."""
PATIENCE = 3.0
"""A budget counts processor seconds; on a busy machine it ends after this many times as much elapsed time."""


class Budget:
    """Time budget of a solve in seconds: processor time of this thread, or PATIENCE times that in elapsed time."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.reserved = 0.0
        """Seconds at the end that are kept for what follows a descent: the last round and its check."""
        self._busy, self._clock = thread_time(), perf_counter()

    @property
    def left(self) -> float:
        """Seconds left before the reserved ones, at least 0."""
        busy, clock = thread_time() - self._busy, perf_counter() - self._clock
        return max(0.0, min(self.seconds - self.reserved - busy, PATIENCE * (self.seconds - self.reserved) - clock))

    @property
    def spent(self) -> bool:
        """True if no time is left."""
        return self.left <= 0


@dataclass
class SolveTrace:
    """Record of the rounds, for the report."""

    answers: dict[Side, Answer] = field(default_factory=dict)
    engines: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)
    rounds: int = 0
    sides: dict[Side, tuple[Assembled, Answer]] = field(default_factory=dict)
    """The joint check's own solves, at the returned point."""
    settled: bool = True
    """True if neither side alone could still lower the objective."""
    gains: dict[Side, float] = field(default_factory=dict)
    """Share of each side's objective by which solving it again lowers it, however small the objective is."""
    joint: Check = PERFECT
    """The KKT check of both sides at the returned point."""
    worst_case_left: float | None = None
    """Relative distance of the largest robust error from its least possible value; None if not requested."""
    timings: dict[str, float] = field(default_factory=dict)

    def add(self, side: Side, answer: Answer, seconds: float) -> None:
        """Count one solve of a side."""
        self.answers[side] = answer
        self.engines.update(answer.engines)
        self.timings[side] = self.timings.get(side, 0.0) + seconds

    @property
    def gain(self) -> float:
        """The largest share that a side could lose."""
        return max(self.gains.values(), default=0.0)

    @property
    def optimal(self) -> bool:
        """True if neither side alone could lower its objective by a millionth, beyond rounding."""
        return self.settled and self.gain <= SETTLED

    def better_than(self, other: SolveTrace) -> bool:
        """True if the last joint check passed, and no side could lose as much as in another."""
        return self.settled and self.joint.passed and self.gain < other.gain

    def restore(self, other: SolveTrace) -> None:
        """Take the joint check of another trace."""
        self.answers, self.sides, self.gains = other.answers, other.sides, other.gains
        self.joint, self.settled = other.joint, other.settled

    def settle(self, side: Side, assembled: Assembled, answer: Answer) -> None:
        """Record an answer of the only side as the joint check: nothing else can improve."""
        self.sides[side] = assembled, answer
        self.joint, self.settled, self.gains = answer.check, True, {}


class Rounds:
    """The two sides of a palette while they are solved in turn; keeps each side's engine warm.

    With ``live``, the rounds of large palettes give up last digits for speed; the joint check does not. ``quick``
    rounds take the engine's answers as they are: for estimates of errors, not for answers.
    """

    def __init__(self, assembler: Assembler, trace: SolveTrace, *, live: bool = False, quick: bool = False) -> None:
        self._most, self._quick = LIVE if live else None, quick
        self.assembler = assembler
        self.trace = trace
        sides: tuple[Side, ...] = ("reflectances", "lights")
        self.sides: list[Side] = [side for side in sides if assembler.free_items(side)]
        self.engines: dict[Side, Engine] = {side: Engine() for side in self.sides}
        self._decided: dict[Side, Decision] = {}
        self._refined: dict[Side, Answer] = {}
        """The last decision about each side, and its last answer."""
        self._moves: dict[Side, tuple[float, float]] = {}
        """Decrease of each side's objective in the last round, and its value."""

    def solve(self, side: Side, state: PaletteState, *, perceptual: bool = False) -> PaletteState:
        """One side: the new state. The worst case over observers takes several solves."""
        started = perf_counter()
        solved = [self._solved(side, state, perceptual=perceptual)]
        requests, problem = self.assembler.requests, self.assembler.problem
        if problem.robustness == "worst_case" and len(requests.conditions) > 1:

            def again() -> dict[RowKey, float]:
                solved[0] = self._solved(side, state, perceptual=perceptual)
                assembled, answer, found = solved[0]
                return self.assembler.robust_rows(assembled, answer.colors, found)

            left = worst_case_shares(again, self.assembler.shares)
            self.trace.worst_case_left = left if left is not None else self.trace.worst_case_left
        assembled, answer, found = solved[0]
        self.trace.add(side, answer, perf_counter() - started)
        fall, least = gain(assembled, answer, state)
        self._moves[side] = fall, least
        return found

    def _solved(self, side: Side, state: PaletteState, *, perceptual: bool) -> tuple[Assembled, Answer, PaletteState]:
        assembled, answer = self._answered(side, state, perceptual=perceptual)
        values = dict(zip(assembled.items, answer.values, strict=True))
        return assembled, answer, state.with_values(side, values)

    def _answered(
        self, side: Side, state: PaletteState, *, perceptual: bool, returned: bool = False
    ) -> tuple[Assembled, Answer]:
        """The engine's answer with its last digits, which hold the smoothness of spectra that meet all targets."""
        assembled = self.assembler.assembled(side, state, perceptual=perceptual)
        changes = THOROUGH if returned or len(self.sides) == 1 else CHANGES
        answer = self.engines[side].solve(assembled.quadratic)
        if self._quick:
            return assembled, answer
        decision = self._decided[side] = decided(assembled.quadratic, answer, self._decided.get(side))
        answer = decision.answer
        most, before = None if returned else self._most, self._refined.get(side)
        answer = self._refined[side] = refined(assembled.quadratic, answer, changes, most, before)
        return assembled, answer

    def round(self, state: PaletteState, *, perceptual: bool = False) -> PaletteState:
        """Both sides once."""
        self.trace.rounds += 1
        for side in self.sides:
            state = self.solve(side, state, perceptual=perceptual)
        return state

    def check(self, state: PaletteState, *, perceptual: bool = False) -> None:
        """The joint check: solve each side alone from ``state`` and record the changes in the trace.

        Reflectances and lights are each optimal for the other exactly where neither solve lowers its objective. The KKT
        residual of both is taken at ``state`` itself, with the multipliers of those solves.
        """
        joint, settled = PERFECT, True
        gains: dict[Side, float] = {}
        for side in self.sides:
            assembled, answer = self._answered(side, state, perceptual=perceptual, returned=True)
            # Each side by its own measure: the roughness of lights must not hide a decrease of the reflectances.
            fall, least = gain(assembled, answer, state)
            settled = settled and is_nothing(fall, least)
            gains[side] = max(0.0, fall - _rounding(assembled, state)) / (fall + least + ROUNDING)
            joint = joint | answer.check
            self.trace.answers[side] = answer
            self.trace.sides[side] = assembled, answer
        self.trace.joint, self.trace.settled, self.trace.gains = joint, settled, gains

    def answered(self, state: PaletteState) -> PaletteState:
        """The state with the last joint check's answer for the side that could lose the larger share."""
        side = max(self.trace.gains, key=lambda each: self.trace.gains[each])
        assembled, answer = self.trace.sides[side]
        return state.with_values(side, dict(zip(assembled.items, answer.values, strict=True)))

    def ended(self) -> bool:
        """True if no descent of both sides together can help: no request needs both, or nothing is left to lower."""
        is_zero = all(fall + least <= ROUNDING for fall, least in self._moves.values())
        return is_zero or are_apart(self.assembler.problem, self.assembler.requests)

    def settled(self, state: PaletteState, *, perceptual: bool = False) -> bool:
        """True if the last round changed nothing, and the joint check agrees."""
        if not all(is_nothing(*move) for move in self._moves.values()):
            return False
        self.check(state, perceptual=perceptual)
        return self.trace.settled


def are_apart(problem: PaletteProblem, requests: Requests) -> bool:
    """True if no request depends on a designed light and on a designed reflectance: each side is then best alone."""
    cells = [(target.cell,) for target in requests.targets]
    for members in (*cells, *(group.members for group in requests.groups)):
        lit = any(problem.lights[j].free for _, j in members)
        if lit and any(problem.reflectances[i].free for i, _ in members):
            return False
    return True


def is_nothing(fall: float, least: float) -> bool:
    """True if a side's objective, now ``least``, has fallen by no more than counts as optimal."""
    return fall <= SETTLED * least + NOTHING


def _rounding(assembled: Assembled, state: PaletteState) -> float:
    values = [getattr(state, assembled.side)[item] for item in assembled.items]
    quadratic = assembled.quadratic
    return quadratic.rounding(quadratic.joined(quadratic.best_colors(values), values))


def gain(assembled: Assembled, answer: Answer, state: PaletteState) -> tuple[float, float]:
    """Decrease of the objective from ``state`` to an answer, and the answer's objective."""
    quadratic = assembled.quadratic
    values = [getattr(state, assembled.side)[item] for item in assembled.items]
    here = quadratic.objective(quadratic.joined(quadratic.best_colors(values), values))
    least = quadratic.objective(quadratic.joined(quadratic.best_colors(answer.values), answer.values))
    return max(0.0, here - least), least
