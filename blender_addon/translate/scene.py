# SPDX-License-Identifier: GPL-3.0-or-later
"""The complete translation: one call from a depsgraph to a Scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any

import bpy

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Camera, Film, LightPaths, Scene, SunLight, World
from spectral_core.spectra.spectrum import Spectrum

from .. import compat
from .approximations import note_approximations
from .camera import translate_camera, translate_film
from .context import Translation, overridden
from .ledger import note_changed
from .lighting.patterns import follows_camera
from .lighting.world import translate_world
from .objects import DRAWN_BY_BLENDER, collect, everything
from .settings import sampling_of, settings_of
from .viewport.answers import forget_outdated, kept_or_asked
from .viewport.kept import Kept


def translate_scene(
    depsgraph: Any,
    *,
    camera: Any = None,
    film: Film | None = None,
    seen_from: Camera | None = None,
    shows: Callable[[Any], bool] = everything,
    kept: Kept | None = None,
    designed: Mapping[int, tuple[Spectrum, float]] = MappingProxyType({}),
    is_moving: bool = False,
    compares_faces: bool = True,
    output: Any = None,
) -> Scene:
    """Scene of an evaluated depsgraph, complete and independent of Blender.

    ``camera``: an object that replaces the scene's (Blender's camera override); ``film``: replaces the output
    settings'; ``seen_from``: a view that replaces any camera; ``shows``: True for an instance of the depsgraph that
    takes part; ``kept``: parts of an earlier translation; ``designed``: as in ``Translation``; ``is_moving``: True if
    motion is added later; ``compares_faces``: False where notes are not shown, because the comparison of faces that
    coincide takes up to half a second; ``output``: as in ``Translation``. Raises InvalidInputError if nothing can be
    rendered at all (no camera, an empty border).
    """
    translation = Translation.of(depsgraph, bpy.data)
    translation.designed, translation.output = designed, output
    source = depsgraph.scene_eval
    sampling = sampling_of(source)
    film = film or translate_film(source, sampling.samples, sampling.seed, translation.render)
    if kept is not None:
        translation.images = kept.images
        forget_outdated(kept, translation)
    chosen = camera if camera is not None else source.camera
    viewed = seen_from or translate_camera(translation, None if chosen is None else chosen.evaluated_get(depsgraph))
    if source.render.use_motion_blur and not is_moving:
        translation.note(
            source.name,
            "motion blur is in renders of F12 and spectral-scene; here the scene is shown without motion blur",
        )
    for item in (source.render, getattr(source, "cycles", None)):
        note_changed(translation, source.name, item)
    layer = depsgraph.view_layer
    for item in (layer, getattr(layer, "cycles", None)):
        note_changed(translation, layer.name, item)
    if kept is None and layer.use_freestyle and source.render.use_freestyle:  # of no engine in views
        translation.note(layer.name, DRAWN_BY_BLENDER.format("Freestyle lines"))
    world = overridden(depsgraph, "world_override") or source.world
    # before the walk over the objects: one that cannot be continued would begin anew if the time ended after it
    world = world if depsgraph.view_layer_eval.use_sky else None
    environment, suns = _world(translation, world, viewed, kept, chosen if seen_from is not None else None)
    found = collect(translation, shows, kept)
    _note_limits(translation, settings_of(source).light_paths)
    scene = Scene(
        camera=viewed,
        film=film,
        meshes=tuple(mesh for mesh in found.meshes.values() if mesh is not None),
        materials=found.materials,
        instances=found.settled,
        lights=(*found.lights, *_apart(suns, {light.name for light in found.lights})),
        world=environment,
        volumes=tuple(found.volumes),
        settings=settings_of(source),
    )
    note_approximations(translation, scene, compares_faces=compares_faces and shows is everything)
    return replace(scene, notes=translation.notes)


def _world(
    translation: Translation, world: Any, viewed: Camera, kept: Kept | None, of_renders: Any
) -> tuple[World, tuple[SunLight, ...]]:
    """The environment, and the suns of its skies. ``of_renders``: in a view, the object of the scene's camera."""
    if world is None:
        return translate_world(translation, None)
    original = world.original
    state: tuple[Any, ...] = (world.name, getattr(original, "lightgroup", ""))
    if of_renders is not None and follows_camera(compat.node_tree(world)):
        viewed = _camera_of_renders(translation.depsgraph, of_renders, viewed)
        film = translate_film(translation.scene, 1, 0)
        state += viewed.world_from_camera.tobytes(), viewed.window(film)
    make = partial(_translated_world, translation, world, viewed, is_view=len(state) > 2, is_seen=kept is None)
    key, makers = ("world", original.session_uid), frozenset((original.session_uid,))
    return kept_or_asked(kept, translation, key, makers, state, make)


def _apart(suns: tuple[SunLight, ...], taken: set[str]) -> list[SunLight]:
    """The suns of a world, renamed where a lamp has their name."""
    found = []
    for sun in suns:
        number, name = 1, sun.name
        while name in taken:
            number += 1
            name = f"{sun.name} #{number}"
        found.append(sun if name == sun.name else replace(sun, name=name))
    return found


def _translated_world(
    translation: Translation, world: Any, viewed: Camera, *, is_view: bool, is_seen: bool
) -> tuple[World, tuple[SunLight, ...]]:
    if is_view:
        translation.note(world.name, "its Window and Camera coordinates are those of the scene's camera in every view")
    return translate_world(translation, world, viewed, is_seen=is_seen)


def _camera_of_renders(depsgraph: Any, chosen: Any, viewed: Camera) -> Camera:
    """The scene's camera without the notes on it; ``viewed`` if it cannot be used."""
    try:
        return translate_camera(Translation.of(depsgraph, bpy.data), chosen.evaluated_get(depsgraph))
    except InvalidInputError:
        return viewed


def _note_limits(translation: Translation, limits: LightPaths) -> None:
    """Note limits that depend on the sampling of light, so that two renderers never limit the same paths."""
    name = translation.scene.name
    if limits.clamps:
        translation.note(name, "samples are clamped by the scene's Light Paths settings, so the picture loses light")
