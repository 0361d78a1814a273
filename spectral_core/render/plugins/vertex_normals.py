# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals and tangents of a triangle, in the world."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.mesh_tables import COLUMNS, NONE, MeshTables, barycentric


def vertex_normals(meshes: MeshTables, si: Any, active: Any) -> tuple[list[Any], Any]:
    """Normals at the three corners, and True for smooth-shaded triangles."""
    mi, dr = meshes.mi, meshes.dr
    places, _, known = meshes.own_corners(si, active)
    own, placed = (dr.reinterpret_array(mi.UInt32, each) for each in (si.shape, si.instance))
    first = dr.gather(mi.UInt32, meshes.rows, own * COLUMNS + 2, known)
    known &= first != NONE
    normals = [mi.Vector3f(dr.gather(mi.Normal3f, meshes.normals, first + places[k], known)) for k in range(3)]
    if meshes.has_parts:
        number = dr.select(placed != 0, placed, own)
        rows = meshes.scene.placement(number, known & (placed != 0))[12:]
        turned = [mi.Vector3f(*(dr.dot(mi.Vector3f(*rows[4 * i : 4 * i + 3]), n) for i in range(3))) for n in normals]
        normals = [dr.select(placed != 0, dr.normalize(t), n) for t, n in zip(turned, normals, strict=True)]
    return normals, known


def normal_at(meshes: MeshTables, si: Any, place: Any, active: Any) -> Any:
    """The interpolated normal at another point of the plane of the triangle; that of the hit on flat shapes."""
    mi, dr = meshes.mi, meshes.dr
    normals, known = vertex_normals(meshes, si, active)
    corners, _ = meshes.corners(si, active)
    shares = barycentric(dr, corners, mi.Point3f(place))
    mean = sum((n * share for n, share in zip(normals, shares, strict=True)), mi.Vector3f(0.0))
    size = dr.norm(mean)
    return dr.select(known & (size > 1e-12), mean / dr.maximum(size, 1e-12), mi.Vector3f(si.sh_frame.n))


def with_shading(meshes: MeshTables, place: Any, active: Any) -> Any:
    """A point of a triangle of a mesh that no instances share, with the normal and tangents that a hit has there."""
    mi, dr = meshes.mi, meshes.dr
    _, corners, known = meshes.own_corners(place, active)
    _, second, third = barycentric(dr, corners, place.p)
    shaded = mi.SurfaceInteraction3f(place)
    meshes.triangle(shaded, dr.reinterpret_array(mi.UInt32, place.shape), mi.Point2f(second, third), known)
    normal = mi.Vector3f(dr.select(known, shaded.sh_frame.n, place.sh_frame.n))
    shaded.p, shaded.n, shaded.uv, shaded.sh_frame = place.p, place.n, place.uv, mi.Frame3f(normal)
    shaded.wi = shaded.sh_frame.to_local(place.to_world(place.wi))
    return shaded
