# SPDX-License-Identifier: GPL-3.0-or-later
"""Placed meshes as Mitsuba shapes: in world space, or as instances of a shared group if that saves memory."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene import geometry, surface
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.lamp_rows import add_glow, constant_glow, emitted_by
from spectral_core.render.mitsuba_scene.media.rows import medium_row
from spectral_core.render.plugins.lamps.light_points import Triangles
from spectral_core.render.plugins.placing import is_regular
from spectral_core.render.trace.media.table import ONLY_BORDER, MediumRow
from spectral_core.scene import Diffuse, Instance, Material, ScatteringMedium, Scene

PLAIN = Material("", Diffuse())
"""Material of a slot without a material: Blender's default gray."""
SHARED_TRIANGLES = 20_000
"""Total number of triangles of a mesh's copies from which they share one group."""


class Shapes:
    """Shapes of a scene's instances; closures and media are made once per material."""

    def __init__(
        self, context: Context, scene: Scene, parts: dict[str, dict[int, geometry.Part]], *, movable: bool = False
    ) -> None:
        self.context, self.parts, self.movable = context, parts, movable
        self.materials = {material.name: material for material in scene.materials}
        self.media: list[MediumRow] = []
        self.inside: list[tuple[Any, int]] = []
        """Shapes that contain a medium: its number, from 1, and True if the shape is only the border of the medium."""
        self._numbers: dict[str, int] = {}
        self._groups: dict[tuple[str, tuple[str, ...]], Any] = {}
        self._parts_of_groups: dict[tuple[str, tuple[str, ...]], list[Any]] = {}
        self.meshes: dict[str, list[tuple[int, Any, Any]]] = {}
        """By the mesh's name the shapes of its parts in object space: material index, shape, its group."""
        self.glowing: list[tuple[int, Instance]] = []
        """Emissive instances, with their numbers as lights."""
        self._uses = Counter((instance.mesh, instance.materials) for instance in scene.instances)

    def of(self, instance: Instance) -> list[Any]:
        """Mitsuba shapes of one instance; none if no ray can see it."""
        matrix, parts = instance.world_from_object, self.parts[instance.mesh]
        if not is_regular(matrix[:3, :3]) and np.linalg.matrix_rank(matrix[:3, :3]) < 2:
            self.context.note(instance.name, "is scaled to a line or a point, so nothing of it can be seen")
            return []
        if self._is_shared(instance):
            transform = self.context.mitsuba.ScalarTransform4f(matrix)
            group = self._group(instance)
            placed = self.context.load({"type": "instance", "to_world": transform, "group": group})
            self.context.meshes.add_instance(placed, self._parts_of_groups[instance.mesh, instance.materials])
            self.context.tables.place(placed, instance, is_instance=True)
            return [placed]
        shapes = []
        for index, part in parts.items():
            placed = geometry.transformed(part, matrix)
            if geometry.area_of(placed) > 0:
                children, glow = self._children(instance, index, placed)
                shape = self._mesh_shape(instance, index, placed, children)
                self.context.tables.place(shape, instance)
                self._remember_medium(instance, index, shape)
                if glow is not None:
                    add_glow(self.context, placed, shape, glow)
                    self._remember_glow(instance)
                shapes.append(shape)
        return shapes

    def _remember_glow(self, instance: Instance) -> None:
        if self.context.lights is not None:
            self.glowing.append((len(self.context.lights.sources), instance))

    @property
    def groups(self) -> list[Any]:
        """The shape groups of the instances; call it after ``of`` for all instances."""
        return list(self._groups.values())

    def _is_shared(self, instance: Instance) -> bool:
        """True if a group can be used: enough copies, an invertible matrix, and neither emission nor medium.

        If objects may move later, each is an instance, because only instances move without rebuilding triangles.
        """
        uses = self._uses[(instance.mesh, instance.materials)]
        triangles = sum(len(part.triangles) for part in self.parts[instance.mesh].values())
        if not self.movable and (uses < 2 or uses * triangles < SHARED_TRIANGLES):
            return False
        if np.linalg.cond(instance.world_from_object[:3, :3]) > 1e6:
            return False
        materials = [self._material(instance, index) for index in self.parts[instance.mesh]]
        return all(m.medium is None and surface.is_dark(m.surface) for m in materials)

    def _group(self, instance: Instance) -> Any:
        key = (instance.mesh, instance.materials)
        if key not in self._groups:
            description: dict[str, Any] = {"type": "shapegroup"}
            for index, part in self.parts[instance.mesh].items():
                shape = self._mesh_shape(instance, index, part, self._children(instance, index, part)[0])
                description[f"part_{index:05d}"] = shape
            group = self._groups[key] = self.context.load(description)
            shapes = self._parts_of_groups[key] = list(description.values())[1:]
            named = zip(self.parts[instance.mesh], shapes, strict=True)
            self.meshes.setdefault(instance.mesh, []).extend((index, shape, group) for index, shape in named)
        return self._groups[key]

    def _mesh_shape(self, instance: Instance, index: int, part: geometry.Part, children: dict[str, Any]) -> Any:
        """Mitsuba mesh of a part; its material is entered in the tables."""
        shape, name = geometry.mesh_shape(self.context, part, children), self._material(instance, index).name
        self.context.bsdf.surfaces.assign(shape, name)
        self.context.meshes.add_mesh(shape, part)
        self.context.material_of_shape.append((shape, name))
        if name in self.context.dyed:
            self.context.dyed[name].shapes.append(shape)
        return shape

    def _material(self, instance: Instance, index: int) -> Material:
        if not instance.materials:
            return PLAIN
        # Blender uses the last slot for an index without one
        return self.materials[instance.materials[min(index, len(instance.materials) - 1)]]

    def fill(self, medium: ScatteringMedium | None, subject: str) -> int:
        """Number of a material's medium, 0 for none."""
        row = None if medium is None else medium_row(self.context, medium, subject)
        if row is None:
            return 0
        self.media.append(row)
        return len(self.media)

    def number_of_medium(self, material: str) -> int:
        """Number of the medium of a material, 0 for none."""
        return self._numbers.get(material, 0)

    def _remember_medium(self, instance: Instance, index: int, shape: Any) -> None:
        material = self._material(instance, index)
        number = self._numbers[material.name]
        if number:
            self.inside.append((shape, number | (ONLY_BORDER if material.surface is None else 0)))

    def _children(self, instance: Instance, index: int, part: geometry.Part) -> tuple[dict[str, Any], Any]:
        """BSDF of a shape, and its emitter if the light tables contain it."""
        material, context = self._material(instance, index), self.context
        if not context.bsdf.surfaces.has(material.name):
            context.bsdf.surfaces.add(material.name, surface.leaves_of(context, material.surface, material.name))
            self._numbers[material.name] = self.fill(material.medium, material.name)
        children = {"bsdf": context.bsdf}
        if context.lights is not None:
            constant = constant_glow(material.surface)
            if constant is not None:
                return children, (emitted_by(context, *constant), None, instance.group)
        radiance = surface.emission(context, material.surface, material.name)
        if radiance is None:
            return children, None
        radiance = context.switched(radiance, instance.group)
        emitter = context.load({"type": "blender_area", "radiance": radiance, "two_sided": True})
        if part.normals is not None:
            emitter.surface = Triangles(part.positions, part.triangles, part.uvs)
        children["emitter"] = emitter
        return children, None if context.lights is None else (None, emitter, instance.group)
