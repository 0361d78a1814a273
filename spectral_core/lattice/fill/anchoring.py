# SPDX-License-Identifier: GPL-3.0-or-later
"""A region relative to a point inside it: center, gauge and enclosing ellipsoid, unchanged by affine maps.

The gauge g(v) of a region around an interior point c is the factor by which it must grow about c to just reach c + v.
The center is the analytic one (maximal product of slacks); the Hessian of the slacks' logarithms there is the metric
in which thin, rotated and slanted regions become round, so that lattice reduction and search behave as in a ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.lattice.fill.cap_ellipsoid import cap_ellipsoid
from spectral_core.lattice.fill.place_and_size import is_bounded, place_and_size
from spectral_core.lattice.fill.regions import NormBall, Region, p_norms

Matrix = NDArray[np.float64]

THINNEST = 1e-7
"""Least accepted width relative to the largest: thinner regions have no interior in double precision."""
MAX_ELLIPSOID_ROWS = 60
"""Most rows that determine the enclosing ellipsoid (n (n + 1) / 2 suffice for the best one)."""
MET_WIDTH = 2.0
"""Width on the far side of a row up to which its parallel row counts as met: beyond, other rows may cut the region long
before, as a small simplex in the unit cube."""
MAX_TANGENTS = 200
"""Tangent planes tried to find a point inside a ball that half-spaces cut."""


@dataclass(frozen=True, eq=False)
class Anchored:
    """A region in coordinates v = x - center; it is {rows v <= 1} within the shifted ball, if there is one."""

    region: Region
    center: Matrix
    """(n,), strictly inside."""
    rows: Matrix
    """(R, n): every row satisfies row·v <= 1 on the region; complete unless ``norm_ball`` is set."""
    metric: Matrix
    """W, (n, n): the region lies in the ellipsoid ‖W (v - ellipsoid_center)‖ <= 1."""
    ellipsoid_center: Matrix
    norm_ball: NormBall | None
    """The ball relative to ``center``."""

    def gauge(self, vectors: Matrix) -> Matrix:
        """g(v) of vectors (N, n) from the center, (N,); the region is g <= 1."""
        # The gauge of an intersection is the largest of the gauges of its constraints.
        value = np.zeros(len(vectors))
        for start in range(0, len(self.rows), 64):  # in blocks, so that memory stays proportional to the vectors
            value = np.maximum(value, (vectors @ self.rows[start : start + 64].T).max(axis=1))
        if self.norm_ball is not None:
            value = np.maximum(value, _ball_gauge(self.norm_ball, vectors))
        return value


def anchor(region: Region) -> Anchored:
    """Center, gauge and ellipsoid of a region; InvalidInputError if it is empty, flat, too thin or unbounded."""
    if region.box_limits is not None:
        return _anchored_box(region, *region.box_limits)
    if region.norm_ball is not None and not len(region.rows):
        return _anchored_ball(region, region.norm_ball)
    return _anchored_general(region)


def _anchored_box(region: Region, low: Matrix, high: Matrix) -> Anchored:
    center, half = 0.5 * low + 0.5 * high, 0.5 * (high - low)
    _check_resolution(center, half)
    n = len(center)
    # Relative to its center, a box is symmetric: both faces of an axis are equally far.
    rows = np.concatenate([np.diag(1.0 / half), np.diag(-1.0 / half)])
    return Anchored(region, center, rows, np.diag(1.0 / half) / np.sqrt(n), np.zeros(n), None)


def _anchored_ball(region: Region, norm_ball: NormBall) -> Anchored:
    _check_resolution(norm_ball.center, norm_ball.radii)
    n = len(norm_ball.center)
    # The half-spaces around the ball prune the search early; the norm itself decides.
    local = NormBall(np.zeros(n), norm_ball.radii, norm_ball.p)
    rows, limits = local.outer_rows()
    metric = np.diag(1.0 / (norm_ball.radii * norm_ball.outer_radius()))
    exact = local if norm_ball.p > 1.0 or n > 10 else None  # for p = 1 the sign rows are the ball
    return Anchored(region, norm_ball.center, rows / limits[:, None], metric, np.zeros(n), exact)


def _anchored_general(region: Region) -> Anchored:
    rows, bounds = region.rows, region.bounds
    if region.norm_ball is not None:
        outer = region.norm_ball.outer_rows()
        # Of length 1, as the others: bounds are lengths then, and no unit makes a region too thin or unbounded.
        lengths = np.linalg.norm(outer[0], axis=1)
        rows = np.concatenate([rows, outer[0] / lengths[:, None]])
        bounds = np.concatenate([bounds, outer[1] / lengths])
    if not is_bounded(rows):
        raise InvalidInputError(
            f"the {len(rows)} half-spaces in {rows.shape[1]} dimensions leave the region unbounded; add limits, as "
            "with & box(...)"
        )
    # Near the origin and of size 1, for which the tolerances of the linear programs are made.
    shift, size = place_and_size(region, rows, bounds)
    bounds = (bounds - rows @ shift) / size
    ball = _rescaled(region.norm_ball, shift, size)
    # The linear program knows the ball by half-spaces only. If its solution lies outside the ball, the tangent plane
    # between them is added, and the next solution is nearer.
    for _ in range(MAX_TANGENTS):
        start, radius = _chebyshev_center(rows, bounds)
        center = _analytic_center(rows, bounds, start) if radius > THINNEST else start
        if ball is None or radius <= THINNEST or ball.norms(center[None])[0] < 1.0 - 1e-9:
            break
        row, limit = ball.tangent_row(center)
        rows, bounds = np.concatenate([rows, row[None]]), np.append(bounds, limit)
    else:
        raise InvalidInputError(
            "no point inside both the ball and the half-spaces was found; their overlap is empty or tiny"
        )
    if radius <= THINNEST:
        raise InvalidInputError(
            f"the region is empty, flat or too thin: the largest ball inside has {max(radius, 0.0):.3g} of its size; "
            f"expected above {THINNEST:g}. Widen the bounds, or leave out the direction that should not vary"
        )
    # Divided by its slack, every row is 1 where it is met: rows become unit-free, as the gauge needs them.
    slacks = bounds - rows @ center
    scaled_rows = rows / slacks[:, None]
    metric, middle = _enclosing_ellipsoid(scaled_rows)
    where = shift + size * center
    _check_resolution(where, np.full(len(where), radius * size))
    if ball is None:
        return Anchored(region, where, scaled_rows / size, metric / size, middle * size, None)
    local = NormBall((ball.center - center) * size, ball.radii * size, ball.p)
    # Two ellipsoids contain the region: one from its half-spaces, one from the ball that they cut. The smaller one
    # leaves fewer partial choices to the search.
    around_cap = cap_ellipsoid(local, scaled_rows / size)
    if np.linalg.slogdet(around_cap[0])[1] > np.linalg.slogdet(metric / size)[1]:
        return Anchored(region, where, scaled_rows / size, *around_cap, local)
    return Anchored(region, where, scaled_rows / size, metric / size, middle * size, local)


def _rescaled(ball: NormBall | None, shift: Matrix, size: float) -> NormBall | None:
    return None if ball is None else NormBall((ball.center - shift) / size, ball.radii / size, ball.p)


def _check_resolution(center: Matrix, half_widths: Matrix) -> None:
    """Raise InvalidInputError for axes far thinner than the widest, and for regions in which neighboring doubles are
    far apart.
    """
    thinnest = int(np.argmin(half_widths))
    if half_widths[thinnest] < THINNEST * half_widths.max():
        raise InvalidInputError(
            f"the region is {2 * half_widths[thinnest]:.3g} wide on axis {thinnest} and {2 * half_widths.max():.3g} on "
            f"another; expected a ratio above {THINNEST:g}. Rescale that axis, or leave it out if it should not vary"
        )
    steps = np.spacing(np.abs(center)) / half_widths
    if not steps.max() < 1e-3:
        axis = int(np.argmax(steps))
        raise InvalidInputError(
            f"the region is {2 * half_widths[axis]:.3g} wide at {center[axis]:.10g} on axis {axis}, where doubles are "
            f"{np.spacing(abs(center[axis])):.2g} apart; subtract an offset from that axis, so that it lies near 0"
        )


def _chebyshev_center(rows: Matrix, bounds: Matrix) -> tuple[Matrix, float]:
    """Center and radius of the largest ball inside (radius negative when empty)."""
    from scipy.optimize import linprog

    n = rows.shape[1]
    lengths = np.linalg.norm(rows, axis=1)
    # A ball of radius r around x is inside when row·x + r ‖row‖ <= bound: linear in (x, r) together.
    matrix = np.column_stack([rows, lengths])
    answer = linprog(np.r_[np.zeros(n), -1.0], A_ub=matrix, b_ub=bounds, bounds=(None, None), method="highs")
    if answer.status != 0:
        raise InvalidInputError(f"the half-spaces have no point in common or do not bound a region ({answer.message})")
    return answer.x[:n], float(answer.x[n])


def _analytic_center(rows: Matrix, bounds: Matrix, start: Matrix) -> Matrix:
    """Newton's method on -Σ log(slack), with damping that keeps every step inside; 100 steps at most."""
    center = start
    for _ in range(100):
        scaled = rows / (bounds - rows @ center)[:, None]
        gradient = scaled.sum(axis=0)
        step = -np.linalg.solve(scaled.T @ scaled, gradient)
        decrement = float(np.sqrt(max(-gradient @ step, 0.0)))
        # The damping of self-concordant barriers (Nesterov and Nemirovskii): the step never leaves the region.
        center = center + step / (1.0 + decrement)
        if decrement < 1e-9:
            break
    return center


def _enclosing_ellipsoid(rows: Matrix) -> tuple[Matrix, Matrix]:
    """Metric W and center e of an ellipsoid ‖W (v - e)‖ <= 1 around {rows v <= 1}; exact for boxes and simplices.

    With t = row·v and -w <= t <= 1 every product (t + w)(1 - t) is positive. Any sum of them with positive weights is
    positive, too, and is an ellipsoid. D-optimal weights make it small and rest on few rows, of which w is found.
    """
    weights = _optimal_weights(rows)
    used = np.argsort(-weights, kind="stable")[: min(len(rows), MAX_ELLIPSOID_ROWS)]
    used = used[weights[used] > 1e-3 * weights.max()]
    if np.linalg.matrix_rank(rows[used]) < rows.shape[1]:  # too many weights were removed: take all
        used = np.flatnonzero(weights > 0)
    weights, widths = weights[used], _opposite_widths(rows, used)
    # Completing the square of the weighted sum of products gives center and radius in closed form.
    hessian = (rows[used] * weights[:, None]).T @ rows[used]
    slope = (weights * (widths - 1.0)) @ rows[used]
    center = -0.5 * np.linalg.solve(hessian, slope)
    squared_radius = float(weights @ widths + center @ hessian @ center) * (1.0 + 1e-9)
    return np.linalg.cholesky(hessian).T / np.sqrt(squared_radius), center


def _optimal_weights(rows: Matrix) -> Matrix:
    """Weights λ of rows that maximize det Σ λ row rowᵀ, Σ λ = 1 (Titterington's multiplicative steps, 300 of them)."""
    n = rows.shape[1]
    weights = np.full(len(rows), 1.0 / len(rows))
    for _ in range(300):
        inverse = np.linalg.inv((rows * weights[:, None]).T @ rows)
        # At the optimum all rows that are used have the same gain, 1.
        gain = np.einsum("ij,jk,ik->i", rows, inverse, rows, optimize=True) / n
        weights = weights * gain
        weights /= weights.sum()
        if gain.max() < 1.0 + 1e-3:
            break
    return weights


def _opposite_widths(rows: Matrix, used: NDArray[np.int64]) -> Matrix:
    """-min row·v over {rows v <= 1} for the rows used: from a parallel row that may be met, else by linear program."""
    from scipy.optimize import linprog

    lengths = np.linalg.norm(rows, axis=1)
    units = rows / lengths[:, None]
    widths = np.empty(len(used))
    for position, i in enumerate(used):
        parallel = np.flatnonzero(units @ units[i] < -1.0 + 1e-12)
        if len(parallel) and (width := float((lengths[i] / lengths[parallel]).min())) < MET_WIDTH:
            widths[position] = width * (1.0 + 1e-9)
            continue
        answer = linprog(rows[i], A_ub=rows, b_ub=np.ones(len(rows)), bounds=(None, None), method="highs")
        if answer.status != 0:
            raise InvalidInputError(f"the half-spaces do not bound the region numerically ({answer.message})")
        widths[position] = -answer.fun * (1.0 + 1e-6) + 1e-9
    return widths


def _ball_gauge(ball: NormBall, vectors: Matrix) -> Matrix:
    """Gauge of a ball around a point that need not be its center, by bisection on the factor (60 halvings)."""
    if not ball.center.any():
        return ball.norms(vectors)
    # The center is at least this deep inside, so the gauge lies between |v| / 4 and |v| / reach.
    reach = 1.0 - float(ball.norms(np.zeros((1, len(ball.center))))[0])
    high = p_norms(vectors / ball.radii, ball.p) / reach + 1e-300
    low = 0.25 * high * reach
    for _ in range(60):
        middle = 0.5 * (low + high)
        outside = ball.norms(vectors / middle[:, None]) > 1.0
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    return high
