# SPDX-License-Identifier: GPL-3.0-or-later
"""Validation of an OpenVDB file: its structure is followed, in any packing, before OpenVDB reads it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.errors import FileFormatError
from spectral_core.volume.files.vdb.header import LEAF_LIST, read_metadata, read_word, transform_of
from spectral_core.volume.files.vdb.read import ACTIVE_MASK, BLOSC, CORNER_BYTES, GridReader, descriptors
from spectral_core.volume.files.vdb.write import ALL_VALUES, LEAF, NODE_LEAVES, ROOT_NODES, ZIP


def sound_metadata(path: Path, name: str) -> dict[str, Any]:
    """The metadata of a grid whose nodes and values end where the file states; raises FileFormatError otherwise.

    OpenVDB itself trusts every count: a damaged one makes it read forever, or allocate any amount of memory. Its Python
    module ends the whole process if a key or a text of the metadata is not UTF-8; they are therefore read here.
    """
    try:
        with path.open("rb") as stream:
            for held, kind, start, end in descriptors(stream, path):
                if held == name:
                    stream.seek(start)
                    return _Walk(stream, path, kind).to(end)
    except (struct.error, KeyError) as error:
        raise FileFormatError(f"{path.name} is truncated or invalid: {error}") from error
    raise FileFormatError(f"{path.name} has no grid {name!r}")


class _Walk(GridReader):
    """Follows the structure of a grid without its values, and so in any packing."""

    def to(self, end: int) -> dict[str, Any]:
        """Go through the grid to its end; returns its metadata. Raises FileFormatError or struct.error."""
        self.flags = read_word(self.stream)
        metadata = read_metadata(self.stream)
        if not np.isfinite(transform_of(self.stream, self.path)).all():
            raise FileFormatError(f"a grid of {self.path.name} has a transform that is not finite")
        read_word(self.stream)
        width = self.dtype.itemsize * int(np.prod(self.shape, dtype=int))
        self._width = width
        self.take(width)
        tiles, children = struct.unpack("<II", self.take(8))
        entries = np.frombuffer(self.take(tiles * (12 + width + 1)), np.uint8).reshape(tiles, 12 + width + 1)
        self.corners(entries[:, :12].tobytes())
        leaves = 0
        for _ in range(children):
            self.corners(self.take(12))
            for _ in range(self._children(ROOT_NODES**3)):
                below = self._children(NODE_LEAVES**3)
                self.take(below * (LEAF**3 // 8))
                leaves += below
        if metadata.get(LEAF_LIST, leaves) != leaves:
            raise FileFormatError(
                f"{self.path.name} is truncated or invalid: it lists {metadata[LEAF_LIST]} leaves and holds {leaves}"
            )
        self._leaves(leaves)
        if self.stream.tell() != end:
            raise FileFormatError(f"{self.path.name} is invalid: a grid ends at byte {self.stream.tell()}, not {end}")
        return metadata

    def _children(self, count: int) -> int:
        """Pass over a node; returns the number of its children."""
        children, active = self.take(count // 8), self.take(count // 8)
        self._skip_values(count, active)
        return int.from_bytes(children, "little").bit_count()

    def _leaves(self, count: int) -> None:
        for _ in range(count):
            active = self.take(LEAF**3 // 8)
            if self.dtype == bool:
                self.take(CORNER_BYTES + LEAF**3 // 8)
            else:
                self._skip_values(LEAF**3, active)

    def _skip_values(self, count: int, active: bytes) -> None:
        mark = self.take(1)[0]
        extra = self._width * ((mark in (2, 4, 5)) + (mark == 5)) + (count // 8 if mark in (3, 4, 5) else 0)
        if extra:
            self.take(extra)
        if self.flags & ACTIVE_MASK and mark != ALL_VALUES:
            count = int.from_bytes(active, "little").bit_count()
        size = count * self.stored.itemsize * (self._width // self.dtype.itemsize)
        if self.flags & (ZIP | BLOSC) and self.holds(count):
            held = struct.unpack("<q", self.take(8))[0]
            if abs(held) > size + 64:  # Blosc adds a header of 16 bytes to data that it cannot compress
                raise FileFormatError(f"{self.path.name} is invalid: {abs(held)} packed bytes for {size} plain ones")
            size = abs(held)
        self.take(size)
