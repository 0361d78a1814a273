# SPDX-License-Identifier: GPL-3.0-or-later
"""The rounded surface that the normals of a coarse mesh describe, from which light at grazing angles starts."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.mesh_tables import MeshTables, barycentric
from spectral_core.render.plugins.paints.tables import SceneTables
from spectral_core.render.plugins.vertex_normals import vertex_normals


def lifts(meshes: MeshTables) -> bool:
    """True if shadow rays start from the rounded surface of some object."""
    return any(row[31] > 0 for row in meshes.scene.rows.values())


def faded(tables: SceneTables, si: Any, wo: Any, active: Any) -> Any:
    """Factor on the light that an object with a moved terminator reflects along the local direction ``wo``.

    A cosine becomes that of the angle times a frequency (appleseed's workaround for coarse meshes, as in Cycles).
    """
    mi, dr = tables.mi, tables.dr
    own, placed = (dr.reinterpret_array(mi.UInt32, each) for each in (si.shape, si.instance))
    frequency = tables.frequency(dr.select(placed != 0, placed, own), active)
    cosine = dr.minimum(dr.abs(wo.z), 1.0)
    share = dr.maximum(dr.cos(dr.safe_acos(cosine) * frequency), 0.0) / dr.maximum(cosine, 1e-6)
    return dr.select((frequency > 1.0) & (si.wi.z * wo.z > 0.0), share, 1.0)


def rounded(meshes: MeshTables, si: Any, outer: Any) -> tuple[Any, Any]:
    """Way from a hit to the rounded surface that the normals of its triangle describe, and the cosine to the
    triangle's normal below which light starts there; 0 for flat triangles. ``outer``: normal of the lit side.
    """
    mi, dr = meshes.mi, meshes.dr
    corners, _ = meshes.corners(si, si.is_valid())
    normals, known = vertex_normals(meshes, si, si.is_valid())
    own, placed = (dr.reinterpret_array(mi.UInt32, each) for each in (si.shape, si.instance))
    number = dr.select(placed != 0, placed, own)
    u, v, w = barycentric(dr, corners, si.p)
    mean = normals[0] * u + normals[1] * v + normals[2] * w
    side = dr.select(dr.dot(mean, outer) > 0.0, mi.Float(1.0), -1.0)

    def bend(one: int, other: int) -> Any:
        return dr.dot(normals[one] - normals[other], corners[other] - corners[one])

    a, b, c = bend(2, 0), bend(2, 1), -bend(1, 0)
    parabola = side * (a * u * (u - 1.0) + (a + b + c) * u * v + b * v * (v - 1.0))
    envelope = mi.Float(dr.inf)
    for k in range(3):
        others = [corners[k - 1], corners[k - 2]]
        most = dr.maximum(*(side * dr.dot(corner - corners[k], normals[k]) for corner in others))
        height = side * dr.dot(corners[k] - si.p, normals[k]) + dr.maximum(most, 0.0)
        envelope = dr.minimum(envelope, dr.maximum(height, 0.0))
    amount = side * dr.maximum(envelope, 0.5 * parabola)
    cutoff = meshes.scene.terminator(number, known)
    return dr.select(known, mean * amount, 0.0), dr.select(known, cutoff, 0.0)
