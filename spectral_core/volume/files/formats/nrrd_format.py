# SPDX-License-Identifier: GPL-3.0-or-later
"""NRRD, attached and detached: pynrrd parses and writes headers, the payload is counted here.

World coordinates are those of the file's own space (often LPS); ``space directions`` and ``space origin`` are kept
as they are. Without them ``spacings`` and ``axis mins`` give axis-parallel voxels.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError, counted
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
from spectral_core.volume.files.units import unit_factors

_ENCODINGS = {
    "raw": "raw",
    "gzip": "gzip",
    "gz": "gzip",
    "bzip2": "bzip2",
    "bz2": "bzip2",
    "ascii": "ascii",
    "text": "ascii",
    "txt": "ascii",
}
_TYPES = {
    **dict.fromkeys(("signed char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "short int", "signed short", "signed short int", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "signed int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    **dict.fromkeys(
        ("longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"), "i8"
    ),
    **dict.fromkeys(("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"), "u8"),
    "float": "f4",
    "double": "f8",
}
"""Every spelling of the NRRD format's definition, http://teem.sourceforge.net/nrrd/format.html."""
MOST_LINE, MOST_LINES_SKIPPED = 1 << 16, 100_000
_SPACE_KINDS = {"domain", "space"}
_KINDS_OF_PARTS = ("color", "vector", "matrix", "complex", "normal", "gradient", "quaternion")
"""Words in the kinds of axes that hold the parts of one value."""


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a NRRD file; ``request.component`` picks from a fourth, non-space axis."""
    nrrd = _pynrrd("reading NRRD files")
    try:
        with open_regular(path) as stream:
            # as text: pynrrd drops all letters beyond ASCII of bytes, so that µm becomes m
            header = nrrd.read_header([header_text(line) for line in _header_lines(stream, path)])
            array = _numbers(header, stream, path)
        space = _space_axes(header, path)
        matrix = _world_from_index(header, space, path)
    except (nrrd.NRRDError, ValueError, KeyError, IndexError, StopIteration, OverflowError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise FileFormatError(f"{path.name} is not a NRRD file that can be read: {error}") from error
    others = [axis for axis in range(array.ndim) if axis not in space]
    require_choice(request.component, [array.shape[axis] for axis in others], path)
    for axis in reversed(others):
        array = pick_component(array, axis, request.component, path)
    return make_volume(str(header.get("content") or path.stem), array, matrix, path)


def write(volume: ScalarVolume, path: Path) -> None:
    """Write gzipped NRRD with space directions and origin; the type is kept.

    Headers are ASCII: a volume whose name has other letters has the name of its file.
    """
    nrrd = _pynrrd("writing NRRD files")
    name = " ".join(volume.name.split())
    header = {
        **({"content": name} if name.isascii() and name.isprintable() and name else {}),
        "space dimension": 3,
        "space directions": volume.world_from_index[:3, :3].T,
        "space origin": volume.world_from_index[:3, 3],
        "kinds": ["domain"] * 3,
        "centerings": ["cell"] * 3,
        "encoding": "gzip",
    }
    if volume.data.dtype.kind == "f" and volume.data.dtype.itemsize not in (4, 8):
        fitting = "float32" if volume.data.dtype.itemsize < 4 else "float64"
        raise InvalidInputError(
            f"NRRD has no type for {volume.data.dtype}; convert volume {volume.name!r} to {fitting} first"
        )
    nrrd.write(str(path), volume.data, header, index_order="F", compression_level=4)


def _pynrrd(purpose: str) -> Any:
    try:
        import nrrd
    except ImportError as error:
        raise MissingDependencyError.package("pynrrd", purpose, "volumes") from error
    return nrrd


def _header_lines(stream: BinaryIO, path: Path) -> list[bytes]:
    """Lines up to the blank one, or to ``data file: LIST``, after which file names follow that pynrrd cannot parse."""
    lines: list[bytes] = []
    for line in header_lines(stream, path):
        if len(line) > MOST_LINE:
            raise FileFormatError(f"{path.name} has a line of {len(line)} bytes in its header; it is damaged")
        if not line.strip():
            break
        lines.append(line)
        if re.fullmatch(rb"datafile:list\d*", line.replace(b" ", b"").strip().lower()):
            break
    return lines


def _numbers(header: Mapping[str, Any], stream: BinaryIO, path: Path) -> NDArray[Any]:
    missing = [key for key in ("dimension", "type", "encoding", "sizes") if key not in header]
    if missing:
        raise FileFormatError(
            f"the NRRD header of {path.name} lacks {', '.join(missing)}; the file is truncated or not NRRD"
        )
    sizes = [int(n) for n in header["sizes"]]
    if len(sizes) != header["dimension"] or min(sizes) < 1:
        raise FileFormatError(f"{path.name} states dimension {header['dimension']} and sizes {sizes}; they must agree")
    encoding = _ENCODINGS.get(header["encoding"].lower())
    if encoding is None or header["type"] == "block":
        raise FileFormatError(f"{path.name} holds {header['type']!r} in encoding {header['encoding']!r}; not supported")
    dtype, count = _dtype(header, path), math.prod(sizes)
    named = header.get("data file", header.get("datafile"))
    if named is None:
        numbers = _payload(header, stream, dtype, count, path, encoding)
    else:
        files = _data_files(named, stream, path)
        if count % len(files):
            raise FileFormatError(
                f"{path.name} spreads {count} numbers over {len(files)} files, which is not a multiple"
            )
        parts = []
        for file in files:
            with open_payload(file, path) as data:
                parts.append(_payload(header, data, dtype, count // len(files), file, encoding))
        numbers = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return x_first(numbers, sizes)


def _dtype(header: Mapping[str, Any], path: Path) -> np.dtype:
    """The type of the numbers, with the byte order in the header if it matters."""
    kind = " ".join(str(header["type"]).split())
    if kind not in _TYPES:
        raise FileFormatError(f"{path.name} holds type {kind[:40]!r}; expected one of {', '.join(_TYPES)}")
    dtype = np.dtype(_TYPES[kind])
    order = str(header.get("endian", "")).lower()
    if dtype.itemsize > 1 and header["encoding"].lower() not in ("ascii", "text", "txt"):
        if order not in ("little", "big"):
            raise FileFormatError(f"{path.name} has numbers of {dtype.itemsize} bytes without the field endian")
        return dtype.newbyteorder("<" if order == "little" else ">")
    return dtype


def _payload(
    header: Mapping[str, Any], stream: BinaryIO, dtype: np.dtype, count: int, path: Path, encoding: str
) -> NDArray:
    lines = int(header.get("line skip", header.get("lineskip", 0)))
    skip = int(header.get("byte skip", header.get("byteskip", 0)))
    if lines < 0 or skip < -1 or (skip and encoding not in ("raw",)):
        raise FileFormatError(f"{path.name} skips {lines} lines and {skip} bytes before {encoding} data; not supported")
    if lines > MOST_LINES_SKIPPED:
        raise FileFormatError(f"{path.name} skips {lines} lines; expected at most {MOST_LINES_SKIPPED:,}")
    for _ in range(lines):
        if not stream.readline(MOST_LINE):
            break
    if skip == -1:
        # An attached header and skipped lines are no data, however short the data are.
        begin, needed = stream.tell(), count * dtype.itemsize
        size = stream.seek(0, 2)
        if size - begin < needed:
            raise FileFormatError(f"{path.name} is truncated: {size - begin} bytes where {needed} of data are stated")
        stream.seek(size - needed)
    else:
        stream.seek(skip, 1)
    return read_numbers(stream, dtype, count, path, encoding=encoding)


def _data_files(named: str, stream: BinaryIO, path: Path) -> list[Path]:
    """The data files of a detached header: one name, ``LIST`` and names after it, or ``pattern first last step``."""
    words = named.split() or [""]
    if words[0] == "LIST":
        return listed_files(stream, path.parent, path)
    if len(words) in (4, 5) and "%" in words[0]:
        first, last, step = (int(word) for word in words[1:4])
        return numbered_files(words[0], range(first, last + (1 if step > 0 else -1), step), path.parent, path)
    return [path.parent / named]


def _space_axes(header: Mapping[str, Any], path: Path) -> list[int]:
    """The three spatial axes: those with a direction, else those of a spatial kind, else the only three."""
    dimension = int(header["dimension"])
    axes = list(range(dimension))
    if "space directions" in header:
        directions = _directions(header)
        axes = [axis for axis in range(dimension) if np.isfinite(directions[axis]).all()]
    elif "kinds" in header and dimension > 3:
        axes = [axis for axis, kind in enumerate(header["kinds"]) if kind.lower() in _SPACE_KINDS]
    elif "kinds" in header:
        parts = [any(word in kind.lower() for word in _KINDS_OF_PARTS) for kind in header["kinds"]]
        axes = [axis for axis, is_parts in enumerate(parts) if not is_parts]
    if len(axes) != 3:
        raise FileFormatError(
            f"{path.name} has {dimension} axes of sizes {[int(n) for n in header['sizes']]}, of which {len(axes)} are "
            "space; expected a volume with three"
        )
    return axes


def _directions(header: Mapping[str, Any]) -> NDArray[np.float64]:
    """(axes, 3) space directions; a row of NaN for an axis that is not spatial."""
    rows = [np.full(3, np.nan) if row is None else np.asarray(row, float) for row in header["space directions"]]
    return np.array(rows)


def _world_from_index(header: Mapping[str, Any], space: list[int], path: Path) -> NDArray[np.float64]:
    if "space directions" in header:
        directions = _directions(header)[space].T
        if directions.shape != (3, 3):
            raise FileFormatError(
                f"{path.name} has space directions of {counted(directions.shape[0], 'number')}; expected 3"
            )
        directions = directions * _factors(header, "space units", range(3), path)[:, None]
        return affine(directions, _space_origin(header, path))

    def per_axis(key: str, default: float) -> NDArray[np.float64]:
        values = np.asarray(
            header.get(key, header.get(key.replace(" ", ""), [default] * int(header["dimension"]))), float
        )
        return np.nan_to_num(values[space], nan=default)

    low, high = per_axis("axis mins", math.nan), per_axis("axis maxs", math.nan)
    centerings = header.get("centerings", header.get("centers", [""] * int(header["dimension"])))
    centerings = centerings.split() if isinstance(centerings, str) else centerings  # pynrrd knows one of both names
    # For cell-centered axes the minimum is the outer face of the first voxel, not its center.
    cell = np.array([centerings[axis] == "cell" for axis in space])
    sizes = np.array([int(header["sizes"][axis]) for axis in space])
    steps = np.where(cell, sizes, sizes - 1)
    stated = (high - low) / np.where(steps > 0, steps, math.nan)
    spacing = per_axis("spacings", math.nan)
    spacing = np.where(np.isfinite(spacing), spacing, np.where(np.isfinite(stated), stated, 1.0))
    stated = np.isfinite(low)
    origin = np.where(stated, low + np.where(cell, spacing / 2, 0.0), 0.0)
    factors = _factors(header, "units", space, path)
    if "space origin" in header and not stated.any():
        return affine(np.diag(spacing * factors), _space_origin(header, path))
    return affine(np.diag(spacing * factors), origin * factors)


def _space_origin(header: Mapping[str, Any], path: Path) -> NDArray[np.float64]:
    """World position of the center of the first voxel, in the first of the space's units; by default 0."""
    origin = np.asarray(header.get("space origin", np.zeros(3)), float)
    if origin.shape != (3,):
        raise FileFormatError(f"{path.name} has a space origin of {counted(origin.size, 'number')}; expected 3")
    return origin * _factors(header, "space units", range(3), path)


def _factors(header: Mapping[str, Any], key: str, axes: Sequence[int], path: Path) -> NDArray[np.float64]:
    """Factors of lengths along ``axes`` to the unit of the first one; 1 where no units are stated."""
    units = header.get(key)
    if units is None or len(units) <= max(axes):
        return np.ones(len(axes))
    return unit_factors([str(units[axis]) for axis in axes], f"{path.name} states")
