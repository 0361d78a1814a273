# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of OpenVDB sequences that Blender opened itself: their transfer functions refer to the range of all frames.

The import stores this range. Without it each frame would have curves of its own, and smoke that fades kept its density.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.types import Volume

from spectral_core.errors import RenderCancelled, SpectralError

if TYPE_CHECKING:
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files.sequence import VolumeSequence


@dataclass(frozen=True)
class FrameRange:
    """The frame of the widest range of values, and the range of all frames."""

    widest: ScalarVolume
    ends: tuple[float, float]


def is_own_sequence(data: Volume) -> bool:
    """True for a sequence that Spectral did not import."""
    return bool(data.is_sequence and not data.spectral.source)


def frames_of(data: Volume) -> VolumeSequence | None:
    """The files of such a sequence; None for other volumes, and for a single file."""
    from spectral_core.volume.files import sequence_of

    if not is_own_sequence(data):
        return None
    path = Path(bpy.path.abspath(data.filepath, library=data.library))
    return sequence_of(path, field=data.spectral.grid or None)


def range_of(frames: VolumeSequence, stopping: threading.Event) -> FrameRange | None:
    """The range of all frames that can be read; None if none can. Reads nothing from Blender."""
    widest: ScalarVolume | None = None
    low, high = np.inf, -np.inf
    for volume in _readable(frames, stopping):
        own = volume.range_without_fill_values
        low, high = min(low, own[0]), max(high, own[1])
        if widest is None or np.ptp(own) > np.ptp(widest.range_without_fill_values):
            widest = volume
    return None if widest is None else FrameRange(widest, (float(low), float(high)))


def _readable(frames: VolumeSequence, stopping: threading.Event) -> Iterator[ScalarVolume]:
    for number in frames.numbers:
        if stopping.is_set():
            raise RenderCancelled("stopped; nothing has changed")
        with suppress(SpectralError, OSError):  # the render of such a frame has a note
            yield frames.read(number)
