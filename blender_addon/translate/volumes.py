# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume objects with a transfer function, as sampled volumes of the scene."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.errors import InvalidInputError, SpectralError
from spectral_core.scene import VolumeObject
from spectral_core.volume.field import ScalarVolume

from .context import Translation
from .volume_looks import transfer as volume_looks
from .volume_looks.look import look_of

NO_TRANSFER = (
    "this volume has no spectral transfer function, and its shader's grids are not simulated; it was left out. "
    "Turn on Transfer Function in its data, or put its shader on a closed mesh"
)


def translate_volume(translation: Translation, name: str, obj: Any, instance: Any) -> VolumeObject | None:
    """The VolumeObject ``name`` of an evaluated Volume object; None, with a Note, if it cannot be rendered."""
    data = obj.data
    settings = getattr(data, "spectral", None)
    if settings is None or not settings.enabled:
        translation.note(obj.name, NO_TRANSFER)
        return None
    matrix = np.array(instance.matrix_world, dtype=np.float64)
    try:
        volume = voxels_of(data)
        placed = ScalarVolume(obj.name, volume.data, matrix @ volume.world_from_index)
        stated = volume_looks.stated_transfer(data, translation.rgb_from_working)
        transfer = stated.for_volume(placed, volume_looks.value_range(data))
    except SpectralError as error:
        raise InvalidInputError(str(error)) from error  # the walk over the objects notes it and continues
    return VolumeObject(name, placed.data, placed.world_from_index, transfer, **look_of(settings))


def voxels_of(data: Any) -> ScalarVolume:
    """The data of a Volume data-block at its present frame, in its object space. Raises SpectralError."""
    path = file_of(data)
    try:
        state = path.stat()
    except OSError as error:
        raise InvalidInputError(
            f"the file {path} of volume {data.name!r} cannot be opened ({error.strerror})"
        ) from error
    return _read(path, data.spectral.grid, state.st_mtime_ns, state.st_size)


def file_of(data: Any) -> Path:
    """The OpenVDB file of the present frame."""
    import bpy

    if data.is_sequence:
        data.grids.load()
        if data.grids.frame_filepath:
            return Path(bpy.path.abspath(data.grids.frame_filepath, library=data.library))
        raise InvalidInputError(
            f"the sequence of volume {data.name!r} has no file for this frame: {data.grids.error_message}"
        )
    if not data.filepath:
        raise InvalidInputError(f"volume {data.name!r} has no file; volumes that nodes make are not rendered")
    return Path(bpy.path.abspath(data.filepath, library=data.library))


@lru_cache(maxsize=2)
def _read(path: Path, grid: str, _modified: int, _size: int) -> ScalarVolume:
    """The last two files stay in memory: another F12, or an edit of a transfer function, should not wait for the
    disk.
    """
    from spectral_core.volume.files import read_volume

    return read_volume(path, field=grid or None)
