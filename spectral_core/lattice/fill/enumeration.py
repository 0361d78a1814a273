# SPDX-License-Identifier: GPL-3.0-or-later
"""All lattice points in a convex region, with work in proportion to the points and never to a bounding box.

In the metric of the region (``anchoring``) the lattice is reduced, and its coordinates are chosen one by one, last
first. A partial choice is dropped when no completion can lie in the region, by three tests of growing price:

* the enclosing ellipsoid (Fincke and Pohst),
* every half-space, with the largest contribution that the open coordinates can make within the ellipsoid,
* projections of the region: where many partial choices survive, a linear program for a sample of them either finds a
  completion or a cut (its dual) that no projection of the region crosses, and that all others are tested against.

Cuts are statements about the gauge, so they hold for every size of the region. Work is bounded by ``MAX_NODES``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.lattice.fill.anchoring import Anchored
from spectral_core.lattice.reduction import lll

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_NODES = 40_000_000
"""Partial choices before the search stops with an error: below a minute of work."""
MAX_PROGRAMS = 400
"""Linear programs for cuts in one window: below a second."""
MAX_PRUNING_ROWS = 256
"""Half-spaces that partial choices are tested against."""
_CHUNK = 60_000
_SAMPLE = 16
_ROUNDS = 12
_SLACK = 1e-9


class Window:
    """The points ``offset + basis k`` (relative to the region's center) in a region grown by a gauge.

    It keeps its cuts from one search to the next; ``nodes`` and ``programs`` count the work so far.
    """

    def __init__(self, region: Anchored, basis: Matrix, offset: Matrix) -> None:
        # In the metric the region is round; a reduced basis there makes early coordinates decide as much as late ones.
        whitened = region.metric @ basis
        self._change = lll(whitened)
        frame, self._r = np.linalg.qr(whitened @ self._change)
        # On z = frameᵀ W v the region is rows z <= gauge, within the ball of radius gauge around gauge · middle.
        every = np.linalg.solve((frame.T @ region.metric).T, region.rows.T).T
        # The nearest planes prune nearly as much as all of them; the last coordinate is tested against all.
        self._rows = every[np.argsort(-np.linalg.norm(every, axis=1), kind="stable")[:MAX_PRUNING_ROWS]]
        # The triangular factor lets coordinates be fixed from the last to the first, each by those after it.
        self._start = frame.T @ (region.metric @ offset)
        self._middle = frame.T @ (region.metric @ region.ellipsoid_center)
        # How much the open coordinates can still change a row, per unit of the radius that is left to them.
        self._reach = np.sqrt(np.cumsum(np.c_[np.zeros(len(self._rows)), self._rows**2], axis=1))
        self._cuts: dict[int, Matrix] = {0: every}
        self.nodes = 0
        self.programs = 0

    def points(self, gauge: float, expected: float, most: int = MAX_NODES) -> Integers:
        """Coefficients k, (N, n), of all points with region gauge up to ``gauge`` (and few beyond, by rounding).

        ``expected`` is about how many; far more partial choices than that call for cuts. SolveError above MAX_NODES,
        InvalidInputError above ``most`` points.
        """
        n = len(self._r)
        limit = gauge * (1.0 + _SLACK)
        done: list[Integers] = []
        found_so_far = 0
        # Depth first, in chunks: memory is bounded by the depth, not by the number of partial choices.
        stack = [(n, np.zeros((1, 0), dtype=np.int64))]
        while stack:
            level, chosen = stack.pop()
            if level == 0:
                done.append(chosen)
                found_so_far += len(chosen)
                if found_so_far > most:
                    raise InvalidInputError(
                        f"the region holds more than {most} points at this level; take a coarser one"
                    )
                continue
            if len(chosen) > _CHUNK:
                stack += [(level, part) for part in np.array_split(chosen, len(chosen) // _CHUNK + 1)]
                continue
            chosen = self._extended(chosen, level - 1, limit, expected)
            if len(chosen):
                stack.append((level - 1, chosen))
        found = np.concatenate(done) if done else np.zeros((0, n), dtype=np.int64)
        return np.asarray(found @ self._change.T)

    def _extended(self, chosen: Integers, level: int, limit: float, expected: float) -> Integers:
        """Partial choices with one more coordinate, without those that cannot lie in the region."""
        r, known = self._r, self._coordinates(chosen, level + 1)
        base = self._start[level] + chosen @ r[level, level + 1 :]
        # Fincke and Pohst: the open coordinates have the part of the squared radius that the fixed ones leave.
        spent = ((known - limit * self._middle[level + 1 :]) ** 2).sum(axis=1)
        half = np.sqrt(np.maximum(limit**2 - spent, 0.0))
        low, high = limit * self._middle[level] - half, limit * self._middle[level] + half
        if level in self._cuts:
            low, high = _within_cuts(self._cuts[level], known, limit, low, high)
        step = r[level, level]
        first, last = (
            ((low - base) / step, (high - base) / step) if step > 0 else ((high - base) / step, (low - base) / step)
        )
        first = np.ceil(first - _SLACK).astype(np.int64)
        counts = np.maximum(np.floor(last + _SLACK).astype(np.int64) - first + 1, 0)
        self._count_nodes(int(counts.sum()))
        parent = np.repeat(np.arange(len(chosen)), counts)
        # All choices of all parents at once: an arange that restarts for every parent.
        k = first[parent] + np.arange(len(parent)) - np.repeat(np.cumsum(counts) - counts, counts)
        extended = np.concatenate([k[:, None], chosen[parent]], axis=1)
        if level == 0:
            return extended
        extended = self._within_halfspaces(extended, level, limit)
        if len(extended) > 30_000 + 8.0 * expected:
            extended = self._within_projection(extended, level, limit)
        return extended

    def _coordinates(self, chosen: Integers, level: int) -> Matrix:
        """z_level .. z_(n-1) of partial choices of the last n - level coefficients."""
        coordinates: Matrix = self._start[level:] + chosen @ self._r[level:, level:].T
        return coordinates

    def _within_halfspaces(self, chosen: Integers, level: int, limit: float) -> Integers:
        """Drop choices for which a half-space lies beyond the reach of the open coordinates in the ellipsoid."""
        keep = []
        # In blocks of 32 MB, independent of the number of rows.
        block = max(1, 4_000_000 // (len(self._rows) + 1))
        for start in range(0, len(chosen), block):
            known = self._coordinates(chosen[start : start + block], level)
            away = known - limit * self._middle[level:]
            left = np.sqrt(np.maximum(limit**2 - (away**2).sum(axis=1), 0.0))
            shift = limit * (self._rows[:, :level] @ self._middle[:level])
            least = known @ self._rows[:, level:].T - left[:, None] * self._reach[:, level] + shift
            keep.append((least <= limit).all(axis=1))
        return chosen[np.concatenate(keep)] if keep else chosen

    def _within_projection(self, chosen: Integers, level: int, limit: float) -> Integers:
        """Drop choices outside the projection of the region, by cuts from the linear programs of a sample."""
        rng = np.random.default_rng(level)
        known = self._coordinates(chosen, level)
        for _ in range(_ROUNDS):
            if self.programs + _SAMPLE > MAX_PROGRAMS or len(chosen) < 2000:
                break
            # A linear program costs as much as a thousand tests, but its cut applies to all partial choices.
            sample = rng.choice(len(chosen), _SAMPLE, replace=False)
            cuts = [cut for cut in (self._cut_at(known[i], level, limit) for i in sample) if cut is not None]
            # Most of the sample has a completion: more cuts would exclude little.
            if len(cuts) < _SAMPLE // 4:
                break
            new = np.array(cuts)
            self._cuts[level] = np.concatenate([self._cuts[level], new]) if level in self._cuts else new
            keep = (known @ new.T <= limit).all(axis=1)
            chosen, known = chosen[keep], known[keep]
        return chosen

    def _cut_at(self, known: Matrix, level: int, limit: float) -> Matrix | None:
        """Least gauge of a completion of ``known``; its dual as a row on the known coordinates when above ``limit``."""
        from scipy.optimize import linprog

        self.programs += 1
        # Least gauge t with rows · (open, known) <= t: the last column is -t.
        rows = np.column_stack([self._rows[:, :level], -np.ones(len(self._rows))])
        fixed = self._rows[:, level:] @ known
        answer = linprog(np.r_[np.zeros(level), 1.0], A_ub=rows, b_ub=-fixed, bounds=(None, None), method="highs")
        if answer.status != 0 or answer.fun <= limit:
            return None
        # By duality this combination of rows holds for every completion, so it is a condition on the fixed coordinates.
        factors = np.maximum(-answer.ineqlin.marginals, 0.0)
        row: Matrix = (factors @ self._rows[:, level:]) / factors.sum()
        # A slightly inexact dual must not cut the region: its remainder on open coordinates widens the cut.
        rest = np.linalg.norm(factors @ self._rows[:, :level]) / factors.sum()
        return row / (1.0 + rest * (1.0 + np.linalg.norm(self._middle)) + 1e-9)

    def _count_nodes(self, more: int) -> None:
        self.nodes += more
        if self.nodes > MAX_NODES:
            raise SolveError(
                f"the search for points in the region passed {MAX_NODES} partial choices; the region is too slanted "
                "or the dimension too high. Ask for fewer points, or split the region"
            )


def _within_cuts(cuts: Matrix, known: Matrix, limit: float, low: Matrix, high: Matrix) -> tuple[Matrix, Matrix]:
    """Interval of the next coordinate that all cuts allow; the first column of a cut belongs to it."""
    block = max(1, 4_000_000 // (len(known) + 1))
    for start in range(0, len(cuts), block):
        part = cuts[start : start + block]
        slope = part[:, 0]
        room = limit - known @ part[:, 1:].T
        for sign in (1.0, -1.0):
            side = sign * slope > 1e-12
            if side.any():
                bound = room[:, side] / slope[side]
                if sign > 0:
                    high = np.minimum(high, bound.min(axis=1))
                else:
                    low = np.maximum(low, bound.max(axis=1))
    return low, high
