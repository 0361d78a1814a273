# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture that follows the dial: the image "Light Dial".

Without a window a change is handled at once; with one a timer handles all changes since its last call together.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import SpectralError
from spectral_core.scene.look import shown

from ...properties import hooks
from ...properties.hooks import Topic
from ..behind import Behind
from ..deferred import Deferred, redraw
from .kept_mix import (
    MISSING,
    designed_factors,
    forget_mixes,
    is_known,
    known_mix,
    live_mix,
    mix_of,
    remember,
    stamp_of,
)
from .members import forget_deleted
from .paths import follow_save, note_paths, transport_path
from .picture import fill, fits_half, in_frame, picture_for, picture_of, place
from .rendered_parts import look_matrix

DELAY_SECONDS = 0.0
"""Time from a change to its picture: the next round of Blender's events, for all changes until then."""
SHARPEN_SECONDS = 0.25
"""Time without a further picture of a dragged light after which it is shown at full size."""


def shares_of(dial: PropertyGroup) -> np.ndarray:
    """Share (n,) of each bulb by Eq. 6.1: they sum to 1, or are all zero if all bulbs are off."""
    from spectral_core.render.relight.dial import dial_weights

    if not len(dial.bulbs):
        return np.zeros(0)
    places = [tuple(bulb.place) for bulb in dial.bulbs]
    return dial_weights(tuple(dial.selector), places, [bulb.is_on for bulb in dial.bulbs])


def weights_of(dial: PropertyGroup) -> np.ndarray:
    """Factor (n,) on the recorded brightness of each bulb's lights: its share times the dial's intensity."""
    return dial.intensity * shares_of(dial)


def show(scene: Scene, *, quick: bool = False) -> Any:
    """Relight now, and put the picture into the image "Light Dial"; returns it.

    ``quick``: a light that is dragged may be shown at half the size until the artist pauses. Raises the errors of
    ``live_mix``; ``dial.message`` holds the text then.
    """
    dial = scene.spectral.dial
    try:
        factors, mix = designed_factors(scene), live_mix(scene)
        can_halve = quick and not bpy.app.background and fits_half(scene, *mix.transport.coverage.shape)
        pixels = mix.picture(weights_of(dial) * factors, quick=can_halve)
        pixels = shown(look_matrix(scene), pixels)
    except (SpectralError, OSError) as error:
        dial.message = str(error)
        raise
    if dial.message:
        dial.message = ""
    image = _store(scene, pixels, is_coarse=mix.is_coarse)
    if quick:
        _prepare_drag(scene, mix)
    place(scene, image, over_camera=dial.over_camera)
    return image


def show_soon(scene: Scene, failed: Callable[[Scene, str], None]) -> None:
    """``show`` for a light that is dragged; a recording that is not in memory is read on a thread first.

    ``failed`` receives the reason if the recording cannot be read then, or cannot show the light.
    """
    stamp = stamp_of(transport_path(scene.spectral.dial))
    if bpy.app.background or is_known(scene, stamp) or stamp[1:] == MISSING:
        show(scene, quick=True)
    else:
        _waiting[scene.session_uid] = failed
        changed(scene)


def _prepare_drag(scene: Scene, mix: Any) -> None:
    """Make further pictures of a slow drag quick, and show its last one at full size."""
    if mix.is_coarse:
        SHARPEN.request(scene)
    index = mix.worth_halving
    if index is not None and not HALVES.is_busy(scene, lambda _: None):
        HALVES.run(scene, lambda: mix.halved(index), lambda _, half: mix.halve(index, half), patience_seconds=0.0)


def _sharpen(scene: Scene) -> None:
    """Show a picture of half the size at its full size."""
    mix = known_mix(scene)
    if mix is not None and mix.is_coarse:
        _show_quietly(scene)


def uncover(scene: Scene) -> None:
    """Remove the picture from the camera view until it is shown again."""
    image = picture_of(scene)
    if image is not None:
        place(scene, image, over_camera=False)


def _uncover_other(scene: Scene) -> None:
    """Uncover the camera view if the picture is not the dial's.

    Blender makes the image anew, in black, after an undo and in an opened file; and after an undo of Record it shows a
    recording of other bulbs.
    """
    image, mix = picture_of(scene), known_mix(scene)
    is_of_others = mix is not None and mix.transport.groups != tuple(bulb.name for bulb in scene.spectral.dial.bulbs)
    if image is not None and (is_of_others or not image.is_dirty):
        uncover(scene)


def _store(scene: Scene, pixels: np.ndarray, *, is_coarse: bool) -> Any:
    if not is_coarse:
        pixels = in_frame(scene, pixels)
    height, width = pixels.shape[:2]
    image = picture_for(scene, width, height, is_coarse=is_coarse)
    fill(image, pixels)
    image.update()
    return image


def changed(scene: bpy.types.Scene) -> None:
    """Update the picture after a change of the dial, if there is a recording."""
    if isinstance(scene, bpy.types.Scene) and scene.spectral.dial.scene_hash:
        LIVE.request(scene)


def _follow(scene: bpy.types.Scene) -> None:
    """Show the dial's picture; a file is read on a thread first."""
    if READS.is_busy(scene, changed):
        return
    path = transport_path(scene.spectral.dial)
    stamp = stamp_of(path)
    if is_known(scene, stamp):
        _show_quietly(scene)
        return
    scene_hash = scene.spectral.dial.scene_hash
    READS.run(scene, lambda: _read(path, scene_hash), partial(_was_read, stamp))


def _read(path: Path, scene_hash: str) -> Any:
    """LiveMix of a file, or a text on why it cannot be read."""
    from spectral_core.render.relight.transport_file import read_transport

    try:
        return mix_of(read_transport(path, scene_hash=scene_hash))
    except (SpectralError, OSError) as error:
        return str(error)


def _was_read(stamp: tuple[str, int, int], scene: bpy.types.Scene, mix: Any) -> None:
    if isinstance(mix, str):
        scene.spectral.dial.message = mix
        uncover(scene)  # the picture is that of another recording, or black
        redraw_dial()
        _tell(scene, mix)
        return
    remember(scene, mix, stamp)  # another file may have been chosen meanwhile
    _show_quietly(scene)


def _show_quietly(scene: bpy.types.Scene) -> None:
    why = ""
    try:
        show(scene)
    except (SpectralError, OSError) as error:  # dial.message reports it
        why = str(error)
        _uncover_other(scene)
    redraw_dial()
    _tell(scene, why)


def _tell(scene: bpy.types.Scene, why: str) -> None:
    """Tell who waits for a light of a recording that was read; "" if it is shown."""
    failed = _waiting.pop(scene.session_uid, None)
    if failed is not None and why:
        failed(scene, why)


_waiting: dict[int, Callable[[Scene, str], None]] = {}
"""By session number of the scene: who waits for a light until the recording is read."""
LIVE = Deferred(_follow, delay_seconds=DELAY_SECONDS)
SHARPEN = Deferred(lambda _: None, _sharpen, delay_seconds=DELAY_SECONDS, rest_seconds=SHARPEN_SECONDS)
READS, HALVES = Behind("light dial"), Behind("half-size light")


def redraw_dial() -> None:
    """Repaint every area that may show the dial or its picture."""
    redraw("VIEW_3D", "IMAGE_EDITOR")


@bpy.app.handlers.persistent
def _after_frame(scene: Scene | None, *_rest: object) -> None:
    """A keyframed selector has moved. During a render this runs beside it, when no image may be written.

    Without a window, a transport is not read for this: a command that renders an animation does not need it.
    """
    if scene is None or scene.animation_data is None or bpy.app.is_job_running("RENDER"):
        return
    if not bpy.app.background or known_mix(scene) is not None:
        changed(scene)


@bpy.app.handlers.persistent
def _after_undo(scene: Scene | None, *_rest: object) -> None:
    """An undo changes the dials of all scenes; Blender names only that of the window in which it was called."""
    for each in bpy.data.scenes:
        if each == scene or known_mix(each) is not None:
            changed(each)


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    """Forget the recording in memory when another file is opened."""
    forget_mixes()
    LIVE.cancel()
    SHARPEN.cancel()
    READS.stop()
    HALVES.stop()
    if not bpy.app.background:
        for scene in {window.scene for window in bpy.context.window_manager.windows}:
            changed(scene)


@bpy.app.handlers.persistent
def _before_save(blend: object = "", *_: object) -> None:
    """A file gets no deleted light and no picture of half the size, and its recording may get another place."""
    forget_deleted()
    for scene in bpy.data.scenes:
        _sharpen(scene)
    note_paths(blend)


HANDLERS = {"frame_change_post": _after_frame, "undo_post": _after_undo, "redo_post": _after_undo,
            "load_post": _after_load, "save_pre": _before_save, "save_post": follow_save,
            "save_post_fail": follow_save}  # fmt: skip


def register() -> None:
    """Start listening to frames, undo and files."""
    hooks.listen(Topic.DIAL, lambda properties: changed(properties.id_data))
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Stop listening, and free the memory."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    hooks.ignore(Topic.DIAL)
    forget_mixes()
    _waiting.clear()
    LIVE.cancel()
    SHARPEN.cancel()
    READS.stop()
    HALVES.stop()
