# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a view: a light of the palette, a light group, a lamp of the catalogue."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from spectral_core.errors import InvalidInputError, counted
from spectral_core.scene import Note, Scene
from spectral_core.scene.look import Look
from spectral_core.spectra.spectrum import Spectrum

from ..spectra import catalogue, stored

MOST_STOPS = 64.0
"""Greatest exposure of a view and a look together; Blender limits each to half of it."""
PREVIEW_SAMPLES = 16
"""Samples per pixel of a preview: an icon is small, and a panel's picture is shown briefly."""


def look_of(settings: Any, scene: Any, layer: Any = None) -> Look:
    """The look in ``settings`` (a SpectralLook) for a Blender scene; ``layer``: the view layer that is shown.

    Raises InvalidInputError or UnknownNameError, with a remedy, if a named item does not exist.
    """
    look = Look(exposure_stops=float(settings.exposure), adapts=bool(settings.adapts))
    if settings.kind == "LAMP":
        return replace(look, spectrum=catalogue.named("illuminant", settings.lamp))
    if settings.kind == "GROUP":
        if not settings.group:
            raise InvalidInputError("no light group is chosen to look under; choose one, or look at it As It Is")
        known = {group.name for layer in scene.view_layers for group in layer.lightgroups}
        if settings.group not in known:
            raise InvalidInputError(
                f"the scene has no light group {settings.group!r} to look under; "
                f"it has {', '.join(sorted(known)) or 'none'}; choose another one, or look at it As It Is"
            )
        return replace(look, group=settings.group)
    if settings.kind == "COLUMN":
        return _under_column(look, settings.column, scene, getattr(layer, "world_override", None) or scene.world)
    return look


def _under_column(look: Look, name: str, scene: Any, world: Any) -> Look:
    """Only the lamps of a light of the palette, and ``world`` if it is one; all lamps if the light has neither."""
    columns = scene.spectral.palette.lights
    if not name:
        raise InvalidInputError(
            "no light of the palette is chosen to look under; "
            + ("choose one" if len(columns) else "the palette has none, so make it first")
            + ", or look at it As It Is"
        )
    column = columns.get(name)
    if column is None:
        known = ", ".join(columns.keys()) or "none"
        raise InvalidInputError(
            f"the palette has no light {name!r} to look under; it has {known}; choose another one, or look at it "
            "As It Is"
        )
    lamps, others = _lamps_of(column, scene)
    with_world = column.world is not None and column.world == world
    shown = lamps if lamps or with_world else None
    look = replace(look, lamps=shown, other_lamps=others, with_world=with_world)
    return replace(look, spectrum=_spectrum_of(column))


def _spectrum_of(column: Any) -> Spectrum | None:
    """The palette's solution for a light, else its given spectrum."""
    return stored.spectrum_of(column, "result") or stored.spectrum_of(column)


def _lamps_of(column: Any, scene: Any) -> tuple[frozenset[str], frozenset[str]]:
    """Names of the lamps in a scene, in its background scenes, and in the collections that these instance: those of a
    column, and the others.
    """
    names: tuple[set[str], set[str]] = set(), set()
    waiting, seen = [each.objects for each in _with_backgrounds(scene)], set()
    while waiting:
        for obj in waiting.pop():
            kind = obj.type
            if kind == "LIGHT":
                names[obj.data != column.light].add(obj.name_full)
            elif kind == "EMPTY" and (collection := obj.instance_collection) is not None and collection not in seen:
                seen.add(collection)
                waiting.append(collection.all_objects)
    return frozenset(names[0]), frozenset(names[1])


def _with_backgrounds(scene: Any) -> list[Any]:
    """A scene, its background scene, that one's, and so on; Blender permits no circle."""
    found = [scene]
    while found[-1].background_set is not None:
        found.append(found[-1].background_set)
    return found


def exposure_of_display(scene: Any, look: Look) -> float:
    """Factor with which the radiance of a picture is seen: the exposure of the scene's view, and that of its look."""
    stops = float(scene.view_settings.exposure) + look.exposure_stops
    return float(2.0 ** min(max(stops, -MOST_STOPS), MOST_STOPS))


def notes_of(look: Look) -> tuple[Note, ...]:
    """What a look changes in a render, and how the render becomes plain again."""
    texts = []
    if look.has_light:
        texts.append("it is rendered under a light of the panel Look Under; choose As It Is there for its own lamps")
    if look.exposure_stops:
        brighter = "brighter" if look.exposure_stops > 0 else "darker"
        stops = counted(abs(look.exposure_stops), "stop", form=".3g")
        texts.append(f"it is {stops} {brighter} by the Exposure of the panel Look Under; set that to 0 for its own")
    return tuple(Note("Look", text) for text in texts)


def require_light(scene: Scene, settings: Any) -> None:
    """Raise InvalidInputError if nothing shines in a translated scene because of the look in ``settings``."""
    from spectral_core.render.light_groups import light_groups

    shown = {"GROUP": f"the light group {settings.group!r}", "COLUMN": f"the palette's light {settings.column!r}"}
    if settings.kind in shown and not light_groups(scene):
        raise InvalidInputError(
            f"the panel Look Under shows {shown[settings.kind]} alone, which gives no light, so there is nothing to "
            "record; choose As It Is there, or make that light shine"
        )


def preview_scene(scene: Scene, managers: Any) -> Scene:
    """A preview's scene with few samples, under the lamp for previews.

    ``managers``: those of all windows, in ``bpy.data``; a thread must not read the context of Blender's main thread.
    """
    film, settings = replace(scene.film, samples=PREVIEW_SAMPLES), replace(scene.settings, denoise=False)
    scene = replace(scene, film=film, settings=settings, notes=())
    windows = (window for manager in managers for window in manager.windows)
    # a preview does not tell its window: the lamp of any scene that is shown and has one
    names = (window.scene.spectral.viewport.preview_lamp.strip() for window in windows)
    name = next(filter(None, names), "")
    return Look(spectrum=catalogue.named("illuminant", name)).on(scene) if name else scene
