# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of a file as numbers, with checks of their count: a short or overlong payload is an error that states both
lengths.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, counted
from spectral_core.files.guarded import MOST_NAMES, half_of_memory, header_lines, open_regular, require_room
from spectral_core.volume.field import ScalarVolume

_CHUNK = 1 << 20
MOST_DIGITS = 64
"""Most characters of a number in a text file, blanks included."""
_BLANK = re.compile(rb"\s")
Names = TypeVar("Names", list[str], range)
BROKEN_STREAM = (EOFError, OSError, zlib.error, lzma.LZMAError)
"""Errors of the standard decompressors for a truncated or damaged stream."""


class EmptyGridError(FileFormatError):
    """A grid has no voxels: a file by itself shows nothing, but a frame of a sequence may be empty."""


def open_payload(path: Path, named_by: Path) -> BinaryIO:
    """Open the data file that header ``named_by`` names; raises FileFormatError if it does not exist or is no regular
    file.
    """
    try:
        return open_regular(path)
    except FileFormatError as error:
        raise FileFormatError(
            f"{named_by.name} names the data file {path.name[:80]!r}, which cannot be opened in {path.parent} "
            f"({error}); keep both files together"
        ) from error


def header_text(content: bytes) -> str:
    """Text of a header: UTF-8, else the Western letters of Windows, as its programs write names and units."""
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def listed_files(stream: BinaryIO, folder: Path, header: Path) -> list[Path]:
    """The data files that are listed after ``LIST``, one per line. Raises FileFormatError."""
    names = [header_text(line.strip()) for line in header_lines(stream, header)]
    return [folder / name for name in _bounded([name for name in names if name], header)]


def numbered_files(pattern: str, numbers: range, folder: Path, header: Path) -> list[Path]:
    """The data files of a ``printf`` pattern with one number, such as ``slice%03d.raw``. Raises FileFormatError."""
    parts = re.fullmatch(r"([^%]*)%(0?)(\d{0,2})[du]([^%]*)", pattern)
    if parts is None:
        raise FileFormatError(
            f"{header.name} names data files by {pattern[:40]!r}; expected one number, as in x%03d.raw"
        )
    before, zero, width, after = parts.groups()
    count = len(_bounded(numbers, header))
    shown = (f"{number:{zero}{width or 0}d}" if zero or width else str(number) for number in numbers[:count])
    return [folder / f"{before}{text}{after}" for text in shown]


def _bounded(names: Names, header: Path) -> Names:
    """The files unchanged if there is at least one, and not more than a volume has slices."""
    try:
        count = len(names)
    except OverflowError:
        count = MOST_NAMES + 1
    if not 1 <= count <= MOST_NAMES:
        what = "no data file" if count == 0 else f"more than {MOST_NAMES:,} data files"
        raise FileFormatError(f"{header.name} names {what}; its header is damaged")
    return names


def read_numbers(
    stream: BinaryIO, dtype: np.dtype, count: int, source: Path, *, encoding: str = "raw", exact: bool = True
) -> NDArray[Any]:
    """``count`` numbers from ``stream`` at its position, encoded as raw, gzip, bzip2, zlib or ascii; native, read-only.

    ``exact`` refuses further bytes after the numbers, for payloads that should fill their file.
    """
    if encoding == "ascii":
        most = MOST_DIGITS * min(count, half_of_memory() // MOST_DIGITS)
        array, rest = parse_text(stream.read(min(most, _bytes_left(stream)) + 1), dtype, count, source), 0
    else:
        if encoding == "raw":
            _require_length(stream, count * dtype.itemsize, source)
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
    require_room(count * dtype.itemsize, source)
    try:
        return np.empty(count, dtype)
    except (MemoryError, ValueError) as error:
        raise FileFormatError(
            f"{source.name} states {count} numbers of type {dtype.name}, more than memory holds; "
            "the header is invalid, or the volume must be cropped or resampled first"
        ) from error


def _bytes_left(stream: BinaryIO) -> int:
    start = stream.tell()
    end = stream.seek(0, 2)
    stream.seek(start)
    return max(end - start, 0)


def _require_length(stream: BinaryIO, needed: int, source: Path) -> None:
    """Raise FileFormatError if the rest of a file is shorter than its header states, before memory is allocated for
    it.
    """
    left = _bytes_left(stream)
    if left < needed:
        raise FileFormatError(
            f"{source.name} is truncated: its data have {left} bytes where its header states {needed}; "
            "copy or export it again"
        )


def _fill(stream: BinaryIO, target: NDArray[np.uint8], source: Path, encoding: str, exact: bool) -> int:
    """Fill ``target`` from the decoded stream; raises FileFormatError if it is short; 1 if ``exact`` and more
    follows.
    """
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
            f"the {encoding} data of {source.name} are truncated or damaged after {done} bytes: {error}"
        ) from error
    if done < len(view):
        raise FileFormatError(
            f"{source.name} is truncated: its data have {done} bytes where its header states {len(view)}; "
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


def parse_text(text: bytes, dtype: np.dtype, count: int, source: Path) -> NDArray[Any]:
    """``count`` numbers of a text, native; raises FileFormatError if there are more or fewer.

    A million at a time: a Python string takes 40 bytes in addition to the two that it may have in the file.
    """
    require_room(count * dtype.itemsize, source)
    parts, found, start = [], 0, 0
    while start < len(text) and found <= count:
        space = _BLANK.search(text, min(start + 4 * _CHUNK, len(text)))
        end = space.start() if space else len(text)
        words, start = text[start:end].split(), end
        found += len(words)
        parts.append(parse_words(words, dtype, source))
    if found != count:
        raise FileFormatError(
            f"{source.name} lists {'more than ' * (start < len(text))}{counted(found, 'number')} where {count} "
            "are stated"
        )
    return np.concatenate(parts) if parts else np.empty(0, dtype.newbyteorder("="))


def parse_words(words: Sequence[bytes], dtype: np.dtype, source: Path) -> NDArray[Any]:
    """Text numbers as ``dtype``; raises FileFormatError for a text that is no number or does not fit the type."""
    try:
        if dtype.kind == "f":
            return np.array(words, dtype=np.float64).astype(dtype.newbyteorder("="))
        whole = [int(word) for word in words]
    except (ValueError, OverflowError) as error:
        raise FileFormatError(f"{source.name} holds text that is not a number of type {dtype.name}: {error}") from error
    limits = np.iinfo(dtype)
    # Before the conversion: NumPy takes -1 for the largest unsigned number.
    if whole and (min(whole) < limits.min or max(whole) > limits.max):
        raise FileFormatError(f"{source.name} lists a value outside the range of its type {dtype.name}")
    return np.array(whole, dtype=dtype.newbyteorder("="))


def x_first(numbers: NDArray[Any], shape: Sequence[int]) -> NDArray[Any]:
    """Numbers stored with the first axis fastest as an array of ``shape``, without a copy."""
    return numbers.reshape(tuple(shape)[::-1]).transpose()


def require_choice(component: int | None, lengths: Sequence[int], source: Path) -> None:
    """Raise InvalidInputError for a component that nothing would read, or that would choose on several axes at once.

    ``lengths``: of the axes that are not spatial.
    """
    several = [length for length in lengths if length > 1]
    if not several and component:
        raise InvalidInputError(
            f"component {component} of {source.name} was requested; it holds one number per voxel, leave component out"
        )
    if len(several) > 1:
        raise InvalidInputError(
            f"{source.name} holds {' times '.join(map(str, several))} numbers per voxel on {len(several)} axes, and "
            "component chooses on one; write the wanted part into a file of its own"
        )


def pick_component(
    array: NDArray[Any], axis: int, component: int | None, source: Path, what: str = "components"
) -> NDArray[Any]:
    """One entry of a non-spatial axis; an axis of length 1 needs no choice."""
    length = array.shape[axis]
    if component is None and length > 1:
        raise InvalidInputError(
            f"{source.name} holds {length} {what} per voxel; say which with component=0 to {length - 1}"
        )
    index = component or 0
    if not 0 <= index < length:
        raise InvalidInputError(
            f"component {component} of {source.name} was requested; it has {what} 0 to {length - 1}"
        )
    chosen = array[(slice(None),) * axis + (index,)]
    return chosen if length == 1 else chosen.copy(order="K")


def make_volume(name: str, array: NDArray[Any], world_from_index: NDArray[np.float64], source: Path) -> ScalarVolume:
    """The volume, with errors that name the file; booleans become uint8 0 and 1."""
    if array.dtype.kind == "b":
        array = array.view(np.uint8)
    if array.flags.writeable:  # just read and not shared: frozen in place instead of copied
        array.setflags(write=False)
    try:
        return ScalarVolume(name, array, world_from_index)
    except InvalidInputError as error:
        raise FileFormatError(f"{source}: {error}") from error


def affine(directions: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """4×4 matrix from index to world: column a of ``directions`` (3, 3) is a step along axis a."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = directions, origin
    return matrix
