# SPDX-License-Identifier: GPL-3.0-or-later
"""Size of a pixel where a ray hits a surface, as Cycles computes it (util/differential.h)."""

from __future__ import annotations

from typing import Any


def pixel_side(tables: Any, si: Any) -> Any:
    """Side in the world of a pixel at a hit, in the plane of the surface.

    Other rays than the camera's take the distance to the camera for the length of their path.
    """
    dr = tables.dr
    width, perspective = tables.pixel_width()
    x, y, z = (sum(row[j] * si.p[j] for j in range(3)) + row[3] for row in tables.camera_matrix(False))
    distance = dr.maximum(dr.sqrt(x * x + y * y + z * z), 1e-30)
    forward = dr.abs(z) / distance
    across = [dr.safe_sqrt(1.0 - dr.square(part / distance)) for part in (x, y)]
    angle = width * forward * 0.5 * (across[0] + across[1])
    return dr.select(perspective > 0.5, distance * angle, width)


LEAST_STEP = 3e-5
"""Least step of Bump's height samples over the length of a ray: shorter ones have no digits left."""


def pixel_axes(tables: Any, si: Any) -> tuple[Any, Any]:
    """Unit sides of a pixel in the plane of a surface, about the normal that faces the viewer."""
    mi, dr = tables.mi, tables.dr
    n = dr.mulsign(mi.Vector3f(si.n), dr.dot(si.n, si.to_world(si.wi)))
    even = (n.x == n.y) & (n.x == n.z)
    first = mi.Vector3f(n.z - n.y, n.x - n.z, n.y - n.x)
    first = dr.normalize(dr.select(even, mi.Vector3f(n.z - n.y, n.x + n.z, -n.y - n.x), first))
    return first, dr.cross(n, first)


def step_along(tables: Any, si: Any, axis: int, width: float) -> Any:
    """Step along axis 1 or 2 of the surface, of a width in pixels."""
    dr = tables.dr
    distance = dr.select(dr.isfinite(si.t) & (si.t > 0.0), si.t, 1.0)
    return pixel_axes(tables, si)[axis - 1] * dr.maximum(pixel_side(tables, si) * width, distance * LEAST_STEP)


def pixel_width(tables: Any, si: Any) -> Any:
    """Width in the world, across the view, of a pixel at a hit: the mean of the widths of its two sides."""
    dr = tables.dr
    toward = si.to_world(si.wi)
    seen = [dr.norm(part - toward * dr.dot(part, toward)) for part in pixel_axes(tables, si)]
    return pixel_side(tables, si) * 0.5 * (seen[0] + seen[1])
