# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared memory for pixels: a file that the render process and the session both map, with slots that are filled in
turn.

A slot begins with a number that the writer changes before and after writing, so that a reader detects an overwrite. The
session creates and deletes the file; a writer that crashes leaves nothing behind. The name of the file contains the
number of the session's process, so that a later session can delete the files of one that has crashed.
"""

from __future__ import annotations

import atexit
import contextlib
import itertools
import mmap
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import RenderError
from spectral_core.files.of_process import left_in, named_after_process

SLOTS = 3
PREFIX = "spectral-view-"
MEMORY = "/dev/shm"
"""Folder of Linux whose files are kept in memory."""
RESERVE = 2
"""Free space in it per size of an area: another view may grow at the same time."""
_HEAD = 64
"""Bytes before the pixels of a slot."""
_BUSY = np.uint64(0xFFFFFFFFFFFFFFFF)
_numbers = itertools.count(1)
"""Numbers of the pictures of this process: a place in one area fits no picture of the area that replaces it."""
_made: set[str] = set()
"""Files that this process has made and not deleted yet."""
_left: set[str] = set()
"""Those of them that are to be deleted: Windows refuses it while a process has the file mapped."""


@dataclass(frozen=True, slots=True)
class Place:
    """Position of a picture: ``slot``, ``number`` of the picture, its ``height`` and ``width``."""

    slot: int
    number: int
    height: int
    width: int


class PixelArea:
    """A mapped file with room for pictures of ``pixels`` pixels of four 32-bit numbers."""

    def __init__(self, path: str, pixels: int) -> None:
        self.path, self.pixels = path, pixels
        self._size = _HEAD + 16 * pixels
        with Path(path).open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), SLOTS * self._size)
        self._turn = 0

    @classmethod
    def make(cls, pixels: int) -> PixelArea:
        """Create an area, in memory if the system has a folder for that with enough space.

        Raises RenderError if there is not enough space in the folder of temporary files either, OSError if a file
        cannot be made there.
        """
        size = SLOTS * (_HEAD + 16 * pixels)
        handle, path = tempfile.mkstemp(prefix=named_after_process(PREFIX), dir=_folder(size))
        _made.add(path)
        try:
            try:
                os.truncate(handle, size)
                return cls(path, pixels)
            finally:
                os.close(handle)  # after it was mapped: Windows lets nobody delete it in between
        except BaseException:
            _delete(path)
            raise

    def _parts(self, slot: int, count: int) -> tuple[NDArray[np.uint64], NDArray[np.float32]]:
        start = slot * self._size
        head = np.frombuffer(self._map, np.uint64, 1, start)
        return head, np.frombuffer(self._map, np.float32, 4 * count, start + _HEAD)

    def write(self, pixels: NDArray[np.float32]) -> Place:
        """Put a picture (height, width, 4) into the next slot."""
        height, width = pixels.shape[:2]
        self._turn += 1
        slot, number = self._turn % SLOTS, next(_numbers)
        head, body = self._parts(slot, height * width)
        head[0] = _BUSY
        body.reshape(height, width, 4)[:] = pixels
        head[0] = number
        return Place(slot, number, height, width)

    def read(self, place: Place) -> NDArray[np.float32] | None:
        """A copy of the picture at a position; None if the writer has overwritten it, or the area is closed."""
        try:
            head, body = self._parts(place.slot, place.height * place.width)
        except ValueError:
            if self._map.closed:
                return None
            raise
        if head[0] != place.number:
            return None
        pixels = body.reshape(place.height, place.width, 4).copy()
        return pixels if head[0] == place.number else None

    def close(self) -> None:
        """Release the memory here; if another thread reads it at present, it is released after that."""
        with contextlib.suppress(BufferError):
            self._map.close()

    def remove(self) -> None:
        """Close the area and delete the file, at the latest at the end of this process. A process that has it mapped
        keeps its memory.
        """
        self.close()
        _delete(self.path)


def delete_left() -> None:
    """Try again to delete the files that the system has refused to delete."""
    for path in tuple(_left):
        with contextlib.suppress(OSError):
            Path(path).unlink(missing_ok=True)
            _made.discard(path)
            _left.discard(path)


def clean() -> None:
    """Delete files that are left: of this process, and of processes that have ended without deleting them."""
    delete_left()
    for folder in _folders():
        with contextlib.suppress(OSError):  # a folder that cannot be listed
            for path in left_in(folder, PREFIX):
                with contextlib.suppress(OSError):  # another session has deleted it, or it belongs to another user
                    path.unlink()


def _delete(path: str) -> None:
    _left.add(path)
    delete_left()


@atexit.register
def _delete_made() -> None:
    """At the end of this process delete its files. A copy of the process (``os.fork``) has another number."""
    _left.update(path for path in _made if Path(path).name.startswith(f"{PREFIX}{os.getpid()}-"))
    delete_left()


def _folders() -> list[str]:
    """Folders for areas, the preferred one first."""
    return [*([MEMORY] if Path(MEMORY).is_dir() else []), tempfile.gettempdir()]


def _folder(size: int) -> str:
    """The first folder with space for ``size`` bytes and a reserve, else the last one. Raises RenderError.

    The file grows as it is written, and a process that writes where no space is left ends with a bus error. Containers
    often have 64 MB in memory.
    """
    *folders, last = _folders()
    found = next((folder for folder in folders if (_free(folder) or 0) >= RESERVE * size), last)
    left = _free(last)
    if found == last and left is not None and left < size:
        raise RenderError(
            f"the pictures of the view need {size / 1e6:.1f} MB, and the folder of temporary files, {last}, has "
            f"{left / 1e6:.1f} MB left; make room there, or let the variable TMPDIR name a folder of another disk"
        )
    return found


def _free(folder: str) -> int | None:
    """Bytes that this user can write into a folder; None if the system does not tell."""
    try:
        return shutil.disk_usage(folder).free if os.access(folder, os.W_OK) else 0
    except OSError:
        return None
