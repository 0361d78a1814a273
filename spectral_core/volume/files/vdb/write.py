# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB files without OpenVDB: one float or double grid, zipped, for a Blender without the Python module.

The layout is that of OpenVDB's own ``io`` code, file version 224, tree 5-4-3: a root over nodes of 32³ nodes of 16³
leaves of 8³ voxels. Voxels of value 0 are background. All numbers are little-endian; within a node x varies slowest.
"""

from __future__ import annotations

import struct
import uuid
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

MAGIC = 0x56444220
FILE_VERSION = 224
ZIP = 1
ALL_VALUES = 6
"""Mark before a node's values: every one of them follows."""
LEAF = 8
NODE_LEAVES, ROOT_NODES = 16, 32


def write_grid(
    path: Path, data: NDArray[Any], world_from_index: NDArray[np.float64], name: str, texts: Mapping[str, str]
) -> None:
    """Write ``data`` (nx, ny, nz), float32 or float64, voxel (0, 0, 0) at index 0; ``texts`` become grid metadata."""
    kind = {4: "float", 8: "double"}[data.dtype.itemsize]
    leaves, keys = _leaves(data)
    with path.open("wb") as stream:
        stream.write(struct.pack("<qIII", MAGIC, FILE_VERSION, 10, 0) + b"\1" + str(uuid.uuid4()).encode())
        stream.write(struct.pack("<I", 0))  # no metadata of the file
        stream.write(struct.pack("<I", 1) + _text(name) + _text(f"Tree_{kind}_5_4_3") + _text(""))
        place = stream.tell()
        stream.write(bytes(24))
        start = stream.tell()
        stream.write(struct.pack("<I", ZIP))
        held = {"class": "fog volume", "name": name, **texts}
        stream.write(struct.pack("<I", len(held)) + b"".join(_string_entry(key, held[key]) for key in held))
        stream.write(_text("AffineMap") + world_from_index.T.astype("<f8").tobytes())  # row vectors
        _write_topology(stream, leaves, keys, data.dtype)
        block = stream.tell()
        _write_buffers(stream, leaves)
        end = stream.tell()
        stream.seek(place)
        stream.write(struct.pack("<qqq", start, block, end))


def _leaves(data: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Leaves (n, 512) with any value, in file order; (n, 6) positions of each in three nodes, and its root corner."""
    blocks = [-(-n // LEAF) for n in data.shape]
    padded = np.zeros([n * LEAF for n in blocks], data.dtype)
    padded[tuple(slice(n) for n in data.shape)] = data
    split = padded.reshape(blocks[0], LEAF, blocks[1], LEAF, blocks[2], LEAF).transpose(0, 2, 4, 1, 3, 5)
    used = np.argwhere(split.any(axis=(3, 4, 5)))
    leaves = split[tuple(used.T)].reshape(-1, LEAF**3)
    per_root = NODE_LEAVES * ROOT_NODES
    root = _place(used // per_root, max(1, -(-max(blocks) // per_root)))
    outer = _place(used // NODE_LEAVES % ROOT_NODES, ROOT_NODES)
    inner = _place(used % NODE_LEAVES, NODE_LEAVES)
    order = np.lexsort((inner, outer, root))
    roots = (used // per_root)[order] * per_root * LEAF
    keys = np.column_stack([root[order], outer[order], inner[order], roots])
    return leaves[order], keys


def _place(index: NDArray[np.int64], edge: int) -> NDArray[np.int64]:
    return (index[:, 0] * edge + index[:, 1]) * edge + index[:, 2]


def _write_topology(stream: BinaryIO, leaves: NDArray[Any], keys: NDArray[np.int64], dtype: np.dtype) -> None:
    masks = np.packbits(leaves != 0, axis=1, bitorder="little")
    outer_values, inner_values = (_packed(np.zeros(edge**3, dtype)) for edge in (ROOT_NODES, NODE_LEAVES))
    roots = np.unique(keys[:, 0])
    stream.write(struct.pack("<I", 1) + bytes(dtype.itemsize) + struct.pack("<II", 0, len(roots)))
    for root in roots:
        below = np.flatnonzero(keys[:, 0] == root)
        stream.write(keys[below[0], 3:].astype("<i4").tobytes())
        outers, starts = np.unique(keys[below, 1], return_index=True)
        stream.write(_mask(outers, ROOT_NODES**3) + bytes(ROOT_NODES**3 // 8) + outer_values)
        for first, last in zip(starts, [*starts[1:], len(below)], strict=True):
            inside = below[first:last]
            stream.write(_mask(keys[inside, 2], NODE_LEAVES**3) + bytes(NODE_LEAVES**3 // 8) + inner_values)
            stream.write(masks[inside].tobytes())


def _write_buffers(stream: BinaryIO, leaves: NDArray[Any]) -> None:
    masks = np.packbits(leaves != 0, axis=1, bitorder="little")
    for mask, values in zip(masks, leaves, strict=True):
        stream.write(mask.tobytes() + _packed(values))


def _packed(values: NDArray[Any]) -> bytes:
    """A node's values: the mark, the size of the zipped bytes (negative if zipping gains nothing), the bytes."""
    plain = values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
    zipped = zlib.compress(plain, 1)
    size, held = (len(zipped), zipped) if len(zipped) < len(plain) else (-len(plain), plain)
    return struct.pack("<bq", ALL_VALUES, size) + held


def _mask(places: NDArray[np.int64], count: int) -> bytes:
    bits = np.zeros(count, bool)
    bits[places] = True
    return np.packbits(bits, bitorder="little").tobytes()


def _text(text: str) -> bytes:
    encoded = text.encode()
    return struct.pack("<I", len(encoded)) + encoded


def _string_entry(key: str, value: str) -> bytes:
    return _text(key) + _text("string") + _text(value)
