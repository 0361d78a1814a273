# SPDX-License-Identifier: GPL-3.0-or-later
"""One designed spectrum of a side with its rows, and all spectra of a side as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DIM = 1e-7
"""Sum of absolute values of a color row below which its light is invisible, so that its error cannot be seen."""
RowKey = tuple[int, tuple[int, int]]
"""(condition, cell) of three rows."""


@dataclass(frozen=True, eq=False)
class Block:
    """One designed spectrum of n values: its rows, its roughness and its bounds."""

    rows: Array
    """A, (m, n)."""
    targets: Array
    """t, (m,)."""
    ties: Array
    """τ, (m, q): how each row depends on the free colors."""
    weights: Array
    """ω, (m,): squared weights; infinite for exact rows."""
    roughness: Array
    """D, (r, n)."""
    gram: Array
    """DᵀD, (n, n)."""
    lower: Array
    upper: Array
    keys: tuple[RowKey, ...] = ()
    """Cell of each of the first rows, three rows to a cell; rows after them belong to no cell."""
    own_weights: Array | None = None
    """(m,): squared weights of exact rows relative to each other if they cannot all hold; None: equal weights."""

    @cached_property
    def exact(self) -> NDArray[np.bool_]:
        """Exact rows, (m,)."""
        return np.isinf(self.weights)

    @cached_property
    def any_exact(self) -> bool:
        """True if any row is exact."""
        return bool(self.exact.any())

    @cached_property
    def soft_weights(self) -> Array:
        """ω, (m,), with 0 for exact rows."""
        return np.where(self.exact, 0.0, self.weights)

    @cached_property
    def scale(self) -> float:
        """Reference size of the gradient by x: the gradient of an error of 1 in the color of the lightest cell.

        No heavy row then hides an error of a light one. Roughness is the reference if it is larger.
        """
        # A color error of 1 has the gradient ω·a; its largest component is the row's largest coefficient times ω.
        strength = np.abs(self.rows).max(axis=1, initial=0.0)
        shown = (np.abs(self.rows).sum(axis=1) >= DIM) & (self.soft_weights > 0)
        if self.keys:
            # Three rows are one color: the largest of them measures its visibility.
            colored = 3 * len(self.keys)
            strength[:colored] = np.repeat(strength[:colored].reshape(-1, 3).max(axis=1), 3)
            shown[colored:] = False
        lightest = float((self.soft_weights * strength)[shown].min(initial=np.inf))
        # The gradient of roughness, for a block without visible rows: a free spectrum under no light.
        curvature = float(np.diagonal(self.gram).max(initial=0.0))
        strongest = max(curvature, float((self.soft_weights @ self.rows**2).max(initial=0.0)))
        return min(strongest, lightest) or 1.0

    @cached_property
    def lightest_ties(self) -> Array:
        """Least weight of the rows that are tied to each free color, (q,); infinite without such rows."""
        tied = (self.ties != 0) & (self.soft_weights > 0)[:, None]
        return np.where(tied, self.soft_weights[:, None], np.inf).min(axis=0, initial=np.inf)

    def misses(self, x: Array, colors: Array) -> Array:
        """Residual of each row, unweighted, (m,)."""
        return self.rows @ x - self.targets - self.ties @ colors


@dataclass(frozen=True, slots=True, eq=False)
class Stack:
    """Blocks of equal shape as arrays, so that one product serves them all."""

    rows: Array
    """(K, m, n)."""
    targets: Array
    """(K, m)."""
    ties: Array
    """(K, m, q)."""
    soft_weights: Array
    """(K, m)."""
    exact: NDArray[np.bool_]
    """(K, m)."""
    scales: Array
    """(K,): ``Block.scale``."""

    @classmethod
    def of(cls, blocks: Sequence[Block]) -> Stack:
        """The arrays of some blocks."""
        return cls(
            np.array([block.rows for block in blocks]),
            np.array([block.targets for block in blocks]),
            np.array([block.ties for block in blocks]),
            np.array([block.soft_weights for block in blocks]),
            np.array([block.exact for block in blocks]),
            np.array([block.scale for block in blocks]),
        )

    def with_block(self, k: int, block: Block) -> Stack:
        """The same arrays with one block replaced."""
        found = Stack(
            self.rows, self.targets.copy(), self.ties, self.soft_weights.copy(), self.exact.copy(), self.scales.copy()
        )
        # Rows and ties are shared: an edit of a target or weight leaves them.
        found.targets[k], found.soft_weights[k], found.exact[k] = block.targets, block.soft_weights, block.exact
        found.scales[k] = block.scale
        return found

    def misses(self, values: Array, colors: Array) -> Array:
        """Residual of each row, unweighted, (K, m)."""
        # One product over the stack: K small ones would spend more time in Python than in arithmetic.
        left = np.matmul(self.rows, values[:, :, None])[:, :, 0] - self.targets
        return left - self.ties @ colors if colors.size else left
