# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex regions of parameter space: boxes, p-norm balls, half-spaces, and their intersections."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, real_numbers, require_kind, require_range
from spectral_core.errors import InvalidInputError

Matrix = NDArray[np.float64]

MAX_REGION_DIMENSIONS = 64
"""More than lattices reach: Sobol points and Latin hypercubes sample regions, too."""
MAX_SIGN_ROWS_DIMENSIONS = 10
"""A ball with p < 1.25 is enclosed by its 2ⁿ sign half-spaces up to this dimension."""


@dataclass(frozen=True, eq=False)
class NormBall:
    """{x : ‖(x - center) / radii‖_p <= 1}: an ellipsoid for p = 2, a box for p = ∞, a cross polytope for p = 1."""

    center: Matrix
    radii: Matrix
    p: float

    def norms(self, points: Matrix) -> Matrix:
        """‖(x - center) / radii‖_p of points (N, n), (N,)."""
        return p_norms((points - self.center) / self.radii, self.p)

    def outer_radius(self) -> float:
        """Radius of the 2-norm ball around it, in scaled coordinates: n^max(0, 1/2 - 1/p)."""
        return float(len(self.center) ** max(0.0, 0.5 - 1.0 / self.p))

    def outer_rows(self) -> tuple[Matrix, Matrix]:
        """Half-spaces (rows, bounds) that contain the ball and touch it: its box and, near p = 1, its sign planes."""
        n = len(self.center)
        # Near p = 1 the ball is a cross polytope, which its box represents badly: add the planes of its facets.
        signs = np.concatenate([np.eye(n), -np.eye(n)])
        limits = np.ones(2 * n)
        if self.p < 1.25 and 1 < n <= MAX_SIGN_ROWS_DIMENSIONS:
            corners = 1.0 - 2.0 * ((np.arange(2**n)[:, None] >> np.arange(n)) & 1)
            signs = np.concatenate([signs, corners])
            limits = np.concatenate([limits, np.full(2**n, n ** (1.0 - 1.0 / self.p))])
        rows = signs / self.radii
        return rows, limits + rows @ self.center

    def tangent_row(self, point: Matrix) -> tuple[Matrix, float]:
        """Half-space a·x <= b that contains the ball and cuts off ``point`` outside it (b is its support value)."""
        scaled = (point - self.center) / self.radii
        # The gradient of the norm is normal to its level set; scaled by the dual norm its support value is 1.
        if math.isinf(self.p):
            gradient = np.where(np.abs(scaled) == np.abs(scaled).max(), np.sign(scaled), 0.0)
            gradient /= np.abs(gradient).sum()
        else:
            gradient = np.sign(scaled) * np.abs(scaled / np.abs(scaled).max()) ** (self.p - 1.0)
            dual = math.inf if self.p == 1.0 else self.p / (self.p - 1.0)
            gradient /= np.linalg.norm(gradient, ord=dual)
        row = gradient / self.radii
        return row, float(1.0 + row @ self.center)


def p_norms(vectors: Matrix, p: float) -> Matrix:
    """‖v‖_p of vectors (N, n), (N,)."""
    sizes = np.abs(vectors)
    if p <= 2.0:
        return np.asarray(np.linalg.norm(sizes, ord=p, axis=1))
    # High powers of numbers away from 1 are 0 or infinite.
    largest = sizes.max(axis=1)
    shares = sizes / np.where(largest > 0.0, largest, 1.0)[:, None]
    return np.asarray(largest * np.linalg.norm(shares, ord=p, axis=1))


@dataclass(frozen=True, eq=False)
class Region:
    """A closed convex region {x : A x <= b} within at most one p-norm ball; bounded and with an interior.

    Build it with ``box``, ``ball`` or ``halfspaces`` and cut it with ``&``. Whether it is bounded and has an
    interior is found when it is filled (see ``anchoring``).
    """

    rows: Matrix
    """A, (R, n), each row of length 1."""
    bounds: Matrix
    """b, (R,)."""
    norm_ball: NormBall | None = None
    box_limits: tuple[Matrix, Matrix] | None = field(default=None, repr=False)
    """Lower and upper corner when the region is exactly a box."""

    @property
    def dimensions(self) -> int:
        """n."""
        return self.rows.shape[1]

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """True if each point (N, n) satisfies every inequality in floating point, (N,)."""
        given = real_numbers("points", points)
        if given.ndim != 2 or given.shape[1] != self.dimensions:
            raise InvalidInputError(f"points has shape {given.shape}; expected (N, {self.dimensions})")
        if self.box_limits is not None:
            low, high = self.box_limits
            return np.asarray(((given >= low) & (given <= high)).all(axis=1))
        inside = np.ones(len(given), dtype=bool)
        # In blocks, so that memory stays proportional to the points.
        for start in range(0, len(self.rows), 64):
            inside &= (given @ self.rows[start : start + 64].T <= self.bounds[start : start + 64]).all(axis=1)
        if self.norm_ball is not None:
            inside &= self.norm_ball.norms(given) <= 1.0
        return inside

    def log_volume(self) -> float | None:
        """Natural logarithm of the volume where a formula exists (box, p-norm ball), else None."""
        if self.box_limits is not None:
            return float(np.log(self.box_limits[1] - self.box_limits[0]).sum())
        if self.norm_ball is not None and not len(self.rows):
            n, p = self.dimensions, self.norm_ball.p
            unit = n * math.log(2.0 * math.gamma(1.0 + 1.0 / p)) - math.lgamma(1.0 + n / p)
            return float(unit + np.log(self.norm_ball.radii).sum())
        return None

    def __and__(self, other: Region) -> Region:
        """The points in both regions; at most one of them may hold a ball."""
        require_kind("the other region", other, Region, "lattice.box, ball or halfspaces")
        if self.dimensions != other.dimensions:
            raise InvalidInputError(
                f"regions of {self.dimensions} and {other.dimensions} dimensions cannot be intersected"
            )
        if self.norm_ball is not None and other.norm_ball is not None:
            raise InvalidInputError(
                "both regions hold a p-norm ball; a region may hold one, enclose the other by half-spaces"
            )
        if self.box_limits is not None and other.box_limits is not None:
            low = np.maximum(self.box_limits[0], other.box_limits[0])
            high = np.minimum(self.box_limits[1], other.box_limits[1])
            if (low < high).all():  # else it is empty, which is said when it is filled
                return box(low, high)
        rows = np.concatenate([self.rows, other.rows])
        bounds = np.concatenate([self.bounds, other.bounds])
        return Region(_frozen(rows), _frozen(bounds), self.norm_ball or other.norm_ball)


def box(low: ArrayLike, high: ArrayLike) -> Region:
    """The box low <= x <= high; both (n,). InvalidInputError if empty or flat."""
    lower = frozen_array("low", low, (None,))
    upper = frozen_array("high", high, (len(lower),))
    _check_dimensions(len(lower))
    if not (lower < upper).all():
        axis = int(np.argmin(lower < upper))
        raise InvalidInputError(
            f"the box has low {lower[axis]} and high {upper[axis]} on axis {axis}; expected low < high. Leave out an "
            "axis that should not vary"
        )
    with np.errstate(over="ignore"):
        width = upper - lower
    if not np.isfinite(width).all():
        axis = int(np.argmax(width))
        raise InvalidInputError(
            f"the box reaches from {lower[axis]} to {upper[axis]} on axis {axis}, which is wider than the largest "
            "double number; expected less than 1.8e308. Choose a larger unit for that axis"
        )
    n = len(lower)
    rows = np.concatenate([np.eye(n), -np.eye(n)])
    return Region(_frozen(rows), _frozen(np.concatenate([upper, -lower])), None, (lower, upper))


def unit_cube(dimensions: int) -> Region:
    """The box from 0 to 1 on every axis."""
    _check_dimensions(dimensions)
    return box(np.zeros(dimensions), np.ones(dimensions))


def ball(center: ArrayLike, radii: ArrayLike, *, p: float = 2.0) -> Region:
    """Ball ‖(x - center) / radii‖_p <= 1 with 1 <= p <= ∞; ``radii`` one number or (n,)."""
    middle = frozen_array("center", center, (None,))
    _check_dimensions(len(middle))
    if np.ndim(radii) == 0:
        radii = np.full(middle.shape, require_range("radii", radii, -math.inf, math.inf))  # type: ignore[arg-type]
    half = frozen_array("radii", radii, (len(middle),))
    if not (half > 0).all():
        raise InvalidInputError(f"radii holds {half.min()}; expected positive numbers")
    if not (isinstance(p, Real) and p >= 1.0):  # nor is NaN
        raise InvalidInputError(f"p is {p}; expected 1 <= p (below 1 the ball is not convex)")
    if math.isinf(p):
        return box(middle - half, middle + half)
    empty = np.zeros((0, len(middle)))
    return Region(_frozen(empty), _frozen(np.zeros(0)), NormBall(middle, half, float(p)))


def halfspaces(rows: ArrayLike, bounds: ArrayLike) -> Region:
    """The polytope rows @ x <= bounds; rows (R, n), bounds (R,). Rows are scaled to length 1."""
    a = frozen_array("rows", rows, (None, None))
    b = frozen_array("bounds", bounds, (len(a),))
    _check_dimensions(a.shape[1])
    lengths = np.linalg.norm(a, axis=1)
    empty = lengths == 0.0
    if (b[empty] < 0).any():
        raise InvalidInputError(
            f"row {int(np.flatnonzero(empty & (b < 0))[0])} says 0 <= {b[empty].min()}: no point fits"
        )
    keep = ~empty
    return Region(_frozen(a[keep] / lengths[keep, None]), _frozen(b[keep] / lengths[keep]))


def corner_simplex(dimensions: int, size: float = 1.0) -> Region:
    """{x >= 0, Σ x <= size}: mixtures that leave a rest."""
    _check_dimensions(dimensions)
    size = require_range("size", size, 1e-300, 1e300)
    rows = np.concatenate([-np.eye(dimensions), np.ones((1, dimensions))])
    return halfspaces(rows, np.concatenate([np.zeros(dimensions), [size]]))


def _check_dimensions(n: int) -> None:
    if not isinstance(n, int | np.integer) or isinstance(n, bool) or not 1 <= n <= MAX_REGION_DIMENSIONS:
        raise InvalidInputError(
            f"the region has {n} dimensions; expected a whole number from 1 to {MAX_REGION_DIMENSIONS}"
        )


def _frozen(array: Matrix) -> Matrix:
    array = np.ascontiguousarray(array)
    array.setflags(write=False)
    return array
