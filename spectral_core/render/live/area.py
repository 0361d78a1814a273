# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared memory for pixels: a file that the render process and the session both map, with slots that are filled in
turn.

A slot begins with a number that the writer changes before and after writing, so that a reader detects an overwrite. The
session creates and deletes the file; a writer that crashes leaves nothing behind.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SLOTS = 3
_HEAD = 64
"""Bytes before the pixels of a slot."""
_BUSY = np.uint64(0xFFFFFFFFFFFFFFFF)


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
        self._number = 0

    @classmethod
    def make(cls, pixels: int) -> PixelArea:
        """Create an area, in memory if the system has a folder for that. Raises OSError if there is not enough
        space.
        """
        folder = "/dev/shm" if Path("/dev/shm").is_dir() else None
        handle, path = tempfile.mkstemp(prefix="spectral-view-", dir=folder)
        try:
            os.truncate(handle, SLOTS * (_HEAD + 16 * pixels))
        finally:
            os.close(handle)
        return cls(path, pixels)

    def _parts(self, slot: int, count: int) -> tuple[NDArray[np.uint64], NDArray[np.float32]]:
        start = slot * self._size
        head = np.frombuffer(self._map, np.uint64, 1, start)
        return head, np.frombuffer(self._map, np.float32, 4 * count, start + _HEAD)

    def write(self, pixels: NDArray[np.float32]) -> Place:
        """Put a picture (height, width, 4) into the next slot."""
        height, width = pixels.shape[:2]
        self._number += 1
        slot = self._number % SLOTS
        head, body = self._parts(slot, height * width)
        head[0] = _BUSY
        body.reshape(height, width, 4)[:] = pixels
        head[0] = self._number
        return Place(slot, self._number, height, width)

    def read(self, place: Place) -> NDArray[np.float32] | None:
        """A copy of the picture at a position; None if the writer has overwritten it."""
        head, body = self._parts(place.slot, place.height * place.width)
        if head[0] != place.number:
            return None
        pixels = body.reshape(place.height, place.width, 4).copy()
        return pixels if head[0] == place.number else None

    def remove(self) -> None:
        """Delete the file; mapped memory stays valid until both processes release it."""
        with contextlib.suppress(OSError):
            Path(self.path).unlink()
