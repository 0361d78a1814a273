# SPDX-License-Identifier: GPL-3.0-or-later
"""How the colors of a side respond to a request that is dropped, from the multipliers of its last solve.

With the active bounds fixed, the answer is a linear function of every row. Releasing cell j changes the error of i by

    Δe_i = M_ij (1/ω_j − M_jj)⁻¹ e_j      M = B K⁻¹ Bᵀ

with K the block-arrow matrix of the last solve, B its color rows, and e_j the error of cell j, or its multiplier over
its weight if it is exact.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtrs

from spectral_core.palette.assemble.side import Assembled
from spectral_core.palette.given import CellIndex
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.arrow import CAP, median_weight, regular_factor
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.elastic import softened
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

NEAR = 1e-9
"""Distance to a bound at which a sample or a free color counts as fixed there."""
HELD, RIDGE = 1e12, 1e-12
"""Curvature of a color at an end of its box, and that added to all others, relative to the largest."""
ALONE = 1e-9
"""Share of a row's compliance below which nothing but the row itself holds its color: its release has no known effect.
"""
LEAST_WEIGHT = 1e-12
"""Least weight of a released row, relative to the median one."""


@dataclass(frozen=True, eq=False)
class Responses:
    """M of the module's docstring, for some cells in the first condition of one side, as the factors of its parts.

    M of errors is ``within + through @ onwards``; that of the colors themselves has ``through + ties`` in place of
    ``through``, as an error is the distance to a free color, which moves as well.
    """

    rows: dict[CellIndex, list[int]]
    """First of the three rows of each request of a cell: it may have a target and a link."""
    errors: Array
    """(m,): error of each row, or multiplier over weight where exact."""
    weights: Array
    """(m,)."""
    within: Array
    """(m, m): response through the block itself."""
    through: Array
    """(m, q): gradient of each row by the free colors."""
    ties: Array
    """(m, q)."""
    onwards: Array
    """(q, m): change of the free colors by each row's force."""
    rgb_from_rows: Array
    """(m / 3, 3, 3): rows of a perceptual round are in CIELAB, linearized; all others are linear RGB already."""

    @classmethod
    def of(cls, assembled: Assembled, answer: Answer, cells: Collection[CellIndex]) -> Responses:
        """Factor the blocks once more with their active bounds held, exact rows as rows of large weight."""
        unit, _ = median_weight(assembled.quadratic)
        # If exact rows conflict, the answer is that of this problem; else its exact rows move by a negligible amount.
        quadratic = softened(assembled.quadratic, everything=True)
        rows: dict[CellIndex, list[int]] = {}
        places: list[tuple[int, int]] = []
        chosen: list[NDArray[np.int_]] = []
        for k, block in enumerate(quadratic.blocks):
            begins = [3 * r for r, (condition, cell) in enumerate(block.keys) if condition == 0 and cell in cells]
            for begin in begins:
                rows.setdefault(block.keys[begin // 3][1], []).append(3 * len(places))
                places.append((k, begin))
            chosen.append((np.array(begins, dtype=int)[:, None] + np.arange(3)).ravel())
        weights = [np.minimum(block.weights / unit, CAP) for block in quadratic.blocks]
        own = _of_rows(weights, chosen)
        errors = _of_rows(answer.forces, chosen) / unit / np.maximum(own, 1e-300)
        parts = _joined(quadratic, answer, unit, weights, chosen)
        return cls(rows, errors, own, *parts, _rgb_from_rows(assembled, places))

    def pushes(self, released: Sequence[CellIndex]) -> Array:
        """The forces on all rows that stand for the release of each cell, (m, released)."""
        found = np.zeros((len(self.errors), len(released)))
        for count in {len(self.rows[cell]) for cell in released}:
            numbers = np.array([k for k, cell in enumerate(released) if len(self.rows[cell]) == count])
            begins = np.array([self.rows[released[k]] for k in numbers])
            at = (begins[:, :, None] + np.arange(3)).reshape(len(numbers), -1)
            compliances = 1.0 / np.maximum(self.weights[at], LEAST_WEIGHT)
            systems = -self.within[at[:, :, None], at[:, None, :]]
            systems -= np.matmul(self.through[at], self.onwards.T[at].transpose(0, 2, 1))
            diagonal = np.arange(at.shape[1])
            systems[:, diagonal, diagonal] += compliances
            # The least force that the equations leave: rows may depend on each other, or hold a color alone.
            values, vectors = np.linalg.eigh(systems)
            is_held = values > ALONE * compliances.max(axis=1, keepdims=True)
            along = np.matmul(self.errors[at][:, None, :], vectors)[:, 0] / np.where(is_held, values, np.inf)
            found[at, numbers[:, None]] = np.matmul(vectors, along[:, :, None])[:, :, 0]
        return found

    def moved(self, cells: Sequence[CellIndex], released: Sequence[CellIndex]) -> Array:
        """Change of the linear RGB of each cell by the release of each other one alone, (cells, released, 3)."""
        first = np.array([self.rows[cell][0] for cell in cells], dtype=int)
        seen = (first[:, None] + np.arange(3)).ravel()
        pushes = self.pushes(released)
        found = self.within[seen] @ pushes + (self.through[seen] + self.ties[seen]) @ (self.onwards @ pushes)
        return np.matmul(self.rgb_from_rows[first // 3], found.reshape(len(cells), 3, -1)).transpose(0, 2, 1)


def _of_rows(values: Sequence[Array] | Array, chosen: Sequence[NDArray[np.int_]]) -> Array:
    """Numbers of the chosen rows, of numbers for each row of each block."""
    return np.concatenate([np.zeros(0), *(each[rows] for each, rows in zip(values, chosen, strict=True))])


def _rgb_from_rows(assembled: Assembled, places: Sequence[tuple[int, int]]) -> Array:
    metric = assembled.view.metric
    if metric is None:
        return np.broadcast_to(np.eye(3), (len(places), 3, 3))
    blocks = assembled.quadratic.blocks
    # Exact rows are in linear RGB in every round.
    inverses = [
        np.eye(3) if blocks[k].exact[row] else np.linalg.inv(metric[blocks[k].keys[row // 3][1]]) for k, row in places
    ]
    return np.array(inverses).reshape(-1, 3, 3)


def _joined(
    quadratic: Quadratic, answer: Answer, unit: float, weights: Sequence[Array], chosen: Sequence[NDArray[np.int_]]
) -> tuple[Array, Array, Array, Array]:
    """``within``, ``through``, ``ties`` and ``onwards`` of ``Responses``."""
    count, size = quadratic.color_lower.size, sum(map(len, chosen))
    hessian = (quadratic.known_ties.T * (quadratic.known_weights / unit)) @ quadratic.known_ties
    hessian = hessian.reshape(count, count)
    within, through, ties = (np.zeros((size, columns)) for columns in (size, count, count))
    x = np.concatenate([answer.colors.ravel(), *answer.values])
    free = (x > quadratic.lower + NEAR) & (x < quadratic.upper - NEAR)
    end = 0
    for k, (block, own, rows) in enumerate(zip(quadratic.blocks, weights, chosen, strict=True)):
        begin, end = end, end + len(rows)
        if not len(rows) and not block.ties.size:
            continue
        colors = block.ties.any(axis=0).nonzero()[0]
        tied = block.ties.take(colors, axis=1)
        samples = free[quadratic.offsets[k] : quadratic.offsets[k + 1]].nonzero()[0]
        products, curvature = _eliminated(block, samples, own, rows, tied, unit)
        within[begin:end, begin:end] = products[: len(rows), : len(rows)]
        ties[begin:end, colors] = tied.take(rows, axis=0)
        through[begin:end, colors] = products[: len(rows), len(rows) :] - ties[begin:end, colors]
        hessian[colors[:, None], colors] += curvature - products[len(rows) :, len(rows) :]
    least = RIDGE * max(float(np.abs(hessian).max(initial=0.0)), 1e-300)
    hessian.flat[:: count + 1] += np.where(free[:count], least, HELD)
    return within, through, ties, np.linalg.solve(hessian, through.T)


def _eliminated(
    block: Block, free: NDArray[np.int_], weights: Array, chosen: NDArray[np.int_], tied: Array, unit: float
) -> tuple[Array, Array]:
    """Products H⁻¹ of some rows of a block and of the forces of its free colors, and the colors' own curvature."""
    # take along both axes is several times faster than np.ix_ at these sizes.
    rows = block.rows.take(free, axis=1)
    weighted = rows.T * weights
    pulls = weights[:, None] * tied
    curvature = weighted @ rows
    curvature += block.gram.take(free, axis=0).take(free, axis=1) / unit
    right = np.concatenate([rows.take(chosen, axis=0), pulls.T @ rows])
    # With H = L Lᵀ every product is one of two columns of L⁻¹ times the right-hand sides.
    half = dtrtrs(regular_factor(curvature), right.T, lower=1, overwrite_b=1)[0] if right.size else right.T
    return half.T @ half, pulls.T @ tied
