# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of a file as numbers, counted: a short or overlong payload is an error that states both lengths."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError
from spectral_core.volume.field import ScalarVolume

_CHUNK = 1 << 20
BROKEN_STREAM = (EOFError, OSError, zlib.error, lzma.LZMAError)
"""What the standard decompressors raise for a stream that is cut or damaged."""


def open_payload(path: Path, named_by: Path) -> BinaryIO:
    """Open the data file that header ``named_by`` names; FileFormatError when it is not there."""
    try:
        return path.open("rb")
    except (OSError, ValueError) as error:  # ValueError: a name that no file system takes
        raise FileFormatError(
            f"{named_by.name} names the data file {path.name!r}, which cannot be opened in {path.parent} "
            f"({getattr(error, 'strerror', error)}); keep both files together"
        ) from error


def read_numbers(
    stream: BinaryIO, dtype: np.dtype, count: int, source: Path, *, encoding: str = "raw", exact: bool = True
) -> NDArray[Any]:
    """``count`` numbers from ``stream`` at its position, encoded raw, gzip, bzip2, zlib or ascii; native, read-only.

    ``exact`` refuses what follows the numbers, for payloads that should fill their file.
    """
    if encoding == "ascii":
        array, rest = _ascii_numbers(stream.read(), dtype, count, source), 0
    else:
        array = _room_for(count, dtype, source)
        rest = _fill(stream, array.view(np.uint8), source, encoding, exact)
    if exact and rest:
        raise FileFormatError(
            f"{source.name} holds more than the {count} numbers of type {dtype.name} its header states; "
            "the size or the type is wrong, or the file is not what it is named"
        )
    if not array.dtype.isnative:
        array = array.byteswap(inplace=True).view(array.dtype.newbyteorder("="))
    array.setflags(write=False)
    return array


def _room_for(count: int, dtype: np.dtype, source: Path) -> NDArray[Any]:
    try:
        return np.empty(count, dtype)
    except (MemoryError, ValueError) as error:
        raise FileFormatError(
            f"{source.name} states {count} numbers of type {dtype.name}, more than memory holds; "
            "the header is odd, or the volume must be cropped or resampled first"
        ) from error


def _fill(stream: BinaryIO, target: NDArray[np.uint8], source: Path, encoding: str, exact: bool) -> int:
    """Fill ``target`` from the decoded stream, FileFormatError when it is short; 1 if ``exact`` and more follows."""
    openers: dict[str, Any] = {
        "raw": lambda: stream,
        "gzip": lambda: gzip.GzipFile(fileobj=stream),
        "bzip2": lambda: bz2.BZ2File(stream),
        "zlib": lambda: _ZlibStream(stream),
    }
    decoded, view, done = openers[encoding](), target.data, 0
    try:
        while done < len(view):
            got = decoded.readinto(view[done : done + 64 * _CHUNK])
            if not got:
                break
            done += got
        rest = len(decoded.read(1)) if exact else 0
    except BROKEN_STREAM as error:
        raise FileFormatError(
            f"the {encoding} data of {source.name} are cut or damaged after {done} bytes: {error}"
        ) from error
    if done < len(view):
        raise FileFormatError(
            f"{source.name} is cut: its data have {done} bytes where its header states {len(view)}; "
            "copy or export it again"
        )
    return rest


class _ZlibStream:
    """A zlib or gzip stream read like a file; the standard library has one for gzip only."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._inflate = zlib.decompressobj(wbits=47)  # either header

    def read(self, size: int) -> bytes:
        while not self._inflate.eof:
            packed = self._inflate.unconsumed_tail or self._stream.read(_CHUNK)
            plain = self._inflate.decompress(packed, size)
            if plain:
                return plain
            if not packed:
                raise EOFError("the stream ends before its end mark")
        return b""

    def readinto(self, target: memoryview) -> int:
        plain = self.read(len(target))
        target[: len(plain)] = plain
        return len(plain)


def _ascii_numbers(text: bytes, dtype: np.dtype, count: int, source: Path) -> NDArray[Any]:
    words = text.split()
    if len(words) != count:
        raise FileFormatError(f"{source.name} lists {len(words)} numbers where its header states {count}")
    return parse_words(words, dtype, source)


def parse_words(words: Sequence[bytes], dtype: np.dtype, source: Path) -> NDArray[Any]:
    """Text numbers as ``dtype``; FileFormatError for a word that is none or does not fit the type."""
    try:
        if dtype.kind == "f":
            return np.array(words, dtype=np.float64).astype(dtype.newbyteorder("="))
        wide = np.array([int(word) for word in words], dtype=np.int64 if dtype.kind == "i" else np.uint64)
    except (ValueError, OverflowError) as error:
        raise FileFormatError(f"{source.name} holds text that is not a number of type {dtype.name}: {error}") from error
    limits = np.iinfo(dtype)
    if wide.size and (wide.min() < limits.min or wide.max() > limits.max):
        raise FileFormatError(f"{source.name} lists a value outside the range of its type {dtype.name}")
    return wide.astype(dtype.newbyteorder("="))


def ascii_stream(text: bytes) -> BinaryIO:
    """Text already read, as a stream for ``read_numbers``."""
    return io.BytesIO(text)


def x_first(numbers: NDArray[Any], shape: Sequence[int]) -> NDArray[Any]:
    """Numbers stored with the first axis fastest as an array of ``shape``, without a copy."""
    return numbers.reshape(tuple(shape)[::-1]).transpose()


def pick_component(
    array: NDArray[Any], axis: int, component: int | None, source: Path, what: str = "components"
) -> NDArray[Any]:
    """One entry of a non-space axis; an axis of length 1 needs no choice."""
    length = array.shape[axis]
    if component is None and length > 1:
        raise InvalidInputError(
            f"{source.name} holds {length} {what} per voxel; say which with component=0 to {length - 1}"
        )
    index = component or 0
    if not 0 <= index < length:
        raise InvalidInputError(
            f"component {component} of {source.name} was asked for; it has {what} 0 to {length - 1}"
        )
    chosen = array[(slice(None),) * axis + (index,)]
    return chosen if length == 1 else chosen.copy(order="K")


def make_volume(name: str, array: NDArray[Any], to_world: NDArray[np.float64], source: Path) -> ScalarVolume:
    """The volume, with errors that name the file; booleans become uint8 0 and 1."""
    if array.dtype.kind == "b":
        array = array.view(np.uint8)
    if array.flags.writeable:  # just read and held by nobody else: frozen in place instead of copied
        array.setflags(write=False)
    try:
        return ScalarVolume(name, array, to_world)
    except InvalidInputError as error:
        raise FileFormatError(f"{source}: {error}") from error


def affine(directions: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """4×4 matrix from index to world: column a of ``directions`` (3, 3) is a step along axis a."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = directions, origin
    return matrix
