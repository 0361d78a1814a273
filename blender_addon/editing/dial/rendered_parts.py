# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a recorded scene that its objects in the viewport do not show: settings of renders, and what objects show in
renders only.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields
from functools import cache
from typing import Any

import bpy
import numpy as np
from bpy.types import LayerCollection, Modifier, Object, Scene, ViewLayer
from numpy.typing import NDArray

from spectral_core.errors import SpectralError
from spectral_core.scene import Film, RenderSettings
from spectral_core.scene.look import Look

from ...translate.camera import translate_film
from ...translate.settings import settings_of
from ...translate.viewport.look import look_of

FILM, LIMITS, PLAN, LOOK = "the film", "a limit of light paths", "the render plan", "the look"
MOTION, SIMPLIFY = "the motion blur", "the simplification"
SETTINGS = (FILM, LIMITS, PLAN, LOOK, MOTION, SIMPLIFY)
"""Parts that are settings of a scene. Recordings of earlier versions do not have them."""
FORM = "the rendered form of object "
"""Beginning of the name of a part with settings of an object that only renders use."""
OF_LIMITS = ("light_paths", "scene_bounces", "max_bounces")
"""Settings of a render that are limits of light paths."""
NOISE = ("samples", "seed", "denoise", "target_error", "time_budget_s", "variant", "passes", "display_exposure")
"""Settings of noise, of speed, of the display, and of the pictures beside the picture."""
SIZE = ("width", "height")
"""Settings of the film that are a part of their own."""
OF_THE_INTERFACE = ("show_expanded", "is_active", "use_pin_to_last", "trail_count")
"""Settings that renders do not use, as those whose names begin with one of OF_VIEWS."""
OF_VIEWS = ("display_", "show_viewport", "show_in_editmode", "show_on_cage")


def settings_parts(scene: Scene, layer: ViewLayer) -> dict[str, Any]:
    """By name: the settings that the picture of a view layer depends on."""
    settings = _values(settings_of(scene))
    return {
        FILM: list(_values(translate_film(scene, 1, 0)).values()),
        LIMITS: [settings.pop(name) for name in OF_LIMITS],
        PLAN: list(settings.values()),
        MOTION: _motion(scene, layer),
        SIMPLIFY: _simplification(scene),
        LOOK: _look_part(scene, layer),
    }


def scene_state(scene: Scene) -> str:
    """Hash of everything in a scene, beside its objects and their data, that a picture depends on."""
    from spectral_core.scene import scene_hash

    render = scene.render
    size = [render.resolution_x, render.resolution_y, render.resolution_percentage]
    found: list[Any] = [size, _name(scene.camera), _name(scene.world)]
    for layer in scene.view_layers:
        with suppress(SpectralError):  # the translation reports it
            found.append(list(settings_parts(scene, layer).values()))
        found.append([layer.name, _name(layer.material_override), _name(getattr(layer, "world_override", None))])
        found += [[each.exclude, each.holdout, each.indirect_only] for each in _collections(layer.layer_collection)]
    return scene_hash(found)


def _name(block: bpy.types.ID | None) -> str | None:
    return None if block is None else block.name_full


def _collections(layer: LayerCollection) -> Iterator[LayerCollection]:
    yield layer
    for child in layer.children:
        yield from _collections(child)


def _values(settings: Film | RenderSettings) -> dict[str, Any]:
    names = [each.name for each in fields(settings) if each.name not in (*NOISE, *SIZE)]
    return {name: getattr(settings, name) for name in names}


def _motion(scene: Scene, layer: ViewLayer) -> list[Any] | None:
    render = scene.render
    if not (render.use_motion_blur and getattr(layer, "use_motion_blur", True)):
        return None
    mapping = getattr(render, "motion_blur_shutter_curve", None)
    points = [list(point.location) for curve in mapping.curves for point in curve.points] if mapping else []
    return [render.motion_blur_position, render.motion_blur_shutter, points]


def _simplification(scene: Scene) -> list[Any] | None:
    names = ("simplify_subdivision_render", "simplify_child_particles_render", "simplify_volumes")
    return [getattr(scene.render, name) for name in names] if scene.render.use_simplify else None


def _look_part(scene: Scene, layer: ViewLayer) -> list[Any] | None:
    """The light of the look of renders, without its exposure, which the dial's picture follows."""
    settings = scene.spectral.viewport.look
    if settings.kind == "SCENE":
        return None
    named = [settings.kind, getattr(settings, settings.kind.lower())]
    look = _look(scene, layer)
    if look is None:
        return named
    lamps = [None if names is None else sorted(names) for names in (look.lamps, look.other_lamps)]
    return [*named, *lamps, look.spectrum, look.with_world]


def _look(scene: Scene, layer: ViewLayer | None = None) -> Look | None:
    """The look of renders; None if its light is gone, which a render reports."""
    try:
        return look_of(scene.spectral.viewport.look, scene, layer)
    except SpectralError:
        return None


def look_matrix(scene: Scene) -> NDArray[np.float64]:
    """(3, 3) from linear sRGB of a picture to that which renders show: exposure and adaptation of the look."""
    look = _look(scene) or Look(exposure_stops=float(scene.spectral.viewport.look.exposure))
    return look.picture_matrix


def rendered_forms(objects: Iterable[Object]) -> dict[str, Any]:
    """By name: settings of an object, of its modifiers and of its hair that only renders use."""
    found = {f"{FORM}{obj.name_full!r}": _form(obj) for obj in objects}
    return {name: values for name, values in found.items() if values}


def _form(obj: Object) -> list[Any]:
    found = [_of_modifier(modifier) for modifier in obj.modifiers if modifier.show_render]
    found += [_plain(system.settings) for system in obj.particle_systems]
    if obj.type in ("CURVE", "SURFACE", "FONT", "META"):
        found.append(_plain(obj.data, only="render"))
    return [values for values in found if values]


def _of_modifier(modifier: Modifier) -> dict[str, Any]:
    """All settings of a modifier that the viewport does not show, else those for renders."""
    return _plain(modifier, only="render" if modifier.show_viewport else "")


def _plain(block: Any, only: str = "") -> dict[str, Any]:
    """The plain values of a block, and the names of the data-blocks that it uses. ``only``: a part of the names."""
    return {name: _value(getattr(block, name)) for name in _names(type(block).__name__, only)}


def _value(value: Any) -> Any:
    if isinstance(value, bpy.types.ID):
        return value.name
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    return sorted(value) if isinstance(value, set) else list(value) if isinstance(value, Iterable) else None


@cache
def _names(kind: str, only: str) -> tuple[str, ...]:
    """Names of the plain properties of a type, and of its pointers; a scene may have thousands of modifiers."""
    properties = getattr(bpy.types, kind).bl_rna.properties
    of_all = {*OF_THE_INTERFACE, *bpy.types.ID.bl_rna.properties.keys()}
    own = [each for each in properties if only in each.identifier and each.identifier not in of_all]
    used = [each for each in own if each.type == "POINTER" or (each.type in PLAIN and not each.is_readonly)]
    return tuple(each.identifier for each in used if not each.identifier.startswith(OF_VIEWS))


PLAIN = ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM")
"""Types of properties whose values are plain."""


def rendered_objects(layer: LayerCollection) -> Iterator[Object]:
    """Objects of a layer's collections that a render shows, independent of the viewport."""
    if layer.exclude or layer.collection.hide_render:
        return
    yield from (each for each in layer.collection.objects if not each.hide_render)
    for child in layer.children:
        yield from rendered_objects(child)


def names_of(obj: Object, lamps: Mapping[str, str]) -> list[str]:
    """Names of an object's parts. ``lamps``: other names of lamps."""
    if obj.type == "LIGHT":
        return [f"light {lamps.get(obj.name_full, obj.name_full)!r}"]
    materials = [f"material {slot.material.name_full!r}" for slot in obj.material_slots if slot.material]
    kept = [] if obj.data is None else [f"mesh {obj.data.name_full!r}"]
    return [f"object {obj.name_full!r}", f"volume {obj.name_full!r}", *kept, *materials]
