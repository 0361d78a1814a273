# SPDX-License-Identifier: GPL-3.0-or-later
"""The reachable colors of one luminance: a convex set of X and Z, bounded by tangents."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.equations import Equation
from spectral_core.palette.assemble.limits import Limits
from spectral_core.spectra.color import XYZ_FROM_RGB

Array = NDArray[np.float64]

SHORT = 1e-4
"""Length of a side of the polygon, relative to the largest X or Z, that is not divided any more."""
DIVISIONS = 5
"""Most divisions of the first four sides."""


@dataclass(frozen=True, slots=True, eq=False)
class _Tangent:
    """``normal`` (2,), of X and Z; ``extent``: the largest ``normal · (X, Z)``; ``point`` (2,): where it touches.

    Both are infinite where nothing bounds the set.
    """

    normal: Array
    extent: float
    point: Array


def tangents_at(
    luminance: float, matrix: Array, bounds: tuple[float, float], equations: Sequence[Equation]
) -> tuple[Array, Array] | None:
    """Normals (k, 2) and extents (k,) of tangents of the colors ``matrix`` (3, n) @ unknowns, linear RGB, of one
    luminance Y within ``bounds`` and ``equations``; None if no color has this luminance.

    The first four normals are along the axes. Each side of the polygon of the points that are touched then gives a
    further one, as long as that touches a point outside of the polygon. So a long and narrow set is followed as well
    as a round one.
    """
    rows = XYZ_FROM_RGB @ matrix
    own = Equation(rows[1:2], np.full((2, 1), luminance), rows[1:2])
    limits = Limits(matrix.shape[1], bounds, [*equations, own])
    found = []
    for normal in np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]):
        tangent = _touching(limits, rows[::2], normal)
        if tangent is None:
            return None
        found.append(tangent)
    points = [each.point for each in found if np.isfinite(each.extent)]
    short = SHORT * max((float(np.abs(point).max()) for point in points), default=0.0)
    finished: set[bytes] = set()
    for _ in range(DIVISIONS):
        sides = list(zip(found, [*found[1:], found[0]], strict=True))
        found = []
        for here, following in sides:
            found.append(here)
            between = _between(limits, rows[::2], here, following, short, finished)
            if between is not None:
                found.append(between)
    return np.array([each.normal for each in found]), np.array([each.extent for each in found])


def _between(
    limits: Limits, rows: Array, here: _Tangent, following: _Tangent, short: float, finished: set[bytes]
) -> _Tangent | None:
    """The tangent along the side between two points; None if the side is short or is a part of the outline itself.

    ``finished``: sides that were found to be.
    """
    if not np.isfinite([here.extent, following.extent]).all():
        return None
    side = following.point - here.point
    length = float(np.hypot(*side))
    if length <= short or side.tobytes() in finished:
        return None
    normal = np.array([side[1], -side[0]]) / length  # outward: the points go counterclockwise
    tangent = _touching(limits, rows, normal)
    if tangent is None or not tangent.extent - normal @ here.point > short:
        finished.add(side.tobytes())
        return None
    return tangent


def _touching(limits: Limits, rows: Array, normal: Array) -> _Tangent | None:
    """The tangent with a normal; None if nothing is within the limits."""
    found = limits.extreme(normal @ rows)
    if found is None:
        return None
    if not np.isfinite(found).all():
        return _Tangent(normal, np.inf, np.full(2, np.inf))
    point = rows @ found
    return _Tangent(normal, float(normal @ point), point)
