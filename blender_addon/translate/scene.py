# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole of a translation: one call from a depsgraph to a Scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from spectral_core.scene import Film, Scene

from .camera import translate_camera, translate_film
from .context import Translation, overridden
from .objects import collect
from .settings import sampling_of, settings_of
from .world import translate_world


def translate_scene(depsgraph: Any, *, camera: Any = None, film: Film | None = None) -> Scene:
    """Scene of an evaluated depsgraph, whole and independent of Blender.

    ``camera``: an object in place of the scene's (Blender's camera override); ``film``: in place of the output
    settings'. Raises InvalidInputError where nothing can be rendered at all (no camera, an empty border).
    """
    translation = Translation.of(depsgraph, bpy.data)
    source = depsgraph.scene_eval
    sampling = sampling_of(source)
    film = film or translate_film(source, sampling.samples, sampling.seed)
    chosen = camera if camera is not None else source.camera
    viewed = translate_camera(translation, None if chosen is None else chosen.evaluated_get(depsgraph))
    if source.render.use_motion_blur:
        translation.note(source.name, "motion blur is not simulated; each frame stands still")
    found = collect(translation)
    world = overridden(depsgraph, "world_override") or source.world
    scene = Scene(
        camera=viewed,
        film=film,
        meshes=tuple(mesh for mesh in found.meshes.values() if mesh is not None),
        materials=found.materials,
        instances=tuple(found.instances),
        lights=tuple(found.lights),
        world=translate_world(translation, world if depsgraph.view_layer_eval.use_sky else None),
        volumes=tuple(found.volumes),
        settings=settings_of(source),
    )
    return replace(scene, notes=translation.notes)
