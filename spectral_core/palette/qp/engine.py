# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine of a palette's side: four methods on one factorization, and a check that decides.

From an earlier answer: daqp for the spectrum that changed, then the parametric walk; primal-dual active set where all
changed; with exact rows, piqp where the walk did not arrive. Cold: daqp where no spectrum depends on another, else the
interior point, and the active set from its guess. Every answer is checked (``optimality``). If no method passes, piqp
is tried; if exact rows cannot hold together, they get large weights instead, and the answer states it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.answer import FAILED, PERFECT, Answer, answer_at, better, is_sharp, is_strained, nothing
from spectral_core.palette.qp.arrow import Arrow
from spectral_core.palette.qp.backends import REACHED, PiqpAnswer, by_piqp, lone_spectra, nearest_miss
from spectral_core.palette.qp.color_newton import ColorNewton, is_dense
from spectral_core.palette.qp.elastic import Elastic, softened
from spectral_core.palette.qp.feasibility import ImpossibleBlocks
from spectral_core.palette.qp.interior_point import interior_point
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

COLD_SHARP = 1e-9
"""KKT residual past which the answer to a cold start is refined."""
FINE_STEPS = 12
"""Active-set steps that a refinement may take."""
ELASTIC_STEPS = 20
"""Most breakpoints of a walk to an elastic answer, or from it to the exact one: a cold solve costs less than more."""
NEAR_STEPS = 60
"""Most breakpoints of the walk from one elastic answer to the next, and from the guess of an interior point of small
spectra. Where it needs more, bounds are active whose multipliers are 0, and the walk may exchange them without end.
"""
DIRECT_STEPS, DIRECT_SIZE = 60, 400
"""Most steps of piqp after a walk that did not reach its end, and most unknowns for which it is then the fastest."""
CONFLICTING = 1e-3
"""Miss of a row of an elastic answer, in linear RGB, above which it surely cannot hold."""
NEAR = 1e-7
"""Distance to a bound at which an interior answer counts as lying on it."""


class Engine:
    """Solves similar problems one after another, each from the answer to the last."""

    def __init__(self) -> None:
        self._active: ColorNewton | None = None
        self._arrow: Arrow | None = None
        self._impossible = ImpossibleBlocks()
        self._elastic, self._yielding = Elastic(), Elastic()
        """The last problem with large weights in place of all exact rows, and with those of the impossible blocks."""
        self._arrived = False
        """True if the last walk reached its end."""
        self._by_piqp = False
        """True if only piqp solved the last problem without a start: the next one is likely to be like it."""
        self._conflict = False
        """True if exact rows of several spectra conflicted in the last problem."""
        self.steps = 0
        """Active-set steps of the last solve."""

    def forget(self) -> None:
        """Start cold at the next solve."""
        self._active = self._arrow = None

    def solve(self, problem: Quadratic, changed: list[int] | None = None) -> Answer:
        """Solve ``problem``.

        ``changed``: blocks that differ from the last problem, if everything else is the same; None for all.
        """
        if not problem.blocks:
            return Answer((), problem.color_lower.clip(0.0), (), PERFECT, ())
        # Conflicting rows of one spectrum are found by daqp's phase one in microseconds; the methods below would need
        # many steps to fail on them.
        changed = self._impossible.tested(problem, changed)
        if self._impossible.numbers:
            problem, changed = self._yielding.of(problem, self._impossible.numbers, changed)
        else:
            self._yielding.forget()
        # A method that diverges overflows; its answer is no number, and the check refuses it.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            # While an artist drags within a conflict, the last compromise is the nearest start; the exact problem is
            # tried again when the compromise shows that it may hold.
            answer = self._still_conflicting(problem, changed, NEAR_STEPS) if self._conflict else None
            if answer is None:
                self._conflict = False
                self._elastic.forget()
                answer = self._solve(problem, changed)
            if is_strained(problem, answer):
                answer = better(problem, answer, self._from_piqp(problem))
        if self._impossible.numbers and not answer.infeasible:
            return Answer(answer.values, answer.colors, answer.forces, answer.check, answer.engines, infeasible=True)
        return answer

    def _still_conflicting(self, problem: Quadratic, changed: list[int] | None, most: int) -> Answer | None:
        """The elastic answer to a problem like one whose exact rows conflicted; None where they may hold now.

        ``most``: breakpoints of the walk to it.
        """
        elastic, changed = self._elastic.of(problem, None, changed)
        answer = self._warm(elastic, changed, most)
        if answer is None or not answer.check.passed:
            return None
        misses = [
            float(np.abs(block.misses(value, answer.colors.ravel())[block.exact]).max(initial=0.0))
            for block, value in zip(problem.blocks, answer.values, strict=True)
        ]
        # A row that could hold misses by its multiplier over the elastic weight, which is far less.
        return replace(answer, infeasible=True) if max(misses) > CONFLICTING else None

    def _solve(self, problem: Quadratic, changed: list[int] | None) -> Answer:
        warm = self._warm(problem, changed)
        if warm is not None and warm.check.passed:
            return warm
        if problem.has_equalities and self._active is not None and problem.size <= DIRECT_SIZE:
            # The problem is far from the last one: this takes a third of the time of the methods below.
            direct = self._direct(problem)
            if direct is not None:
                return direct
        # With large spectra, which are all new, the walks of this test would cost more than piqp's cold solve.
        is_worthwhile = (changed is not None or not is_dense(problem)) and not self._by_piqp
        if problem.has_equalities and self._active is not None and is_worthwhile:
            elastic = self._still_conflicting(problem, None, ELASTIC_STEPS)
            if elastic is not None:
                self._conflict = True
                return elastic
            if self._arrived:
                # They can hold, and the elastic answer is near the exact one.
                warm = self._warm(problem, None, ELASTIC_STEPS)
        answer = warm if warm is not None and warm.check.passed else self._cold(problem)
        if not answer.check.passed:
            # A failed answer is no start for the next solve.
            self.forget()
        return answer

    # -- methods ---------------------------------------------------------------------------------------------------

    def _warm(self, problem: Quadratic, changed: list[int] | None, most: int | None = None) -> Answer | None:
        """Answer computed from the last one: by the active set, else by the walk; None if there is no last answer.

        ``most``: breakpoints of the walk, if fewer than usual.
        """
        active, arrow = self._active, self._arrow
        if active is None or arrow is None or not _alike(arrow.problem, problem):
            return None
        begin, free = active.x, active.free
        if changed is None:
            # ``settle`` changes them.
            begin, free = begin.copy(), free.copy()
        same_bounds = active.lower is problem.lower and active.upper is problem.upper
        if not same_bounds:
            same_bounds = np.array_equal(active.lower, problem.lower) and np.array_equal(active.upper, problem.upper)
            if same_bounds:
                active.lower, active.upper = problem.lower, problem.upper
        # Keeping the other blocks' factors makes an edit of one cell cost one block.
        if changed is not None and same_bounds and arrow.replaced(problem, changed):
            active.stale.update(changed)
        else:
            arrow = self._arrow = Arrow(problem)
            active = self._active = ColorNewton(arrow)
            active.begin(begin, free)
            begin, free = active.x.copy(), active.free.copy()
        active.steps = 0
        try:
            # After an edit of one spectrum its many changes of bounds are left to daqp first, see ``color_newton``.
            arrived = (changed is None and active.settle()) or active.descend(begin, free, changed, most)
        except np.linalg.LinAlgError:
            return None
        self.steps, self._arrived = active.steps, arrived
        if not arrived:
            return None
        answer = self._read(problem, active, "active set")
        if not is_sharp(answer) and active.renew() and active.settle():
            answer = self._read(problem, active, "active set")
        return answer if is_sharp(answer) else self._finer(problem, active, "active set", answer)

    def _cold(self, problem: Quadratic) -> Answer:
        """Without a start."""
        best = Answer((), np.zeros(problem.color_lower.shape), (), FAILED, ())
        # Dense factors cost n³ per block, piqp's sparse ones about n: from some hundred samples on, piqp is first.
        methods = [self._from_guess, self._from_piqp]
        if is_dense(problem) or self._by_piqp:
            methods.reverse()
        for method in methods:
            try:
                answer = method(problem)
            except np.linalg.LinAlgError:
                continue
            if answer is not None and (not best.values or answer.check.worst < best.check.worst):
                best = answer
            if best.check.passed:
                self._by_piqp = method == self._from_piqp
                return best
        self._by_piqp = False
        # All methods failed: either the exact rows conflict, or the problem is ill-conditioned; this decides which.
        if problem.has_equalities and nearest_miss(problem) > REACHED:
            return self._compromise(problem)
        return best if best.values else nothing(problem)

    def _from_guess(self, problem: Quadratic) -> Answer | None:
        """daqp or the interior point for the active bounds, then the active set for the accuracy."""
        arrow = Arrow(problem)
        guess = lone_spectra(arrow)
        if guess is not None:
            return self._sharpened(problem, arrow, *guess, "daqp")
        begin, free, arrived = interior_point(arrow)
        # Its multipliers grow without limit where exact rows conflict: no method can pass then.
        if not arrived and problem.has_equalities and nearest_miss(problem) > REACHED:
            return self._compromise(problem)
        return self._sharpened(problem, arrow, begin, free, "interior point")

    def _from_piqp(self, problem: Quadratic) -> Answer | None:
        """piqp's answer, refined by the active set if that helps."""
        found = by_piqp(problem)
        return None if found is None else self._read_piqp(problem, found)

    def _direct(self, problem: Quadratic) -> Answer | None:
        """piqp's answer, or the compromise if it shows that exact rows conflict; None where it decides neither."""
        found = by_piqp(problem, DIRECT_STEPS)
        if found is not None and found.is_impossible and nearest_miss(problem) > REACHED:
            self._by_piqp = True
            return self._compromise(problem)
        answer = self._read_piqp(problem, found) if found is not None and found.is_solved else None
        return answer if answer is not None and answer.check.passed else None

    def _read_piqp(self, problem: Quadratic, found: PiqpAnswer) -> Answer:
        """piqp's answer, refined by the active set if that helps."""
        x = found.x
        low, high = problem.lower, problem.upper
        # An interior-point method ends near the bounds, never on them.
        free = (x > low + NEAR) & (x < high - NEAR)
        raw = np.where(x <= low + NEAR, low, np.where(x >= high - NEAR, high, x))
        sharp = self._sharpened(problem, Arrow(problem), raw, free, "piqp")
        if sharp is not None and sharp.check.passed and not is_strained(problem, sharp):
            return sharp
        # The digits of piqp, in case the active set lost some of them.
        rough = answer_at(problem, x, problem.forces(x, found.multipliers), "piqp")
        return sharp if sharp is not None and sharp.check.passed and not rough.check.passed else rough

    def _sharpened(self, problem: Quadratic, arrow: Arrow, begin: Array, free: Mask, engine: str) -> Answer | None:
        active = ColorNewton(arrow)
        near_low = begin - problem.lower <= problem.upper - begin
        # Held unknowns of the guess must lie exactly on their nearer bounds, or ``begin`` would treat them as free.
        held = np.where(free, begin, np.where(near_low, problem.lower, problem.upper))
        active.begin(held, free)
        self._arrow, self._active = arrow, active
        # The walk begins at the guess itself, not at the end of the first method.
        longest = active.longest_walk if active.is_dense else NEAR_STEPS
        arrived = active.settle() or active.walk(held, free, longest)
        self.steps = active.steps
        answer = self._read(problem, active, engine)
        # Refinement costs a residual per row; it is made only where the first digits are not enough.
        if arrived and not is_sharp(answer, COLD_SHARP):
            return self._finer(problem, active, engine, answer)
        return answer if arrived or answer.check.passed else None

    def _finer(self, problem: Quadratic, active: ColorNewton, engine: str, answer: Answer) -> Answer:
        """The answer after refinement, if that is better.

        Where lights differ much in strength, the gradient of the dim ones is lost in the rounding of the bright ones'.
        Exact rows with large multipliers show what the factors' own ridge leaves.
        """
        held, free = active.x.copy(), active.free.copy()
        if active.settle(FINE_STEPS, fine=True):
            fine = self._read(problem, active, engine)
            if fine.check.worst <= answer.check.worst:
                return fine
        active.begin(held, free)
        return answer

    def _read(self, problem: Quadratic, active: ColorNewton, engine: str) -> Answer:
        misses = problem.all_misses(active.x)
        return answer_at(problem, active.x, active.arrow.row_forces(misses, active.multipliers), engine, misses)

    def _compromise(self, problem: Quadratic) -> Answer:
        """Exact rows with large weights: the nearest compromise."""
        elastic = softened(problem)
        # Nothing became soft: the conflicting rows belong to no cell (a light's white), so they must become soft too.
        if sum(block.exact.sum() for block in elastic.blocks) == sum(block.exact.sum() for block in problem.blocks):
            elastic = softened(problem, everything=True)
        answer = self._cold(elastic)
        self._conflict = True
        return replace(answer, infeasible=True)


def solve(problem: Quadratic) -> Answer:
    """Solve a single problem."""
    return Engine().solve(problem)


def _alike(one: Quadratic, other: Quadratic) -> bool:
    """True if two problems have the same unknowns."""
    return one.color_lower.shape == other.color_lower.shape and one.offsets == other.offsets
