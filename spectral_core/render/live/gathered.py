# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattered copies of a mesh as one mesh: each instance of a scene adds to the time of every launch.

Dr.Jit visits each of Mitsuba's instances before it replays a recorded launch, so that 5,000 of them take longer than
the launch itself. Copies that look alike wherever they are become one mesh in the world, in views only.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.emission import is_dark
from spectral_core.scene import Instance, Material, Mesh, Scene
from spectral_core.scene.geometry import Attribute
from spectral_core.scene.leaves import leaves, mesh_inputs_of, programs_of
from spectral_core.scene.shading import SENDS_RAYS
from spectral_core.scene.surface import Closure, Subsurface

FEWEST = 64
"""Copies from which a mesh is gathered: fewer cost less than the loss of single objects that can be moved."""
MOST_TRIANGLES = 3_000_000
"""Of all gathered meshes: more would take more memory and time to load than they save."""
OWN = frozenset(("name", "world_from_object", "color", "index", "random", "attributes", "shown_as", "asset"))
"""Fields of ``Instance`` in which gathered copies may differ, because their materials do not read them."""
PLACELESS = frozenset(("uv", "position", "normal", "true_normal", "incoming", "backfacing"))
"""Inputs of programs that depend on the surface in the world, not on its object."""
_SHARED = tuple(each.name for each in fields(Instance) if each.name not in OWN)
Kind = tuple[Any, ...]


@dataclass
class Gathered:
    """The scenes of one stage with their copies gathered; equal copies stay the same mesh from scene to scene."""

    _made: dict[Kind, tuple[tuple[Instance, ...], Mesh, Mesh, Instance]] = field(default_factory=dict)
    """By kind the copies, their mesh, and what they became."""
    _instances: tuple[Instance, ...] = ()
    _kinds: dict[Kind, tuple[Instance, ...]] = field(default_factory=dict)
    """The copies by kind of ``_instances``, which most edits do not change."""

    def of(self, scene: Scene) -> Scene:
        """``scene`` with one instance in place of many alike; the same object if there are none."""
        if scene.instances is not self._instances:
            self._instances, self._kinds = scene.instances, _kinds_of(scene.instances)
        meshes = {mesh.name: mesh for mesh in scene.meshes}
        materials = {material.name: material for material in scene.materials}
        made, left = {}, MOST_TRIANGLES
        for kind, copies in self._kinds.items():
            mesh = meshes[copies[0].mesh]
            usable = not mesh.is_strands and all(
                _is_placeless(materials.get(name), mesh) for name in copies[0].materials
            )
            if usable and left >= len(mesh.triangles) * len(copies):
                left -= len(mesh.triangles) * len(copies)
                made[kind] = self._gathered(kind, copies, mesh)
        self._made = made
        if not made:
            return scene
        taken = {item.name for copies, *_ in made.values() for item in copies}
        rest = (item for item in scene.instances if item.name not in taken)
        return replace(
            scene,
            instances=(*rest, *(item for *_, item in made.values())),
            meshes=(*scene.meshes, *(mesh for _, _, mesh, _ in made.values())),
        )

    def _gathered(
        self, kind: Kind, copies: tuple[Instance, ...], mesh: Mesh
    ) -> tuple[tuple[Instance, ...], Mesh, Mesh, Instance]:
        before = self._made.get(kind)
        if before is not None and before[1] is mesh and _are_same(before[0], copies):
            return before
        name = f"{mesh.name} × {len(copies)} ({copies[0].name})"
        whole = merged(name, mesh, np.array([item.world_from_object for item in copies]))
        return copies, mesh, whole, replace(copies[0], name=name, mesh=name, world_from_object=np.eye(4))


def _kinds_of(instances: tuple[Instance, ...]) -> dict[Kind, tuple[Instance, ...]]:
    """The copies of each kind that has enough of them, with materials, without those that are mirrored or flat."""
    counts = Counter((item.mesh, item.materials) for item in instances)
    found: dict[Kind, list[Instance]] = defaultdict(list)
    for item in instances:
        if item.materials and counts[item.mesh, item.materials] >= FEWEST:
            found[tuple(getattr(item, name) for name in _SHARED)].append(item)
    regular = {kind: _regular(copies) for kind, copies in found.items() if len(copies) >= FEWEST}
    return {kind: copies for kind, copies in regular.items() if len(copies) >= FEWEST}


def merged(name: str, mesh: Mesh, matrices: NDArray[np.float64]) -> Mesh:
    """A mesh at all of its places in the world. ``matrices``: (k, 4, 4), neither singular nor mirroring."""
    count, linear = len(matrices), matrices[:, :3, :3]
    placed = mesh.positions.astype(np.float64) @ np.swapaxes(linear, 1, 2) + matrices[:, None, :3, 3]
    starts = (np.arange(count, dtype=np.uint32) * len(mesh.positions))[:, None, None]
    normals = None
    if mesh.normals is not None:
        # normals are transformed by the inverse transpose
        turned = mesh.normals.astype(np.float64) @ np.linalg.inv(linear)
        lengths = np.linalg.norm(turned, axis=2, keepdims=True)
        normals = np.divide(turned, lengths, out=np.zeros_like(turned), where=lengths > 0)
        normals = normals.reshape(-1, 3).astype(np.float32)
    return Mesh(
        name,
        placed.reshape(-1, 3).astype(np.float32),
        (mesh.triangles[None] + starts).reshape(-1, 3),
        normals,
        None if mesh.uvs is None else np.tile(mesh.uvs, (count, 1)),
        material_indices=None if mesh.material_indices is None else np.tile(mesh.material_indices, count),
        attributes=tuple(Attribute(each.name, np.tile(each.values, (count, 1))) for each in mesh.attributes),
    )


def _is_placeless(material: Material | None, mesh: Mesh) -> bool:
    """True if a material looks the same on one mesh as on its copies, and gives no light."""
    if material is None or material.medium is not None or not is_dark(material.surface):
        return False
    if any(_is_translucent(closure) for closure in leaves(material.surface)):
        return False
    known = PLACELESS | {each.name for each in mesh.attributes}
    if not all(name in known or name.startswith("ray:") for name in mesh_inputs_of(material.surface)):
        return False
    steps = (step.operation for program in programs_of(material.surface) for step in program.instructions)
    return SENDS_RAYS.isdisjoint(steps)  # their rays tell one object from another


def _is_translucent(closure: Closure) -> bool:
    """True if light walks inside of an object, which ends at the object's own surface."""
    return isinstance(closure, Subsurface) or getattr(closure, "subsurface_weight", 0.0) != 0


def _regular(copies: list[Instance]) -> tuple[Instance, ...]:
    """The copies that are neither mirrored nor flat."""
    linear = np.array([item.world_from_object[:3, :3] for item in copies])
    fits = np.linalg.det(linear) > 1e-6 * np.linalg.norm(linear, axis=(1, 2)) ** 3
    return tuple(item for item, is_regular in zip(copies, fits, strict=True) if is_regular)


def _are_same(first: tuple[Instance, ...], second: tuple[Instance, ...]) -> bool:
    return len(first) == len(second) and all(one is other for one, other in zip(first, second, strict=True))
