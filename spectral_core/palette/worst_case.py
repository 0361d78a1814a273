# SPDX-License-Identifier: GPL-3.0-or-later
"""Robust cells as a worst case: minimize the largest of their errors over observers and variants.

    minimize  F(x) + ½ N max_l e_l(x)²      with e_l the weighted error of robust row l, N rows in all

is the largest, over shares μ ≥ 0 that sum to 1, of the soft problem F + ½ N Σ μ_l e_l² (both are convex, so the order
of minimum and maximum does not matter). Lawson's iteration μ ← μ e / Σ μ e finds the shares by solving soft problems
alone, and their difference to the maximum bounds the remaining error: no cone solver is needed. A test compares it with
cvxpy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.problem import CellIndex

Array = NDArray[np.float64]

RowKey = tuple[int, CellIndex]
"""(condition, cell) of a robust row."""
TOLERANCE = 0.01
"""Share by which the largest error may exceed the bound from below when the iteration stops."""
ITERATIONS = 25
"""Updates in one half-round; the next one continues with the same shares."""
FLOOR = 1e-6
"""Least share of a row, so that the share of a row that was met early can grow again."""


@dataclass
class Shares:
    """Distribution of the robust weight among rows; all 1 for least squares."""

    of_row: dict[RowKey, float] = field(default_factory=dict)

    def factor(self, row: RowKey) -> float:
        """Factor of a row's weight: √(N μ)."""
        return float(np.sqrt(self.of_row.get(row, 1.0)))

    def moved(self, errors: dict[RowKey, float]) -> float:
        """Lawson's update by the rows' errors; returns the relative distance of the largest from the bound."""
        keys = sorted(errors)
        size = np.array([errors[key] for key in keys])
        share = np.array([self.of_row.get(key, 1.0) for key in keys])
        largest = float(size.max(initial=0.0))
        bound = float(np.sqrt(np.mean(share * size**2)))
        if largest <= 0:
            return 0.0
        share = np.maximum(share * size, FLOOR * largest)
        self.of_row |= dict(zip(keys, (share * len(keys) / share.sum()).tolist(), strict=True))
        return (largest - bound) / largest


def worst_case_shares(solve: Callable[[], dict[RowKey, float]], shares: Shares) -> float | None:
    """Move the shares until the largest error is within TOLERANCE of its bound; ``solve`` returns the rows' errors.

    Returns the remaining difference relative to the largest error; None without robust rows. The answer
    is that of the last ``solve``, before the last update of the shares.
    """
    left = None
    for _ in range(ITERATIONS):
        errors = solve()
        if not errors:
            return None
        left = shares.moved(errors)
        if left <= TOLERANCE:
            break
    return left
