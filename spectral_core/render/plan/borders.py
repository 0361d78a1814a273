# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that rays pass and that share a plane with other faces: fog or a transparent box on the floor.

A ray that passes a face continues a short way behind it, so that it does not meet the same face again. It would not
meet another face in the same plane either: the ray would stay in a medium that it has left, or pass the floor. Borders
of media, transparent bodies and bodies that are hidden from some rays are therefore drawn in by a few such lengths,
several in one plane by different ones.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plan.inventory import is_transparent, media_borders
from spectral_core.scene import Instance, Rays, Scene
from spectral_core.scene.geometry import Mesh, box_of, placed, placed_boxes

Array = NDArray[np.float64]

OFFSET = 1500 * 2.0**-24
"""Length by which Mitsuba moves the start of a ray from its surface, over 1 plus the largest coordinate."""
APART = 3.0
"""Distance between faces that shared a plane, in such lengths."""
MOST_FACES = 256
"""Triangles of a mesh whose own planes are compared; of one with more, those of the box around it."""
MOST_BODIES, MOST_NEIGHBORS = 500, 64
"""Transparent or hidden bodies of a scene that are drawn in, and the largest objects beside each that it is compared
with, so that a forest of leaves does not delay a render.
"""
MOST_STEPS = 3
"""Most steps by which a transparent or hidden body is drawn in: many in one plane would shrink visibly."""
_SEEN_BY = Rays.ALL & ~Rays.SHADOW
_PARALLEL = 1e-5
"""1 minus the cosine of the angle between normals that count as equal."""
_SIDES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
"""Corners of each side of a box, as ``box_of`` orders them."""


def with_borders_apart(scene: Scene) -> Scene:
    """``scene`` with the faces that rays pass drawn in where they share a plane with others; itself if none does."""
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    borders = _borders(scene, meshes)
    bodies = _bodies(scene, meshes, borders)
    if not borders and not bodies:
        return scene
    boxes = placed_boxes(scene.meshes, scene.instances)
    ends = np.array([(box.min(axis=0), box.max(axis=0)) if len(box) else np.full((2, 3), np.inf) for box in boxes])
    planes: dict[int, Array] = {}

    def planes_of(number: int) -> Array:
        if number not in planes:
            planes[number] = _planes(meshes, scene.instances[number], boxes[number])
        return planes[number]

    moved: dict[int, Instance] = {}
    for number in (*borders, *bodies):
        least = APART * OFFSET * (1 + float(np.abs(ends[number]).max()))
        near = np.all((ends[:, 0] <= ends[number, 1] + least) & (ends[:, 1] >= ends[number, 0] - least), axis=1)
        others = np.flatnonzero(near)
        if number in bodies and len(others) > MOST_NEIGHBORS:
            sizes = np.linalg.norm(ends[others, 1] - ends[others, 0], axis=1)
            others = others[np.argsort(-sizes)[:MOST_NEIGHBORS]]
        beside = [
            planes_of(other) for other in map(int, others)
            if other != number
            and (other in moved or not (other in borders or (number in bodies and other in bodies)))
        ]  # fmt: skip
        moved[number] = scene.instances[number]
        box = box_of(meshes[moved[number].mesh])
        most = MOST_STEPS if number in bodies else len(beside) + 1
        # a face that is drawn in may come near another one: each place is compared again
        for count in range(1, most + 1):
            if not any(_share(planes_of(number), each, least) for each in beside):
                break
            moved[number] = _drawn_in(scene.instances[number], box, count * least)
            planes[number] = _planes(meshes, moved[number], placed(box, moved[number].world_from_object))
    instances = tuple(moved.get(number, item) for number, item in enumerate(scene.instances))
    is_same = all(one is other for one, other in zip(instances, scene.instances, strict=True))
    return scene if is_same else replace(scene, instances=instances)


def _borders(scene: Scene, meshes: dict[str, Mesh]) -> dict[int, Instance]:
    """The instances, by their numbers, that are borders of media alone."""
    materials = media_borders(scene)
    return {
        number: item for number, item in enumerate(scene.instances)
        if item.materials and materials.issuperset(item.materials) and len(meshes[item.mesh].positions)
    }  # fmt: skip


def _bodies(scene: Scene, meshes: dict[str, Mesh], borders: dict[int, Instance]) -> frozenset[int]:
    """Numbers of the instances whose surfaces some rays pass: transparent ones, and those that are hidden from rays."""
    transparent = {item.name for item in scene.materials if item.surface is not None and is_transparent(item)}
    passed = (
        number for number, item in enumerate(scene.instances)
        if number not in borders
        and (item.hidden_from & _SEEN_BY or not transparent.isdisjoint(item.materials))
        and len(meshes[item.mesh].positions)
        and not meshes[item.mesh].is_strands
    )  # fmt: skip
    return frozenset(islice(passed, MOST_BODIES))


def _planes(meshes: dict[str, Mesh], instance: Instance, box: Array) -> Array:
    """(k, 4): normals and offsets of an instance's planes in the world."""
    mesh = meshes[instance.mesh]
    if len(mesh.triangles) <= MOST_FACES:
        matrix = instance.world_from_object
        points = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
        corners = points[mesh.triangles.astype(np.int64)]
    else:
        corners = box[np.array(_SIDES)][:, :3]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals, first = normals[lengths > 0] / lengths[lengths > 0, None], corners[lengths > 0, 0]
    return np.concatenate([normals, np.sum(normals * first, axis=1)[:, None]], axis=1)


def _share(one: Array, other: Array, least: float) -> bool:
    """True if any two planes of both lists are nearer than ``least``, whichever side they face."""
    cosines = one[:, :3] @ other[:, :3].T
    apart = np.abs(one[:, 3:] * np.sign(cosines) - other[:, 3])
    return bool(np.any((np.abs(cosines) > 1 - _PARALLEL) & (apart < least)))


def _drawn_in(instance: Instance, box: Array, inward: float) -> Instance:
    """An instance whose sides are moved toward the middle of its box by ``inward``, along each axis that has room."""
    matrix = instance.world_from_object
    low, high = box.min(axis=0), box.max(axis=0)
    half = np.linalg.norm(matrix[:3, :3], axis=0) * (high - low) / 2
    scale = np.where(half > 4 * inward, 1 - inward / np.maximum(half, 1e-300), 1.0)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = np.diag(scale), (1 - scale) * (low + high) / 2
    return replace(instance, world_from_object=matrix @ moved)
