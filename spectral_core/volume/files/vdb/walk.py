# SPDX-License-Identifier: GPL-3.0-or-later
"""Validation of an OpenVDB file: its structure is followed, in any packing, before OpenVDB reads it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError
from spectral_core.volume.files.vdb.header import LEAF_LIST, read_metadata, read_word, transform_of
from spectral_core.volume.files.vdb.read import ACTIVE_MASK, BLOSC, CORNER_BYTES, GridReader, coordinates, descriptors
from spectral_core.volume.files.vdb.write import ALL_VALUES, LEAF, NODE_LEAVES, ROOT_NODES, ZIP


def sound_metadata(path: Path, name: str) -> dict[str, Any]:
    """The metadata of a grid whose nodes and values end where the file states; raises FileFormatError otherwise.

    OpenVDB itself trusts every count: a damaged one makes it read forever, or allocate any amount of memory. Its Python
    module ends the whole process if a key or a text of the metadata is not UTF-8; they are therefore read here.
    """
    return _walked(path, name)[1]


def tiles_begin(path: Path, name: str) -> NDArray[np.bool_]:
    """(3,): true along an axis if tiles alone have the lowest active voxels of a grid. A tile is a cube of one value,
    of at least 8³ voxels. Raises FileFormatError.
    """
    walk, _ = _walked(path, name)
    return np.asarray(walk.lowest_of_tiles < walk.lowest_of_leaves)


def _walked(path: Path, name: str) -> tuple[_Walk, dict[str, Any]]:
    try:
        with path.open("rb") as stream:
            for held, kind, start, end in descriptors(stream, path):
                if held == name:
                    stream.seek(start)
                    walk = _Walk(stream, path, kind)
                    return walk, walk.to(end)
    except (struct.error, KeyError) as error:
        raise FileFormatError(f"{path.name} is truncated or invalid: {error}") from error
    raise FileFormatError(f"{path.name} has no grid {name!r}")


class _Walk(GridReader):
    """Follows the structure of a grid without its values, and so in any packing.

    ``lowest_of_tiles``, ``lowest_of_leaves``: (3,) lowest indices of active voxels, infinite without any.
    """

    def to(self, end: int) -> dict[str, Any]:
        """Go through the grid to its end; returns its metadata. Raises FileFormatError or struct.error."""
        self.lowest_of_tiles = np.full(3, np.inf)
        self.lowest_of_leaves = np.full(3, np.inf)
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
        self._meet_tiles(self.corners(entries[:, :12].tobytes())[entries[:, -1] != 0])
        corners = [np.empty((0, 3), np.int64)]
        for _ in range(children):
            for outer in self._children(self.corners(self.take(12)), ROOT_NODES, NODE_LEAVES * LEAF):
                corners.append(self._children(outer, NODE_LEAVES, LEAF))
                self.take(len(corners[-1]) * (LEAF**3 // 8))
        leaves = np.concatenate(corners)
        if metadata.get(LEAF_LIST, len(leaves)) != len(leaves):
            raise FileFormatError(
                f"{self.path.name} is truncated or invalid: it lists {metadata[LEAF_LIST]} leaves and holds "
                f"{len(leaves)}"
            )
        self._leaves(leaves)
        if self.stream.tell() != end:
            raise FileFormatError(f"{self.path.name} is invalid: a grid ends at byte {self.stream.tell()}, not {end}")
        return metadata

    def _children(self, corner: NDArray[np.int64], edge: int, width: int) -> NDArray[np.int64]:
        """Pass over a node; returns the first indices (n, 3) of its children, each ``width`` voxels wide."""
        children, active = self.take(edge**3 // 8), self.take(edge**3 // 8)
        self._skip_values(edge**3, active)
        below, shown = (np.frombuffer(bits, np.uint8) for bits in (children, active))
        self._meet_tiles(corner + _places(shown & ~below, edge) * width)
        return corner + _places(below, edge) * width

    def _meet_tiles(self, corners: NDArray[np.int64]) -> None:
        if len(corners):
            self.lowest_of_tiles = np.minimum(self.lowest_of_tiles, corners.min(axis=0))

    def _leaves(self, corners: NDArray[np.int64]) -> None:
        for corner in corners:
            active = self.take(LEAF**3 // 8)
            if (corner < self.lowest_of_leaves).any():
                found = _places(np.frombuffer(active, np.uint8), LEAF)
                if len(found):
                    self.lowest_of_leaves = np.minimum(self.lowest_of_leaves, corner + found.min(axis=0))
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


def _places(bits: NDArray[np.uint8], edge: int) -> NDArray[np.int64]:
    """Indices (n, 3) in a node of the bits that are set in its mask."""
    return coordinates(np.flatnonzero(np.unpackbits(bits, bitorder="little")), edge)
