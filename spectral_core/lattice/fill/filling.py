# SPDX-License-Identifier: GPL-3.0-or-later
"""Exactly m lattice points in any convex region, and about m at a fixed level (thesis B.1: counts that do not jump).

Exactly m: rank the points of a randomly placed lattice by the region's gauge and shrink the lattice until the m-th
lies inside and the next one outside. One search, no trial and error, and the points are all the lattice points there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_kind
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.lattice.construction import Lattice
from spectral_core.lattice.fill.anchoring import Anchored, anchor
from spectral_core.lattice.fill.enumeration import Window
from spectral_core.lattice.fill.frame import (
    MAX_LEVEL,
    MAX_POINTS,
    Frame,
    checked_rotation,
    expected_count,
    random_rotation,
)
from spectral_core.lattice.fill.regions import Region

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]

_SEED_DOMAIN = 0x1A771CE
MAX_GROWTHS = 60
"""Searches with growing gauge before giving up."""
COUNTED, ENOUGH = 500, 100
"""Points that are counted where a region has no formula of its volume, and the least that are enough."""
MAX_DRAWS = 16
"""Rotations and offsets tried when rounding does not separate the m-th point from the next."""


def fill_exactly(
    lattice: Lattice, region: Region, count: int, *, seed: int = 0, rotation: ArrayLike | None = None
) -> tuple[Frame, Integers]:
    """Frame whose level 0 has exactly ``count`` points in ``region``, and their integer coordinates (count, n).

    ``seed`` draws the rotation (unless ``rotation`` (n, n) is given) and the offset; 0 <= count <= ``MAX_POINTS``.
    Time and memory grow with the points. Raises InvalidInputError for counts out of range and for regions that are
    empty, flat, unbounded or lost in the rounding of their distance from the origin.
    """
    require_count(count)
    anchored = _anchored(lattice, region)
    rng = seeded(seed)
    n = lattice.dimensions
    # The lattice starts with a cell as large as the region's ellipsoid, so that gauges are near 1; afterward only their
    # ratios count.
    unit = math.exp(-float(np.linalg.slogdet(anchored.metric)[1]) / n)
    for _ in range(MAX_DRAWS):
        # An offset drawn over one cell makes every placement of the lattice equally likely.
        orientation = random_rotation(n, rng) if rotation is None else checked_rotation(rotation, n)
        basis = unit * (orientation @ lattice.generator)
        offset = unit * (orientation @ lattice.reduced @ (rng.random(n) - 0.5))
        gauges, coefficients = _nearest(anchored, basis, offset, count)
        # Any scale between the two gauges gives exactly m; their middle is the farthest from both borders.
        inner, outer = (0.0 if count == 0 else float(gauges[count - 1])), float(gauges[count])
        shrink = 2.0 / (inner + outer)
        frame = _frozen_frame(lattice, orientation, shrink * unit, anchored.center + shrink * offset)
        # Rounding may put a point on the other side of the border, so the final positions are tested.
        inside = region.contains(frame.positions(coefficients[: count + 8]))
        if outer - inner > 1e-12 * outer and inside[:count].all() and not inside[count:].any():
            return frame, coefficients[:count]
    raise SolveError(
        f"none of {MAX_DRAWS} placements tells {count} points in the region from the next one in double precision; the "
        "region is too small for its distance from the origin (subtract an offset), or the given rotation lines the "
        "lattice up with its faces (leave it out)"
    )


def level_for(frame: Frame, region: Region, count: int) -> int:
    """The level of a frame that comes nearest to ``count`` points in a region.

    By the region's volume where a formula has it, else by counting the points of a level that has some hundreds.
    """
    require_count(count)
    require_kind("the frame", frame, Frame, "fill_exactly")
    anchored = _anchored(frame.lattice, region)
    at_zero = expected_count(region, anchored.metric, frame.dimensions * math.log(frame.spacing))
    if region.log_volume() is None:
        at_zero = _counted_at_zero(frame, region, at_zero)
    level = round(float(np.log(max(count, 1) / at_zero) / np.log(frame.lattice.rate)))
    if not 0 <= level <= MAX_LEVEL:
        raise InvalidInputError(
            f"about {count} points would be level {level} of this frame; levels run from 0 to {MAX_LEVEL}, level 0 has "
            f"about {at_zero:.3g} here"
        )
    return level


def _counted_at_zero(frame: Frame, region: Region, estimate: float) -> float:
    """About how many points level 0 has in a region, from those of the first level that has enough of them."""
    rate = frame.lattice.rate
    level = min(max(round(math.log(COUNTED / estimate) / math.log(rate)), 0), MAX_LEVEL)
    found = len(frame.points_in(region, level)[0])
    while found < ENOUGH and level < MAX_LEVEL:
        level = min(level + max(round(math.log(COUNTED / max(found, 1)) / math.log(rate)), 1), MAX_LEVEL)
        found = len(frame.points_in(region, level)[0])
    return max(found, 0.5) / float(rate) ** level


def _nearest(anchored: Anchored, basis: Matrix, offset: Matrix, count: int) -> tuple[Matrix, Integers]:
    """Gauges, ascending, and coordinates of the lattice points nearest to the center: at least count + 1 of them."""
    n = len(basis)
    expected = expected_count(anchored.region, anchored.metric, float(np.linalg.slogdet(basis)[1]))  # at gauge 1
    # Counts vary by about their square root: request enough that one search is nearly always sufficient.
    wanted = 1.1 * (count + 1) + 3.0 * np.sqrt(count + 1.0) + 4.0
    known = anchored.region.log_volume() is not None
    # Without a volume formula the ellipsoid overstates the region: start small and grow.
    gauge = float((wanted / expected) ** (1.0 / n)) * (1.0 if known else 0.6)
    window = Window(anchored, basis, offset)
    for _ in range(MAX_GROWTHS):
        coefficients = window.points(gauge, wanted)
        gauges = anchored.gauge(offset + coefficients @ basis.T)
        inside = np.flatnonzero(gauges <= gauge)
        if len(inside) > count:
            order = inside[np.argsort(gauges[inside], kind="stable")][: count + 64]
            return gauges[order], coefficients[order]
        # Few points are a poor estimate of the density: grow by a fixed factor instead of by extrapolation.
        few = len(inside) < 16
        gauge *= 1.0 + 1.5 / n if few else min(2.0, float((1.02 * wanted / len(inside)) ** (1.0 / n)))
    raise SolveError(
        f"{count} points were not reached in {MAX_GROWTHS} searches; the region is too slanted for this lattice"
    )


def _anchored(lattice: Lattice, region: Region) -> Anchored:
    require_kind("the region", region, Region, "box, ball, halfspaces")
    require_kind("the lattice", lattice, Lattice, "make_lattice")
    if region.dimensions != lattice.dimensions:
        raise InvalidInputError(
            f"the region has {region.dimensions} dimensions, the lattice {lattice.dimensions}; make one for the region"
        )
    return anchor(region)


def seeded(seed: int) -> np.random.Generator:
    """Random generator that differs from other uses of the same seed, so that regions drawn with it do not align."""
    if not _is_whole(seed) or seed < 0:
        raise InvalidInputError(f"seed is {seed!r}; expected a whole number from 0")
    return np.random.default_rng([_SEED_DOMAIN, int(seed)])


def require_count(count: int) -> None:
    """Raise InvalidInputError unless so many points can be asked for."""
    if not _is_whole(count) or not 0 <= count <= MAX_POINTS:
        raise InvalidInputError(f"the number of points is {count!r}; expected a whole number from 0 to {MAX_POINTS}")


def _is_whole(number: object) -> bool:
    return isinstance(number, int | np.integer) and not isinstance(number, bool)  # True is an int in Python


def _frozen_frame(lattice: Lattice, rotation: Matrix, spacing: float, origin: Matrix) -> Frame:
    origin.setflags(write=False)
    rotation.setflags(write=False)
    return Frame(lattice, rotation, spacing, origin)
