# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: the scene at several instants while the shutter is open.

Blender evaluates the scene at a few instants that the objects' Motion Steps ask for, three by default. Between them
everything moves as Cycles interpolates it, so that an arc is as angular here as there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Camera, Instance, Light, Material, Mesh, Moment, Note, Scene
from spectral_core.scene.motion import same_camera, same_mesh

from ..context import Translation, stated, whole
from ..meshes.velocities import flown
from ..objects import collect
from ..visibility import cycles_settings
from . import translate_camera
from .between import around, between
from .identities import Named, Owners, as_in_the_middle, owners_of, shown_in_the_middle
from .moved_volumes import Places, VolumesInMotion, places_in_frame

FEWEST, MOST = 8, 32
"""Least and largest number of instants of a picture with motion."""
SAMPLES_PER_MOMENT = 4
"""Least number of samples of an instant."""
CHANGED = "its number of vertices changes while the shutter is open; its shape is rendered without that motion"
ABSENT = "it is not there all the time that the shutter is open; meanwhile it is rendered without motion"
SHIFTS = {"START": 0.0, "CENTER": -0.5, "END": -1.0}
"""Opening time of the shutter relative to the frame, in shares of its open time."""


@dataclass(frozen=True, eq=False)
class _Key:
    """The scene at one instant that Blender evaluates: its camera, and the placed instances and meshes by name."""

    camera: Camera
    placed: dict[str, Instance]
    shapes: dict[str, Mesh]
    lights: dict[str, Light]
    materials: dict[str, Material]
    volumes: Places


@dataclass(frozen=True, eq=False)
class _Steps:
    """Number of parts of each object's motion while the shutter is open: 0 for one that stands still."""

    camera: int
    instances: dict[str, int]
    meshes: dict[str, int]


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
    shutter = float(render.motion_blur_shutter)  # the frame's: it may be animated, and other instants are evaluated
    first = frame + subframe + SHIFTS[render.motion_blur_position] * shutter
    chosen = camera if camera is not None else source.camera
    parts = _parts_of_all(depsgraph)
    most = max([motion for motion, _ in parts.values()] + [_parts(chosen)[0] if chosen else 0, 2])
    named = _named(depsgraph)
    in_frame = places_in_frame(depsgraph, scene)
    keys: dict[int, _Key] = {}
    shown: dict[int, _Key] = {}
    open_s = shutter * render.fps_base / render.fps
    try:
        for places in ((0, most // 2, most), range(most + 1)):
            for place in places:
                if place not in keys:
                    time = first + shutter * place / most
                    frame_set(int(np.floor(time)), float(time - np.floor(time)))
                    keys[place], steps = _key(depsgraph, camera, parts, named)
            middle = keys[most // 2]
            particles = named.of_particles()
            scene = shown_in_the_middle(scene, [keys[k].placed for k in sorted(keys)], particles)
            scene = as_in_the_middle(scene, middle.placed, middle.shapes, middle.materials, particles)
            shown = {place: _flown(keys[place], middle, open_s * (place / most - 0.5)) for place in keys}
            volumes = VolumesInMotion(in_frame, [keys[place].volumes for place in sorted(keys)], parts)
            if not (volumes.any_moves() or any(_moves(scene, key, steps) for key in shown.values())):
                return _in_the_middle(scene, list(keys.values()), middle, volumes)
    finally:
        frame_set(frame, subframe)
    count = int(np.clip(scene.film.samples // SAMPLES_PER_MOMENT, FEWEST, MOST))
    ordered = [shown[place] for place in range(most + 1)]
    ordered, notes = _completed(scene, ordered)
    moments = tuple(
        replace(_moment(scene, ordered, steps, float(time)), volumes=volumes.at(scene, float(time)))
        for time in instants(render, count)
    )
    lights = _lights(scene, list(keys.values()), keys[most // 2])
    return replace(scene, moments=moments, lights=lights, notes=(*scene.notes, *notes))


def _flown(key: _Key, middle: _Key, seconds: float) -> _Key:
    """An instant with the shapes that have velocities, a time after the middle of the shutter's open time."""
    shapes = {name: moved for name, mesh in middle.shapes.items() if (moved := flown(mesh, seconds)) is not None}
    return replace(key, shapes=key.shapes | shapes)


def _in_the_middle(scene: Scene, keys: list[_Key], middle: _Key, volumes: VolumesInMotion) -> Scene:
    """A scene in which nothing is blurred: it is shown in the middle of the shutter's open time, as in Cycles."""
    moment = _moment(scene, _completed(scene, [middle] * 3)[0], _Steps(0, {}, {}), 0.5)
    moment = replace(moment, volumes=volumes.at(scene, 0.5))
    return replace(scene.at(moment), lights=_lights(scene, keys, middle))


def _lights(scene: Scene, keys: list[_Key], middle: _Key) -> tuple[Light, ...]:
    """The lamps as they are in the middle of the shutter's open time; the suns of skies, which no instant has, stay."""
    lamps = {name for key in keys for name in key.lights}
    suns = [light for light in scene.lights if light.name not in lamps]
    return (*middle.lights.values(), *suns)


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


def _parts(obj: Any) -> tuple[int, int]:
    """Parts of an object's motion and of its deformation: two or more, 0 for none by the artist's choice."""
    if not cycles_settings(obj, "use_motion_blur", True):
        return 0, 0
    count = 2 ** max(1, int(cycles_settings(obj, "motion_steps", 1)))
    return count, count if cycles_settings(obj, "use_deform_motion", True) else 0


def _parts_of_all(depsgraph: Any) -> dict[Owners, tuple[int, int]]:
    """Parts of the motion and deformation of each object, and of each one that another shows, by session numbers."""
    found: dict[Owners, tuple[int, int]] = {}
    for instance in depsgraph.object_instances:
        owners = owners_of(instance)
        if owners not in found:
            shown_by = instance.parent if owners[1] else None
            found[owners] = _both(
                *(
                    (2, 2) if obj is None else _parts(stated(whole(obj, depsgraph), depsgraph))
                    for obj in (instance.object, shown_by)
                )
            )
    return found


def _both(own: tuple[int, int], shown_by: tuple[int, int]) -> tuple[int, int]:
    """Parts of an object that another one shows: none if either has none, else the more of the two, as in Cycles."""
    return tuple(max(pair) if all(pair) else 0 for pair in zip(own, shown_by, strict=True))  # type: ignore[return-value]


def _named(depsgraph: Any) -> Named:
    """Names of the instances of the frame that ``depsgraph`` shows; those of no instancer never change."""
    if not any(item.is_instance for item in depsgraph.object_instances):
        return Named({})
    found = collect(Translation.of(depsgraph, bpy.data))
    return Named(dict(zip(found.identities, (item.name for item in found.instances), strict=True)))


def _key(depsgraph: Any, camera: Any, parts: dict[Owners, tuple[int, int]], named: Named) -> tuple[_Key, _Steps]:
    """The scene at the frame that ``depsgraph`` shows."""
    translation = Translation.of(depsgraph, bpy.data)
    chosen = camera if camera is not None else depsgraph.scene_eval.camera
    found = collect(translation)
    owners = [parts.get((each.owner, each.shown_by), (2, 2)) for each in found.identities]
    placed = named.placed(found.identities, found.instances)
    own = list(zip(placed.values(), owners, strict=True))
    key = _Key(
        translate_camera(translation, None if chosen is None else chosen.evaluated_get(depsgraph)),
        placed,
        {mesh.name: mesh for mesh in found.meshes.values() if mesh is not None},
        {light.name: light for light in found.lights},
        {material.name: material for material in found.materials},
        found.volume_places,
    )
    meshes = {item.mesh: deforming for item, (_, deforming) in own}  # the last instance decides, as in Cycles
    moving = parts.get((chosen.original.session_uid, 0), (2, 2))[0] if chosen is not None else 0
    return key, _Steps(moving, {item.name: motion for item, (motion, _) in own}, meshes)


def _completed(scene: Scene, keys: list[_Key]) -> tuple[list[_Key], tuple[Note, ...]]:
    """The instants with the whole scene, and a note for each instance and mesh that some of them lack.

    As in Cycles, what an instant lacks, or has with another number of vertices, is there as in the middle. What the
    middle lacks as well stays as the scene has it.
    """
    middle = keys[len(keys) // 2]
    placed = {item.name: middle.placed.get(item.name, item) for item in scene.instances}
    shapes = {mesh.name: mesh if _differ(mesh, middle.shapes.get(mesh.name)) else middle.shapes[mesh.name]
              for mesh in scene.meshes}  # fmt: skip
    changed = {
        name for name, mesh in shapes.items()
        if any(name in key.shapes and _differ(mesh, key.shapes[name]) for key in keys)
    }  # fmt: skip
    absent = {name for name in placed if any(name not in key.placed for key in keys)}
    full = [
        replace(
            key,
            placed=placed | key.placed,
            shapes=key.shapes | {name: mesh for name, mesh in shapes.items() if _differ(mesh, key.shapes.get(name))},
        )
        for key in keys
    ]
    told = {CHANGED: changed, ABSENT: absent}
    return full, tuple(Note(name, text) for text, names in told.items() for name in sorted(names))


def _differ(mesh: Mesh, other: Mesh | None) -> bool:
    """True if a mesh cannot move to another shape."""
    return other is None or other.positions.shape != mesh.positions.shape


def _moves(scene: Scene, key: _Key, steps: _Steps) -> bool:
    """True if anything that may move is elsewhere, or has another shape, than in the frame."""
    if steps.camera and not same_camera(scene.camera, key.camera):
        return True
    for item in scene.instances:
        other = key.placed.get(item.name)
        if other is None or (steps.instances.get(item.name) and not _same_place(item, other)):
            return True
    shapes = ((mesh, key.shapes.get(mesh.name)) for mesh in scene.meshes if steps.meshes.get(mesh.name))
    return any(other is None or not same_mesh(mesh, other) for mesh, other in shapes)


def _same_place(one: Instance, other: Instance) -> bool:
    return bool(np.array_equal(one.world_from_object, other.world_from_object))


def _moment(scene: Scene, keys: list[_Key], steps: _Steps, time: float) -> Moment:
    """The scene at a time, in shares of the shutter's open time; ``keys``: as ``_completed`` gives them."""
    instances = []
    for item in scene.instances:
        one, other, share = around(keys, steps.instances.get(item.name, 0), time)
        first, last = (key.placed[item.name].world_from_object for key in (one, other))
        placed = between(first, last, share)
        if not np.array_equal(placed, item.world_from_object):
            instances.append(replace(item, world_from_object=placed))
    meshes = []
    for mesh in scene.meshes:
        one, other, share = around(keys, steps.meshes.get(mesh.name, 0), time)
        shape = _blend(mesh, one.shapes[mesh.name], other.shapes[mesh.name], share)
        if not same_mesh(mesh, shape):
            meshes.append(shape)
    return Moment(_seen_from(scene.camera, keys, steps.camera, time), tuple(instances), tuple(meshes))


def _blend(mesh: Mesh, one: Mesh, other: Mesh, share: float) -> Mesh:
    """The mesh with the vertices and normals between two shapes."""
    if same_mesh(one, other):
        return replace(mesh, positions=one.positions, normals=one.normals)
    normals = None
    if one.normals is not None and other.normals is not None:
        normals = one.normals * (1 - share) + other.normals * share
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    positions = one.positions * (1 - share) + other.positions * share
    return replace(mesh, positions=positions, normals=None if normals is None else normals.astype(np.float32))


def _seen_from(camera: Camera, keys: list[_Key], parts: int, time: float) -> Camera:
    """The camera at a time. It turns and moves in ``parts``; its view widens along two straight lines, as in Cycles."""
    one, other, share = around(keys, parts, time)
    placed = between(one.camera.world_from_camera, other.camera.world_from_camera, share)
    if not parts:
        return replace(camera, world_from_camera=placed)
    one, other, share = around(keys, 2, time)
    first, last = (np.tan(key.camera.field_of_view_rad / 2) for key in (one, other))
    angle = 2 * float(np.arctan(first * (1 - share) + last * share))
    return replace(camera, world_from_camera=placed, field_of_view_rad=angle)
