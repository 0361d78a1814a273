# SPDX-License-Identifier: GPL-3.0-or-later
"""Latin hypercubes: m points of which each axis has one in each of m parts that hold equal shares of the region.

In a box the parts are equally long. In another convex region they are quantiles of its own projection: Sobol points of
the region get the coordinates of such parts, each axis in the order that the points have there. A point that leaves the
region by this exchanges coordinates with near ones until both are inside.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.explore.sweep.batches.drawn import bounding_box, is_box, sobol_batches
from spectral_core.lattice import Region

Matrix = NDArray[np.float64]

POOL, LEAST_POOLED = 16, 2**16
"""Points of the region, per point of the hypercube, from which quantiles are taken, and the least number of them."""
MOST_POOLED = 2**20
MOST_OPTIMIZED = 5000
"""Points of a hypercube whose discrepancy is made small by exchanges, about a second for a thousand; a hundred thousand
would take minutes for a share of the gain."""
MOST_BATCHES = 32
"""Batches that the quantiles of a narrow region may need, beyond those of the hypercube's own points."""
NEAR = 64
"""Neighbors on an axis, on either side, with which a point may exchange its coordinate."""
ROUNDS, MOST_ATTEMPTS = 20, 3000
"""Attempts per point to bring it into the region, and of all points."""


def latin_batches(region: Region, wanted: int, seed: int) -> Iterator[Matrix]:
    """A hypercube of ``wanted`` points, then others, which fill up where points coincide as whole numbers."""
    if not is_box(region):
        yield latin_within(region, wanted, seed)
        yield from sobol_batches(region, wanted, seed + 1)
        return
    from scipy.stats import qmc

    low, high = bounding_box(region)
    rng = np.random.default_rng(seed)
    optimization: Literal["random-cd"] | None = "random-cd" if wanted <= MOST_OPTIMIZED else None
    while True:
        drawn = qmc.LatinHypercube(region.dimensions, optimization=optimization, rng=rng).random(wanted)
        optimization = None  # takes seconds for a thousand points, and further hypercubes only fill up
        yield low + drawn * (high - low)


def latin_within(region: Region, wanted: int, seed: int) -> Matrix:
    """A hypercube in a region that is no box; points without a place stay where Sobol points were. Empty if none."""
    pool = np.empty((0, region.dimensions))
    most = max(wanted, min(max(POOL * wanted, LEAST_POOLED), MOST_POOLED))
    for number, batch in enumerate(sobol_batches(region, wanted, seed)):
        pool = np.concatenate([pool, batch])
        if len(pool) >= most or (len(pool) >= wanted and number >= MOST_BATCHES):
            break
    if len(pool) < wanted:
        return pool
    rng = np.random.default_rng(seed)
    points = pool[:wanted].copy()
    order = np.argsort(points, axis=0)
    parts = (np.arange(wanted)[:, None] + rng.random(points.shape)) / wanted
    coordinates = np.take_along_axis(np.sort(pool, axis=0), (parts * len(pool)).astype(int), axis=0)
    np.put_along_axis(points, order, coordinates, axis=0)
    return _brought_inside(region, points, order, pool[:wanted])


def _brought_inside(region: Region, points: Matrix, order: NDArray[np.intp], start: Matrix) -> Matrix:
    """Points (m, n) with coordinates exchanged until all are in the region; ``order`` lists them along each axis."""
    place = np.argsort(order, axis=0)
    outside = list(np.flatnonzero(~region.contains(points)))
    attempts = min(ROUNDS * len(outside), MOST_ATTEMPTS)
    while outside and attempts:
        attempts -= 1
        one = outside.pop(0)
        found = _best_exchange(region, points, order, place, one)
        if found is None:
            outside.append(one)
            continue
        axis, other = found
        points[[one, other], axis] = points[[other, one], axis]
        place[[one, other], axis] = place[[other, one], axis]
        order[place[[one, other], axis], axis] = one, other
        outside.extend(each for each in (one, other) if each not in outside and not region.contains(points[[each]])[0])
    points[outside] = start[outside]
    return points


def _best_exchange(
    region: Region, points: Matrix, order: NDArray[np.intp], place: NDArray[np.intp], one: int
) -> tuple[int, int] | None:
    """Axis and partner of the exchange that brings a point nearest to the region, the shortest of equal ones."""
    best, least = None, _excess(region, points[[one]])[0]
    for axis in range(points.shape[1]):
        at = place[one, axis]
        others = order[max(0, at - NEAR) : at + NEAR + 1, axis]
        others = others[others != one]
        mine, theirs = np.repeat(points[[one]], len(others), axis=0), points[others]
        mine[:, axis], theirs[:, axis] = points[others, axis], points[one, axis]
        worse = np.maximum(_excess(region, theirs) - _excess(region, points[others]), 0.0)
        left = _excess(region, mine) + worse + 1e-9 * np.abs(place[others, axis] - at)
        if len(others) and left.min() < least:
            least, best = left.min(), (axis, int(others[np.argmin(left)]))
    return best


def _excess(region: Region, points: Matrix) -> Matrix:
    """How far points (N, n) are beyond the limits of a region, (N,); 0 in it."""
    beyond = np.maximum(points @ region.rows.T - region.bounds, 0.0).sum(axis=1)
    if region.norm_ball is not None:
        beyond += np.maximum(region.norm_ball.norms(points) - 1.0, 0.0)
    return np.asarray(beyond)
