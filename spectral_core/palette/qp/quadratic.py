# SPDX-License-Identifier: GPL-3.0-or-later
"""The problem of every side of a palette: many bounded spectra, coupled by a few free colors.

    minimize ½ Σ_k [ Σ_r ω_r (a_r·x_k − t_r − τ_r·g)² + ||D x_k||² ] + ½ Σ_s ω_s (t_s + τ_s·g)²
    subject to  low ≤ x_k ≤ high,  low ≤ g ≤ high,  a_r·x_k − t_r = τ_r·g  where ω_r is infinite

A block x_k is a designed spectrum (or the amounts of its primaries); g holds a free color for each group of cells that
should look the same (Eq. 5.16). Rows without a spectrum (index s) come from cells whose color is known already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.block import Block, Stack, typical

if TYPE_CHECKING:
    from scipy import sparse

Array = NDArray[np.float64]
EPSILON = float(np.finfo(float).eps)
FAR = 1e30
"""Large number in place of infinity for solvers that need one."""


@dataclass(eq=False)
class Quadratic:
    """The problem in the module's docstring. Free colors precede the spectra in the vector of all unknowns."""

    blocks: tuple[Block, ...]
    color_lower: Array
    """(G, 3)."""
    color_upper: Array
    known_ties: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """τ_s, (s, q)."""
    known_targets: Array = field(default_factory=lambda: np.zeros(0))
    known_weights: Array = field(default_factory=lambda: np.zeros(0))
    cell_unit: float | None = None
    """Median weight of soft cells where these rows do not tell it: in a part of a palette, or with exact rows soft."""

    @cached_property
    def offsets(self) -> list[int]:
        """Start of each block in the vector of all unknowns, and the end of the last."""
        return np.cumsum([self.color_lower.size, *(block.lower.size for block in self.blocks)]).tolist()

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.offsets[-1]

    @cached_property
    def lower(self) -> Array:
        """Lower bounds of all unknowns."""
        return np.concatenate([self.color_lower.ravel(), *(block.lower for block in self.blocks)])

    @cached_property
    def upper(self) -> Array:
        """Upper bounds of all unknowns."""
        return np.concatenate([self.color_upper.ravel(), *(block.upper for block in self.blocks)])

    @cached_property
    def has_equalities(self) -> bool:
        """True if any row is exact."""
        return any(block.any_exact for block in self.blocks)

    @cached_property
    def typical_weights(self) -> tuple[float, float]:
        """Lower median and least of all finite weights; 1 if there is none."""
        stacked = self.stack
        own = [stacked.soft_weights.ravel()] if stacked is not None else [block.soft_weights for block in self.blocks]
        return typical(np.concatenate([self.known_weights, *own]))

    @cached_property
    def stack(self) -> Stack | None:
        """The blocks as arrays; None if their shapes differ, or if they are too few to gain by it."""
        shapes = {(block.rows.shape, id(block.gram)) for block in self.blocks}
        return Stack.of(self.blocks) if len(shapes) == 1 and len(self.blocks) > 1 else None

    @cached_property
    def gradient_scale(self) -> Array:
        """The scale of the gradient by each unknown, with which a check compares it.

        ``Block.scale``, and by color the weight of its lightest cell: the least weight that ties a color decides, or an
        error of a cell of small weight would vanish beside large ones.
        """
        stacked = self.stack
        if stacked is not None:
            lightest = stacked.lightest_ties.min(axis=0, initial=np.inf)
            scales = np.repeat(stacked.scales, stacked.rows.shape[2])
        else:
            ties = [block.lightest_ties for block in self.blocks]
            lightest = np.min(ties, axis=0, initial=np.inf) if ties else np.full(self.color_lower.size, np.inf)
            scales = np.repeat([block.scale for block in self.blocks], np.diff(self.offsets))
        if self.known_weights.size and lightest.size:
            known = np.where(self.known_ties != 0, self.known_weights[:, None], np.inf)
            lightest = np.minimum(lightest, known.min(axis=0))
        colors = np.where(np.isfinite(lightest), lightest, 1.0)
        return np.concatenate([colors, scales])

    def with_block(self, k: int, block: Block) -> Quadratic:
        """The same problem with other targets or weights in one block; all parts that do not depend on them are
        kept.
        """
        blocks = (*self.blocks[:k], block, *self.blocks[k + 1 :])
        # Cached properties that depend on shapes and bounds alone are copied: an edit changes neither.
        found = Quadratic(
            blocks,
            self.color_lower,
            self.color_upper,
            self.known_ties,
            self.known_targets,
            self.known_weights,
            self.cell_unit,
        )
        for name in ("offsets", "lower", "upper"):
            found.__dict__[name] = getattr(self, name)
        same_weights = block.weights is self.blocks[k].weights
        if same_weights:
            for name in ("has_equalities", "gradient_scale", "typical_weights"):
                found.__dict__[name] = getattr(self, name)
        if self.stack is not None:
            found.__dict__["stack"] = self.stack.with_block(k, block, same_weights=same_weights)
        return found

    def all_misses(self, x: Array) -> Array | list[Array]:
        """The unweighted error of each row of each block: (K, m), or a list if the blocks differ in shape."""
        count = self.offsets[0]
        if self.stack is not None:
            # One batched product instead of K small ones, which are all overhead.
            return self.stack.misses(x[count:].reshape(len(self.blocks), -1), x[:count])
        _, values = self.split(x)
        return [block.misses(value, x[:count]) for block, value in zip(self.blocks, values, strict=True)]

    def split(self, x: Array) -> tuple[Array, list[Array]]:
        """Free colors (G, 3) and the spectra."""
        return x[: self.offsets[0]].reshape(-1, 3), [x[a:b] for a, b in pairwise(self.offsets)]

    def joined(self, colors: Array, values: Sequence[Array]) -> Array:
        """The vector of all unknowns; inverse of ``split``."""
        return np.concatenate([colors.ravel(), *values])

    def best_colors(self, values: Sequence[Array]) -> Array:
        """Optimal free colors (G, 3) for given spectra: the weighted mean of each group, within its box."""
        count = self.color_lower.size
        if not count:
            return np.zeros((0, 3))
        hessian = (self.known_ties.T * self.known_weights) @ self.known_ties
        linear = -self.known_ties.T @ (self.known_weights * self.known_targets)
        for block, value in zip(self.blocks, values, strict=True):
            finite = block.weights[~block.exact]
            # Exact rows of a group have one color; a large weight selects it.
            weights = np.where(block.exact, 1e8 * max(float(finite.max(initial=0.0)), 1.0), block.weights)
            tied = block.ties.T * weights
            hessian = hessian + tied @ block.ties
            linear = linear + tied @ (block.rows @ value - block.targets)
        index = np.arange(count)
        # A group without rows has a zero row; the system must still be regular.
        hessian[index, index] += 1e-300 + 1e-15 * np.diagonal(hessian)
        low, high = self.color_lower.ravel(), self.color_upper.ravel()
        colors = np.linalg.solve(hessian, linear)
        clipped = np.clip(colors, low, high)
        if np.any(clipped != colors) and np.any(hessian != np.diag(np.diagonal(hessian))):
            # Under a metric the channels depend on each other: the nearest point of the box is not the clipped one.
            clipped = least_in_box(hessian, linear, low, high, clipped)
        return clipped.reshape(-1, 3)

    def forces(self, x: Array, equality_forces: Sequence[Array] | None = None) -> list[Array]:
        """Multiplier of each row of each block, (m,): weight × residual, or as given for an exact row."""
        colors, values = self.split(x)
        found = []
        for k, (block, value) in enumerate(zip(self.blocks, values, strict=True)):
            exact = block.exact
            force = block.soft_weights * block.misses(value, colors.ravel())
            if equality_forces is not None:
                force[exact] = equality_forces[k]
            found.append(force)
        return found

    def gradient(self, x: Array, forces: Array | Sequence[Array]) -> Array:
        """Gradient of the Lagrangian by all unknowns, from the rows' multipliers."""
        colors = x[: self.offsets[0]]
        by_colors = np.zeros(colors.size)
        if self.known_weights.size and colors.size:
            shown = self.known_targets + self.known_ties @ colors
            by_colors = self.known_ties.T @ (self.known_weights * shown)
        if self.stack is not None:
            forces = np.asarray(forces)
            own = np.matmul(forces[:, None, :], self.stack.rows)[:, 0]
            own += x[colors.size :].reshape(own.shape) @ self.blocks[0].gram
            if colors.size:
                by_colors = by_colors - forces.ravel() @ self.stack.ties.reshape(-1, colors.size)
            return np.concatenate([by_colors, own.ravel()])
        parts = []
        for block, value, force in zip(self.blocks, self.split(x)[1], forces, strict=True):
            parts.append(block.gram @ value + block.rows.T @ force)
            by_colors = by_colors - block.ties.T @ force
        return np.concatenate([by_colors, *parts])

    def objective(self, x: Array) -> float:
        """Half the weighted sum of squares of all soft rows."""
        colors, values = self.split(x)
        total = float(self.known_weights @ (self.known_targets + self.known_ties @ colors.ravel()) ** 2)
        for block, value in zip(self.blocks, values, strict=True):
            # Not through the Gram matrix: for a smooth bright light it gives only rounding, a millionth of ε instead of
            # ε².
            rough = block.roughness @ value
            total += float(block.soft_weights @ block.misses(value, colors.ravel()) ** 2 + rough @ rough)
        return total / 2

    def rounding(self, x: Array) -> float:
        """Largest error of ``objective`` at a point by rounding: the sum of a row is known to ε of its terms."""
        colors, values = self.split(x)
        total = 0.0
        for block, value in zip(self.blocks, values, strict=True):
            size = (
                np.abs(block.rows) @ np.abs(value) + np.abs(block.targets) + np.abs(block.ties) @ np.abs(colors.ravel())
            )
            smooth = np.abs(block.roughness) @ np.abs(value)
            for weights, left, error in (
                (block.soft_weights, block.misses(value, colors.ravel()), EPSILON * size),
                (1.0, block.roughness @ value, EPSILON * smooth),
            ):
                total += float(np.sum(weights * error * (2 * np.abs(left) + error)))
        return total / 2

    def least_squares(self) -> tuple[sparse.csr_matrix, Array]:
        """All rows times the roots of their weights, (M, y) with objective ½||M x − y||²."""
        from scipy import sparse

        parts, right = [], []
        root = np.sqrt(self.known_weights)
        if root.size:
            parts.append(_wide(root[:, None] * self.known_ties, 0, self.size))
            right.append(-root * self.known_targets)
        for block, start in zip(self.blocks, self.offsets, strict=False):
            soft = ~block.exact
            # Roots, not weights: a solver that works on the rows keeps their condition instead of its square.
            root = np.sqrt(block.weights[soft])[:, None]
            tied = _wide(-root * block.ties[soft], 0, self.size)
            parts += [_wide(root * block.rows[soft], start, self.size) + tied, _wide(block.roughness, start, self.size)]
            right += [root[:, 0] * block.targets[soft], np.zeros(len(block.roughness))]
        if not parts:
            return sparse.csr_matrix((0, self.size)), np.zeros(0)
        return sparse.vstack(parts, format="csr"), np.concatenate(right)

    def equalities(self) -> tuple[sparse.csr_matrix, Array]:
        """Exact rows and their right-hand sides, in the order of the blocks."""
        from scipy import sparse

        parts = [
            _wide(block.rows[block.exact], start, self.size) + _wide(-block.ties[block.exact], 0, self.size)
            for block, start in zip(self.blocks, self.offsets, strict=False)
        ]
        right = [block.targets[block.exact] for block in self.blocks]
        if not parts:
            return sparse.csr_matrix((0, self.size)), np.zeros(0)
        return sparse.vstack(parts, format="csr"), np.concatenate(right)


def least_in_box(hessian: Array, linear: Array, low: Array, high: Array, fallback: Array) -> Array:
    """The minimum of ½ xᵀHx − linear·x within a box; ``fallback`` also holds the values where the box is a point."""
    import daqp

    open_ended = low < high
    held = np.where(open_ended, 0.0, low)
    inner = np.ascontiguousarray(hessian[open_ended][:, open_ended])
    right = (linear - hessian @ held)[open_ended]
    # daqp's tolerances are absolute, so each color has a unit in which its curvature is 1: that of exact cells is 10⁸
    # times that of others.
    root = np.sqrt(np.maximum(np.diagonal(inner), 1e-300))
    ends = [
        np.where(np.abs(end[open_ended]) < FAR, root * end[open_ended], sign * FAR)
        for end, sign in ((high, 1), (low, -1))
    ]
    sense = np.zeros(len(inner), dtype=np.int32)
    scaled = inner / root / root[:, None]
    found, _, flag, _ = daqp.solve(scaled, -right / root, np.zeros((0, len(inner))), *ends, sense)
    if flag <= 0 or not np.all(np.isfinite(found)):
        return fallback
    best = held.copy()
    best[open_ended] = np.clip(found / root, low[open_ended], high[open_ended])
    return best


def _wide(matrix: Array, start: int, width: int) -> sparse.csr_matrix:
    """A dense matrix as columns ``start`` onwards of a sparse one of a given width."""
    from scipy import sparse

    rows, columns = np.nonzero(matrix)  # roughness rows hold three values each
    return sparse.csr_matrix((matrix[rows, columns], (rows, columns + start)), shape=(len(matrix), width))
