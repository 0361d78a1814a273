# SPDX-License-Identifier: GPL-3.0-or-later
"""Test if a picture file is complete. Blender writes pictures without a word about a full disk.

PNG: "Portable Network Graphics (PNG) Specification", W3C, section 5. TIFF: "TIFF Revision 6.0", Adobe, section 2.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

from spectral_core.errors import FileFormatError, FileWriteError
from spectral_core.files.exr import require_whole_exr
from spectral_core.files.guarded import open_regular

_PNG, _JPEG, _TIFF = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", {b"II*\0": "<", b"MM\0*": ">"}
_OFFSETS, _NUMBERS = {273: 279, 324: 325}, {3: "H", 4: "I"}
"""TIFF's tags of the offsets of strips and tiles, and those of their lengths; types of such numbers."""
_BYTES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8}
"""Size of a value of each type of TIFF."""


def require_whole_picture(path: Path) -> None:
    """Raise FileFormatError if a file is no PNG, JPEG, TIFF or EXR picture, or ends before its last pixel."""
    with open_regular(path) as stream:
        size, first = stream.seek(0, 2), b""
        stream.seek(0)
        first = stream.read(8)
        try:
            if first == _PNG:
                _require_png(stream)
            elif first.startswith(_JPEG):
                _require_jpeg(stream)
            elif first[:4] in _TIFF:
                _require_tiff(stream, _TIFF[first[:4]], size)
            elif not first:
                raise FileFormatError(f"{path} is empty")
            else:
                require_whole_exr(path)
        except struct.error as error:
            raise FileFormatError(f"{path} is truncated: {error}") from error


def require_written(path: Path) -> None:
    """Raise FileWriteError if a temporary picture that Blender wrote is absent or truncated."""
    try:
        require_whole_picture(path)
    except FileFormatError as error:
        raise full_disk("a temporary picture", path, error) from error


def full_disk(what: str, path: Path, reason: Exception) -> FileWriteError:
    """The error for a temporary file that Blender did not write in whole."""
    return FileWriteError(
        f"Blender could not write {what} ({str(reason).strip()}); is the disk of {path.parent} full? "
        "Make room there, or let the variable TMPDIR name a folder of another disk"
    )


def _require_png(stream: BinaryIO) -> None:
    """Chunks of a length, a type, data and a checksum, up to IEND."""
    kind = b""
    while kind != b"IEND":
        length, kind = struct.unpack(">I4s", stream.read(8))
        stream.seek(length, 1)
        struct.unpack(">I", stream.read(4))


def _require_jpeg(stream: BinaryIO) -> None:
    stream.seek(-2, 2)
    if stream.read(2) != b"\xff\xd9":
        raise struct.error("it has no end mark")


def _require_tiff(stream: BinaryIO, order: str, size: int) -> None:
    stream.seek(4)
    (place,) = struct.unpack(f"{order}I", stream.read(4))
    if not place:
        raise struct.error("it has no directory")
    stream.seek(place)
    (count,) = struct.unpack(f"{order}H", stream.read(2))
    entries = [struct.unpack(f"{order}HHI4s", stream.read(12)) for _ in range(count)]
    struct.unpack("4s", stream.read(4))  # the next directory
    found = {}
    for tag, kind, amount, value in entries:
        data = _values(stream, order, _BYTES.get(kind, 1) * amount, value)
        if tag in {*_OFFSETS, *_OFFSETS.values()}:
            found[tag] = struct.unpack(f"{order}{amount}{_NUMBERS[kind]}", data)
    for offsets, lengths in _OFFSETS.items():
        for offset, length in zip(found.get(offsets, ()), found.get(lengths, ()), strict=True):
            if not 0 < offset <= size - length:
                raise struct.error(f"pixels end at byte {offset + length} of {size}")


def _values(stream: BinaryIO, order: str, length: int, value: bytes) -> bytes:
    """The values of an entry: in its four bytes, or where these point to."""
    if length <= 4:
        return value[:length]
    stream.seek(struct.unpack(f"{order}I", value)[0])
    data = stream.read(length)
    if len(data) < length:
        raise struct.error("values of its directory lie beyond its end")
    return data
