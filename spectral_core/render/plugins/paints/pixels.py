# SPDX-License-Identifier: GPL-3.0-or-later
"""Width of a pixel where a ray hits a surface."""

from __future__ import annotations

from typing import Any


def pixel_width(tables: Any, si: Any) -> Any:
    """Width in the world, across the view, of a pixel at a hit, as Cycles computes it (util/differential.h).

    A pixel is a square in the plane of the surface with the sides of ``coordinate_system``; the mean of its two widths
    counts. Other rays than the camera's take the distance to the camera for the length of their path.
    """
    mi, dr = tables.mi, tables.dr
    width, perspective = tables.pixel_width()
    x, y, z = (sum(row[j] * si.p[j] for j in range(3)) + row[3] for row in tables.camera_matrix(False))
    distance = dr.maximum(dr.sqrt(x * x + y * y + z * z), 1e-30)
    forward = dr.abs(z) / distance
    across = [dr.safe_sqrt(1.0 - dr.square(part / distance)) for part in (x, y)]
    angle = width * forward * 0.5 * (across[0] + across[1])
    side = dr.select(perspective > 0.5, distance * angle, width)
    toward, n = si.to_world(si.wi), si.n
    even = (n.x == n.y) & (n.x == n.z)
    first = mi.Vector3f(n.z - n.y, n.x - n.z, n.y - n.x)
    first = dr.normalize(dr.select(even, mi.Vector3f(n.z - n.y, n.x + n.z, -n.y - n.x), first))
    second = dr.cross(n, first)
    seen = [dr.norm(part - toward * dr.dot(part, toward)) for part in (first, second)]
    return side * 0.5 * (seen[0] + seen[1])
