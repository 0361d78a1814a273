# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB files without OpenVDB: grids of numbers, plain or zipped, for a Python without the module.

Reads file versions from 222 on and trees 5-4-3, which programs write since 2013. Blosc, the packing that
OpenVDB itself prefers, is left to OpenVDB. See ``vdb_write`` for the layout.
"""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, MissingDependencyError
from spectral_core.volume.files.vdb.grid import PlainGrid, Tiles
from spectral_core.volume.files.vdb.header import exactly, read_metadata, read_text, read_word, transform_of
from spectral_core.volume.files.vdb.write import ALL_VALUES, LEAF, MAGIC, NODE_LEAVES, ROOT_NODES, ZIP

ACTIVE_MASK, BLOSC = 2, 4
FIRST_VERSION = 222
LEAF_BYTES = LEAF**3 // 8 + 1
"""Least number of bytes for the values of a leaf: a mask and a mark."""
CORNER_BYTES = 12
"""Bytes of the corner of a leaf."""
TILE_BYTES, MOST_TILE_BYTES = 41, 512 << 20
FARTHEST = 1 << 29
"""Greatest index of a node of the root, of either sign."""
_TYPES = {
    "bool": "?",
    "float": "<f4",
    "double": "<f8",
    "int32": "<i4",
    "int64": "<i8",
    "vec3s": "<3f4",
    "vec3d": "<3f8",
    "vec3i": "<3i4",
}


def grid_names(path: Path) -> list[str]:
    """Names of the grids of a file. Raises FileFormatError."""
    with path.open("rb") as stream:
        return [name for name, *_ in descriptors(stream, path)]


def read_grid(path: Path, name: str) -> PlainGrid:
    """The grid of that name. Raises FileFormatError for truncated or invalid files, MissingDependencyError for
    Blosc.
    """
    try:
        with path.open("rb") as stream:
            for held, kind, start, _ in descriptors(stream, path):
                if held == name:
                    stream.seek(start)
                    return GridReader(stream, path, kind).grid(name)
    except (struct.error, zlib.error, ValueError, KeyError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(f"{path.name} is truncated or invalid: {error}") from error
    raise FileFormatError(f"{path.name} has no grid {name!r}")


def grid_background(path: Path, name: str) -> Any:
    """The value of a grid where it has no voxels: a number, or (3,). Raises FileFormatError."""
    try:
        with path.open("rb") as stream:
            for held, kind, start, _ in descriptors(stream, path):
                if held == name:
                    stream.seek(start)
                    reader = GridReader(stream, path, kind)
                    reader.head()
                    return reader.background
    except (struct.error, ValueError, KeyError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(f"{path.name} is truncated or invalid: {error}") from error
    raise FileFormatError(f"{path.name} has no grid {name!r}")


def descriptors(stream: BinaryIO, path: Path) -> list[tuple[str, str, int, int]]:
    """(name, tree type, start, end) of each grid. Grids of one name have OpenVDB's own names, ``density[0]``,
    ``density[1]`` and so on.
    """
    size = path.stat().st_size
    try:
        magic, version = struct.unpack("<qI", stream.read(12))
        if magic != MAGIC or version < FIRST_VERSION:
            raise FileFormatError(
                f"{path.name} is an OpenVDB file of version {version}; expected {FIRST_VERSION} or later"
            )
        stream.seek(8 + 1 + 36, 1)
        read_metadata(stream)
        found = []
        for _ in range(read_word(stream)):
            name, kind, parent = read_text(stream), read_text(stream), read_text(stream)
            start, _, end = struct.unpack("<3q", stream.read(24))
            if not stream.tell() <= start <= end <= size:
                raise FileFormatError(f"{path.name} is truncated: its grids end at byte {end}, the file at byte {size}")
            if not parent:
                found.append((name, kind, start, end))
            stream.seek(end)
    except struct.error as error:
        raise FileFormatError(f"{path.name} is truncated: it ends within its list of grids") from error
    return [(name, *rest) for name, (_, *rest) in zip(_distinct([each[0] for each in found]), found, strict=True)]


def first_of_name(names: list[str], name: str) -> str:
    """``name``, or that of the first of several grids that share it, which Blender shows; ``names`` are a file's."""
    return f"{name}[0]" if name not in names and f"{name}[0]" in names else name


def _distinct(stored: list[str]) -> list[str]:
    """Names of grids; the file distinguishes grids of one name by a number after a record separator."""
    parts = [name.partition("\x1e") for name in stored]
    plain = [name for name, _, _ in parts]
    return [f"{name}[{number}]" if number and plain.count(name) > 1 else name for name, _, number in parts]


class GridReader:
    """Reads one grid in the order of the file."""

    def __init__(self, stream: BinaryIO, path: Path, tree: str) -> None:
        self.stream, self.path = stream, path
        self._held = 0
        self.tiles: list[tuple[NDArray[np.int64], int, NDArray[Any], NDArray[np.bool_]]] = []
        words = tree.removesuffix("_HalfFloat").split("_")
        if words[0] != "Tree" or words[2:] != ["5", "4", "3"] or words[1] not in _TYPES:
            raise FileFormatError(f"a grid of {path.name} is a {tree}; expected numbers in a tree 5-4-3")
        base = np.dtype(_TYPES[words[1]])
        self.shape = base.shape
        self.dtype = base.base if base.shape else base
        # The mark is also on grids of integers, which OpenVDB stores whole.
        self.stored = np.dtype("<f2") if tree.endswith("_HalfFloat") and self.dtype.kind == "f" else self.dtype

    def head(self) -> tuple[dict[str, Any], NDArray[np.float64]]:
        """Metadata and matrix of the grid; reads its background, which no grid packs."""
        self.flags = read_word(self.stream)
        metadata = read_metadata(self.stream)
        matrix = transform_of(self.stream, self.path)
        read_word(self.stream)  # buffers per leaf: one
        self.background = self._numbers(1)[0]
        return metadata, matrix

    def grid(self, name: str) -> PlainGrid:
        metadata, matrix = self.head()
        if self.flags & BLOSC:
            raise MissingDependencyError(
                f"{self.path.name} is packed with Blosc, which needs OpenVDB's own Python module: open it in a Blender "
                "from blender.org, or save it without Blosc"
            )
        tiles, children = struct.unpack("<II", self.take(8))
        for _ in range(tiles):
            corner, value = self.corners(self.take(12))[0], self._numbers(1)
            active = np.array([self.take(1) != b"\0"])
            self.tiles.append((corner[None], ROOT_NODES * NODE_LEAVES * LEAF, value, active))
        origins: list[NDArray[np.int64]] = []
        for _ in range(children):
            for outer in self._node(self.corners(self.take(12))[0], ROOT_NODES, NODE_LEAVES * LEAF):
                for inner in self._node(outer, NODE_LEAVES, LEAF):
                    origins.append(inner)
                    self.take(LEAF**3 // 8)
        left = os.fstat(self.stream.fileno()).st_size - self.stream.tell()
        if len(origins) * LEAF_BYTES > left:  # before memory is allocated for them
            raise struct.error(f"{left} bytes for the values of {len(origins)} leaves")
        leaves = np.empty((len(origins), LEAF**3, *self.shape), self.dtype.newbyteorder("="))
        active = np.empty((len(origins), LEAF**3), bool)
        for index in range(len(origins)):
            active[index] = self._mask(LEAF**3)
            leaves[index] = self._leaf_values(active[index])
        cube = (len(origins), LEAF, LEAF, LEAF)
        corners = np.array(origins, np.int64).reshape(-1, 3)
        values = leaves.reshape(*cube, *self.shape)
        leaf_active = active.reshape(cube)
        return PlainGrid(name, metadata, matrix, self.background, values, corners, leaf_active, self._tiles())

    def _node(self, corner: NDArray[np.int64], edge: int, width: int) -> list[NDArray[np.int64]]:
        """First indices of the children of a node, each ``width`` voxels wide; its tiles are kept."""
        children, active = self._mask(edge**3), self._mask(edge**3)
        values = self._values(edge**3, active)
        shown = np.any((values != self.background).reshape(edge**3, -1), axis=1) | active
        places = np.flatnonzero(shown & ~children)
        self.tiles.append((corner + coordinates(places, edge) * width, width, values[places], active[places]))
        self._held += len(places) * TILE_BYTES
        if self._held > MOST_TILE_BYTES:
            raise FileFormatError(
                f"{self.path.name} holds over {MOST_TILE_BYTES // TILE_BYTES:,} tiles, more than are read here; open "
                "it in a Blender from blender.org, whose OpenVDB reads it"
            )
        return list(corner + coordinates(np.flatnonzero(children), edge) * width)

    def _tiles(self) -> Tiles:
        corners, widths, values, active = zip(*self.tiles, strict=True) if self.tiles else ((), (), (), ())
        empty = np.empty((0, *self.shape), self.dtype)
        return Tiles(
            np.concatenate([np.empty((0, 3), np.int64), *corners]),
            np.repeat(np.array(widths, np.int64), [len(each) for each in corners]),
            np.concatenate([empty, *values]),
            np.concatenate([np.empty(0, bool), *active]),
        )

    def corners(self, stored: bytes) -> NDArray[np.int64]:
        """First indices (n, 3) of entries of the root, each a node or tile of 4096³ voxels. Raises FileFormatError.

        OpenVDB trusts them. Voxels of an entry elsewhere may have indices beyond its 32 bits, and end the process; so
        do voxels near the ends of these 32 bits when they are copied.
        """
        found = np.frombuffer(stored, "<i4").astype(np.int64).reshape(-1, 3)
        width = ROOT_NODES * NODE_LEAVES * LEAF
        wrong = np.flatnonzero((found % width).any(axis=1) | (np.abs(found) > FARTHEST).any(axis=1))
        if wrong.size:
            raise FileFormatError(
                f"{self.path.name} is invalid: a node of the root begins at voxel {tuple(found[wrong[0]].tolist())}; "
                f"expected multiples of {width} within {FARTHEST:,} of 0"
            )
        return found

    def _values(self, count: int, active: NDArray[np.bool_]) -> NDArray[Any]:
        """``readCompressedValues`` of OpenVDB: all values, or the active ones and a rule for the others."""
        mark = self.take(1)[0]
        negative = ~self.background if self.dtype == bool else -self.background
        others = [negative if mark == 1 else self.background, self.background]
        if mark in (2, 4, 5):
            others[0] = self._numbers(1)[0]
        if mark == 5:
            others[1] = self._numbers(1)[0]
        chosen = self._mask(count) if mark in (3, 4, 5) else np.zeros(count, bool)
        if mark == 3:
            others[0] = negative
        if not self.flags & ACTIVE_MASK or mark == ALL_VALUES:
            return self._packed(count)
        values = np.where(chosen.reshape(-1, *[1] * len(self.shape)), others[1], others[0]).astype(self.dtype)
        values[active] = self._packed(int(active.sum()))
        return values

    def _leaf_values(self, active: NDArray[np.bool_]) -> NDArray[Any]:
        """Values of a leaf: of Booleans its corner and a mask, never packed."""
        if self.dtype != bool:
            return self._values(LEAF**3, active)
        self.take(CORNER_BYTES)
        return self._mask(LEAF**3)

    def holds(self, count: int) -> bool:
        """False where a node has no values to store: of half floats OpenVDB then omits their number of bytes too."""
        return count > 0 or self.stored == self.dtype

    def _packed(self, count: int) -> NDArray[Any]:
        size = count * self.stored.itemsize * int(np.prod(self.shape, dtype=int))
        is_zipped = self.flags & ZIP and self.holds(count)
        held = struct.unpack("<q", self.take(8))[0] if is_zipped else -size
        plain = zlib.decompressobj().decompress(self.take(held), size + 1) if held > 0 else self.take(-held)
        if len(plain) != size:
            raise FileFormatError(f"{self.path.name} is invalid: a node has {len(plain)} bytes where {size} are due")
        return np.frombuffer(plain, self.stored).reshape(-1, *self.shape).astype(self.dtype)

    def _numbers(self, count: int) -> NDArray[Any]:
        width = self.dtype.itemsize * int(np.prod(self.shape, dtype=int))
        return np.frombuffer(self.take(count * width), self.dtype).reshape(-1, *self.shape)

    def _mask(self, count: int) -> NDArray[np.bool_]:
        bits = np.unpackbits(np.frombuffer(self.take(count // 8), np.uint8), bitorder="little")
        return bits.astype(bool)

    def take(self, count: int) -> bytes:
        return exactly(self.stream, count)


def coordinates(places: NDArray[np.int64], edge: int) -> NDArray[np.int64]:
    """Index (n, 3) in a node of each entry (n,)."""
    return np.stack([places // edge**2, places // edge % edge, places % edge], axis=-1).astype(np.int64)
