# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette's solution in the picture during editing: re-lit if only lights change, else rendered again.

Radiance is linear in the spectrum of each light, at any number of bounces, so a recording shows new lights at once. It
is not linear in a reflectance, whose light reaches other surfaces too: for those, Rendered viewports start again.
"""

from __future__ import annotations

import bpy
import numpy as np
from bpy.types import ID, PropertyGroup, Scene

from spectral_core.errors import SpectralError
from spectral_core.render.same import equal
from spectral_core.spectra.spectrum import Spectrum

from ...properties import hooks
from ...properties.hooks import Topic
from ...properties.render import ENGINE
from ...translate.palette.apply import designed
from ...translate.spectra.stored import stored_samples, strength_of
from ..deferred import Deferred
from ..dial import kept_mix
from ..dial import live as dial_live
from ..dial.dimming import block_of
from ..dial.names import name_of
from .bindings import bound

Shown = dict[int, tuple[Spectrum, float]]

_shown: dict[int, Shown] = {}
"""By scene, the spectra that are shown before they are applied. Not saved: they follow from the table."""
_told: dict[int, str] = {}
"""By scene, how these spectra are shown."""
_seen: set[int] = set()
"""Scenes whose table has been looked at; an opened file and a copy of a scene bring others."""
RELIT = "Re-lit from the recording"
RENDERED = "Rendered anew"


def shown_in(scene: Scene) -> Shown:
    """Spectrum and power factor of each material, light and world that differs from the applied one, by session
    number.
    """
    return _shown.get(scene.session_uid, {})


def follow(scene: Scene) -> None:
    """Show the palette's solution; ``palette.picture`` selects how."""
    palette = scene.spectral.palette
    _seen.add(scene.session_uid)
    if not palette.in_viewport or palette.allow_negative or palette.status in ("", "inaccurate", "invisible"):
        forget(scene)
        return
    before = shown_in(scene)
    blocks, found = _found(palette)
    now = {key: before[key] if key in before and equal(before[key], new) else new for key, new in found.items()}
    if not now and palette.picture:
        palette.picture = ""
    if now.keys() == before.keys() and all(now[key] is before[key] for key in now):
        if now and palette.picture != _told.get(scene.session_uid, palette.picture):
            palette.picture = _told[scene.session_uid]  # an undo step may have that of the solution before
        return
    _shown[scene.session_uid] = now
    scene.update_tag()  # notifies the viewports
    if not now:
        return
    _tell(scene, _relight(scene, {block: now[key] for key, block in blocks.items() if key in now}))


def _tell(scene: Scene, why: str) -> None:
    """Let the panel say how the solution is shown. ``why``: the reason why it is rendered, "" if it is re-lit."""
    told = _told[scene.session_uid] = f"{RENDERED}: {why}" if why else RELIT
    scene.spectral.palette.picture = told


def follow_new(scene: Scene) -> None:
    """Show the stored solution of a scene that was opened or copied, as the option in its table states."""
    if bpy.app.background or scene.session_uid in _seen or bpy.app.is_job_running("RENDER"):
        return
    _seen.add(scene.session_uid)
    _switched(scene.spectral.palette)


def look_at(scene: Scene) -> None:
    """``follow_new``, soon: a view begins to show a scene. Blender calls no handler for a copy of a scene."""
    if scene.session_uid not in _seen:
        NEW.request(scene)


NEW = Deferred(follow_new, delay_seconds=0.0)


def forget(scene: Scene) -> None:
    """Show the scene as it is: after Apply, or if the palette is not to be shown."""
    scene.spectral.palette.picture = ""
    if _shown.pop(scene.session_uid, None):
        scene.update_tag()
        if kept_mix.design(scene, {}) and scene.spectral.dial.scene_hash:
            dial_live.changed(scene)


def _found(palette: PropertyGroup) -> tuple[dict[int, ID], Shown]:
    """Spectra that differ from those of their material, light or world, by session number."""
    level = 2.0**palette.applied_exposure
    blocks: dict[int, ID] = {}
    found: Shown = {}
    for entry, _, block in bound(palette):
        if block is None or entry.result.source == "NONE":
            continue
        spectrum, strength = designed(entry, level)
        same = all(map(np.array_equal, stored_samples(entry.result), stored_samples(block.spectral)))
        if not same or block.spectral.source == "NONE" or abs(strength - strength_of(block)) > 1e-5 * strength:
            blocks[block.session_uid], found[block.session_uid] = block, (spectrum, strength)
    return blocks, found


def _relight(scene: Scene, blocks: dict[ID, tuple[Spectrum, float]]) -> str:
    """Re-light the recording; the reason if that is impossible, "" if it was done."""
    why, lights = _bulbs(scene.spectral.dial, blocks)
    if not why:
        kept_mix.design(scene, lights)
        try:
            dial_live.show_soon(scene, _not_relit)
        except (SpectralError, OSError) as error:
            scene.spectral.dial.message = ""
            why = str(error)
    if why:
        _leave_recording(scene)
    return why


def _leave_recording(scene: Scene) -> None:
    """Let the dial show the recorded lights."""
    kept_mix.design(scene, {})
    if _is_rendered(scene):
        dial_live.uncover(scene)  # it would hide the rendered picture


def _not_relit(scene: Scene, why: str) -> None:
    """A recording that was read meanwhile cannot show the solution."""
    _leave_recording(scene)
    _tell(scene, why)
    if not _is_rendered(scene):
        dial_live.changed(scene)


def _bulbs(
    dial: PropertyGroup, blocks: dict[ID, tuple[Spectrum, float]]
) -> tuple[str, dict[str, tuple[Spectrum, float]]]:
    """Reason why a recording cannot show these spectra, and the new light by bulb."""
    if not dial.scene_hash or not len(dial.bulbs):
        return "the Light Dial has no recording", {}
    if dial.changes:
        return "the scene has changed since the recording", {}
    material = next((block for block in blocks if isinstance(block, bpy.types.Material)), None)
    if material is not None:
        return f"{material.name} reflects other light onto other objects", {}
    lights: dict[str, tuple[Spectrum, float]] = {}
    for block, (spectrum, strength) in blocks.items():
        bulbs = [bulb for bulb in dial.bulbs if any(block_of(member) == block for member in bulb.members)]
        if not bulbs:
            return f"{block.name} is not in the recording", {}
        for bulb in bulbs:
            if any(block_of(member) != block for member in bulb.members):
                return f"{block.name} was recorded together with other lights ({name_of(bulb)})", {}
            lights[bulb.name] = spectrum, strength / max(strength_of(block), 1e-30)
    return "", lights


def _is_rendered(scene: Scene) -> bool:
    """True if a 3D view shows the scene in Rendered mode by this engine."""
    windows = bpy.context.window_manager.windows if scene.render.engine == ENGINE else ()
    areas = (area for window in windows if window.scene == scene for area in window.screen.areas)
    return any(area.type == "VIEW_3D" and area.spaces.active.shading.type == "RENDERED" for area in areas)


def _switched(palette: PropertyGroup) -> None:
    """The option was changed: show the last solution, or the scene as it is."""
    if palette.status and not palette.is_stale:
        follow(palette.id_data)


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    for known in (_shown, _told, _seen):
        known.clear()
    for scene in bpy.data.scenes:  # Blender reports no evaluation of an opened file
        follow_new(scene)


def register() -> None:
    """Start listening to the option, and to files."""
    hooks.listen(Topic.PALETTE_PICTURE, _switched)
    bpy.app.handlers.load_post.append(_after_load)


def unregister() -> None:
    """Stop showing the solution."""
    bpy.app.handlers.load_post.remove(_after_load)
    hooks.ignore(Topic.PALETTE_PICTURE)
    NEW.cancel()
    for known in (_shown, _told, _seen):
        known.clear()
