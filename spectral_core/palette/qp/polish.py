# SPDX-License-Identifier: GPL-3.0-or-later
"""The last digits of an answer: bounded-variable least squares from an engine's answer on, by orthogonal factors.

Stark and Parker 1995, "Bounded-variable least squares", started at the bounds that an engine found active. It does not
square the matrix, so it sees cells that weigh 1e-3 beside one that weighs 1, where engines on normal equations do not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.least_squares import Check, LinkedLeastSquares, dense_equalities, dense_rows
from spectral_core.palette.qp.optimality import checked

Array = NDArray[np.float64]

NEAR = 1e-7
"""Distance to a bound at which an engine's answer is taken to lie on it."""
WRONG = 1e-11
"""Scaled gradient that pulls off a bound from which an unknown is released."""


def polished(problem: LinkedLeastSquares, x: Array) -> tuple[Array, Check]:
    """A better answer near ``x``, and its check; ``x`` itself where none is found."""
    walk = _Walk(problem, x)
    best, best_check = walk.x, checked(problem, walk.x)
    for _ in range(4 * problem.size + 20):
        arrived = walk.step()
        if not arrived:
            continue
        check = checked(problem, walk.x)
        if check.worst < best_check.worst:
            best, best_check = walk.x.copy(), check
        if (check.kkt <= 0.01 * Check.LIMIT and check.gap <= Check.SHARP) or not walk.release():
            break
    return best, best_check


class _Walk:
    """A feasible point that moves from face to face of the bounds, always downhill."""

    def __init__(self, problem: LinkedLeastSquares, x: Array) -> None:
        self._problem = problem
        self._matrix, self._target = dense_rows(problem)
        self._rows, self._rows_target = dense_equalities(problem)
        low, high = problem.lower, problem.upper
        self.x = np.where(x <= low + NEAR, low, np.where(x >= high - NEAR, high, x))
        self._free = (self.x > low) & (self.x < high)

    def step(self) -> bool:
        """Move to the minimum on the present face, or to the first bound before it; whether it was reached."""
        free, low, high = self._free, self._problem.lower, self._problem.upper
        held = np.where(free, 0.0, self.x)
        goal = self.x.copy()
        goal[free] = equality_least_squares(
            self._matrix[:, free],
            self._target - self._matrix @ held,
            self._rows[:, free],
            self._rows_target - self._rows @ held,
        )
        move = goal - self.x
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(move < 0, (low - self.x) / move, np.where(move > 0, (high - self.x) / move, np.inf))
        room[~free] = np.inf
        part = float(room.min(initial=np.inf))
        if part >= 1.0:
            self.x = np.clip(goal, low, high)
            return True
        self.x = self.x + part * move
        stopped = free & (room <= part * (1 + 1e-12))
        self.x[stopped] = np.where(move[stopped] < 0, low[stopped], high[stopped])
        self._free = free & ~stopped
        return False

    def release(self) -> bool:
        """Free the bound whose gradient pulls away from it most; False where none does."""
        problem = self._problem
        gradient = problem.gradient(self.x)
        if self._rows.shape[0] and self._free.any():
            shares, *_ = np.linalg.lstsq(self._rows[:, self._free].T, -gradient[self._free], rcond=1e-13)
            gradient = gradient + self._rows.T @ shares
        scaled = gradient / problem.scale
        pull = np.where(self.x <= problem.lower, -scaled, np.where(self.x >= problem.upper, scaled, 0.0))
        pull[self._free] = 0.0
        worst = int(pull.argmax())
        if pull[worst] <= WRONG:
            return False
        self._free[worst] = True
        return True


def equality_least_squares(matrix: Array, target: Array, rows: Array, rows_target: Array) -> Array:
    """Minimum of ||matrix x − target|| where rows x = rows_target, by the null space of the rows."""
    if rows.shape[0] == 0 or rows.shape[1] == 0:
        return np.linalg.lstsq(matrix, target, rcond=1e-14)[0]
    left, sizes, right = np.linalg.svd(rows)
    rank = int((sizes > 1e-11 * max(sizes.max(initial=0.0), 1e-300)).sum())
    particular = right[:rank].T @ ((left[:, :rank].T @ rows_target) / sizes[:rank])
    null = right[rank:].T
    return particular + null @ np.linalg.lstsq(matrix @ null, target - matrix @ particular, rcond=1e-14)[0]
