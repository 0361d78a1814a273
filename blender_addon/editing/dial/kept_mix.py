# SPDX-License-Identifier: GPL-3.0-or-later
"""The recording of each scene in memory: a mix of its lights, with the lamps and designed spectra of the bulbs."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from bpy.types import PropertyGroup, Scene

from spectral_core.errors import InvalidInputError, SpectralError

from .paths import transport_path

if TYPE_CHECKING:
    from spectral_core.render.relight.transport import Transport

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
    known, stamp = _sessions.get(scene.session_uid), stamp_of(path)
    if known is None or not known.is_current(stamp, dial):
        transport = read_transport(path, scene_hash=dial.scene_hash)
        known = _Session(stamp, LiveMix(transport), [""] * len(transport.groups))
        _sessions[scene.session_uid] = known
    _require_same_bulbs(dial, known.live.transport)
    _assign_lamps(scene, known)
    return known.live


def stamp_of(path: Path) -> tuple[str, int, int]:
    """Values that distinguish a file from a later one at the same path."""
    try:
        facts = path.stat()
    except OSError:
        return str(path), *MISSING
    return str(path), facts.st_mtime_ns, facts.st_size


def _require_same_bulbs(dial: PropertyGroup, transport: Transport) -> None:
    from spectral_core.render.light_groups import group_text

    names = tuple(bulb.name for bulb in dial.bulbs)
    if names != transport.groups:
        raise InvalidInputError(
            f"the dial has bulbs {', '.join(map(group_text, names))}, the transport light groups "
            f"{', '.join(map(group_text, transport.groups))}; record it again"
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
    stamp = stamp or stamp_of(transport_path(scene.spectral.dial))
    _sessions[scene.session_uid] = _Session(stamp, mix, [""] * len(mix.transport.groups))


def mix_of(transport: Transport) -> Any:
    """LiveMix with the pictures of its groups, which take a moment each; reads nothing from Blender."""
    from spectral_core.render.relight.mix import LiveMix

    mix = LiveMix(transport)
    with contextlib.suppress(SpectralError):  # a group of unlike lights, which ``show`` reports
        mix.picture(np.ones(len(transport.groups)))
    return mix


def designed_factors(scene: Scene) -> list[float]:
    """Factor on the brightness of each bulb by the palette's solution, 1 for the others."""
    designed = _designed.get(scene.session_uid, {})
    return [designed[bulb.name][1] if bulb.name in designed else 1.0 for bulb in scene.spectral.dial.bulbs]


def known_mix(scene: Scene) -> Any:
    """The LiveMix in memory, whatever its file; None if there is none."""
    known = _sessions.get(scene.session_uid)
    return None if known is None else known.live


def is_known(scene: Scene, stamp: tuple[str, int, int]) -> bool:
    """True if the recording in memory is the dial's, of a file with this stamp."""
    known = _sessions.get(scene.session_uid)
    return known is not None and known.is_current(stamp, scene.spectral.dial)


def forget_mixes() -> None:
    """Free the memory of all scenes."""
    _sessions.clear()
    _designed.clear()
