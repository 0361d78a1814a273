# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of a ``bpy.types.Mesh``, its shading normals, and measures for the Geometry node (Pointiness, Random Per
Island), as Cycles computes them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

READ = "attribute_of_mesh:"
"""Prefix of the name by which a shading program reads a measure."""
WELDED = 1e-6
"""Vertices that lie nearer to each other count as one."""


def measure(name: str, positions: Array, normals: Array, edges: Array) -> Array:
    """A measure of each vertex, three times (v, 3); ``edges``: vertices (e, 2)."""
    values = pointiness(positions, normals, edges) if name == "pointiness" else island_randoms(len(positions), edges)
    return np.repeat(values.astype(np.float32)[:, None], 3, axis=1)


def pointiness(positions: Array, normals: Array, edges: Array) -> Array:
    """(v,) 0.5 where flat, more where the mesh is convex: the angle of normal and edges, averaged with neighbors."""
    cells = np.round(np.asarray(positions, dtype=np.float64) / WELDED).astype(np.int64)
    _, first, welded = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    welded = welded.reshape(-1)
    count = len(first)
    normal = _summed(welded, normals, count)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    pairs = np.sort(welded[edges], axis=1)
    pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    one, other = pairs.T
    place = np.asarray(positions, dtype=np.float64)[first]
    along = place[other] - place[one]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-20)
    total = _summed(one, along, count) - _summed(other, along, count)
    met = np.bincount(pairs.ravel(), minlength=count)
    mean = total / np.maximum(met, 1)[:, None]
    angle = np.arccos(np.clip(np.einsum("vi,vi->v", normal, mean), -1, 1)) / np.pi
    raw = np.where(met > 0, angle, 0.0)
    around = np.bincount(one, raw[other], minlength=count) + np.bincount(other, raw[one], minlength=count)
    return np.asarray(((raw + around) / (met + 1))[welded])


def _summed(place: Array, values: Array, count: int) -> Array:
    return np.stack([np.bincount(place, column, minlength=count) for column in np.asarray(values, np.float64).T], 1)


def island_randoms(count: int, edges: Array) -> Array:
    """(v,) a random number in [0, 1] of each connected part of a mesh."""
    parents, ranks = list(range(count)), [0] * count

    def root(vertex: int) -> int:
        top = vertex
        while parents[top] != top:
            top = parents[top]
        while parents[vertex] != top:
            parents[vertex], vertex = top, parents[vertex]
        return top

    # The number of an island depends on the vertex that represents it, so islands are joined as Cycles joins them.
    for first, second in edges.tolist():
        one, other = root(first), root(second)
        if one == other:
            continue
        if ranks[one] < ranks[other]:
            one, other = other, one
        parents[other] = one
        ranks[one] += ranks[one] == ranks[other]
    roots = np.array([root(vertex) for vertex in range(count)], dtype=np.uint32)
    return hashed(roots) / float(0xFFFFFFFF)


def hashed(words: Array) -> Array:
    """Jenkins' lookup3, its final mix, of one 32-bit word each."""
    with np.errstate(over="ignore"):
        start = np.uint32((0xDEADBEEF + (1 << 2) + 13) & 0xFFFFFFFF)
        a = words.astype(np.uint32) + start
        b = c = np.full_like(a, start)
        for first, second, third in ((14, 11, 25), (16, 4, 14)):
            c = (c ^ b) - _rotated(b, first)
            a = (a ^ c) - _rotated(c, second)
            b = (b ^ a) - _rotated(a, third)
        return (c ^ b) - _rotated(b, 24)


def _rotated(words: Array, bits: int) -> Array:
    return (words << np.uint32(bits)) | (words >> np.uint32(32 - bits))


def floats(collection: Any, name: str, length: int, width: int) -> Array:
    """Values (length, width) float32 of a collection."""
    values = np.empty(length * width, dtype=np.float32)
    collection.foreach_get(name, values)
    return values.reshape(length, width)


def corner_vertices(source: Any) -> Array:
    """Vertex (c,) of each corner."""
    values = np.empty(len(source.loops), dtype=np.int32)
    attribute = source.attributes.get(".corner_vert")
    if attribute is not None:
        attribute.data.foreach_get("value", values)
    else:
        source.loops.foreach_get("vertex_index", values)
    return values


def normals_of(source: Any) -> Array | None:
    """None if every face is flat, one per vertex if all are smooth, else one per corner."""
    if source.normals_domain == "FACE":
        # Cycles reads the normals of vertices, which Blender makes from an artist's, and for smooth faces alone
        return _of_smooth_and_flat(source) if source.attributes.get("custom_normal") is not None else None
    if source.normals_domain == "POINT":
        values = _without_zeros(floats(source.vertex_normals, "vector", len(source.vertices), 3))
        # as many vertices as corners could be confused with corners
        return np.take(values, corner_vertices(source), axis=0) if len(values) == len(source.loops) else values
    if source.has_custom_normals or has_sharp_edges(source):
        return _without_zeros(floats(source.corner_normals, "vector", len(source.loops), 3))
    return _of_smooth_and_flat(source)


def has_sharp_edges(source: Any) -> bool:
    """True if a mesh has edges that are marked as sharp."""
    attribute = source.attributes.get("sharp_edge")
    if attribute is None or attribute.domain != "EDGE" or attribute.data_type != "BOOLEAN":
        return False
    values = np.empty(len(source.edges), dtype=bool)
    attribute.data.foreach_get("value", values)
    return bool(values.any())


def _of_smooth_and_flat(source: Any) -> Array:
    """Normals of corners where some faces are flat and no edge is sharp: smooth faces have those of their vertices.

    So does Cycles; Blender's own corner normals split at the borders of flat faces. The normals of the polygons
    themselves are those of the geometry, ``polygon_normals`` may be an artist's.
    """
    count = len(source.polygons)
    smooth, sizes = np.empty(count, dtype=bool), np.empty(count, dtype=np.int32)
    source.polygons.foreach_get("use_smooth", smooth)
    source.polygons.foreach_get("loop_total", sizes)
    of_faces = np.repeat(floats(source.polygons, "normal", count, 3), sizes, axis=0)
    of_vertices = np.take(
        floats(source.vertex_normals, "vector", len(source.vertices), 3), corner_vertices(source), axis=0
    )
    return _without_zeros(np.where(np.repeat(smooth, sizes)[:, None], of_vertices, of_faces))


def _without_zeros(normals: Array) -> Array:
    """Blender gives zero normals to loose vertices and collapsed faces; they become up, which is never NaN."""
    lost = ~(np.abs(normals).max(axis=1, initial=0) > 0)
    if lost.any():
        normals[lost] = (0, 0, 1)
    return normals
