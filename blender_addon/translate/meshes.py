# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated Blender meshes to triangles: arrays move whole, and a vertex is split only where its corners differ."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Mesh

Array = NDArray[Any]

GENERATED = "\0generated"
"""Stands for a UV map where the material asks for generated coordinates: the bounding box as a unit square."""


def translate_mesh(name: str, source: Any, uv_map: str | None = None) -> Mesh | None:
    """Mesh of a ``bpy.types.Mesh``, None where it has no faces.

    ``uv_map``: the map its materials read, "" for the one that renders, None where they read none (then corners are
    not split along its seams).
    """
    source.calc_loop_triangles()
    count = len(source.loop_triangles)
    if count == 0:
        return None
    positions = _floats(source.attributes["position"].data, "vector", len(source.vertices), 3)
    corners = _corner_vertices(source)
    triangle_corners = np.empty(count * 3, dtype=np.int32)
    source.loop_triangles.foreach_get("loops", triangle_corners)
    triangle_corners = triangle_corners.reshape(-1, 3)

    uvs = None if uv_map is None else _corner_uvs(source, uv_map, positions, corners)
    normals = _normals(source)
    keys = [array for array in (uvs, normals) if array is not None and len(array) == len(corners)]
    vertex_of_corner, corner_of_vertex = corners, None
    if keys:
        vertex_of_corner, corner_of_vertex = split_corners(corners, np.concatenate(keys, axis=1), len(positions))
        # np.take moves whole rows several times faster than indexing does
        vertex = np.take(corners, corner_of_vertex)
        positions = np.take(positions, vertex, axis=0)
        uvs = None if uvs is None else np.take(uvs, corner_of_vertex, axis=0)
        if normals is not None:
            normals = np.take(normals, corner_of_vertex if len(normals) == len(corners) else vertex, axis=0)
    return Mesh(
        name,
        positions,
        np.take(vertex_of_corner, triangle_corners).astype(np.uint32),
        normals=normals,
        uvs=uvs,
        material_indices=_material_indices(source, count),
    )


def split_corners(corners: Array, attributes: Array, vertex_count: int) -> tuple[Array, Array]:
    """New vertex of each corner, and one corner of each new vertex, such that equal vertices have equal attributes.

    ``corners``: (c,) vertex of each corner; ``attributes``: (c, k) float32. Vertices keep their order and the
    attributes of their first corner; corners that differ from it follow. A loose vertex takes corner 0.
    """
    first = np.zeros(vertex_count, dtype=np.int64)
    first[corners[::-1]] = np.arange(len(corners))[::-1]
    differs = np.flatnonzero(_rows_differ(attributes, np.take(first, corners)))
    if differs.size == 0:
        return corners.astype(np.int64), first
    representative = _same_rows(np.take(corners, differs), np.take(attributes, differs, axis=0))
    vertex_of_corner = corners.astype(np.int64)
    vertex_of_corner[differs] = vertex_count + representative[1]
    return vertex_of_corner, np.concatenate([first, differs[representative[0]]])


def _rows_differ(rows: Array, others: Array) -> Array:
    """Which rows differ from the row that ``others`` names for them; (n,) bool."""
    differs = np.zeros(len(rows), dtype=bool)
    for column in rows.T:  # a column at a time: no temporary of the size of all
        differs |= column != np.take(column, others)
    return differs


def _same_rows(vertices: Array, attributes: Array) -> tuple[Array, Array]:
    """(index of one row of each kind, kind of each row), rows being a vertex with its attributes.

    Rows are told apart by a 64-bit hash, then checked: where two kinds fell together, every row is a kind.
    """
    words = np.ascontiguousarray(attributes, dtype=np.float32).view(np.uint32).astype(np.uint64)
    with np.errstate(over="ignore"):
        digest = vertices.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        for column in words.T:
            digest = (digest ^ column) * np.uint64(0xBF58476D1CE4E5B9)
            digest ^= digest >> np.uint64(29)
    _, one, kind = np.unique(digest, return_index=True, return_inverse=True)
    kind = kind.reshape(-1)
    same = np.take(one, kind)
    if np.any(vertices != np.take(vertices, same)) or np.any(_rows_differ(attributes, same)):
        one = kind = np.arange(len(vertices))
    return one, kind


def _floats(collection: Any, name: str, length: int, width: int) -> Array:
    values = np.empty(length * width, dtype=np.float32)
    collection.foreach_get(name, values)
    return values.reshape(length, width)


def _corner_vertices(source: Any) -> Array:
    values = np.empty(len(source.loops), dtype=np.int32)
    attribute = source.attributes.get(".corner_vert")
    if attribute is not None:
        attribute.data.foreach_get("value", values)
    else:
        source.loops.foreach_get("vertex_index", values)
    return values


def _normals(source: Any) -> Array | None:
    """None where every face is flat, one per vertex where all are smooth, else one per corner."""
    if source.normals_domain == "FACE":
        return None
    if source.normals_domain == "POINT":
        return _unit(_floats(source.vertex_normals, "vector", len(source.vertices), 3))
    return _unit(_floats(source.corner_normals, "vector", len(source.loops), 3))


def _unit(normals: Array) -> Array:
    """Blender gives zero normals to loose vertices and collapsed faces; up is as good as any and never NaN."""
    lost = ~(np.abs(normals).max(axis=1, initial=0) > 0)
    if lost.any():
        normals[lost] = (0, 0, 1)
    return normals


def _corner_uvs(source: Any, uv_map: str, positions: Array, corners: Array) -> Array:
    """UV of each corner, (c, 2); zero where the mesh has no such map, as in Blender, or no finite value."""
    if uv_map == GENERATED:
        low, high = positions.min(axis=0), positions.max(axis=0)
        return ((positions - low) / np.where(high > low, high - low, 1))[corners, :2].astype(np.float32)
    layer = uv_layer(source, uv_map)
    if layer is None:
        return np.zeros((len(corners), 2), dtype=np.float32)
    uvs = _floats(layer.uv, "vector", len(corners), 2)
    return np.where(np.isfinite(uvs), uvs, np.float32(0))


def uv_layer(source: Any, uv_map: str) -> Any:
    """UV layer of that name, for "" the one marked for rendering; None where the mesh has none."""
    if uv_map:
        return source.uv_layers.get(uv_map)
    return next((layer for layer in source.uv_layers if layer.active_render), source.uv_layers.active)


def _material_indices(source: Any, count: int) -> Array | None:
    attribute = source.attributes.get("material_index")  # absent while all faces wear the first material
    if attribute is None or attribute.domain != "FACE":
        return None
    of_face = np.empty(len(source.polygons), dtype=np.int32)
    attribute.data.foreach_get("value", of_face)
    face = np.empty(count, dtype=np.int32)
    source.loop_triangle_polygons.foreach_get("value", face)
    return of_face[face].clip(0, 65535).astype(np.uint16)
