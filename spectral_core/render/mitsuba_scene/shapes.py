# SPDX-License-Identifier: GPL-3.0-or-later
"""Placed meshes as Mitsuba shapes: in world space, or as instances of a shared group if that saves memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import geometry, limits, surface
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.kept import MeshOf, geometry_for
from spectral_core.render.mitsuba_scene.lamps.rows import add_emissive, emitted_by, emitted_evenly
from spectral_core.render.mitsuba_scene.media.rows import medium_row
from spectral_core.render.mitsuba_scene.paint import white_light
from spectral_core.render.plugins.lamps.light_points import Triangles
from spectral_core.render.plugins.placing import is_regular
from spectral_core.render.trace.media.table import HIDDEN, ONLY_BORDER, MediumRow
from spectral_core.scene import Diffuse, Instance, Material, ScatteringMedium, Scene

PLAIN = Material("", Diffuse())
"""Material of a slot without a material: Blender's default gray."""
SHARED_TRIANGLES = 20_000
"""Total number of triangles of a mesh's copies from which they share one group."""


class Shapes:
    """Shapes of a scene's instances; closures and media are made once per material. ``links``: bits of linked lights.
    ``geometry`` may have been built for another scene.
    """

    def __init__(self, context: Context, scene: Scene, links: Mapping[str, int]) -> None:
        self.context = context
        self._links = links
        self.materials = {material.name: material for material in scene.materials}
        self.media: list[MediumRow] = []
        self.inside: list[tuple[Any, int]] = []
        """Shapes that contain a medium: its number, from 1, with the bits of ``trace.media.table`` above it."""
        self.unlit_media: list[tuple[int, int]] = []
        """Media with light linking: the number, and the bits of the lights that do not illuminate it."""
        self.has_clear_borders = False
        """True if an object is only the border of a medium that is empty."""
        self._numbers: dict[tuple[str, str, int], int] = {}
        """Numbers of the media by material, by light group if that matters, and by the lights that leave them out."""
        passes = scene.settings.passes
        self._keeps_groups = context.switches is not None or (passes is not None and bool(passes.light_groups))
        self.meshes: dict[str, list[tuple[int, Any, Any]]] = {}
        """By the mesh's name the shapes of its parts in object space: material index, shape, its group."""
        self.emissive: list[tuple[Any, Instance]] = []
        """Emissive instances, with their numbers as lights, or with Mitsuba's emitters without light tables."""
        self._uses = Counter((instance.mesh, instance.materials) for instance in scene.instances)
        self.geometry = geometry_for(
            context, scene, lambda parts: tuple(self._is_shared(parts[item.mesh], item) for item in scene.instances)
        )
        self._entered: dict[tuple[str, tuple[str, ...]], list[Any]] = {}

    def of(self, number: int, instance: Instance) -> list[Any]:
        """Mitsuba shapes of one instance, the ``number``-th of the scene; none if no ray can see it."""
        matrix = instance.world_from_object
        if not is_regular(matrix[:3, :3]) and np.linalg.matrix_rank(matrix[:3, :3]) < 2:
            self.context.note(instance.name, "is scaled to a line or a point, so nothing of it can be seen")
            return []
        if self.geometry.shared[number]:
            return [self._copy(number, instance)]
        for index in self.geometry.parts[instance.mesh]:
            self._enter(self._material(instance, index))
        if number not in self.geometry.placed:
            self.geometry.placed[number] = list(self._made(instance))
        shapes = []
        for index, part, shape in self.geometry.placed[number]:
            self._assign(instance, index, shape)
            self.context.tables.place(shape, instance)
            self._remember_medium(instance, index, shape)
            if self.context.lights is not None:
                self._enter_emission(instance, index, (part, shape))
            elif shape.emitter() is not None:
                self.emissive.append((shape.emitter(), instance))
            shapes.append(shape)
        return shapes

    def _made(self, instance: Instance) -> Iterator[MeshOf]:
        """The meshes of an instance, in the world."""
        for index, part in self.geometry.parts[instance.mesh].items():
            placed = geometry.transformed(part, instance.world_from_object)
            if geometry.has_area(placed):
                yield index, placed, self._mesh(instance, index, placed)

    def _copy(self, number: int, instance: Instance) -> Any:
        """A shape that shows a group of meshes at another place."""
        context, group, shapes = self.context, *self._group(instance)
        if number not in self.geometry.copies:
            transform = context.mitsuba.ScalarTransform4f(instance.world_from_object)
            made = context.load({"type": "instance", "to_world": transform, "group": group})
            context.meshes.add_instance(made, shapes)
            self.geometry.copies[number] = made
        placed = self.geometry.copies[number]
        context.tables.place(placed, instance, is_instance=True)
        return placed

    @property
    def groups(self) -> list[Any]:
        """The shape groups of the instances; call it after ``of`` for all instances."""
        return [group for group, _ in self.geometry.groups.values()]

    def _is_shared(self, parts: dict[int, geometry.Part], instance: Instance) -> bool:
        """True if a group can be used: enough copies, an invertible matrix, and neither emission nor medium.

        If objects may move later, each is an instance, because only instances move without rebuilding triangles.
        """
        uses = self._uses[(instance.mesh, instance.materials)]
        triangles = sum(len(part.triangles) for part in parts.values())
        if not self.context.movable and (uses < 2 or uses * triangles < SHARED_TRIANGLES):
            return False
        if np.linalg.cond(instance.world_from_object[:3, :3]) > 1e6:
            return False
        materials = [self._material(instance, index) for index in parts]
        return all(m.medium is None and surface.is_dark(m.surface) for m in materials)

    def _group(self, instance: Instance) -> tuple[Any, list[Any]]:
        """The group of the meshes of an instance, and the meshes."""
        key, parts = (instance.mesh, instance.materials), self.geometry.parts[instance.mesh]
        if key in self._entered:
            return self.geometry.groups[key][0], self._entered[key]
        for index in parts:
            self._enter(self._material(instance, index))
        if key not in self.geometry.groups:
            made = [(index, part, self._mesh(instance, index, part)) for index, part in parts.items()]
            named = {f"part_{index:05d}": shape for index, _, shape in made}
            self.geometry.groups[key] = self.context.load({"type": "shapegroup", **named}), made
        group, made = self.geometry.groups[key]
        for index, _, shape in made:
            self._assign(instance, index, shape)
        self._entered[key] = [shape for _, _, shape in made]
        self.meshes.setdefault(instance.mesh, []).extend((index, shape, group) for index, _, shape in made)
        return group, self._entered[key]

    def _mesh(self, instance: Instance, index: int, part: geometry.Part) -> Any:
        """Mitsuba mesh of a part, with its emitter."""
        children = {"bsdf": self.context.bsdf, **self._emitter(instance, index, part)}
        shape = geometry.mesh_shape(self.context, part, children)
        self.context.meshes.add_mesh(shape, part)
        return shape

    def _assign(self, instance: Instance, index: int, shape: Any) -> None:
        """Enter the material of a mesh in the tables."""
        context, name = self.context, self._material(instance, index).name
        context.bsdf.surfaces.assign(shape, name)
        context.material_of_shape.append((shape, name))
        if name in context.dyed:
            context.dyed[name].shapes.append(shape)

    def material_name(self, instance: Instance, index: int) -> str:
        """Name of the material of a part of an instance."""
        return self._material(instance, index).name

    def _material(self, instance: Instance, index: int) -> Material:
        if not instance.materials:
            return PLAIN
        # Blender uses the last slot for an index without one
        return self.materials[instance.materials[min(index, len(instance.materials) - 1)]]

    def fill(self, medium: ScatteringMedium | None, subject: str, group: str) -> int:
        """Number of a material's medium, 0 for none; ``group``: light group of its emission."""
        row = None if medium is None else medium_row(self.context, medium, subject, group)
        if row is None:
            return 0
        self.media.append(row)
        return len(self.media)

    def number_of_medium(self, material: str) -> int:
        """Number of the medium of a material; 0 if it has none, or several that light groups or linking tell apart."""
        found = {number for (name, *_), number in self._numbers.items() if name == material}
        return found.pop() if len(found) == 1 else 0

    def unlit_by(self, instance: Instance) -> int:
        """Bits of the linked lights that do not illuminate an instance."""
        return sum({self._links.get(name, 0) for name in instance.unlit_by})

    def _remember_medium(self, instance: Instance, index: int, shape: Any) -> None:
        material = self._material(instance, index)
        medium = material.medium
        # the light of a medium belongs to the group of its object
        has_group = self._keeps_groups and medium is not None and medium.emission_strength > 0
        unlit = 0 if medium is None else self.unlit_by(instance)
        key = material.name, instance.group if has_group else "", unlit
        if key not in self._numbers:
            self._numbers[key] = self.fill(medium, material.name, instance.group)
            if unlit and self._numbers[key]:
                self.unlit_media.append((self._numbers[key], unlit))
        number = self._numbers[key]
        if number:
            hidden = int(instance.hidden_from) << HIDDEN
            self.inside.append((shape, number | hidden | (ONLY_BORDER if material.surface is None else 0)))
        elif medium is not None and material.surface is None:
            self.has_clear_borders = True

    def _enter(self, material: Material) -> None:
        """Enter a material in the tables, once."""
        surfaces = self.context.bsdf.surfaces
        if not surfaces.has(material.name):
            surfaces.add(material.name, surface.leaves_of(self.context, material.surface, material.name))

    def _emitter(self, instance: Instance, index: int, part: geometry.Part) -> dict[str, Any]:
        """Mitsuba's emitter of a mesh, unless the light tables contain its emission."""
        material, context = self._material(instance, index), self.context
        if context.lights is not None and emitted_evenly(material.surface) is not None:
            return {}
        radiance = surface.emission(context, material.surface, material.name)
        if radiance is None:
            return {}
        radiance = context.switched(radiance, instance.group)
        emitter = context.load({"type": "blender_area", "radiance": radiance, "two_sided": True})
        if part.normals is not None:
            emitter.surface = Triangles(part.positions, part.triangles, part.uvs)
        return {"emitter": emitter}

    def _enter_emission(self, instance: Instance, index: int, placed: tuple[geometry.Part, Any]) -> None:
        """Enter the emission of a mesh in the light tables."""
        assert self.context.lights is not None
        (part, shape), material = placed, self._material(instance, index)
        constant = emitted_evenly(material.surface)
        emitter = shape.emitter() if constant is None else None
        if constant is not None:
            limits.note_unlike_light(self.context, constant[0], self.context.white or white_light(), material.name)
            add_emissive(self.context, part, shape, (emitted_by(self.context, *constant), None, instance.group))
        elif emitter is not None:
            add_emissive(self.context, part, shape, (None, emitter, instance.group))
        else:
            return
        self.emissive.append((len(self.context.lights.sources), instance))
