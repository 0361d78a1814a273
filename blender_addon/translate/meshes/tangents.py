# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents of UV maps at the corners of a mesh, as Cycles computes them.

Source: Mikkelsen 2008, "Simulation of wrinkled surfaces revisited", and its code MikkTSpace. Normal maps are baked for
these tangents: interpolated over smooth faces, they differ from the directions of the UV map in each triangle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene.shading import SMOOTH_NORMAL, UV_SIGN, UV_TANGENT

from .splits import same_rows

Array = NDArray[Any]

OF_MAPS = (f"{UV_TANGENT}:", f"{UV_SIGN}:")
SPACE = (*OF_MAPS, SMOOTH_NORMAL)
"""Beginnings of the inputs of programs that are computed here."""
TINY = float(np.finfo(np.float32).tiny)


def smooth_normals(source: Any, normals: Array | None, corners: Array) -> Array | None:
    """Normal (c, 3) of each corner of smooth faces and 0 of the others, from those of vertices or corners."""
    if normals is None:
        return None
    at_corners = normals if len(normals) == len(corners) else np.take(normals, corners, axis=0)
    count = len(source.polygons)
    smooth, sizes = np.empty(count, dtype=bool), np.empty(count, dtype=np.int32)
    source.polygons.foreach_get("use_smooth", smooth)
    source.polygons.foreach_get("loop_total", sizes)
    return np.where(np.repeat(smooth, sizes)[:, None], at_corners, np.float32(0))


def tangent_space(
    places: Array, normals: Array | None, reads: frozenset[str], uvs_of: Callable[[str], Array | None]
) -> dict[str, Array]:
    """Tangents, signs and normals (3 t, 3) of the corners of triangles, by the inputs of programs that read them.

    Parameters
    ----------
    places : position of each corner, (3 t, 3).
    normals : those of smooth faces, else 0; None if all faces are flat.
    reads : inputs of programs.
    uvs_of : coordinates (3 t, 2) by the name of a UV map, "" for the one that renders; None if the mesh lacks it.
    """
    found: dict[str, Array] = {}
    if SMOOTH_NORMAL in reads and normals is not None:
        found[SMOOTH_NORMAL] = normals
    for uv_map in sorted({name.partition(":")[2] for name in reads if name.startswith(OF_MAPS)}):
        uvs = uvs_of(uv_map)
        if uvs is None and uv_map:
            continue
        tangents, signs = tangents_of(places, normals, uvs)
        for name, values in ((UV_TANGENT, tangents), (UV_SIGN, np.repeat(signs[:, None], 3, axis=1))):
            if f"{name}:{uv_map}" in reads:
                found[f"{name}:{uv_map}"] = values
    return found


def around_origin(places: Array) -> Array:
    """Coordinates (3 t, 2) of the corners of triangles on a sphere around the origin, without a seam in a triangle."""
    x, y, z = places.astype(np.float64).T
    length = np.sqrt(x * x + y * y + z * z)
    u = np.where((x == 0) & (y == 0), 0.0, 0.5 - np.arctan2(x, y) / (2 * np.pi)).reshape(-1, 3)
    u = np.where((np.ptp(u, axis=1, keepdims=True) > 0.5) & (u < 0.5), u + 1.0, u).ravel()
    v = 1.0 - np.arccos(np.clip(z / np.where(length > 0, length, 1.0), -1, 1)) / np.pi
    return np.where(length[:, None] > 0, np.stack([u, v], axis=1), 0.0).astype(np.float32)


def tangents_of(places: Array, normals: Array | None, uvs: Array | None) -> tuple[Array, Array]:
    """Tangent (3 t, 3) and sign (3 t,) of each corner of each triangle; ``uvs``: (3 t, 2), None without a UV map.

    Corners with the same position, normal, coordinates and orientation of the UV map share a tangent: the mean of the
    directions in their triangles, each weighted by the angle there, if these triangles are joined by edges. Triangles
    without area take what others have.
    """
    mapped = around_origin(places) if uvs is None else uvs
    p, t = (values.astype(np.float32).reshape(-1, 3, values.shape[1]) for values in (places, mapped))
    n = _all_normals(p, normals)
    first, second, (u1, v1), (u2, v2) = (
        p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], (t[:, 1] - t[:, 0]).T, (t[:, 2] - t[:, 0]).T,
    )  # fmt: skip
    area = u1 * v2 - v1 * u2
    along, across = v2[:, None] * first - v1[:, None] * second, u1[:, None] * second - u2[:, None] * first
    is_point = (p[:, 0] == p[:, 1]).all(1) | (p[:, 0] == p[:, 2]).all(1) | (p[:, 1] == p[:, 2]).all(1)
    counts = ~is_point & (np.abs(area) > TINY) & ((along**2).sum(1) > TINY) & ((across**2).sum(1) > TINY)
    sign = np.where(area > 0, np.float32(1), np.float32(-1))[:, None]

    alike = np.concatenate([p, n] if uvs is None else [p, n, t], axis=2)
    rows = alike.reshape(-1, alike.shape[2]) + np.float32(0)  # no negative zeros
    corner = same_rows(np.zeros(len(rows), np.int64), rows)[1].reshape(-1, 3)
    keys, size = 2 * corner + (area > 0)[:, None], 2 * (int(corner.max()) + 1)
    keys = np.where(counts[:, None], keys, _shared(corner, keys[counts].ravel(), size, is_point))
    signs = np.where(keys % 2 == 1, 1.0, -1.0).ravel()
    keys, size = _by_fans(corner, keys, size, is_point)
    sums = _sums(p[counts], n[counts], _unit(along * sign)[counts], keys[counts], size)
    has = np.zeros(size, bool)
    has[keys[counts]] = True
    keys = keys.ravel()
    tangents = np.where(has[keys, None], _unit(sums)[keys], (1.0, 0.0, 0.0))
    return tangents.astype(np.float32), np.where(has[keys], signs, -1.0).astype(np.float32)


def _by_fans(corner: Array, keys: Array, size: int, is_point: Array) -> tuple[Array, int]:
    """Keys (t, 3) that differ where triangles meet at a corner but no edges join them, and their number."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes = np.arange(corner.size).reshape(-1, 3)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    end_node, flat = np.roll(nodes, -1, axis=1).ravel(), keys.ravel()
    edge = np.minimum(start, end).astype(np.int64) * (int(corner.max()) + 1) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    one, other = order[:-1], order[1:]
    joined = (edge[one] == edge[other]) & (start[one] == end[other])
    joined &= ~is_point[one // 3] & ~is_point[other // 3]
    one, other = one[joined], other[joined]
    first, second = np.concatenate([one, end_node[one]]), np.concatenate([end_node[other], other])
    alike = flat[first] == flat[second]
    first, second = first[alike], second[alike]
    usable = np.repeat(~is_point, 3)
    apart = np.bincount(flat[usable], minlength=size) - np.bincount(flat[first], minlength=size) > 1
    chosen = np.flatnonzero(usable & apart[flat])
    if chosen.size == 0:
        return keys, size
    place = np.full(corner.size, -1)
    place[chosen] = np.arange(chosen.size)
    kept = apart[flat[first]]
    links = coo_array((np.ones(kept.sum(), bool), (place[first[kept]], place[second[kept]])), (chosen.size,) * 2)
    count, fans = connected_components(links, directed=False)
    flat = flat.copy()
    flat[chosen] = size + fans
    return flat.reshape(-1, 3), size + count


def _shared(corner: Array, keys: Array, size: int, is_point: Array) -> Array:
    """Keys (t, 3) of triangles that have no direction: those of the earliest triangle at any of their corners, which
    gives them its orientation; of triangles without area, at each corner. ``keys``: of triangles with a direction.
    """
    first = np.full(size, len(keys))
    first[keys[::-1]] = np.arange(len(keys))[::-1]
    earliest = np.minimum(first[2 * corner], first[2 * corner + 1])
    own = first[2 * corner + 1] < first[2 * corner]
    common = np.take_along_axis(own, earliest.argmin(axis=1)[:, None], axis=1)
    return 2 * corner + np.where(is_point[:, None], own, common)


def _sums(p: Array, n: Array, direction: Array, keys: Array, size: int) -> Array:
    """Sum (size, 3) of the directions of triangles at their corners, in the plane of the normal, times the angle."""
    sums = np.zeros((size, 3))
    for k in range(3):
        here, after, before = (p[:, (k + j) % 3] for j in range(3))
        one, other, along = (_unit(_in_plane(n[:, k], each)) for each in (after - here, before - here, direction))
        angle = np.arccos(np.clip(np.einsum("ti,ti->t", one, other), -1.0, 1.0))
        for axis in range(3):
            sums[:, axis] += np.bincount(keys[:, k], along[:, axis] * angle, minlength=size)
    return sums


def _all_normals(p: Array, normals: Array | None) -> Array:
    """Normal (t, 3, 3) at each corner of each triangle; of flat faces that of the triangle."""
    found = np.zeros_like(p) if normals is None else normals.astype(np.float32).reshape(p.shape).copy()
    flat = ~found[:, 0].any(axis=1)
    found[flat] = _unit(np.cross(p[flat, 1] - p[flat, 0], p[flat, 2] - p[flat, 0]))[:, None]
    return found


def _in_plane(normal: Array, vector: Array) -> Array:
    return vector - normal * np.einsum("ti,ti->t", normal, vector)[:, None]


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1.0), vectors)
