# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole scene: meshes with their materials, lights, surroundings, and what could not be said exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import geometry, light, surface
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.paint import unit_luminance
from spectral_core.scene import Diffuse, Instance, Material, Note, Scene

_PLAIN = Material("", Diffuse())
"""What a material slot without a material looks like: Blender's default gray."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadedScene:
    """``scene``: Mitsuba's; ``notes``: what is rendered as something near to it.

    ``hidden``: lights' shapes that the camera does not see. ``switches``: per light group what turns it on and off,
    where that was asked for.
    """

    scene: Any
    notes: tuple[Note, ...]
    hidden: tuple[Any, ...]
    switches: dict[str, list[Callable[[bool], None]]]

    def light_only(self, group: str) -> None:
        """Switch every light group off but one."""
        for name, switches in self.switches.items():
            for switch in switches:
                switch(name == group)


def load_scene(scene: Scene, mitsuba: Any, *, spectral: bool, groups: bool = False) -> LoadedScene:
    """Mitsuba's scene of ``scene`` under the active variant; ``groups`` makes its light groups switchable."""
    white = scene.settings.white
    context = Context(mitsuba, spectral, {} if groups else None, white=None if white is None else unit_luminance(white))
    description: dict[str, Any] = {"type": "scene"}
    parts = {mesh.name: geometry.split_by_material(mesh) for mesh in scene.meshes}
    shapes = _Shapes(context, scene, parts)
    for number, instance in enumerate(scene.instances):
        for shape_number, shape in enumerate(shapes.of(instance)):
            description[f"shape_{number:06d}_{shape_number:03d}"] = shape
    sphere = _bounding_sphere(scene, parts)
    hidden = []
    for number, item in enumerate(scene.lights):
        for object_number, entry in enumerate(light.light_objects(context, item, sphere)):
            description[f"light_{number:06d}_{object_number}"] = entry
            if isinstance(entry, mitsuba.Shape) and not item.camera_visible:
                hidden.append(entry)
    world = light.world_emitter(context, scene.world)
    if world is not None:
        description["world"] = world
    return LoadedScene(context.load(description), tuple(context.notes), tuple(hidden), context.switches or {})


class _Shapes:
    """Instances as shapes; BSDFs are made once per material."""

    def __init__(self, context: Context, scene: Scene, parts: dict[str, dict[int, geometry.Part]]) -> None:
        self.context, self.parts = context, parts
        self.materials = {material.name: material for material in scene.materials}
        self.bsdfs: dict[str, Any] = {}

    def of(self, instance: Instance) -> list[Any]:
        shapes = []
        matrix = instance.world_from_object
        if np.linalg.matrix_rank(matrix[:3, :3]) < 2:
            self.context.note(instance.name, "is scaled to a line or a point, so nothing of it can be seen")
            return []
        for index, part in self.parts[instance.mesh].items():
            placed = geometry.transformed(part, matrix)
            if geometry.area_of(placed) > 0:
                shapes.append(geometry.mesh_shape(self.context, placed, self._children(instance, index)))
        return shapes

    def _children(self, instance: Instance, index: int) -> dict[str, Any]:
        material = _PLAIN
        if instance.materials:
            # Blender shows the last slot where an index has none
            material = self.materials[instance.materials[min(index, len(instance.materials) - 1)]]
        if material.name not in self.bsdfs:
            self.bsdfs[material.name] = surface.bsdf(self.context, material.surface, material.name)
        children = {"bsdf": self.bsdfs[material.name]}
        radiance = surface.emission(self.context, material.surface, material.name)
        if radiance is not None:
            radiance = self.context.switched(radiance, instance.group)
            description = {"type": "blender_area", "radiance": radiance, "two_sided": True}
            children["emitter"] = self.context.load(description)
        return children


def _bounding_sphere(scene: Scene, parts: dict[str, dict[int, geometry.Part]]) -> tuple[NDArray[np.float64], float]:
    """Center and radius around every placed mesh, every volume and the camera."""
    points = [scene.camera.world_from_camera[None, :3, 3]]
    for instance in scene.instances:
        for part in parts[instance.mesh].values():
            low, high = part.positions.min(axis=0), part.positions.max(axis=0)
            corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8).T
            points.append(corners @ instance.world_from_object[:3, :3].T + instance.world_from_object[:3, 3])
    for volume in scene.volumes:
        corners = np.array(np.meshgrid(*((-0.5, n - 0.5) for n in volume.data.shape))).reshape(3, 8).T
        points.append(corners @ volume.world_from_index[:3, :3].T + volume.world_from_index[:3, 3])
    everything = np.concatenate(points)
    low, high = everything.min(axis=0), everything.max(axis=0)
    return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1.0)
