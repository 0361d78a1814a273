# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair curves and particle hair as thin tubes, point clouds as balls: meshes with smooth normals."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import STRAND_AXIS, STRAND_PLACE, STRAND_RANDOM, STRAND_SIDES, STRAND_TANGENT, Mesh
from spectral_core.scene.geometry import Attribute

from ..shading.attributes import hashed_pair
from .carried import lengths_of, of_curves, of_points, on_emitter, radii_of
from .smooth import alike, smooth, straight

Array = NDArray[np.float64]

SIDES = STRAND_SIDES
WIDER = np.pi / (SIDES * np.sin(np.pi / SIDES))
"""Radius of a tube's vertices over that of its strand: seen from all sides, its mean width is the strand's."""
GOLDEN = (5**0.5 - 1) / 2
"""Part of a side by which a tube is turned against the one before, which spreads the angles of all strands evenly."""
STRAND_READS = (STRAND_TANGENT, STRAND_RANDOM, STRAND_PLACE, STRAND_AXIS)
"""Attributes of strands that materials read."""
BETWEEN = 3
"""Most added points between two points of a strand, along a smooth curve through them."""
MOST_TRIANGLES = 6_000_000
"""Most triangles of one object's hair or points; beyond it strands are straight between their points, then balls
coarser.
"""


def curves_mesh(name: str, curves: Any, reads: frozenset[str] = frozenset()) -> Mesh | None:
    """Tubes of a ``bpy.types.Curves``, in the object's space; None if it has none. ``reads``: see ``tubes``."""
    count = len(curves.points)
    if count == 0:
        return None
    points = np.empty(count * 3, np.float32)
    curves.attributes["position"].data.foreach_get("vector", points)
    radii, lengths = radii_of(curves), lengths_of(curves)
    places = np.where(np.isfinite(points), points, np.nan).reshape(-1, 3).astype(np.float64)  # as in ``radii_of``
    return tubes(name, places, radii.astype(np.float64), lengths, reads, of_curves(curves, reads, lengths, places))


def particle_mesh(
    name: str, obj: Any, system: Any, *, is_render: bool, reads: frozenset[str] = frozenset()
) -> Mesh | None:
    """Tubes of a hair system of an evaluated object, in the object's space; None if it grows none.

    ``reads``: see ``tubes``. ``is_render``: True if it was evaluated for a render, whose steps differ.
    """
    settings = system.settings
    count = len(system.particles) + len(system.child_particles)
    # as in Cycles, parents are never shown beside their children
    first = len(system.particles) if len(system.child_particles) else 0
    steps = 2 ** int(settings.render_step if is_render else settings.display_step) + 1
    steps += int(settings.kink_extra_steps) if settings.kink == "SPIRAL" else 0
    found = {number: _strand(system, obj, number, steps) for number in range(first, count)}
    grown = [number for number, strand in found.items() if len(strand) > 1]
    if not grown:
        return None
    # Blender gives positions in the world; radii are in the object's space, where its scale changes them
    object_from_world = np.linalg.inv(np.array(obj.matrix_world, dtype=np.float64))
    strands = [found[number] @ object_from_world[:3, :3].T + object_from_world[:3, 3] for number in grown]
    lengths = np.array([len(strand) for strand in strands])
    along = np.concatenate([_ways(strand) for strand in strands])
    radii = _thickness(along, settings)
    roots = np.stack([strand[0] for strand in strands])
    carried = {
        read: np.repeat(values, lengths, axis=0) for read, values in on_emitter(obj, system, grown, reads, roots)
    }
    return tubes(name, np.concatenate(strands), radii, lengths, reads, carried)


def _strand(system: Any, obj: Any, number: int, steps: int) -> Array:
    """Points of a strand. Shortened children end before their last step, beyond which Blender returns zeros."""
    points = np.array([system.co_hair(obj, particle_no=number, step=step) for step in range(steps)], dtype=np.float64)
    points = points[: np.flatnonzero(points.any(axis=1)).max(initial=0) + 1]
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9
    return points[np.concatenate([[True], moved])]


def _ways(strand: Array) -> Array:
    """Share of a strand's length at each of its points."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(strand, axis=0), axis=1))])
    return np.asarray(way / max(way[-1], 1e-30))


def _thickness(along: Array, settings: Any) -> Array:
    """Radius from root to tip, by the particle settings."""
    rest = 1.0 - along
    shape = float(settings.shape)
    if shape < 0:
        rest = rest ** (1.0 + shape)
    elif shape > 0:
        rest = rest ** (1.0 / max(1.0 - shape, 1e-3))
    root, tip = float(settings.root_radius), float(settings.tip_radius)
    radii = 0.5 * float(settings.radius_scale) * (rest * (root - tip) + tip)
    return np.where(along >= 1.0, 0.0, radii) if settings.use_close_tip else np.asarray(radii)


def tubes(
    name: str,
    points: Array,
    radii: Array,
    lengths: NDArray[Any],
    reads: frozenset[str] = frozenset(),
    carried: Mapping[str, Array] = MappingProxyType({}),
) -> Mesh | None:
    """Tubes around strands: points (n, 3), radii (n,), and the number of points of each strand, one after another.

    ``reads``: inputs that materials read, of which strands have their direction, their place, a random number and the
    larger axis of their cross-section; ``carried``: values (n, 3) of others at the points, UVs as ``"uv"``.
    """
    most = BETWEEN if len(points) * (BETWEEN + 1) * SIDES * 2 <= MOST_TRIANGLES else 0
    vertices, normals, triangles, start = [], [], [], 0
    read: dict[str, list[Array]] = {name: [] for name in (*STRAND_READS, *carried) if name in reads}
    for numbers, rows, between in alike(lengths, points, radii, most):
        strand, thickness = points[rows], radii[rows]
        if between:
            strand, thickness = smooth(strand, between), smooth(thickness[..., None], between)[..., 0]
        around = _circles(strand, numbers)
        made = strand[:, :, None] + around * (WIDER * np.maximum(thickness, 0.0))[:, :, None, None]
        count, rings = strand.shape[:2]
        vertices.append(made.reshape(-1, 3))
        normals.append(around.reshape(-1, 3))
        if STRAND_PLACE in read:
            read[STRAND_PLACE].append(_spread(_places(strand, thickness), around))
        if STRAND_AXIS in read:
            read[STRAND_AXIS].append(_spread(_axes(strand), around))
        if STRAND_TANGENT in read:
            read[STRAND_TANGENT].append(_spread(_tangents(strand), around))
        if STRAND_RANDOM in read:
            chance = np.array([hashed_pair(int(number), 0) / 0xFFFFFFFF for number in numbers])
            read[STRAND_RANDOM].append(_spread(chance[:, None, None] * np.ones((*strand.shape[:2], 3)), around))
        for item, values in carried.items():
            read[item].append(_spread(straight(values[rows], between), around))
        triangles.append(_faces(count, rings) + start)
        start += count * rings * SIDES
    if not vertices:
        return None
    positions = np.concatenate(vertices)
    keep = np.isfinite(positions).all(axis=1)
    faces = np.concatenate(triangles)
    faces = faces[keep[faces].all(axis=1)]
    positions, directions = np.nan_to_num(positions), np.nan_to_num(np.concatenate(normals))
    at_vertices = {key: np.nan_to_num(np.concatenate(values)) for key, values in read.items()}
    uvs = at_vertices.pop("uv", None)
    return Mesh(
        name,
        positions.astype(np.float32),
        faces.astype(np.uint32),
        normals=directions.astype(np.float32),
        uvs=_no_uvs(reads, len(positions)) if uvs is None else uvs[:, :2].astype(np.float32),
        attributes=tuple(Attribute(key, values.astype(np.float32)) for key, values in at_vertices.items()),
        is_strands=True,
    )


def _no_uvs(reads: frozenset[str], count: int) -> NDArray[np.float32] | None:
    """Zeros (count, 2) where materials read UVs that strands or points do not have: 0 in Cycles.

    A mesh without UVs would show the parametric coordinates of its triangles.
    """
    return np.zeros((count, 2), np.float32) if "uv" in reads else None


def _places(strand: Array, thickness: Array) -> Array:
    """Share of a strand before each point, the strand's length, and the thickness: (count, k, 3)."""
    steps = np.linalg.norm(np.diff(strand, axis=1), axis=-1)
    way = np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))
    length = way[:, -1:]
    return np.stack(np.broadcast_arrays(way / np.maximum(length, 1e-30), length, 2 * thickness), axis=-1)


def _spread(values: Array, around: Array) -> Array:
    """Values at the points of strands (count, k, 3) at every vertex of their rings."""
    return np.broadcast_to(values[:, :, None], around.shape).reshape(-1, 3)


def _circles(strand: Array, numbers: NDArray[Any]) -> Array:
    """Unit vectors (count, k, SIDES, 3) around each point, perpendicular to the strand, transported without twist.

    Each strand (``numbers``: which) begins at another angle: parallel tubes would all be too wide, or too narrow,
    from one direction, and much more or less light would pass between them.
    """
    tangent = _tangents(strand)
    start = tangent[:, 0]
    axis = np.where(np.abs(start[:, 2:3]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    across = _carried(tangent, np.cross(start, axis))[:, :, None]
    other = np.cross(tangent[:, :, None], across)
    turn = (np.arange(SIDES) + (numbers * GOLDEN % 1.0)[:, None]) * (2 * np.pi / SIDES)
    return np.asarray(across * np.cos(turn)[:, None, :, None] + other * np.sin(turn)[:, None, :, None])


def _axes(strand: Array) -> Array:
    """Normals (count, k, 3) of least twist, as Blender computes them; cross-sections are wider along these."""
    tangent = _tangents(strand)
    level = np.stack([tangent[:, 0, 1], -tangent[:, 0, 0], np.zeros(len(tangent))], axis=-1)
    upright = np.linalg.norm(level, axis=-1, keepdims=True) < 1e-4
    return _carried(tangent, np.where(upright, [1.0, 0.0, 0.0], level))


def _carried(tangent: Array, start: Array) -> Array:
    """Unit vectors perpendicular to a strand's directions (count, k, 3), from those at its start (count, 3) on."""
    result, across = np.empty_like(tangent), start.astype(np.float64)
    for k in range(tangent.shape[1]):
        across = across - tangent[:, k] * np.sum(across * tangent[:, k], axis=-1, keepdims=True)
        across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-30)
        result[:, k] = across
    return result


def _tangents(strand: Array) -> Array:
    """Unit directions (count, k, 3) of strands at their points."""
    tangent = np.gradient(strand, axis=1)
    return np.asarray(tangent / np.maximum(np.linalg.norm(tangent, axis=-1, keepdims=True), 1e-30))


def _faces(count: int, rings: int) -> NDArray[np.int64]:
    """Triangles of tubes with vertices in rings."""
    side = np.arange(SIDES)
    ring = np.arange(rings - 1)[:, None] * SIDES
    a, b = ring + side, ring + (side + 1) % SIDES
    one = np.stack([np.stack([a, b, b + SIDES], -1), np.stack([a, b + SIDES, a + SIDES], -1)], axis=2).reshape(-1, 3)
    return np.asarray((np.arange(count)[:, None, None] * rings * SIDES + one).reshape(-1, 3))


def points_mesh(name: str, cloud: Any, reads: frozenset[str] = frozenset()) -> Mesh | None:
    """Balls of a ``bpy.types.PointCloud``; ``reads``: attributes of its points that materials use.

    As in Cycles, points of a negative radius are not seen.
    """
    count = len(cloud.points)
    if count == 0:
        return None
    places = np.empty(count * 3, np.float32)
    cloud.attributes["position"].data.foreach_get("vector", places)
    radii = radii_of(cloud)
    finer = next((k for k in (3, 2, 1) if count * 20 * 4**k <= MOST_TRIANGLES), 0)
    directions, faces = ball(finer)
    size = radii.astype(np.float64)
    places = np.where(np.isfinite(places), places, np.float32(np.nan))
    positions = places.reshape(-1, 1, 3) + size[:, None, None] * directions
    triangles = faces + np.arange(count)[:, None, None] * len(directions)
    normals = np.broadcast_to(directions, positions.shape)
    shown = np.isfinite(positions).all(axis=(1, 2)) & ~(size < 0)
    positions = np.where(shown[:, None, None], positions, 0.0)
    placed = {read: positions for read in ("generated",) if read in reads}  # as in Cycles: the position itself
    return Mesh(
        name,
        positions.reshape(-1, 3).astype(np.float32),
        triangles[shown].reshape(-1, 3).astype(np.uint32),
        normals=normals.reshape(-1, 3).astype(np.float32),
        uvs=_no_uvs(reads, normals.shape[0] * normals.shape[1]),
        attributes=tuple(
            Attribute(read, np.repeat(values, len(directions), axis=0))
            for read, values in of_points(cloud, reads, places, radii)
        )
        + tuple(Attribute(read, values.reshape(-1, 3)) for read, values in placed.items()),
    )


def ball(finer: int) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (v, 3) of a unit sphere and its triangles: an icosahedron, each face divided into four ``finer``
    times.
    """
    golden = (1 + 5**0.5) / 2
    corners = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)]
    vertices = np.array([np.roll(corner, shift) for shift in range(3) for corner in corners], dtype=np.float64)
    vertices /= np.linalg.norm(vertices[0])
    # faces: all triples of mutual neighbors, turned outward
    near = np.isclose(np.linalg.norm(vertices[:, None] - vertices[None], axis=-1), 2 / np.sqrt(golden * 5**0.5))
    triples = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    faces = np.array(triples)
    for _ in range(finer):
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        middles = np.stack([a + b, b + c, c + a], axis=1)
        middles /= np.linalg.norm(middles, axis=-1, keepdims=True)
        every = np.concatenate([np.stack([a, b, c], axis=1), middles], axis=1)
        cut = np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)])
        _, first, faces_of = np.unique(every.reshape(-1, 3).round(9), axis=0, return_index=True, return_inverse=True)
        numbers = faces_of.reshape(-1, 6)
        vertices, faces = every.reshape(-1, 3)[first], numbers[:, cut].reshape(-1, 3)
    outward = np.einsum(
        "fi,fi->f", np.cross(*(vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))), vertices[faces[:, 0]]
    )
    faces = np.where((outward > 0)[:, None], faces, faces[:, ::-1])
    return vertices, faces
