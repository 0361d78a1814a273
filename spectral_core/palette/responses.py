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
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtrs

from spectral_core.palette.assemble.side import Assembled
from spectral_core.palette.given import CellIndex
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.arrow import BOOSTS, CAP, median_weight
from spectral_core.palette.qp.arrow import RIDGE as CURVATURE_RIDGE
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


class _Part(NamedTuple):
    """One block with r rows of the cells that are looked at, and the free colors that it knows, c."""

    rows: slice
    """Its rows among all that are looked at, r of them."""
    colors: NDArray[np.int_]
    """Numbers of its free colors, (c,)."""
    ties: Array
    """(r, c)."""
    products: Array
    """(r + c, r + c): response of its rows, and of what its free colors push, to each other through the block."""


@dataclass(frozen=True, eq=False)
class Responses:
    """M of the module's docstring, for some cells in the first condition of one side."""

    rows: dict[CellIndex, list[int]]
    """First of the three rows of each request of a cell: it may have a target and a link."""
    errors: Array
    """(m,): error of each row, or multiplier over weight where exact."""
    weights: Array
    """(m,)."""
    distances: Array
    """M, (m, m): change of each row's error, its distance to the target or the free color, by each row's force."""
    colors: Array
    """(m, m): change of the cell's color itself."""
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
        for k, block in enumerate(quadratic.blocks):
            for r, (condition, cell) in enumerate(block.keys):
                if condition == 0 and cell in cells:
                    rows.setdefault(cell, []).append(3 * len(places))
                    places.append((k, 3 * r))
        system = _System(quadratic, answer, unit, places)
        weights = system.of_rows([np.minimum(block.weights / unit, CAP) for block in quadratic.blocks])
        errors = system.of_rows(answer.forces) / unit / np.maximum(weights, 1e-300)
        distances, colors = system.responses()
        return cls(rows, errors, weights, distances, colors, _rgb_from_rows(assembled, places))

    def pushes(self, released: Sequence[CellIndex]) -> Array:
        """The forces on all rows that stand for the release of each cell, (m, released)."""
        found = np.zeros((len(self.errors), len(released)))
        for count in {len(self.rows[cell]) for cell in released}:
            numbers = np.array([k for k, cell in enumerate(released) if len(self.rows[cell]) == count])
            begins = np.array([self.rows[released[k]] for k in numbers])
            at = (begins[:, :, None] + np.arange(3)).reshape(len(numbers), -1)
            compliances = 1.0 / np.maximum(self.weights[at], LEAST_WEIGHT)
            systems = -self.distances[at[:, :, None], at[:, None, :]]
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
        found = (self.colors[seen] @ self.pushes(released)).reshape(len(cells), 3, len(released))
        return np.matmul(self.rgb_from_rows[first // 3], found).transpose(0, 2, 1)


def _rgb_from_rows(assembled: Assembled, places: Sequence[tuple[int, int]]) -> Array:
    metric = assembled.view.metric
    found = np.broadcast_to(np.eye(3), (len(places), 3, 3))
    if metric is None:
        return found
    blocks = assembled.quadratic.blocks
    # Exact rows are in linear RGB in every round.
    inverses = [
        np.eye(3) if blocks[k].exact[row] else np.linalg.inv(metric[blocks[k].keys[row // 3][1]]) for k, row in places
    ]
    return np.array(inverses).reshape(-1, 3, 3)


class _System:
    """The block-arrow system of a side with its active bounds held, and the rows that are looked at."""

    def __init__(self, quadratic: Quadratic, answer: Answer, unit: float, places: Sequence[tuple[int, int]]) -> None:
        self._quadratic, self._answer, self._unit = quadratic, answer, unit
        self._size = 3 * len(places)
        begins = [[row for block, row in places if block == k] for k in range(len(quadratic.blocks))]
        self._chosen = [(np.array(each, dtype=int)[:, None] + np.arange(3)).ravel() for each in begins]
        """Rows of each block that are looked at."""
        ends = np.cumsum([0, *map(len, self._chosen)]).tolist()
        self._spans = [slice(begin, end) for begin, end in pairwise(ends)]
        """The same rows among all that are looked at."""

    def of_rows(self, values: Sequence[Array] | Array) -> Array:
        """The numbers of the rows that are looked at, of numbers for each row of each block."""
        return np.concatenate([each[chosen] for each, chosen in zip(values, self._chosen, strict=True)])

    def responses(self) -> tuple[Array, Array]:
        """M by errors and by colors, (m, m) each: through the blocks, and through the colors that connect them."""
        quadratic, count = self._quadratic, self._quadratic.color_lower.size
        hessian = (quadratic.known_ties.T * (quadratic.known_weights / self._unit)) @ quadratic.known_ties
        hessian = hessian.reshape(count, count)
        within, through, ties = (np.zeros((self._size, columns)) for columns in (self._size, count, count))
        alike: dict[tuple[tuple[int, ...], int], list[int]] = {}
        for k, block in enumerate(quadratic.blocks):
            if len(self._chosen[k]) or block.ties.size:
                alike.setdefault((block.rows.shape, id(block.gram)), []).append(k)
        for which in alike.values():
            parts, curvature = self._parts(which)
            hessian += curvature
            for rows, colors, tied, products in parts:
                own = len(tied)
                within[rows, rows] = products[:own, :own]
                through[rows, colors] = products[:own, own:] - tied
                ties[rows, colors] = tied
                hessian[colors[:, None], colors] -= products[own:, own:]
        if not count:
            return within, within
        at_bound = (self._answer.colors <= quadratic.color_lower + NEAR) | (
            self._answer.colors >= quadratic.color_upper - NEAR
        )
        held = at_bound.ravel()
        least = RIDGE * max(float(np.abs(hessian).max(initial=0.0)), 1e-300)
        hessian.flat[:: count + 1] += np.where(held, HELD, least)
        onwards = np.linalg.solve(hessian, through.T)
        distances = within + through @ onwards
        return distances, distances + ties @ onwards

    def _parts(self, which: Sequence[int]) -> tuple[list[_Part], Array]:
        """Blocks of equal shape with their unknowns eliminated, and the curvature of the free colors before that."""
        blocks = [self._quadratic.blocks[k] for k in which]
        values = np.array([self._answer.values[k] for k in which])
        lower, upper = (np.array([getattr(block, end) for block in blocks]) for end in ("lower", "upper"))
        free = ((values > lower + NEAR) & (values < upper - NEAR)).astype(float)
        # One product for all blocks: one for each would spend more time in Python than in arithmetic.
        rows = np.array([block.rows for block in blocks]) * free[:, None, :]
        weights = np.minimum(np.array([block.weights for block in blocks]) / self._unit, CAP)
        ties = np.array([block.ties for block in blocks])
        curvature = np.matmul(rows.transpose(0, 2, 1) * weights[:, None, :], rows)
        curvature += (blocks[0].gram / self._unit) * free[:, :, None] * free[:, None, :]
        tied = weights[:, :, None] * ties
        pushes = np.matmul(tied.transpose(0, 2, 1), rows)
        knows = ties.any(axis=1)
        factors = _factors(curvature, free)
        parts = []
        for number, k in enumerate(which):
            chosen, colors = self._chosen[k], knows[number].nonzero()[0]
            right = np.concatenate([rows[number].take(chosen, axis=0), pushes[number].take(colors, axis=0)])
            # With H = L Lᵀ every response is a product of two columns of L⁻¹ times the right-hand sides. Transposes are
            # in the order of LAPACK, which then copies nothing.
            half = dtrtrs(factors[number].T, right.T, trans=1, overwrite_b=1)[0] if right.size else right.T
            own = ties[number].take(chosen, axis=0).take(colors, axis=1)
            parts.append(_Part(self._spans[k], colors, own, half.T @ half))
        return parts, np.tensordot(tied, ties, axes=((0, 1), (0, 1)))


def _factors(matrices: Array, free: Array) -> Array:
    """Lower Cholesky factors of H of some blocks, (k, n, n), with 1 on the diagonal of unknowns that are not free."""
    counts = np.maximum(free.sum(axis=1), 1.0)
    means = np.maximum(np.trace(matrices, axis1=1, axis2=2) / counts, 1e-12)
    diagonal = np.arange(matrices.shape[1])
    for share in (CURVATURE_RIDGE, *BOOSTS):
        ridged = matrices.copy()
        ridged[:, diagonal, diagonal] += np.where(free > 0, share * means[:, None], 1.0)
        try:
            return np.linalg.cholesky(ridged)
        except np.linalg.LinAlgError:
            if len(matrices) > 1:
                return np.concatenate([_factors(matrices[k : k + 1], free[k : k + 1]) for k in range(len(matrices))])
    raise np.linalg.LinAlgError("a spectrum's quadratic form is not positive definite")
