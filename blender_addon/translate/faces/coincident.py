# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that lie on others where light passes, or that are there twice: Cycles hits one of the two by chance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Instance, Mesh, Scene
from spectral_core.scene.geometry import placed, placed_boxes

Array = NDArray[np.float64]

MOST_TRIANGLES, MOST_PLANES = 20_000, 32
"""Triangles of a mesh, and its planes of the largest area, that are compared with those of other meshes."""
MOST_COMPARED = 1_000_000
"""Boxes and triangles that are compared in one scene, so that thousands of instances do not delay a render."""
MOST_PAIRS = 1 << 20
"""Pairs of faces in one plane that are compared one by one; of more, the box of all faces counts."""
LARGE_SHARE = 0.01
"""Share of a mesh's area from which the faces in one plane are compared, however small each of them is."""
RAY_STEP = 1e-4
"""Distance to a surface from which rays start, relative to the coordinates plus 1."""
MOST_DOUBLED = 300_000
"""Triangles of one scene among which doubled ones are looked for."""
FOLDED = 1e-4
"""Largest difference of directions of two faces from their edge at which one lies on the other."""
MOST_AT_EDGE = 8
"""Faces at an edge that are compared with each other."""
MULTIPLES = np.array([6364136223846793005, 1442695040888963407, 3935559000370003845], np.int64)
"""Odd numbers without a pattern."""
NORMAL_STEP = 1e-3
"""Normals and offsets are rounded to find faces in one plane: these are steps of a normal's coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class _Plane:
    """Faces of a mesh in one plane: ``normal`` · p = ``offset``; ``boxes``: (k, 2, 3) of its faces, padded by
    ``step``, the distance within which a point lies on it.
    """

    normal: Array
    offset: float
    boxes: Array
    step: float

    def has(self, triangles: Array) -> NDArray[np.bool_]:
        """(t,): True for triangles that lie on the plane."""
        return np.asarray((np.abs(triangles @ self.normal - self.offset) < self.step).all(axis=1))

    def shared(self, triangles: Array) -> Array:
        """Lengths (k, t, 3) that the boxes of the faces and those of triangles have in common, negative for a gap."""
        low, high = triangles.min(axis=1), triangles.max(axis=1)
        boxes = self.boxes
        if len(boxes) * len(triangles) > MOST_PAIRS:
            boxes = np.array([[boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]])
        return np.asarray(np.minimum(boxes[:, None, 1], high) - np.maximum(boxes[:, None, 0], low))


def coincident(scene: Scene, meshes: dict[str, Mesh], materials: set[str]) -> Iterator[tuple[str, str]]:
    """Names of instances with some of the materials, each with one (or itself) that faces of it lie on."""
    chosen = [item for item in scene.instances if materials.intersection(item.materials)]
    if not chosen:
        return
    counts = {name: len(mesh.triangles) for name, mesh in meshes.items()}
    boxes = np.array([_ends(box) for box in placed_boxes(scene.meshes, scene.instances)])
    places = {item.name: place for place, item in enumerate(scene.instances)}
    left = MOST_COMPARED
    for item in chosen:
        left -= len(boxes) + counts[item.mesh]
        if left <= 0:
            return
        if not 0 < counts[item.mesh] <= MOST_TRIANGLES:
            continue
        triangles = triangles_of(meshes[item.mesh], item)
        planes = planes_of(triangles)
        own = boxes[places[item.name]]
        meet = np.flatnonzero(np.all((own[0] <= boxes[:, 1]) & (boxes[:, 0] <= own[1]), axis=1))
        for other in (scene.instances[place] for place in meet if place != places[item.name]):
            if counts[other.mesh] > MOST_TRIANGLES or left <= 0:
                continue
            left -= counts[other.mesh]
            if lies_on(planes, triangles_of(meshes[other.mesh], other)):
                yield item.name, other.name
                break
        else:
            if _lies_on_itself(planes, triangles):
                yield item.name, item.name


def doubled(scene: Scene, meshes: dict[str, Mesh]) -> Iterator[tuple[str, str]]:
    """Names of instances with faces that are there twice, each with the other one (or itself) that has them.

    Instances of media alone have no faces that could be darkened.
    """
    media = {material.name for material in scene.materials if material.surface is None}
    left = MOST_DOUBLED
    of_itself: dict[str, bool] = {}
    same_place: dict[bytes, list[Instance]] = {}
    for item, box in zip(scene.instances, placed_boxes(scene.meshes, scene.instances), strict=True):
        mesh = meshes[item.mesh]
        if not 0 < len(mesh.triangles) <= MOST_TRIANGLES or (item.materials and media.issuperset(item.materials)):
            continue
        if item.mesh not in of_itself:
            left -= len(mesh.triangles)
            of_itself[item.mesh] = left > 0 and has_twice(mesh.positions.astype(np.float64), mesh.triangles)
        if not (is_twice := of_itself[item.mesh]) and _flattens(item.world_from_object):
            left -= len(mesh.triangles)  # faces on opposite sides meet only here
            is_twice = left > 0 and has_twice(placed(mesh.positions, item.world_from_object), mesh.triangles)
        if is_twice:
            yield item.name, item.name
        else:
            same_place.setdefault(_ends(box).round(6).tobytes(), []).append(item)
    for first, *others in same_place.values():
        for other in others:
            pair = [triangles_of(meshes[item.mesh], item).reshape(-1, 3) for item in (first, other)]
            points = np.concatenate(pair)
            left -= len(points) // 3
            if left > 0 and has_twice(points, np.arange(len(points)).reshape(-1, 3)):
                yield other.name, first.name


def _flattens(world_from_object: Array) -> bool:
    """True for a scale of 0 along an axis."""
    sizes = np.linalg.svd(world_from_object[:3, :3], compute_uv=False)
    return bool(sizes[-1] < FOLDED * sizes[0])


def has_twice(points: Array, triangles: NDArray[Any]) -> bool:
    """True if triangles (t, 3) of points with a large share of the area lie on others that share an edge with them."""
    step = 0.1 * RAY_STEP * (1.0 + np.abs(points).max())
    # one number for each position, and the sum of two for an edge: multiples that wrap around at 64 bits
    cells = np.round(points / step).astype(np.int64) @ MULTIPLES
    corners = points[triangles]
    found, keys, inward = [], [], []
    for first, second, third in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        along = corners[:, second] - corners[:, first]
        side = corners[:, third] - corners[:, first]
        share = np.einsum("ti,ti->t", side, along) / np.maximum(np.einsum("ti,ti->t", along, along), 1e-300)
        side -= share[:, None] * along
        length = np.sqrt(np.einsum("ti,ti->t", side, side))
        used = np.flatnonzero(length > 10.0 * step)  # of thinner triangles the direction is unknown
        found.append(used)
        keys.append((cells[triangles[:, first]] + cells[triangles[:, second]])[used])
        inward.append(side[used] / length[used, None])
    number, edge, direction = np.concatenate(found), np.concatenate(keys), np.concatenate(inward)
    order = np.argsort(edge)
    twice = []
    for apart in range(1, MOST_AT_EDGE):
        one, other = order[:-apart], order[apart:]
        same = edge[one] == edge[other]
        if not same.any():
            break
        one, other = one[same], other[same]
        folded = np.abs(direction[one] - direction[other]).max(axis=1, initial=0.0) < FOLDED
        twice += [number[one[folded]], number[other[folded]]]
    lying = np.unique(np.concatenate([number[:0], *twice]))
    if not len(lying):
        return False
    areas = np.linalg.norm(np.cross(*edges(corners)), axis=1)
    return float(areas[lying].sum()) > LARGE_SHARE * float(areas.sum())


def edges(triangles: Array) -> tuple[Array, Array]:
    """Two edges of each triangle (t, 3, 3), whose cross product is the normal times twice the area."""
    return triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]


def triangles_of(mesh: Mesh, item: Instance) -> Array:
    """Corners (t, 3, 3) in the world."""
    return placed(mesh.positions.astype(np.float64), item.world_from_object)[mesh.triangles]


def _ends(points: Array) -> Array:
    """Lowest and highest coordinates (2, 3) of points, with the distance from which rays start."""
    if not len(points):
        return np.array([(np.inf,) * 3, (-np.inf,) * 3])
    step = RAY_STEP * (1.0 + np.abs(points).max())
    return np.array([points.min(axis=0) - step, points.max(axis=0) + step])


def planes_of(triangles: Array) -> list[_Plane]:
    """The planes whose faces, together, are a large share of the area, the largest first."""
    crosses = np.cross(*edges(triangles))
    area = np.linalg.norm(crosses, axis=1)
    kept = area > 0.0
    triangles, area = triangles[kept], area[kept]
    normals = crosses[kept] / area[:, None]
    if not len(area):
        return []
    step = RAY_STEP * (1.0 + np.abs(triangles).max())
    offsets = np.einsum("ti,ti->t", normals, triangles[:, 0])
    keys = np.round(np.column_stack([normals / NORMAL_STEP, offsets / (10.0 * step)]))
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    sums = np.bincount(group, area)
    found = []
    for number in np.argsort(-sums)[:MOST_PLANES]:
        if sums[number] <= LARGE_SHARE * area.sum():
            break
        members = triangles[group == number]
        boxes = np.stack([members.min(axis=1) - step, members.max(axis=1) + step], axis=1)
        found.append(_Plane(normals[first[number]], float(offsets[first[number]]), boxes, step))
    return found


def lies_on(planes: list[_Plane], triangles: Array) -> bool:
    """True if a face of other triangles lies on one of the planes, and on a face of the first ones; tiles that only
    touch at an edge do not.
    """
    for plane in planes:
        shared = plane.shared(triangles[plane.has(triangles)])
        # boxes of faces that touch share no more than their padding along the direction from one to the other
        if np.any((shared >= 0.0).all(axis=2) & ((shared > 3.0 * plane.step).sum(axis=2) >= 2)):
            return True
    return False


def _lies_on_itself(planes: list[_Plane], triangles: Array) -> bool:
    """True if faces of a mesh lie on each other, back to back."""
    crosses = np.cross(*edges(triangles))
    for plane in planes:
        back = triangles[plane.has(triangles) & (crosses @ plane.normal < 0.0)]
        # faces that touch at an edge have boxes that share less than this
        least = LARGE_SHARE * (plane.boxes[:, 1] - plane.boxes[:, 0]).max(axis=1).min()
        if np.any((plane.shared(back) > max(least, 3.0 * plane.step)).sum(axis=2) >= 2):
            return True
    return False
