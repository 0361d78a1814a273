# SPDX-License-Identifier: GPL-3.0-or-later
"""MetaImage (.mhd with a data file, .mha in one): the header of ITK and many scanners' exports."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError
from spectral_core.files.guarded import header_lines, open_regular
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import (
    affine,
    header_text,
    listed_files,
    make_volume,
    numbered_files,
    open_payload,
    pick_component,
    read_numbers,
    require_choice,
    x_first,
)
from spectral_core.volume.files.request import ReadRequest

_TYPES = {
    "MET_CHAR": "i1",
    "MET_UCHAR": "u1",
    "MET_SHORT": "i2",
    "MET_USHORT": "u2",
    "MET_INT": "i4",
    "MET_UINT": "u4",
    "MET_LONG": "i4",
    "MET_ULONG": "u4",
    "MET_LONG_LONG": "i8",
    "MET_ULONG_LONG": "u8",
    "MET_FLOAT": "f4",
    "MET_DOUBLE": "f8",
}
_TRUE = {"true", "1", "t", "yes"}


class _Header:
    """The key = value lines; keys have synonyms, the first one present counts."""

    def __init__(self, fields: dict[str, str], path: Path) -> None:
        self._fields, self._path = fields, path

    def text(self, *keys: str, default: str | None = None) -> str:
        for key in keys:
            if key in self._fields:
                return self._fields[key]
        if default is None:
            raise FileFormatError(f"the header of {self._path.name} lacks {' or '.join(keys)}")
        return default

    def true(self, *keys: str) -> bool:
        return self.text(*keys, default="False").lower() in _TRUE

    def numbers(self, *keys: str, count: int, default: list[float] | None = None) -> NDArray[np.float64]:
        text = self.text(*keys, default=None if default is None else " ".join(map(str, default)))
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError as error:
            raise FileFormatError(f"{keys[0]} of {self._path.name} is {text!r}; expected numbers") from error
        if values.size != count or not np.isfinite(values).all():
            raise FileFormatError(f"{keys[0]} of {self._path.name} is {text!r}; expected {count} finite numbers")
        return values

    def whole(self, *keys: str, count: int, default: list[float] | None = None) -> list[int]:
        """Like ``numbers``, for counts."""
        values = self.numbers(*keys, count=count, default=default)
        if (values != np.round(values)).any():
            raise FileFormatError(f"{keys[0]} of {self._path.name} is {values.tolist()}; expected whole numbers")
        return [int(value) for value in values]


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a MetaImage; a fourth axis or several channels need ``request.component``."""
    with open_regular(path) as stream:
        header = _read_header(stream, path)
        dimensions = header.whole("NDims", count=1)[0]
        if dimensions not in (3, 4):
            raise FileFormatError(f"{path.name} has {dimensions} axes; expected a volume with three")
        shape = header.whole("DimSize", count=dimensions)
        if min(shape) < 1:
            raise FileFormatError(f"{path.name} states sizes {shape}; each must be at least 1")
        channels = header.whole("ElementNumberOfChannels", count=1, default=[1])[0]
        if channels < 1:
            raise FileFormatError(f"{path.name} states {channels} channels; expected at least 1")
        array = x_first(_numbers(header, stream, path, [channels, *shape]), [channels, *shape])
    require_choice(request.component, (channels, *shape[3:]), path)
    array = pick_component(array, 0, request.component if channels > 1 else None, path, "channels")
    if dimensions == 4:
        array = pick_component(array, 3, request.component, path, "entries along a fourth axis")
    return make_volume(path.stem, array, _world_from_index(header, dimensions), path)


def _read_header(stream: BinaryIO, path: Path) -> _Header:
    """Header lines up to ElementDataFile, the last one; the stream is then at the data."""
    fields: dict[str, str] = {}
    for line in header_lines(stream, path):
        key, separator, value = header_text(line).partition("=")
        if not separator:
            if line.strip():
                raise FileFormatError(f"line {line[:40]!r} of {path.name} is no 'key = value'; the header is invalid")
            continue
        fields[key.strip()] = value.strip()
        if key.strip() == "ElementDataFile":
            return _Header(fields, path)
    raise FileFormatError(f"the header of {path.name} ends before ElementDataFile; the file is truncated")


def _numbers(header: _Header, stream: BinaryIO, path: Path, shape: list[int]) -> NDArray[Any]:
    kind = header.text("ElementType")
    if kind not in _TYPES:
        raise FileFormatError(f"{path.name} has ElementType {kind}; expected one of {', '.join(_TYPES)}")
    order = ">" if header.true("BinaryDataByteOrderMSB", "ElementByteOrderMSB") else "<"
    dtype, count = np.dtype(order + _TYPES[kind]), math.prod(shape)
    encoding = "raw" if header.text("BinaryData", default="True").lower() in _TRUE else "ascii"
    if header.true("CompressedData"):
        encoding = "zlib"
    named = header.text("ElementDataFile")
    if named.upper() == "LOCAL":
        return read_numbers(stream, dtype, count, path, encoding=encoding)
    files = _data_files(named, stream, path, shape[-1])
    if count % len(files):
        raise FileFormatError(f"{path.name} names {len(files)} data files for sizes {shape}; that is not a multiple")
    parts = []
    for file in files:
        with open_payload(file, path) as data:
            _skip_header(header, data, dtype.itemsize * (count // len(files)), file)
            parts.append(read_numbers(data, dtype, count // len(files), file, encoding=encoding))
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _skip_header(header: _Header, data: BinaryIO, expected: int, file: Path) -> None:
    skip = header.whole("HeaderSize", count=1, default=[0])[0]
    if skip < -1:
        raise FileFormatError(f"HeaderSize of {file.name} is {skip}; expected a number of bytes, or -1")
    if skip == -1:  # the data are the end of the file
        size = data.seek(0, 2)
        if size < expected:
            raise FileFormatError(f"{file.name} is truncated: {size} bytes where {expected} of data are stated")
        skip = size - expected
    data.seek(skip)


def _data_files(named: str, stream: BinaryIO, path: Path, slices: int) -> list[Path]:
    """One file, ``LIST`` with a file per slice after it, or ``pattern first last step``."""
    words = named.split()
    if words and words[0] == "LIST":
        return listed_files(stream, path.parent, path)
    if len(words) in (3, 4) and "%" in words[0]:
        first, last, step = (int(word) for word in [*words[1:], "1"][:3])
        return numbered_files(words[0], range(first, last + 1, step), path.parent, path)
    return [path.parent / named]


def _world_from_index(header: _Header, dimensions: int) -> NDArray[np.float64]:
    spacing = header.numbers("ElementSpacing", "ElementSize", count=dimensions, default=[1.0] * dimensions)
    origin = header.numbers("Offset", "Position", "Origin", count=dimensions, default=[0.0] * dimensions)
    identity = np.eye(dimensions).ravel().tolist()
    rows = header.numbers("TransformMatrix", "Rotation", "Orientation", count=dimensions**2, default=identity)
    # Row a of the stored matrix is the direction of voxel axis a (as ITK reads it).
    directions = rows.reshape(dimensions, dimensions)[:3, :3].T
    return affine(directions * spacing[:3], origin[:3])
