# SPDX-License-Identifier: GPL-3.0-or-later
"""Least-squares steps of spectra that share free colors, by orthogonal factors of each spectrum's rows.

The rows have the form of an arrow: each spectrum has rows of its own, and free colors enter all of them. One spectrum
after the other is eliminated, and few rows are left for the colors. Five spectra of 471 samples are thus five
factorizations of 471 unknowns, and a bound that changes repeats one of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

RANK = 1e-11
"""Singular value of the exact rows, relative to the largest, below which they depend on each other."""
NO_LIGHT = 1e-100
"""Singular value of the exact rows below which a light has no power: its inverse may be no number."""


@dataclass
class _Factors:
    """The factors of one spectrum for one set of free samples."""

    free: Mask
    own: Array
    """P, (f, e): samples that answer to the exact rows."""
    spare: Array
    """(e − rank, e): combinations of the exact rows that no sample changes; colors alone obey them."""
    across: Array | None
    """N, (f, z): directions that leave the exact rows as they are; None for all directions."""
    orthogonal: Array
    """Q, (m, r), of the rows times N."""
    triangle: Array
    """(r, z), its columns in an ``order`` of their own."""
    order: NDArray[np.intp]
    by_colors: Array
    """(m, q): change of the soft rows with the free colors, along the exact rows."""
    beyond: Array
    """(m, t): orthonormal, the part of ``by_colors`` that no sample makes up for."""
    reduced: Array
    """(t, q): that part is beyond · reduced. A spectrum is tied to few of the colors, so that t is small."""


@dataclass
class FactoredRows:
    """All rows of a quadratic problem by spectrum, with the factors of the last set of free samples."""

    problem: Quadratic
    _kept: dict[int, _Factors] = field(default_factory=dict)

    def __post_init__(self) -> None:
        problem = self.problem
        root = np.sqrt(problem.known_weights)
        self._known = root[:, None] * problem.known_ties.reshape(root.size, problem.offsets[0])
        self._parts = [_Part.of(block) for block in problem.blocks]
        # Rows without a spectrum come first, then those of each spectrum.
        self.right = np.concatenate([-root * problem.known_targets, *(part.right for part in self._parts)])
        self.wanted = np.concatenate([part.wanted for part in self._parts])

    def times(self, x: Array) -> tuple[Array, Array]:
        """The soft rows times ``x``, and the exact ones."""
        colors, values = x[: self.problem.offsets[0]], self.problem.split(x)[1]
        soft, exact = [self._known @ colors], []
        for part, value in zip(self._parts, values, strict=True):
            soft.append(part.rows @ value + part.ties @ colors)
            exact.append(part.exact @ value - part.exact_ties @ colors)
        return np.concatenate(soft), np.concatenate(exact)

    def left(self, x: Array) -> tuple[Array, Array]:
        """What is left of the soft rows at ``x``, right − rows · x, and of the exact ones."""
        soft, exact = self.times(x)
        return self.right - soft, self.wanted - exact

    def settled(self, free: Mask, x: Array) -> Array:
        """What is left of the soft rows at the optimum of the free samples, which ``x`` is up to rounding.

        A row of large weight differs from its target by less than the rounding of its sum, but its multiplier decides
        about bounds. What the next step would change is therefore subtracted from what is left: the difference has the
        digits that the sum lacks.
        """
        left, missing = self.left(x)
        return left - self.times(self.step(free, left, missing))[0]

    def back(self, left: Array, *, sizes: bool = False) -> Array:
        """The transposed soft rows times a vector; with ``sizes`` their absolute values."""
        change = np.abs if sizes else np.asarray
        begin = len(self._known)
        colors = change(self._known).T @ left[:begin]
        values = []
        for part in self._parts:
            own = left[begin : begin + len(part.rows)]
            values.append(change(part.rows).T @ own)
            colors = colors + change(part.ties).T @ own
            begin += len(own)
        return np.concatenate([colors, *values])

    def sizes(self, x: Array) -> Array:
        """Sizes of the sums in ``left``: their rounding is a share of these."""
        colors, values = np.abs(x[: self.problem.offsets[0]]), self.problem.split(np.abs(x))[1]
        found = [np.abs(self._known) @ colors]
        for part, value in zip(self._parts, values, strict=True):
            found.append(np.abs(part.rows) @ value + np.abs(part.ties) @ colors)
        return np.concatenate(found) + np.abs(self.right)

    def equalities(self) -> Array:
        """The exact rows of all spectra, dense."""
        count = self.problem.offsets[0]
        total = sum(len(part.wanted) for part in self._parts)
        found, row = np.zeros((total, self.problem.size)), 0
        for part, start, end in zip(self._parts, self.problem.offsets, self.problem.offsets[1:], strict=False):
            found[row : row + len(part.wanted), start:end] = part.exact
            found[row : row + len(part.wanted), :count] = -part.exact_ties
            row += len(part.wanted)
        return found

    def step(self, free: Mask, left: Array, missing: Array) -> Array:
        """The step s of least ||rows · s − left|| with exact · s = missing; s is 0 where not ``free``.

        Exact rows that contradict each other are met as well as they can be.
        """
        count = self.problem.offsets[0]
        opened = free[:count]
        reduced, right = [self._known[:, opened]], [left[: len(self._known)]]
        parts: list[tuple[_Factors, Array]] = []
        ruled, ruling = [np.zeros((0, int(opened.sum())))], [np.zeros(0)]
        row, exact = len(self._known), 0
        for k, part in enumerate(self._parts):
            start, end = self.problem.offsets[k], self.problem.offsets[k + 1]
            factors = self._factors(k, free[start:end])
            held = missing[exact : exact + factors.own.shape[1]]
            own = left[row : row + len(part.rows)]
            if held.size:
                own = own - part.rows[:, factors.free] @ (factors.own @ held)
            if count:
                ruled.append(factors.spare @ part.exact_ties[:, opened])
                ruling.append(-factors.spare @ held)
                reduced.append(factors.reduced[:, opened])
                right.append(factors.beyond.T @ _outside(factors.orthogonal, own))
            parts.append((factors, own))
            row, exact = row + len(own), exact + len(held)
        step = np.zeros(free.size)
        rows = np.concatenate(reduced), np.concatenate(right)
        step[:count][opened] = _ruled(*rows, np.concatenate(ruled), np.concatenate(ruling))
        exact = 0
        colors = step[:count]
        for k, (part, (factors, own)) in enumerate(zip(self._parts, parts, strict=True)):
            held = missing[exact : exact + len(part.wanted)] + part.exact_ties @ colors
            inner = _back(factors, factors.orthogonal.T @ (own - factors.by_colors @ colors))
            along = inner if factors.across is None else factors.across @ inner
            start, end = self.problem.offsets[k], self.problem.offsets[k + 1]
            step[start:end][factors.free] = factors.own @ held + along
            exact += held.size
        return step

    def _factors(self, k: int, free: Mask) -> _Factors:
        kept = self._kept.get(k)
        if kept is not None and np.array_equal(kept.free, free):
            return kept
        part = self._parts[k]
        rows, by_colors, across = part.rows[:, free], part.ties, None
        own, spare = np.zeros((rows.shape[1], 0)), np.zeros((0, 0))
        if part.wanted.size:
            outer, values, inner = np.linalg.svd(part.exact[:, free], full_matrices=True)
            rank = int((values > max(RANK * values.max(initial=0.0), NO_LIGHT)).sum())
            own = inner[:rank].T @ (outer.T[:rank] / values[:rank, None])
            spare, across = outer.T[rank:], inner[rank:].T
            by_colors = by_colors + rows @ (own @ part.exact_ties)
            rows = rows @ across
        orthogonal, triangle, order = _factorized(rows, part.least)
        tied = by_colors.any(axis=0).nonzero()[0]
        beyond, corner = np.linalg.qr(_outside(orthogonal, by_colors[:, tied]))
        reduced = np.zeros((len(corner), by_colors.shape[1]))
        reduced[:, tied] = corner
        found = _Factors(free.copy(), own, spare, across, orthogonal, triangle, order, by_colors, beyond, reduced)
        self._kept[k] = found
        return found


@dataclass
class _Part:
    """Rows of one spectrum, soft ones times the roots of their weights."""

    rows: Array
    ties: Array
    right: Array
    exact: Array
    exact_ties: Array
    wanted: Array
    least: float
    """Size of the smaller kind of rows, those of colors or those of roughness, of which no digit may be lost."""

    @classmethod
    def of(cls, block: Block) -> _Part:
        exact, soft = block.exact, ~block.exact
        root = np.sqrt(block.weights[soft])
        smooth = len(block.roughness)
        colored = root[:, None] * block.rows[soft]
        kinds = [float(np.abs(rows).max(initial=0.0)) for rows in (colored, block.roughness)]
        return cls(
            np.concatenate([colored, block.roughness]),
            np.concatenate([-root[:, None] * block.ties[soft], np.zeros((smooth, block.ties.shape[1]))]),
            np.concatenate([root * block.targets[soft], np.zeros(smooth)]),
            block.rows[exact],
            block.ties[exact],
            block.targets[exact],
            min((kind for kind in kinds if kind > 0), default=0.0),
        )


def _factorized(rows: Array, least: float) -> tuple[Array, Array, NDArray[np.intp]]:
    """Q (m, r), a triangle (r, z) and an order of its columns: Q · triangle = rows[:, order] up to rounding.

    ``least``: size of the least rows that count.
    """
    from scipy.linalg import qr

    if not rows.size:
        return np.zeros((len(rows), 0)), np.zeros((0, rows.shape[1])), np.arange(rows.shape[1])
    # Householder's factors keep the digits of every row only if large rows come first (Cox and Higham 1998).
    first = np.argsort(-np.abs(rows).max(axis=1), kind="stable")
    sorted_rows, triangle, order = qr(rows[first], mode="economic", pivoting=True, check_finite=False)
    size = np.abs(np.diagonal(triangle))
    rank = int((size > np.finfo(float).eps * max(rows.shape) * least).sum())
    orthogonal = np.empty((len(rows), rank))
    orthogonal[first] = sorted_rows[:, :rank]
    return orthogonal, triangle[:rank], order


def _outside(orthogonal: Array, values: Array) -> Array:
    """The part of some columns that is orthogonal to others; taken twice, so that rounding leaves nothing along."""
    for _ in range(2):
        values = values - orthogonal @ (orthogonal.T @ values)
    return values


def _ruled(rows: Array, right: Array, ruled: Array, ruling: Array) -> Array:
    """The least-squares solution of ``rows`` among those of ``ruled``."""
    if not np.any(np.abs(ruled) > RANK):
        return least_squares(rows, right)
    outer, values, inner = np.linalg.svd(ruled, full_matrices=True)
    rank = int((values > RANK * values.max()).sum())
    own = inner[:rank].T @ ((outer.T @ ruling)[:rank] / values[:rank])
    across = inner[rank:].T
    return np.asarray(own + across @ least_squares(rows @ across, right - rows @ own))


def _back(factors: _Factors, right: Array) -> Array:
    """The solution of the triangle; the smallest one where it has more unknowns than rows."""
    from scipy.linalg import solve_triangular

    found = np.zeros(factors.order.size)
    if len(factors.triangle) == found.size:
        found[factors.order] = solve_triangular(factors.triangle, right, check_finite=False)
    else:
        found[factors.order] = least_squares(factors.triangle, right)
    return found


def least_squares(rows: Array, right: Array) -> Array:
    """By orthogonal factors with pivots, which take a fraction of the time of singular values."""
    from scipy.linalg import lstsq

    if not rows.shape[1] or not len(rows):
        return np.zeros(rows.shape[1])
    cond = np.finfo(float).eps * max(rows.shape)
    return np.asarray(lstsq(rows, right, cond=cond, lapack_driver="gelsy", check_finite=False)[0])
