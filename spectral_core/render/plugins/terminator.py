# SPDX-License-Identifier: GPL-3.0-or-later
"""The rounded surface that the normals of a coarse mesh describe, from which light at grazing angles starts."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.mesh_tables import COLUMNS, NONE, MeshTables, barycentric


def lifts(meshes: MeshTables) -> bool:
    """True if shadow rays start from the rounded surface of some object."""
    return any(row[31] > 0 for row in meshes.scene.rows.values())


def rounded(meshes: MeshTables, si: Any, outer: Any) -> tuple[Any, Any]:
    """Way from a hit to the rounded surface that the normals of its triangle describe, and the cosine to the
    triangle's normal below which light starts there; 0 for flat triangles. ``outer``: normal of the lit side.
    """
    mi, dr = meshes.mi, meshes.dr
    corners, known = meshes.corners(si, si.is_valid())
    places, _, _ = meshes.own_corners(si, known)
    own, placed = (dr.reinterpret_array(mi.UInt32, each) for each in (si.shape, si.instance))
    normal = dr.gather(mi.UInt32, meshes.rows, own * COLUMNS + 2, known)
    known &= normal != NONE
    normals = [mi.Vector3f(dr.gather(mi.Normal3f, meshes.normals, normal + places[k], known)) for k in range(3)]
    number = dr.select(placed != 0, placed, own)
    if meshes.has_parts:
        rows = meshes.scene.placement(number, known & (placed != 0))[12:]
        turned = [mi.Vector3f(*(dr.dot(mi.Vector3f(*rows[4 * i : 4 * i + 3]), n) for i in range(3))) for n in normals]
        normals = [dr.select(placed != 0, dr.normalize(t), n) for t, n in zip(turned, normals, strict=True)]
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
