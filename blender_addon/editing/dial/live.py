# SPDX-License-Identifier: GPL-3.0-or-later
"""The transport in memory, and the picture that follows the dial: the image "Light Dial".

Without a window a change is handled at once; with one a timer handles all changes since its last call together.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError, SpectralError

from ...properties import hooks
from ...properties.hooks import Topic
from ..behind import Behind
from ..deferred import Deferred, redraw
from .paths import follow_save, note_paths, transport_path
from .picture import picture_for, picture_of, place

if TYPE_CHECKING:
    from spectral_core.render.relight.transport import Transport

DELAY_SECONDS = 0.0
MISSING = (0, 0)
"""Time and size of a file that is not there."""


@dataclass
class _Session:
    """Transport of one scene as last read; ``stamp`` shows if its file is unchanged. An undo may ask for another."""

    stamp: tuple[str, int, int]
    live: Any
    lamps: list[Any]

    def is_current(self, stamp: tuple[str, int, int], dial: PropertyGroup) -> bool:
        """True if this is the dial's recording, and the file is unchanged, or missing: a save moved its path."""
        is_own = self.live.transport.scene_hash == dial.scene_hash
        return is_own and (self.stamp == stamp or stamp[1:] == MISSING)


_sessions: dict[int, _Session] = {}
_designed: dict[int, dict[str, tuple[Any, float]]] = {}
"""By scene and bulb the spectrum of a palette's solution for its lights, and a factor on their brightness."""


def design(scene: Scene, lights: dict[str, tuple[Any, float]]) -> bool:
    """Let only these bulbs show spectra that are not applied yet; True if others were shown before."""
    before = _designed.pop(scene.session_uid, {})
    if lights:
        _designed[scene.session_uid] = lights
    return bool(before)


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


def live_mix(scene: Scene) -> Any:
    """The LiveMix of a scene's transport, read if it is not in memory, with the bulbs' lamps in it.

    Raises FileFormatError for a file that is missing, truncated, edited or of another scene, InvalidInputError if
    nothing was recorded yet, or if a lamp needs spectra that the storage does not keep.
    """
    from spectral_core.render.relight.mix import LiveMix
    from spectral_core.render.relight.transport_file import read_transport

    dial = scene.spectral.dial
    if not len(dial.bulbs) or not dial.scene_hash:
        raise InvalidInputError("no transport is recorded yet; press Record")
    path = transport_path(dial)
    known, stamp = _sessions.get(scene.session_uid), _stamp(path)
    if known is None or not known.is_current(stamp, dial):
        transport = read_transport(path, scene_hash=dial.scene_hash)
        known = _Session(stamp, LiveMix(transport), [""] * len(transport.groups))
        _sessions[scene.session_uid] = known
    _require_same_bulbs(dial, known.live.transport)
    _assign_lamps(scene, known)
    return known.live


def _stamp(path: Path) -> tuple[str, int, int]:
    """Values that distinguish a file from a later one at the same path."""
    try:
        facts = path.stat()
    except OSError:
        return str(path), *MISSING
    return str(path), facts.st_mtime_ns, facts.st_size


def _require_same_bulbs(dial: PropertyGroup, transport: Transport) -> None:
    names = tuple(bulb.name for bulb in dial.bulbs)
    if names != transport.groups:
        raise InvalidInputError(
            f"the dial has bulbs {', '.join(map(repr, names))}, the transport light groups "
            f"{', '.join(map(repr, transport.groups))}; record it again"
        )


def _assign_lamps(scene: Scene, session: _Session) -> None:
    """Give each group the designed light or the lamp of its bulb, or its own spectrum back without one.

    A lamp is identified by its name, a designed light by its spectrum.
    """
    from spectral_core.render.relight.mix import LiveMix

    from ...translate.spectra import catalogue

    dial, designed = scene.spectral.dial, _designed.get(scene.session_uid, {})
    wanted = [designed[bulb.name][0] if bulb.name in designed else bulb.lamp for bulb in dial.bulbs]
    if any(before != "" and now == "" for before, now in zip(session.lamps, wanted, strict=True)):
        session.live = LiveMix(session.live.transport)
        session.lamps = [""] * len(wanted)
    for number, (before, now) in enumerate(zip(session.lamps, wanted, strict=True)):
        if now is not before and now != "" and now != before:
            light = catalogue.named("illuminant", now) if isinstance(now, str) else now
            session.live.set_light(dial.bulbs[number].name, light)
            session.lamps[number] = now


def remember(scene: Scene, mix: Any, stamp: tuple[str, int, int] | None = None) -> None:
    """Keep a transport as its LiveMix, instead of reading it again.

    ``stamp``: of its file before it was read; None for the dial's file, which was just written.
    """
    stamp = stamp or _stamp(transport_path(scene.spectral.dial))
    _sessions[scene.session_uid] = _Session(stamp, mix, [""] * len(mix.transport.groups))


def mix_of(transport: Transport) -> Any:
    """LiveMix with the pictures of its groups, which take a moment each; reads nothing from Blender."""
    from spectral_core.render.relight.mix import LiveMix

    mix = LiveMix(transport)
    with contextlib.suppress(SpectralError):  # a group of unlike lights, which ``show`` reports
        mix.picture(np.ones(len(transport.groups)))
    return mix


def show(scene: Scene) -> Any:
    """Relight now, and put the picture into the image "Light Dial"; returns it.

    Raises the errors of ``live_mix``; ``dial.message`` holds the text then.
    """
    dial = scene.spectral.dial
    try:
        designed = _designed.get(scene.session_uid, {})
        factors = [designed[bulb.name][1] if bulb.name in designed else 1.0 for bulb in dial.bulbs]
        pixels = live_mix(scene).picture(weights_of(dial) * factors)
    except (SpectralError, OSError) as error:
        dial.message = str(error)
        raise
    if dial.message:
        dial.message = ""
    image = _store(scene, pixels)
    place(scene, image, over_camera=dial.over_camera)
    return image


def uncover(scene: Scene) -> None:
    """Remove the picture from the camera view until it is shown again."""
    image = picture_of(scene)
    if image is not None:
        place(scene, image, over_camera=False)


def _store(scene: Scene, pixels: np.ndarray) -> Any:
    height, width = pixels.shape[:2]
    image = picture_for(scene, width, height)
    image.pixels.foreach_set(pixels.reshape(-1))
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
    known, path = _sessions.get(scene.session_uid), transport_path(scene.spectral.dial)
    stamp = _stamp(path)
    if known is not None and known.is_current(stamp, scene.spectral.dial):
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
        redraw_dial()
        return
    remember(scene, mix, stamp)  # another file may have been chosen meanwhile
    _show_quietly(scene)


def _show_quietly(scene: bpy.types.Scene) -> None:
    with contextlib.suppress(SpectralError, OSError):  # dial.message reports it
        show(scene)
    redraw_dial()


LIVE = Deferred(_follow, delay_seconds=DELAY_SECONDS)
READS = Behind("light dial")


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
    if not bpy.app.background or scene.session_uid in _sessions:
        changed(scene)


@bpy.app.handlers.persistent
def _after_undo(scene: Scene | None, *_rest: object) -> None:
    if scene is not None:
        changed(scene)


@bpy.app.handlers.persistent
def _after_load(*_: object) -> None:
    """Forget the recording in memory when another file is opened."""
    _sessions.clear()
    _designed.clear()
    LIVE.cancel()
    READS.stop()
    if not bpy.app.background:
        changed(bpy.context.scene)


HANDLERS = {"frame_change_post": _after_frame, "undo_post": _after_undo, "redo_post": _after_undo,
            "load_post": _after_load, "save_pre": note_paths, "save_post": follow_save,
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
    _sessions.clear()
    _designed.clear()
    LIVE.cancel()
    READS.stop()
