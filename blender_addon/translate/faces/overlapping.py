# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that overlap in one plane: at each point Cycles meets one of them by chance, and darkens both."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Mesh, Scene
from spectral_core.scene.geometry import placed, placed_by_mesh

from .shared_areas import Array, Indices, shared_areas, touching

LARGE_SHARE = 0.01
"""Least share of an instance's area in one plane, and of the smaller one's area that overlaps."""
MOST_TRIANGLES = 300_000
"""Triangles of one scene that are compared, those of small meshes first."""
MOST_IN_PLANE = 1000
"""Triangles of an instance in one plane that are compared; of more, as many stand for all."""
MOST_PAIRS = 300_000
"""Pairs of triangles that are compared."""
MOST_LIT = 200
"""Pairs of instances for which rays test whether light reaches the faces that overlap."""
STEP = 1e-6
"""Distance of two faces, relative to the largest coordinate, at which Cycles still meets one of them by chance."""
BUCKETS = 1 << 18
"""Planes are told apart by a number below this power of two; those of little area that share one do not matter."""
MULTIPLES = np.array([73856093, 19349663, 83492791, 49979687], np.int64)
"""Odd numbers without a pattern."""
NORMAL_STEP, OFFSET_STEP = 1.0317e-3, 1.0171e-4
"""Coordinates of normals, and offsets relative to the largest coordinate, are rounded to these: no round numbers."""
SLANT = np.array([0.0831, 0.0573, 0.0711])
"""Added to the normal for the direction of a ray, so that it meets no edge of faces along the axes."""


@dataclass(frozen=True, slots=True, eq=False)
class _Faces:
    """Triangles (3, t) of ``points`` (3, n) in the world, with the ``owner`` (t,), an instance, in blocks; unit normals
    (3, t) and areas.
    """

    points: NDArray[np.float32]
    triangles: Indices
    owner: Indices
    normals: NDArray[np.float32]
    areas: NDArray[np.float32]
    scale: float

    def only(self, chosen: Any) -> _Faces:
        """Some of the faces."""
        return _Faces(
            self.points,
            self.triangles[:, chosen],
            self.owner[chosen],
            self.normals[:, chosen],
            self.areas[chosen],
            self.scale,
        )

    def corners(self, chosen: Any = slice(None)) -> Array:
        """Corners (t, 3, 3) of some of the faces."""
        return np.take(self.points, self.triangles[:, chosen], axis=1).astype(np.float64).T


@dataclass(frozen=True, slots=True, eq=False)
class _Overlap:
    """The ``area`` that faces of two instances share; two of the faces, and a point in what those share."""

    area: float
    faces: tuple[int, int]
    middle: Array


def overlapping(scene: Scene, meshes: dict[str, Mesh]) -> Iterator[tuple[str, str]]:
    """Names of instances with faces that overlap others in one plane, each with the other one, or itself.

    Faces that look to opposite sides touch, as a box does its floor, unless light reaches both sides. Instances of
    media alone have no faces that could be darkened.
    """
    every = _faces(scene, meshes)
    if every is None:
        return
    whole: Array = np.bincount(every.owner, every.areas, len(scene.instances)).astype(np.float64)
    found, planes = _in_large_planes(every, whole)
    step, named, left = STEP * every.scale, set[int](), MOST_LIT
    begins = np.flatnonzero(np.diff(every.owner, prepend=-1, append=-1))
    faces_of = dict(zip(every.owner[begins[:-1]].tolist(), itertools.pairwise(begins.tolist()), strict=True))
    for overlap in _overlaps(found, planes, step):
        first, second = sorted(int(found.owner[number]) for number in overlap.faces)
        if second in named or overlap.area < LARGE_SHARE * min(whole[first], whole[second]):
            continue
        if left == 0:
            return
        left -= 1
        around = every.corners(np.concatenate([np.arange(*faces_of[owner]) for owner in {first, second}]))
        sides = [found.normals[:, number].astype(np.float64) for number in overlap.faces]
        if all(_crossings(around, overlap.middle, side, 10.0 * step) % 2 == 0 for side in sides):
            named.add(second)
            yield scene.instances[second].name, scene.instances[first].name


def _faces(scene: Scene, meshes: dict[str, Mesh]) -> _Faces | None:
    """Faces of the instances with the smallest meshes, up to a limit; None if there are none."""
    media = {material.name for material in scene.materials if material.surface is None}
    counts = np.array([len(meshes[item.mesh].triangles) for item in scene.instances], np.intp)
    order = np.argsort(counts, kind="stable")
    few = order[(np.cumsum(counts[order]) <= MOST_TRIANGLES) & (counts[order] > 0)].tolist()
    numbers = [n for n in few if not (kinds := scene.instances[n].materials) or not media.issuperset(kinds)]
    if not numbers:
        return None
    points, triangles, owners, start = [], [], [], 0
    for name, (places, matrices) in placed_by_mesh(scene.instances[n] for n in numbers).items():
        mesh, count = meshes[name], len(meshes[name].positions)
        points.append(placed(mesh.positions, matrices).reshape(-1, 3).T.astype(np.float32))
        begins = np.arange(start, start + count * len(places), count)
        triangles.append((mesh.triangles.T[:, None] + begins[:, None]).reshape(3, -1))
        owners.append(np.repeat([numbers[place] for place in places], len(mesh.triangles)))
        start += count * len(places)
    return _measured(np.concatenate(points, axis=1), np.concatenate(triangles, axis=1), np.concatenate(owners))


def _measured(points: NDArray[np.float32], triangles: Indices, owners: Indices) -> _Faces:
    """Faces with their normals and areas."""
    first, *others = (np.take(points, corner, axis=1) for corner in triangles)
    (x, y, z), (u, v, w) = (other - first for other in others)
    normals = np.stack([y * w - z * v, z * u - x * w, x * v - y * u])
    doubled = np.sqrt(np.einsum("it,it->t", normals, normals))
    normals /= np.maximum(doubled, np.finfo(np.float32).tiny)
    scale = max(float(np.abs(corner).max()) for corner in (first, *others))
    return _Faces(points, triangles, owners, normals, doubled / 2, scale)


def _cross(one: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """Cross products (t, 3), several times as fast as NumPy's own."""
    (x, y, z), (u, v, w) = one.T, other.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def _in_large_planes(every: _Faces, whole: Array) -> tuple[_Faces, Indices]:
    """Faces in planes with much of the area of their instance, and a number (t,) of each one's plane."""
    sign = np.where(SLANT.astype(np.float32) @ every.normals < 0.0, np.float32(-1), np.float32(1))
    offsets = np.einsum("it,it->t", every.normals, np.take(every.points, every.triangles[0], axis=1))
    offsets /= max(1e-30, every.scale) * OFFSET_STEP
    keys = np.rint(offsets * sign).astype(np.int64) * MULTIPLES[3]
    for axis in range(3):
        keys += np.rint(every.normals[axis] * (sign / NORMAL_STEP)).astype(np.int64) * MULTIPLES[axis]
    buckets = (keys + every.owner * 7368787) & (BUCKETS - 1)
    sums = np.bincount(buckets, every.areas, BUCKETS)
    large = np.flatnonzero((sums[buckets] > LARGE_SHARE * whole[every.owner]) & (every.areas > 0.0))
    # of a fine grid, some faces stand for all, with its area
    order = large[np.argsort(buckets[large], kind="stable")]
    _, start, count = np.unique(buckets[order], return_index=True, return_counts=True)
    stride = -(-np.repeat(count, count) // MOST_IN_PLANE)
    kept = (np.arange(len(order)) - np.repeat(start, count)) % stride == 0
    order, stride = order[kept], stride[kept]
    found = every.only(order)
    return replace(found, areas=found.areas * stride), np.unique(keys[order], return_inverse=True)[1].ravel()


def _overlaps(found: _Faces, planes: Indices, step: float) -> list[_Overlap]:
    """What pairs of instances share in all planes, of faces of one side and of opposite sides, the largest first."""
    corners = found.corners()
    first, second, third = (corners[:, k] for k in range(3))
    low = np.minimum(np.minimum(first, second), third) - step
    high = np.maximum(np.maximum(first, second), third) + step
    one, other = _not_adjacent(found, *touching(np.stack([low, high], axis=1), planes, MOST_PAIRS))
    larger = np.where(found.areas[one] < found.areas[other], other, one)  # its normal is the more exact one
    centers = (first + second + third) / 3.0
    normals = found.normals.T[larger].astype(np.float64)
    level = np.abs(np.einsum("pi,pi->p", normals, centers[one] - centers[other])) < step
    one, other, normals = one[level], other[level], normals[level]
    # areas of projections along the axis that is nearest to the normal
    axis = np.abs(normals).argmax(axis=1)[:, None]
    kept = np.array([[1, 2], [0, 2], [0, 1]])[axis[:, 0]]
    flat = [np.take_along_axis(corners[side], kept[:, None, :], axis=2) for side in (one, other)]
    shared, middles = shared_areas(flat[0], flat[1], step)
    stands_for = [found.areas[side] / np.maximum(_area(corners[side]), 1e-300) for side in (one, other)]
    shared *= np.maximum(*stands_for) / np.abs(np.take_along_axis(normals, axis, 1)[:, 0])
    sums: dict[tuple[int, int, bool], float] = {}
    largest: dict[tuple[int, int, bool], int] = {}
    opposite = np.einsum("ip,ip->p", found.normals[:, one], found.normals[:, other]) < 0.0
    for pair in np.flatnonzero(shared > 0.0)[np.argsort(-shared[shared > 0.0])].tolist():
        ends = sorted((int(found.owner[one[pair]]), int(found.owner[other[pair]])))
        key = ends[0], ends[1], bool(opposite[pair])
        sums[key] = sums.get(key, 0.0) + float(shared[pair])
        largest.setdefault(key, pair)
    made = []
    for key, pair in largest.items():
        middle, normal, third = centers[one[pair]].copy(), normals[pair], axis[pair, 0]
        middle[kept[pair]] = middles[pair]
        middle[third] -= normal @ (middle - centers[one[pair]]) / normal[third]
        made.append(_Overlap(sums[key], (int(one[pair]), int(other[pair])), middle))
    return sorted(made, key=lambda overlap: -overlap.area)


def _not_adjacent(found: _Faces, one: Indices, other: Indices) -> tuple[Indices, Indices]:
    """The pairs but those on the two sides of a common edge, as the halves of a square: they share nothing."""
    first, second = found.triangles[:, one], found.triangles[:, other]
    adjacent = np.zeros(len(one), bool)
    for a, b in itertools.product(range(3), repeat=2):
        adjacent |= (first[a] == second[b - 2]) & (first[a - 2] == second[b])
    adjacent &= np.einsum("ip,ip->p", found.normals[:, one], found.normals[:, other]) > 0.0
    return one[~adjacent], other[~adjacent]


def _area(corners: Array) -> Array:
    cross = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.sqrt(np.einsum("ti,ti->t", cross, cross)) / 2)


def _crossings(triangles: Array, origin: Array, normal: Array, step: float) -> int:
    """Number of triangles (t, 3, 3) that a ray meets which leaves a plane near its normal."""
    direction = normal + SLANT
    base, one, other = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = _cross(np.broadcast_to(direction, other.shape), other)
    scale = np.einsum("ti,ti->t", one, across)
    inverse = 1.0 / np.where(scale == 0.0, np.inf, scale)
    away = origin - base
    u = np.einsum("ti,ti->t", away, across) * inverse
    turned = _cross(away, one)
    v = turned @ direction * inverse
    distance = np.einsum("ti,ti->t", other, turned) * inverse
    return int(np.count_nonzero((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance > step)))
