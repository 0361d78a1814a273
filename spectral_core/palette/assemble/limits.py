# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of unknown reflectances: the bounds of each value, and equations of colors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from spectral_core.palette.assemble.equations import Equation

Array = NDArray[np.float64]

OPEN = 1e30
"""An open end of a range: the infinity of daqp."""
UNBOUNDED = 3  # of ``linprog``


class Limits:
    """Bounds of n unknowns, and ``held`` equations; as arrays in the order of DAQP, bounds first.

    ``rows`` (3 k, n): of the k equations; ``shown`` (3 k, n): to the colors that they concern; ``is_equal`` (3 k,):
    True for equalities, False for ranges.
    """

    def __init__(self, size: int, bounds: tuple[float, float], held: Sequence[Equation]) -> None:
        self.bounds, self.size, self.count = bounds, size, len(held)
        none = np.zeros((0, size))
        self.rows = np.concatenate([none, *(each.rows for each in held)])
        self.shown = np.concatenate([none, *(each.shown for each in held)])
        ends = np.concatenate([np.empty((2, 0)), *(each.ends for each in held)], axis=1)
        self.is_equal = ends[0] == ends[1]
        self.lower = np.maximum(np.concatenate([np.full(size, bounds[0]), ends[0]]), -OPEN)
        self.upper = np.minimum(np.concatenate([np.full(size, bounds[1]), ends[1]]), OPEN)
        self.sense = np.concatenate([np.zeros(size), np.where(self.is_equal, 5, 0)]).astype(np.int32)
        """5: an equality."""

    def miss(self, values: Array) -> float:
        """Largest distance of an exact color from its own, or outside its range."""
        shown = self.rows @ values
        return float(np.abs(shown - np.clip(shown, self.lower[self.size :], self.upper[self.size :])).max(initial=0.0))

    def extreme(self, gradient: Array) -> Array | None:
        """Unknowns (n,) that reach farthest along ``gradient`` (n,) within the limits; None if there are none, infinite
        where nothing bounds it.
        """
        equal = self.is_equal
        low, high = self.lower[self.size :], self.upper[self.size :]
        ranges = self.rows[~equal]
        answer = linprog(
            -gradient, A_eq=self.rows[equal], b_eq=low[equal], bounds=self.bounds, method="highs-ds",
            A_ub=np.concatenate([ranges, -ranges]), b_ub=np.concatenate([high[~equal], -low[~equal]]),
        )  # fmt: skip
        if answer.status == UNBOUNDED:
            return np.full(self.size, np.inf)
        return np.asarray(answer.x) if answer.status == 0 else None
