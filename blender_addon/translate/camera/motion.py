# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: the scene at several instants while the shutter is open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Camera, Instance, Mesh, Moment, Note, Scene
from spectral_core.scene.motion import same_camera, same_mesh

from ..context import Translation
from ..objects import Collected, collect
from ..visibility import cycles_settings
from . import translate_camera

FEWEST, MOST = 8, 32
"""Least and largest number of instants of a picture with motion."""
SAMPLES_PER_MOMENT = 4
"""Least number of samples of an instant."""
SHIFTS = {"START": 0.0, "CENTER": -0.5, "END": -1.0}
"""Opening time of the shutter relative to the frame, in shares of its open time."""


def with_motion(scene: Scene, depsgraph: Any, camera: Any, frame_set: Callable[[int, float], None]) -> Scene:
    """The scene with its moments, if the render settings enable motion blur and anything moves.

    ``camera``: replaces the scene's; ``frame_set``: moves ``depsgraph`` to a frame and a share of the next one. Lamps,
    materials and the environment do not move, as in Cycles.
    """
    source = depsgraph.scene_eval
    render = source.render
    if not (render.use_motion_blur and getattr(depsgraph.view_layer_eval, "use_motion_blur", True)):
        return scene
    frame, subframe = int(source.frame_current), float(source.frame_subframe)
    first = frame + subframe + SHIFTS[render.motion_blur_position] * render.motion_blur_shutter
    count = int(np.clip(scene.film.samples // SAMPLES_PER_MOMENT, FEWEST, MOST))
    times = first + render.motion_blur_shutter * instants(render, count)
    lost: set[str] = set()
    kept = _standing(depsgraph)
    try:
        ends = [_moment(scene, depsgraph, camera, (frame_set, time, kept), lost) for time in times[[0, count // 2, -1]]]
        if not any(_moves(scene, moment) for moment in ends):
            return scene
        made = [_moment(scene, depsgraph, camera, (frame_set, time, kept), lost) for time in times]
    finally:
        frame_set(frame, subframe)
    notes = tuple(
        Note(name, "its shape or number of vertices changes while the shutter is open; it is rendered without motion")
        for name in sorted(lost)
    )
    return replace(scene, moments=tuple(made), notes=(*scene.notes, *notes))


def instants(render: Any, count: int) -> NDArray[np.float64]:
    """Instants with equal shares of the light, in shares of the shutter's open time."""
    middles = (np.arange(count) + 0.5) / count
    mapping = getattr(render, "motion_blur_shutter_curve", None)
    if mapping is None:
        return np.asarray(middles)
    mapping.initialize()
    places = np.linspace(0.0, 1.0, 257)
    opened = np.maximum([mapping.evaluate(mapping.curves[0], float(place)) for place in places], 0.0)
    light = np.concatenate([[0.0], np.cumsum((opened[1:] + opened[:-1]) / 2)])
    if not light[-1] > 0:
        return np.asarray(middles)
    return np.asarray(np.interp(middles, light / light[-1], places))


def _standing(depsgraph: Any) -> dict[str, str]:
    """Objects without motion blur by the artist's choice: by name ``"all"``, or ``"deformation"`` alone."""
    found: dict[str, str] = {}
    for thing in depsgraph.objects:
        if not cycles_settings(thing.original, "use_motion_blur", True):
            found[thing.name_full] = "all"
        elif not cycles_settings(thing.original, "use_deform_motion", True):
            found[thing.name_full] = "deformation"
    return found


def _moment(
    scene: Scene,
    depsgraph: Any,
    camera: Any,
    when: tuple[Callable[[int, float], None], float, dict[str, str]],
    lost: set[str],
) -> Moment:
    frame_set, time, standing = when
    frame_set(int(np.floor(time)), float(time - np.floor(time)))
    translation = Translation.of(depsgraph, bpy.data)
    chosen = camera if camera is not None else depsgraph.scene_eval.camera
    seen_from = scene.camera
    if chosen is not None and standing.get(chosen.name_full) != "all":
        seen_from = translate_camera(translation, chosen.evaluated_get(depsgraph))
    found = collect(translation)
    return Moment(seen_from, *_changes(scene, found, standing, lost))


def _changes(
    scene: Scene, found: Collected, standing: dict[str, str], lost: set[str]
) -> tuple[tuple[Instance, ...], tuple[Mesh, ...]]:
    """Instances and meshes that differ from those of the frame."""
    now = {item.name: (item, thing.name_full) for item, thing in zip(found.instances, found.originals, strict=True)}
    shapes = {mesh.name: mesh for mesh in found.meshes.values() if mesh is not None}
    instances, frozen = [], set()
    for item in scene.instances:
        if item.name not in now:
            lost.add(item.name)
            continue
        moved, owner = now[item.name]
        if standing.get(owner) is not None:
            frozen.add(item.mesh)
        if standing.get(owner) != "all" and not np.array_equal(moved.world_from_object, item.world_from_object):
            instances.append(replace(item, world_from_object=moved.world_from_object))
    meshes = []
    for mesh in scene.meshes:
        other = shapes.get(mesh.name)
        if other is None or other.positions.shape != mesh.positions.shape:
            lost.add(mesh.name)
        elif mesh.name not in frozen and not same_mesh(mesh, other):
            meshes.append(replace(mesh, positions=other.positions, normals=other.normals))
    return tuple(instances), tuple(meshes)


def _moves(scene: Scene, moment: Moment) -> bool:
    seen: Camera = moment.camera
    return bool(moment.instances or moment.meshes) or not same_camera(scene.camera, seen)
