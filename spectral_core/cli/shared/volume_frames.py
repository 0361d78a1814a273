# SPDX-License-Identifier: GPL-3.0-or-later
"""The volumes of a call of ``volume``: one, or the frames of a sequence, with one transfer function and one camera."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from spectral_core.checks import require_range
from spectral_core.cli.shared.fill_values import noted
from spectral_core.errors import InvalidInputError

if TYPE_CHECKING:
    from spectral_core.volume.documents.transfer_document import TransferDocument
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.transfer import TransferFunction

LENGTHS = (1e-30, 1e30)
"""Least and largest edge of a voxel: its square is still a number of double precision."""


@dataclass(frozen=True)
class Frame:
    """A volume to come: its number in a sequence, the file or sample that names it, and its reader."""

    number: int | None
    path: str | Path
    read: Callable[[], ScalarVolume]


def frames_of(arguments: argparse.Namespace) -> list[Frame]:
    """The frames of a sequence, or the only volume."""
    from spectral_core.volume.files import RawLayout, find_sequence, read_volume

    raw = None
    if arguments.spacing is not None:
        for each in arguments.spacing:
            require_range("--spacing", each, *LENGTHS)
    if (arguments.raw_shape is None) != (arguments.raw_type is None):
        raise InvalidInputError("--raw-shape and --raw-type go together; give both or neither")
    if arguments.raw_shape is not None:
        raw = RawLayout(tuple(arguments.raw_shape), arguments.raw_type, arguments.raw_order, arguments.raw_offset)
    if arguments.volume.startswith("sample:"):
        return [Frame(None, "", lambda: spaced(_sample(arguments.volume), arguments.spacing))]
    options = {"field": arguments.field, "component": arguments.component, "raw": raw}
    # A file of that very name is no pattern: "head #2.nrrd".
    if any(mark in Path(arguments.volume).name for mark in "#%*{") and not Path(arguments.volume).exists():
        sequence = find_sequence(arguments.volume, **options)
        if sequence.missing_note:
            print(sequence.missing_note)
        return [
            Frame(n, path, partial(lambda n: spaced(sequence.read(n), arguments.spacing), n))
            for n, path in sequence.frames
        ]
    return [Frame(None, arguments.volume, lambda: spaced(read_volume(arguments.volume, **options), arguments.spacing))]


def _sample(given: str) -> ScalarVolume:
    from spectral_core.volume.samples import sample_named, sample_volume

    return sample_volume(*sample_named(given, 96))


def spaced(volume: ScalarVolume, spacing: list[float] | None) -> ScalarVolume:
    """The volume with voxels of another size; its position and the directions of its axes stay the file's."""
    import numpy as np

    from spectral_core.volume.field import ScalarVolume

    if spacing is None:
        return volume
    matrix = volume.world_from_index.copy()
    matrix[:3, :3] *= np.array(spacing) / volume.voxel_size
    return ScalarVolume(volume.name, volume.data, matrix)


def transfer_of(given: str, frames: Sequence[Frame]) -> Callable[[ScalarVolume], TransferFunction]:
    """The transfer function of each volume: one for all frames, or their pictures would not be comparable."""
    from spectral_core.volume.documents.transfer_document import stated_in_fractions
    from spectral_core.volume.documents.transfer_file import read_transfer
    from spectral_core.volume.presets import PRESETS, preset

    named = given.removeprefix("preset:")  # as the integrator's files spell it
    is_file = Path(given).suffix.lower() in (".toml", ".json") or (named not in PRESETS and Path(given).is_file())
    if len(frames) == 1:  # its file is read first
        return lambda volume: preset(named, noted(volume)) if not is_file else _fitted(read_transfer(given), volume)
    stated = read_transfer(given) if is_file else None
    if stated is not None and stated.values == "data":
        return stated.for_volume
    ranges = [noted(frame.read()).range_without_fill_values for frame in frames]
    all_frames = min(low for low, _ in ranges), max(high for _, high in ranges)
    if stated is None:  # fitted to the frame of the widest range, and stretched to that of all frames
        widest = frames[max(range(len(ranges)), key=lambda index: ranges[index][1] - ranges[index][0])].read()
        stated = stated_in_fractions(preset(named, widest), widest)
    return partial(stated.for_volume, value_range=all_frames)


def _fitted(stated: TransferDocument, volume: ScalarVolume) -> TransferFunction:
    return stated.for_volume(volume if stated.values == "data" else noted(volume))


def framed(frames: Sequence[Frame]) -> ScalarVolume | None:
    """A volume that fills the space of all frames, for their camera; None if each fills the same, or there is one only.

    The grid of an OpenVDB file has the size of what it holds: fitted to each frame alone, smoke that grows would keep
    its size in the pictures.
    """
    import numpy as np

    from spectral_core.volume.field import ScalarVolume

    if len(frames) < 2:
        return None
    corners = [volume.corners_world for volume in (frame.read() for frame in frames) if not _is_empty(volume)]
    if not corners or np.ptp(corners, axis=0).max() <= 1e-6 * np.ptp(corners[0], axis=0).max():
        return None
    low, high = np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))
    matrix = np.diag([*(high - low), 1.0])
    matrix[:3, 3] = (low + high) / 2
    return ScalarVolume("all frames", np.zeros((1, 1, 1), np.float32), matrix)


def _is_empty(volume: ScalarVolume) -> bool:
    """True for the voxel of 0 that a sequence has in place of an empty grid."""
    return volume.data.size == 1 and not volume.data.any()
