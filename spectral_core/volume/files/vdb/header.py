# SPDX-License-Identifier: GPL-3.0-or-later
"""What precedes the nodes of a grid in an OpenVDB file: metadata and a transform, made of words, texts and numbers."""

from __future__ import annotations

import itertools
import os
import struct
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError

LEAF_LIST = "file_delayed_load"
"""Metadata with the list of leaves, of which ``read_metadata`` keeps the number."""
_NO_SIZES = 0xFFFFFFFF
"""In place of the number of bytes of sizes, where a list of leaves has none."""
_SCALARS = {"int32": "<i", "int64": "<q", "float": "<f", "double": "<d", "bool": "<?"}


def transform_of(stream: BinaryIO, path: Path) -> NDArray[np.float64]:
    """The 4×4 matrix from index to world of a grid's transform."""
    kind = read_text(stream)
    matrix = np.eye(4)
    if kind in ("AffineMap", "UnitaryMap"):
        return _doubles(stream, 16).reshape(4, 4).T
    if kind in ("TranslationMap", "ScaleTranslateMap", "UniformScaleTranslateMap"):
        matrix[:3, 3] = _doubles(stream, 3)
    if kind in ("ScaleMap", "UniformScaleMap", "ScaleTranslateMap", "UniformScaleTranslateMap"):
        matrix[:3, :3] = np.diag(_doubles(stream, 15)[:3])  # the scale, and four vectors that follow from it
    elif kind != "TranslationMap":
        raise FileFormatError(f"a grid of {path.name} has a {kind}; only linear transforms are volumes here")
    return matrix


def read_metadata(stream: BinaryIO) -> dict[str, Any]:
    """Texts and plain numbers by name; other metadata is skipped."""
    found: dict[str, Any] = {}
    for _ in itertools.repeat(None, read_word(stream)):
        key, kind = read_text(stream), read_text(stream)
        value = exactly(stream, read_word(stream))
        if kind == "__delayedload" and value:
            found[LEAF_LIST] = _listed_leaves(value)
        if kind == "string":
            found[key] = value.decode("utf-8", "replace")
        elif kind in _SCALARS:
            found[key] = struct.unpack(_SCALARS[kind], value)[0]
    return found


def _listed_leaves(value: bytes) -> int:
    """Number of leaves in the list that OpenVDB keeps to load them later; struct.error if the list is not whole.

    For each leaf a mark of one byte and a size of eight; both parts may be packed, after the number of their bytes.
    OpenVDB trusts them, and reads a damaged list for minutes.
    """
    leaves, packed = struct.unpack_from("<II", value)
    end = 8 + (packed or leaves)
    (packed,) = struct.unpack_from("<I", value, end)
    end += 4 if packed == _NO_SIZES else 4 + (packed or 8 * leaves)
    if end > len(value):
        raise struct.error(f"a list of {leaves} leaves takes {end} bytes of {len(value)}")
    return int(leaves)


def _doubles(stream: BinaryIO, count: int) -> NDArray[np.float64]:
    return np.frombuffer(exactly(stream, 8 * count), "<f8").astype(np.float64)


def read_word(stream: BinaryIO) -> int:
    return int(struct.unpack("<I", stream.read(4))[0])


def read_text(stream: BinaryIO) -> str:
    return exactly(stream, read_word(stream)).decode("utf-8", "replace")


def exactly(stream: BinaryIO, count: int) -> bytes:
    # checked before reading, because a damaged count would allocate any amount of memory
    left = os.fstat(stream.fileno()).st_size - stream.tell()
    if not 0 <= count <= left:
        raise struct.error(f"{left} bytes where {count} are due")
    return stream.read(count)
