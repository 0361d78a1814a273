# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of objects that lie on each other, where light passes: Cycles meets one of the two by chance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
        triangles = _triangles(meshes[item.mesh], item)
        planes = _planes(triangles)
        own = boxes[places[item.name]]
        meet = np.flatnonzero(np.all((own[0] <= boxes[:, 1]) & (boxes[:, 0] <= own[1]), axis=1))
        for other in (scene.instances[place] for place in meet if place != places[item.name]):
            if counts[other.mesh] > MOST_TRIANGLES or left <= 0:
                continue
            left -= counts[other.mesh]
            if lies_on(planes, _triangles(meshes[other.mesh], other)):
                yield item.name, other.name
                break
        else:
            if _lies_on_itself(planes, triangles):
                yield item.name, item.name


def edges(triangles: Array) -> tuple[Array, Array]:
    """Two edges of each triangle (t, 3, 3), whose cross product is the normal times twice the area."""
    return triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]


def _triangles(mesh: Mesh, item: Instance) -> Array:
    """Corners (t, 3, 3) in the world."""
    return placed(mesh.positions.astype(np.float64), item.world_from_object)[mesh.triangles]


def _ends(points: Array) -> Array:
    """Lowest and highest coordinates (2, 3) of points, with the distance from which rays start."""
    if not len(points):
        return np.array([(np.inf,) * 3, (-np.inf,) * 3])
    step = RAY_STEP * (1.0 + np.abs(points).max())
    return np.array([points.min(axis=0) - step, points.max(axis=0) + step])


def _planes(triangles: Array) -> list[_Plane]:
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
    """True if a face of other triangles lies on one of the planes, beside a face of the first ones."""
    return any(bool(np.any(np.all(plane.shared(triangles[plane.has(triangles)]) >= 0.0, axis=2))) for plane in planes)


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
