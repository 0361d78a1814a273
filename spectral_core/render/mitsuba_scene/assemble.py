# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole scene: meshes with their materials, lights, surroundings, and what could not be said exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene import geometry, light
from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.medium import medium_around
from spectral_core.render.mitsuba_scene.paint import unit_luminance
from spectral_core.render.mitsuba_scene.shapes import Shapes
from spectral_core.render.plugins.programs import SceneTables
from spectral_core.scene import Camera, Film, Note, Scene


@dataclass(frozen=True, slots=True, eq=False)
class LoadedScene:
    """``scene``: Mitsuba's; ``notes``: what is rendered as something near to it.

    ``hidden``: lights' shapes that the camera does not see. ``switches``: per light group what turns it on and off,
    where that was asked for. ``camera_medium``: what the camera stands in, None for empty space.
    """

    scene: Any
    notes: tuple[Note, ...]
    hidden: tuple[Any, ...]
    switches: dict[str, list[Callable[[bool], None]]]
    camera_medium: Any | None = None

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
    look_through(context.tables, scene.camera, scene.film)
    shapes = Shapes(context, scene, parts)
    for number, instance in enumerate(scene.instances):
        for shape_number, shape in enumerate(shapes.of(instance)):
            description[f"shape_{number:06d}_{shape_number:03d}"] = shape
    for number, group in enumerate(shapes.groups):  # a scene must hold what its instances show
        description[f"group_{number:06d}"] = group
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
    loaded = context.load(description)
    eye = scene.camera.world_from_camera[:3, 3]
    around = medium_around(mitsuba, loaded, shapes.media, eye) if shapes.media else None
    return LoadedScene(loaded, tuple(context.notes), tuple(hidden), context.switches or {}, around)


def look_through(tables: SceneTables, camera: Camera, film: Film) -> None:
    """Let shading programs know the camera: its space has +z forward, as Cycles'."""
    flip = np.diag([1.0, 1.0, -1.0, 1.0])
    # of a camera that collapses space any inverse serves: it is refused when its rays are made
    tables.camera_from_world = flip @ np.linalg.pinv(camera.world_from_camera)
    width, height = float(film.width), float(film.height) * film.pixel_aspect
    side = {"auto": max(width, height), "width": width, "height": height}[camera.sensor_fit]
    perspective = camera.kind == "perspective"
    size = 2 * float(np.tan(camera.field_of_view_rad / 2)) if perspective else float(camera.orthographic_scale)
    share_x, share_y = width / side, height / side
    shift = camera.shift[0] / share_x, camera.shift[1] / share_y
    tables.window = (size * share_x, size * share_y, *shift, 1.0 if perspective else 0.0)


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
