# SPDX-License-Identifier: GPL-3.0-or-later
"""Which instance of one instant is which of another: by what shows it, as in Cycles. Numbers of particles change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from spectral_core.scene import Instance, Material, Mesh, Scene


@dataclass(frozen=True, slots=True)
class Identity:
    """``place``: what Blender says of an instance's place in all that shows it. ``part``: number of those with the same
    place, as of the strands on a mesh. ``is_particle``: True if a particle system shows it.
    """

    owner: int
    shown_by: int
    place: tuple[int, ...]
    part: int
    is_particle: bool = field(compare=False)


Owners = tuple[int, int]
"""Session numbers of an instance's object and of what shows it, 0 if it shows itself."""


def owners_of(instance: Any) -> Owners:
    """Object of an instance of the depsgraph, and what shows it."""
    shown_by = instance.parent if instance.is_instance else None
    return instance.object.original.session_uid, 0 if shown_by is None else shown_by.original.session_uid


def identities_of(instance: Any, count: int) -> list[Identity]:
    """Identities of the ``count`` instances that the translation made of one of the depsgraph."""
    place: tuple[int, ...] = ()
    (owner, parent), is_particle = owners_of(instance), False
    if instance.is_instance:
        place, is_particle = tuple(instance.persistent_id), instance.particle_system is not None
    return [Identity(owner, parent, place, part, is_particle) for part in range(count)]


@dataclass(frozen=True, eq=False)
class Named:
    """Names of the frame's instances by their identities."""

    names: dict[Identity, str]

    def placed(self, identities: list[Identity], instances: list[Instance]) -> dict[str, Instance]:
        """Instances of another instant by the names of the frame; new ones by names of their own."""
        found, taken = {}, set(self.names.values())
        for identity, item in zip(identities, instances, strict=True):
            name = self.names.get(identity)
            if name is None:
                name, number = item.name, 1
                while name in taken:
                    number += 1
                    name = f"{item.name} #{number}"
                taken.add(name)
                self.names[identity] = name
            found[name] = item if item.name == name else replace(item, name=name)
        return found

    def of_particles(self) -> frozenset[str]:
        """Names of the instances that particle systems show."""
        return frozenset(name for identity, name in self.names.items() if identity.is_particle)


def shown_in_the_middle(scene: Scene, placed: list[dict[str, Instance]], of_particles: frozenset[str]) -> Scene:
    """The scene with the particles of the shutter's middle, without those that another instant lacks, as in Cycles.

    ``placed``: the instances of each instant.
    """
    middle = placed[len(placed) // 2]
    always = {name for name in of_particles if all(name in each for each in placed)}
    meshes, materials = {mesh.name for mesh in scene.meshes}, {material.name for material in scene.materials}
    kept = [item for item in scene.instances if item.name not in of_particles or item.name in always]
    there = {item.name for item in kept}
    born = [
        item for name, item in middle.items()
        if name in always - there and item.mesh in meshes and materials.issuperset(item.materials)
    ]  # fmt: skip
    if not born and len(kept) == len(scene.instances):
        return scene
    return replace(scene, instances=(*kept, *born))


def as_in_the_middle(
    scene: Scene,
    placed: Mapping[str, Instance],
    shapes: Mapping[str, Mesh],
    materials: Mapping[str, Material],
    of_particles: frozenset[str],
) -> Scene:
    """The scene with the objects that are there in the middle of the shutter's open time, and the settings that they
    have then, as in Cycles: visibility, colors, attributes. Materials that the frame has are those of the frame.

    ``placed``, ``shapes``, ``materials``: the instances, meshes and materials of the middle by their names. Of the
    particles those stay that the scene has.
    """
    there = {item.name for item in scene.instances}
    kept = [
        replace(placed[item.name], mesh=item.mesh, materials=item.materials, world_from_object=item.world_from_object)
        for item in scene.instances
        if item.name in placed
    ]
    born = [item for name, item in placed.items() if name not in there | of_particles]
    known, painted = {mesh.name for mesh in scene.meshes}, {material.name for material in scene.materials}
    meshes = {item.mesh: shapes[item.mesh] for item in born if item.mesh not in known}
    paints = {name: materials[name] for item in born for name in item.materials if name not in painted}
    return replace(
        scene,
        instances=(*kept, *born),
        meshes=(*scene.meshes, *meshes.values()),
        materials=(*scene.materials, *paints.values()),
    )
