# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounded least squares with equalities, block by block, and the check that every answer must pass.

One phase of a palette (all reflectances under known lights, or all lights on known reflectances) is

    minimize ½ Σ_k ||M_k x_k − y_k||² + ½ Σ_l w_l² ||A_l x_k(l) + c_l − g_group(l)||²
    subject to  low ≤ x ≤ high,  low ≤ g ≤ high,  E_k x_k = e_k,  A_l x_k(l) + c_l = g_group(l) for exact links

with a block x_k per designed spectrum and a free color g per group of cells that should look the same (Eq. 5.16).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy import sparse

Array = NDArray[np.float64]

RIDGE = 1e-13
"""Added to the diagonal of MᵀM, relative to its mean, by engines that need a unique minimum."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """One designed spectrum: rows (r, p), their targets, bounds (p,) and equalities (q, p)."""

    matrix: Array
    target: Array
    lower: Array
    upper: Array
    equality: Array
    equality_target: Array
    pulls: tuple[float, ...] = ()
    """Per soft cell: how strongly an error of its color shows in the gradient, see ``pull_of``."""


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A cell's tie to its group's free color: ``weight * (matrix @ x_block + offset − color)``, or equality.

    ``block`` is None where the cell's light and reflectance are both known; ``matrix`` (3, p) and ``offset`` (3,).
    """

    block: int | None
    group: int
    matrix: Array
    offset: Array
    weight: float
    exact: bool
    metric: Array = field(default_factory=lambda: np.eye(3))
    """(3, 3) applied to the difference: identity, or the Jacobian of CIELAB."""

    def renumbered(self, block: int | None, group: int) -> Link:
        """The same tie in a smaller problem."""
        return replace(self, block=block, group=group)


@dataclass(eq=False)
class LinkedLeastSquares:
    """The problem in the module's docstring; ``color_lower`` and ``color_upper`` are (G, 3)."""

    blocks: tuple[Block, ...]
    links: tuple[Link, ...]
    color_lower: Array
    color_upper: Array

    @cached_property
    def offsets(self) -> NDArray[np.intp]:
        """Where each block begins in x, and the end; free colors come first."""
        sizes = [self.color_lower.size, *(block.lower.size for block in self.blocks)]
        return np.cumsum(sizes)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.offsets[-1])

    def split(self, x: Array) -> tuple[Array, list[Array]]:
        """Free colors (G, 3) and the blocks' values."""
        starts = self.offsets
        return x[: starts[0]].reshape(-1, 3), [x[a:b] for a, b in pairwise(starts)]

    @cached_property
    def lower(self) -> Array:
        """Lower bounds of x."""
        return np.concatenate([self.color_lower.ravel(), *(block.lower for block in self.blocks)])

    @cached_property
    def upper(self) -> Array:
        """Upper bounds of x."""
        return np.concatenate([self.color_upper.ravel(), *(block.upper for block in self.blocks)])

    @cached_property
    def rows(self) -> tuple[sparse.csr_matrix, Array]:
        """All weighted rows and their targets."""
        from scipy import sparse

        soft = [link for link in self.links if not link.exact]
        parts = [(block.matrix, k) for k, block in enumerate(self.blocks)]
        own = _placed([(matrix, int(self.offsets[k])) for matrix, k in parts], self.size)
        tied = self._link_rows(soft, weighted=True)
        target = np.concatenate(
            [*(block.target for block in self.blocks), *(-_scaled(link, link.offset) for link in soft)]
        )
        return sparse.vstack([own, tied], format="csr"), target

    @cached_property
    def equalities(self) -> tuple[sparse.csr_matrix, Array]:
        """All equality rows and their targets."""
        from scipy import sparse

        exact = [link for link in self.links if link.exact]
        own = _placed([(block.equality, int(self.offsets[k])) for k, block in enumerate(self.blocks)], self.size)
        target = np.concatenate([*(block.equality_target for block in self.blocks), *(-link.offset for link in exact)])
        return sparse.vstack([own, self._link_rows(exact, weighted=False)], format="csr"), target

    def _link_rows(self, links: list[Link], *, weighted: bool) -> sparse.csr_matrix:
        from scipy import sparse

        values, rows, columns = [], [], []
        for number, link in enumerate(links):
            transform = link.weight * link.metric if weighted else np.eye(3)
            tied = [(-transform, 3 * link.group)]
            if link.block is not None:
                tied.append((transform @ link.matrix, int(self.offsets[link.block])))
            for matrix, start in tied:
                row, column = np.indices(matrix.shape)
                values.append(matrix.ravel())
                rows.append(row.ravel() + 3 * number)
                columns.append(column.ravel() + start)
        if not links:
            return sparse.csr_matrix((0, self.size))
        index = (np.concatenate(rows), np.concatenate(columns))
        return sparse.csr_matrix((np.concatenate(values), index), shape=(3 * len(links), self.size))

    @cached_property
    def has_equalities(self) -> bool:
        """Whether anything must hold exactly."""
        return any(link.exact for link in self.links) or any(block.equality.shape[0] for block in self.blocks)

    @cached_property
    def scale(self) -> Array:
        """What each unknown's gradient is compared with, by block: nothing heavy hides an error of something light.

        The largest of |Mᵀy| and of the diagonal of MᵀM, or if less, the gradient that an error of 1 in the color of the
        block's lightest cell would make: a residual of 1e-7 then means that about as much is wrong with any color.
        """
        colors = np.zeros(self.color_lower.shape)
        squares = [np.einsum("rp,rp->p", block.matrix, block.matrix) for block in self.blocks]
        pulls = [block.matrix.T @ block.target for block in self.blocks]
        color_pulls = np.zeros(self.color_lower.shape)
        lightest = [min(block.pulls, default=np.inf) for block in self.blocks]
        for link in self.links:
            if link.exact:
                continue
            if link.block is not None:
                lightest[link.block] = min(lightest[link.block], pull_of(link.weight, link.matrix))
            weighing = link.weight * link.metric
            colors[link.group] += np.einsum("ab,ab->b", weighing, weighing)
            color_pulls[link.group] += weighing.T @ (weighing @ link.offset)
            if link.block is not None:
                rows = weighing @ link.matrix
                squares[link.block] = squares[link.block] + np.einsum("rp,rp->p", rows, rows)
                pulls[link.block] = pulls[link.block] - rows.T @ (weighing @ link.offset)
        parts = [(colors.ravel(), color_pulls.ravel()), *zip(squares, pulls, strict=True)]
        sizes = [max(square.max(initial=0.0), np.abs(pull).max(initial=0.0)) for square, pull in parts]
        soft_weights = [link.weight**2 for link in self.links if not link.exact and link.weight > 0]
        sizes = [
            min(size, least) for size, least in zip(sizes, [min(soft_weights, default=np.inf), *lightest], strict=True)
        ]
        lengths = [square.size for square, _ in parts]
        return np.repeat([size if size > 0 else 1.0 for size in sizes], lengths)

    def gradient(self, x: Array) -> Array:
        """Gradient of the objective."""
        colors, values = self.split(x)
        color_part = np.zeros(colors.shape)
        block_parts = [
            block.matrix.T @ (block.matrix @ value - block.target)
            for block, value in zip(self.blocks, values, strict=True)
        ]
        for link in self.links:
            if link.exact:
                continue
            weighing = link.weight * link.metric
            error = weighing.T @ (weighing @ self._mismatch(link, colors, values))
            color_part[link.group] -= error
            if link.block is not None:
                block_parts[link.block] += link.matrix.T @ error
        return np.concatenate([color_part.ravel(), *block_parts])

    def objective(self, x: Array) -> float:
        """Half the sum of squares."""
        colors, values = self.split(x)
        total = sum(
            float(np.sum((block.matrix @ value - block.target) ** 2))
            for block, value in zip(self.blocks, values, strict=True)
        )
        for link in self.links:
            if not link.exact:
                total += float(np.sum(_scaled(link, self._mismatch(link, colors, values)) ** 2))
        return total / 2

    @staticmethod
    def _mismatch(link: Link, colors: Array, values: list[Array]) -> Array:
        shown = link.offset if link.block is None else link.matrix @ values[link.block] + link.offset
        return shown - colors[link.group]


def pull_of(weight: float, matrix: Array) -> float:
    """Size of the gradient that an error of 1 in a cell's color makes; infinite for one too dim to show a color."""
    strength = float(np.abs(matrix).max(initial=0.0))
    dim = np.abs(matrix).sum(axis=1).max(initial=0.0) < 1e-7
    return np.inf if dim or weight == 0 else weight**2 * strength


def _scaled(link: Link, vector: Array) -> Array:
    return link.weight * (link.metric @ vector)


def _placed(parts: list[tuple[Array, int]], width: int) -> sparse.csr_matrix:
    """Dense matrices below each other, each starting at its own column."""
    from scipy import sparse

    if not parts:
        return sparse.csr_matrix((0, width))
    row, values, rows, columns = 0, [], [], []
    for matrix, start in parts:
        index = np.nonzero(matrix)  # roughness rows hold three values each
        values.append(matrix[index])
        rows.append(index[0] + row)
        columns.append(index[1] + start)
        row += matrix.shape[0]
    position = (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_matrix((np.concatenate(values), position), shape=(row, width))


def dense_rows(problem: LinkedLeastSquares) -> tuple[Array, Array]:
    """Weighted rows as one dense matrix, and their targets."""
    if len(problem.blocks) == 1 and not problem.links and problem.color_lower.size == 0:
        return problem.blocks[0].matrix, problem.blocks[0].target
    matrix, target = problem.rows
    return matrix.toarray(), target


def dense_equalities(problem: LinkedLeastSquares) -> tuple[Array, Array]:
    """Equality rows as one dense matrix, and their targets."""
    if not problem.has_equalities:
        return np.zeros((0, problem.size)), np.zeros(0)
    matrix, target = problem.equalities
    return np.ascontiguousarray(matrix.toarray()), target


@dataclass(frozen=True, slots=True)
class Check:
    """How well an answer satisfies the conditions of optimality. All in the units of x, but ``equality`` (rows)."""

    kkt: float
    bounds: float
    equality: float
    gap: float = 0.0
    """Bound on how much the sum of squares could still fall, by its slope towards the bounds."""

    SHARP = 1e-13
    """Gap at which colors are right to about 1e-7 even where a light shows some of them only faintly."""
    LIMIT = 1e-6
    """Largest scaled KKT residual of an answer that is believed."""
    EQUALITY_LIMIT = 1e-9
    """Largest error of an equality, in linear RGB; where multipliers are large, a little slack buys a lot."""
    GOAL = 1e-7
    """At which no other engine is tried."""
    BOUND_LIMIT = 1e-9
    """Largest distance outside the bounds."""

    @property
    def passed(self) -> bool:
        """Whether the answer may be called right."""
        return self.kkt <= self.LIMIT and self.bounds <= self.BOUND_LIMIT and self.equality <= self.EQUALITY_LIMIT

    @property
    def good(self) -> bool:
        """Whether it passed with room to spare."""
        return self.passed and self.worst <= self.GOAL

    @property
    def worst(self) -> float:
        """One number to compare two answers by."""
        return max(self.kkt, self.bounds, self.equality)
