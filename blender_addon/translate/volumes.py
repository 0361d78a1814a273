# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume objects: with a transfer function as sampled volumes of the scene, else the grids that their shader reads."""

from __future__ import annotations

import atexit
import itertools
import os
import shutil
import weakref
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spectral_core.errors import FileFormatError, InvalidInputError, SpectralError
from spectral_core.files.names import file_words
from spectral_core.files.of_process import temporary_folder
from spectral_core.files.whole_picture import full_disk
from spectral_core.scene import VolumeObject
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.formats.openvdb_format import require_whole
from spectral_core.volume.files.vdb.read import first_of_name, grid_names

from .context import makers_of, whole
from .visibility import cycles_settings
from .volume_looks import transfer as volume_looks
from .volume_looks.look import look_of

if TYPE_CHECKING:
    from spectral_core.volume.files.vdb.together import CommonVoxels

    from .objects import Collected


CHANGING_CURVES = (
    "the ends of its curves are the least and greatest value of each frame, so that they change from frame to frame; "
    "a preset fits them to all frames of the sequence"
)
SEVERAL_GRIDS = (
    "its file holds several grids named {name!r}, and the first is rendered, as Blender does; rename them in the "
    "program that wrote the file to show another one"
)


def has_transfer(data: Any) -> bool:
    """True if a Volume data-block is rendered through a transfer function."""
    settings = getattr(data, "spectral", None)
    return settings is not None and bool(settings.enabled)


def settings_data(obj: Any, depsgraph: Any) -> Any:
    """The evaluated Volume data-block with the transfer function of an evaluated Volume object.

    It is the object's own also if nodes have made the grids: these are in a new data-block without settings.
    """
    own = obj.original.data if obj.original.type == "VOLUME" else None
    return obj.data if own is None or obj.data.original == own else own.evaluated_get(depsgraph)


def note_velocity(found: Collected, obj: Any) -> None:
    """Name a grid of velocities by which Cycles would blur a moving volume."""
    translation, data = found.translation, obj.data
    owner = whole(obj, translation.depsgraph)
    if not translation.scene.render.use_motion_blur or not cycles_settings(owner, "use_motion_blur", True):
        return
    stated = data.original  # Blender does not notify the evaluated copy of a change
    if stated.velocity_scale == 0 or not data.grids.load():
        return
    known = {stated.velocity_grid, *(f"{stated.velocity_grid}{end}" for end in ("x", "y", "z", "X", "Y", "Z"))}
    moving = [grid.name for grid in data.grids if grid.name in known]
    if moving:
        translation.note(obj.name, f"its grid {moving[0]!r} gives no motion blur; Velocity Scale 0 silences this")


def translate_volume(found: Collected, name: str, obj: Any, instance: Any) -> VolumeObject:
    """The VolumeObject ``name`` of an evaluated Volume object. Raises InvalidInputError."""
    translation = found.translation
    data = settings_data(obj, translation.depsgraph)
    settings = data.spectral
    matrix = np.array(instance.matrix_world, dtype=np.float64)
    try:
        saved = saved_of(found, obj, instance)
        volume = voxels_of(obj.data, saved, settings.grid)
        if first_of_name(grid_names(_stated(obj.data, saved)[0]), settings.grid) != settings.grid:
            translation.note(obj.name, SEVERAL_GRIDS.format(name=settings.grid))
        placed = ScalarVolume(obj.name, volume.data, matrix @ volume.world_from_index)
        placed.require_renderable()
        stated = volume_looks.stated_transfer(data, translation.rgb_from_working)
        # Not of ``placed``, which is made anew at each edit.
        stored = volume_looks.value_range(data)
        known = stored or volume.range_without_fill_values
        transfer = stated.for_volume(placed, known)
        low, high = volume.value_range
        if obj.data.is_sequence and known is not stored:
            translation.note(obj.name, CHANGING_CURVES)
        if not (transfer.shows(low, high) or obj.data.is_sequence):  # smoke may begin empty
            translation.note(obj.name, f"its transfer function shows nothing of its values from {low:g} to {high:g}")
    except SpectralError as error:
        raise InvalidInputError(str(error)) from error  # the walk over the objects notes it and continues
    return VolumeObject(name, placed.data, placed.world_from_index, transfer, **look_of(settings))


def voxels_of(data: Any, saved: SavedGrids | None = None, grid: str | None = None) -> ScalarVolume:
    """The data of a Volume data-block at its present frame, in its object space. Raises SpectralError.

    ``saved``: as in ``GridFile``. ``grid``: name of the grid, that of the data-block's settings if it is None.
    """
    return reading_of(data, saved, grid)()


def reading_of(data: Any, saved: SavedGrids | None = None, grid: str | None = None) -> Callable[[], ScalarVolume]:
    """A function that reads what ``voxels_of`` returns, and nothing from Blender: a thread may call it."""
    if saved is None and is_made(data):
        saved = SavedGrids(data)
    path, state = _stated(data, saved)
    name = data.spectral.grid if grid is None else grid

    def read(_kept: SavedGrids | None = saved) -> ScalarVolume:  # the file lasts as long as this refers to it
        return _read(path, name, state.st_mtime_ns, state.st_size)

    return read


def _stated(data: Any, saved: SavedGrids | None) -> tuple[Path, os.stat_result]:
    """The file of a Volume data-block at its present frame, and its size and time. Raises InvalidInputError."""
    path = file_of(data) if saved is None else saved.path
    try:
        return path, path.stat()
    except OSError as error:
        raise InvalidInputError(
            f"the file {path} of volume {data.name!r} cannot be opened ({error.strerror})"
        ) from error


@dataclass(frozen=True)
class GridFile:
    """Grids of a file as it was at a time: two that are equal have the same numbers.

    ``clipping``: absolute value up to which voxels at the ends of the grids do not count, None if all count. ``saved``:
    the file of grids that modifiers or nodes have made, None for a file of the user's.
    """

    path: Path
    names: tuple[str, ...]
    modified: int
    size: int
    clipping: float | None
    saved: SavedGrids | None = field(default=None, compare=False)

    @classmethod
    def of(cls, data: Any, names: list[str], saved: SavedGrids | None) -> GridFile:
        """The file of a Volume data-block at its present frame. Raises InvalidInputError."""
        path, state = _stated(data, saved)
        return cls(path, tuple(names), state.st_mtime_ns, state.st_size, float(data.render.clipping), saved)

    def grids(self) -> CommonVoxels:
        """Its grids at common voxels; missing ones are left out. Raises InvalidInputError."""
        try:
            return _together(self.path, self.names, self.clipping, self.modified, self.size)
        except OSError as error:
            raise InvalidInputError(f"the file {self.path} cannot be opened ({error.strerror})") from error
        except SpectralError as error:
            raise InvalidInputError(str(error)) from error


@lru_cache(maxsize=3)
def _together(path: Path, names: tuple[str, ...], clipping: float | None, _modified: int, _size: int) -> CommonVoxels:
    from spectral_core.volume.files.vdb.together import grids_together

    return grids_together(path, names, clipping)


def file_of(data: Any) -> Path:
    """The OpenVDB file of the present frame."""
    import bpy

    if data.is_sequence:
        data.grids.load()
        if data.grids.frame_filepath:
            return Path(bpy.path.abspath(data.grids.frame_filepath, library=data.library))
        reason = data.grids.error_message
        raise InvalidInputError(
            f"the sequence of volume {data.name!r} has no file for this frame" + (f": {reason}" if reason else "")
        )
    return Path(bpy.path.abspath(data.filepath, library=data.library))


def is_made(data: Any, owner: Any = None) -> bool:
    """True if the grids of an evaluated Volume data-block are not those of its file, or have none: modifiers or nodes
    of its evaluated object ``owner`` have made or changed them.
    """
    if not (data.is_sequence or data.filepath):
        return True
    if owner is None or not len(owner.modifiers) or not data.grids.load():
        return False
    # Blender reads the voxels of a file only where something draws or changes them
    return not len(data.grids) or any(grid.is_loaded for grid in data.grids)


_numbers = itertools.count(1)


@cache
def _folder() -> Path:
    """Folder of saved grids: made when the first are saved, deleted at the end of this process."""
    made, owner = temporary_folder("spectral-volumes-"), os.getpid()

    def delete() -> None:
        if os.getpid() == owner:  # a copy of this process (``os.fork``) leaves it
            shutil.rmtree(made, ignore_errors=True)

    atexit.register(delete)
    return made


class SavedGrids:
    """A file of grids that modifiers or nodes have made or changed, deleted with the last object that refers to it."""

    def __init__(self, data: Any) -> None:
        """``data``: an evaluated Volume data-block. Raises InvalidInputError without grids, FileWriteError."""
        if not len(data.grids):
            raise InvalidInputError(f"volume {data.name!r} has neither a file nor grids; give it one of them")
        self.path = _folder() / f"{file_words([data.name_full])[0]}_{next(_numbers)}.vdb"
        weakref.finalize(self, _delete, self.path)
        try:
            data.grids.save(filepath=str(self.path))
            require_whole(self.path)  # Blender does not report a full disk
        except (RuntimeError, FileFormatError) as error:
            raise full_disk(f"the grids of volume {data.name!r}", self.path, error) from error


def _delete(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


def saved_of(found: Collected, obj: Any, instance: Any) -> SavedGrids | None:
    """The saved grids of an evaluated Volume object, None if they are those of its file.

    In a viewport they are those of an earlier translation until Blender reports another geometry of the object. Raises
    InvalidInputError.
    """
    if not is_made(obj.data, obj):
        return None
    if found.kept is None:
        return SavedGrids(obj.data)
    makers = makers_of(obj, instance)
    key = ("grids", obj.data.as_pointer(), obj.data.session_uid, makers)
    found.kept_meshes.add(key)
    kept: Any = found.kept  # its meshes last as long as these grids
    saved: SavedGrids = kept.mesh(key, makers, lambda: SavedGrids(obj.data))
    return saved


@lru_cache(maxsize=2)
def _read(path: Path, grid: str, _modified: int, _size: int) -> ScalarVolume:
    """The last two files stay in memory: another F12, or an edit of a transfer function, should not wait for the
    disk.
    """
    from spectral_core.volume.files import read_volume

    return read_volume(path, field=first_of_name(grid_names(path), grid) if grid else None)
