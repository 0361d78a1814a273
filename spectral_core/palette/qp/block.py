# SPDX-License-Identifier: GPL-3.0-or-later
"""One designed spectrum of a side with its rows, and all spectra of a side as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

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

        No large weight then hides an error of a cell of small weight. Where the largest curvature is less, it is
        the scale.
        """
        strength, shown, squares, curvature = self._visibility
        lightest = float((self.soft_weights * strength)[shown & (self.soft_weights > 0)].min(initial=np.inf))
        strongest = max(curvature, float((self.soft_weights @ squares).max(initial=0.0)))
        return min(strongest, lightest) or 1.0

    @cached_property
    def _visibility(self) -> tuple[Array, NDArray[np.bool_], Array, float]:
        """The inputs of ``scale`` that do not depend on weights."""
        # A color error of 1 has the gradient ω·a; its largest component is the row's largest coefficient times ω.
        strength = np.abs(self.rows).max(axis=1, initial=0.0)
        shown = np.abs(self.rows).sum(axis=1) >= DIM
        if self.keys:
            # Three rows are one color: the largest of them measures its visibility.
            colored = 3 * len(self.keys)
            strength[:colored] = np.repeat(strength[:colored].reshape(-1, 3).max(axis=1), 3)
            shown[colored:] = False
        # The gradient of roughness, where a block has no row that shows: a free spectrum under no light.
        curvature = float(np.diagonal(self.gram).max(initial=0.0))
        return strength, shown, self.rows**2, curvature

    @cached_property
    def lightest_ties(self) -> Array:
        """Least weight with which rows are tied to each free color, (q,); infinite where none is."""
        tied = self._tied & (self.soft_weights > 0)[:, None]
        return np.where(tied, self.soft_weights[:, None], np.inf).min(axis=0, initial=np.inf)

    @cached_property
    def _tied(self) -> NDArray[np.bool_]:
        return np.asarray(self.ties != 0)

    def misses(self, x: Array, colors: Array) -> Array:
        """Residual of each row, unweighted, (m,)."""
        return self.rows @ x - self.targets - self.ties @ colors

    def with_targets(self, targets: Array) -> Block:
        """The same block with other targets (m,); results that do not depend on them are kept."""
        kept = ("exact", "any_exact", "soft_weights", "scale", "lightest_ties")
        return self._kept(self._with(targets, self.weights, self.own_weights), kept)

    def with_weights(self, targets: Array, weights: Array, own_weights: Array | None) -> Block:
        """The same rows with other targets and weights, (m,) each."""
        return self._kept(self._with(targets, weights, own_weights), ())

    def with_request(self, number: int, color: Array, weight: float, own_weight: float) -> Block:
        """The same block with another color (3,), squared weight and weight of one cell, by its number in keys."""
        rows = slice(3 * number, 3 * number + 3)
        assert self.own_weights is not None
        targets = self.targets.copy()
        targets[rows] = color
        if self.weights[rows.start] == weight and self.own_weights[rows.start] == own_weight:
            return self.with_targets(targets)
        weights, own = self.weights.copy(), self.own_weights.copy()
        weights[rows], own[rows] = weight, own_weight
        return self.with_weights(targets, weights, own)

    def _with(self, targets: Array, weights: Array, own_weights: Array | None) -> Block:
        # Sixty times a second: ``dataclasses.replace`` takes several times as long.
        return Block(
            self.rows,
            targets,
            self.ties,
            weights,
            self.roughness,
            self.gram,
            self.lower,
            self.upper,
            self.keys,
            own_weights,
        )

    def _kept(self, found: Block, names: tuple[str, ...]) -> Block:
        """Copy cached results that depend only on data shared by both blocks."""
        for name in ("_visibility", "_tied", *names):
            if name in self.__dict__:
                found.__dict__[name] = self.__dict__[name]
        return found


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
    lightest_ties: Array
    """(K, q): ``Block.lightest_ties``."""
    soft: Array
    """(K, m): 1 for rows with a weight that need not hold exactly, else 0."""
    softness: Array
    """(K, m): 1 / ω where ``soft``, else 0."""

    @classmethod
    def of(cls, blocks: Sequence[Block]) -> Stack:
        """The arrays of some blocks."""
        weights = np.array([block.soft_weights for block in blocks])
        soft = (weights > 0).astype(float)
        return cls(
            np.array([block.rows for block in blocks]),
            np.array([block.targets for block in blocks]),
            np.array([block.ties for block in blocks]),
            weights,
            np.array([block.exact for block in blocks]),
            np.array([block.scale for block in blocks]),
            np.array([block.lightest_ties for block in blocks]),
            soft,
            soft / np.where(weights > 0, weights, 1.0),
        )

    def with_block(self, k: int, block: Block, *, same_weights: bool) -> Stack:
        """The same arrays with one block replaced, of which maybe only the targets changed."""
        # Rows and ties are shared: an edit of a target or weight leaves them.
        targets = _with_row(self.targets, k, block.targets)
        if same_weights:
            return Stack(
                self.rows,
                targets,
                self.ties,
                self.soft_weights,
                self.exact,
                self.scales,
                self.lightest_ties,
                self.soft,
                self.softness,
            )
        weights = block.soft_weights
        soft = (weights > 0).astype(float)
        return Stack(
            self.rows,
            targets,
            self.ties,
            _with_row(self.soft_weights, k, weights),
            _with_row(self.exact, k, block.exact),
            _with_row(self.scales, k, block.scale),
            _with_row(self.lightest_ties, k, block.lightest_ties),
            _with_row(self.soft, k, soft),
            _with_row(self.softness, k, soft / np.where(weights > 0, weights, 1.0)),
        )

    def misses(self, values: Array, colors: Array) -> Array:
        """Residual of each row, unweighted, (K, m)."""
        # One product over the stack: K small ones would spend more time in Python than in arithmetic.
        left = np.matmul(self.rows, values[:, :, None])[:, :, 0]
        left -= self.targets
        if colors.size:
            left -= (self.ties.reshape(-1, colors.size) @ colors).reshape(left.shape)
        return left


def typical(weights: Array) -> tuple[float, float]:
    """Lower median and least of the positive weights; 1 if there is none."""
    weights = weights[weights > 0]
    if weights.size == 0:
        return 1.0, 1.0
    # The lower median: dragging one weight far away does not change the unit.
    middle = (weights.size - 1) // 2
    return float(np.partition(weights, middle)[middle]), float(weights.min())


def _with_row(array: NDArray[Any], k: int, row: Any) -> NDArray[Any]:
    """A copy of an array with one row replaced."""
    found = array.copy()
    found[k] = row
    return found
