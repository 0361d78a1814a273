# SPDX-License-Identifier: GPL-3.0-or-later
"""Raw data with a .dat header, as volvis collections and Inviwo write it.

::

    ObjectFileName: engine.raw         (or RawFile)
    Resolution:     256 256 128
    SliceThickness: 1 1 2              (or Spacing; default 1 1 1)
    Format:         USHORT             (UCHAR, SHORT, FLOAT, ... or UINT8, FLOAT32, ...; USHORT_12 is USHORT)
    ByteOffset:     0                  (optional; bytes before the data)
    Endianness:     LittleEndian       (optional; or BigEndian)
    Origin:         0 0 0              (optional; center of the first voxel)

Inviwo places the whole box of the voxels instead: ``Offset`` is its corner, ``BasisVector1`` to ``3`` are the rows of
the matrix whose columns are its edges, ``WorldVector1`` to ``4`` the rows of a matrix that is applied after it. Without
an offset a box with basis vectors is around the origin.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, counted
from spectral_core.files.guarded import MOST_HEADER_BYTES, read_bytes
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.formats.raw_format import read_layout
from spectral_core.volume.files.payload import affine, header_text
from spectral_core.volume.files.request import RawLayout, ReadRequest

Matrix = NDArray[np.float64]

_TYPES = {
    "UCHAR": "u1",
    "CHAR": "i1",
    "USHORT": "u2",
    "SHORT": "i2",
    "UINT": "u4",
    "INT": "i4",
    "FLOAT": "f4",
    "DOUBLE": "f8",
}
_TYPES |= {f"{kind}{8 * size}": f"{kind[0].lower()}{size}" for kind in ("UINT", "INT") for size in (1, 2, 4, 8)}
_TYPES |= {"BYTE": "u1", "FLOAT32": "f4", "FLOAT64": "f8"}
_SYNONYMS = {"rawfile": "objectfilename", "spacing": "slicethickness", "byteorder": "endianness"}
_SYNONYMS |= dict.fromkeys(("dimension", "dimensions"), "resolution")
_EDGES = ("BasisVector1", "BasisVector2", "BasisVector3")
_WORLD = ("WorldVector1", "WorldVector2", "WorldVector3", "WorldVector4")


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume that a .dat header describes."""
    fields: dict[str, str] = {}
    for line in header_text(read_bytes(path, MOST_HEADER_BYTES)).splitlines():
        key, separator, value = line.partition(":")
        if separator and not line.lstrip().startswith(("#", "//")):
            name = key.strip().lower().replace(" ", "")
            fields[_SYNONYMS.get(name, name)] = value.partition(" #")[0].strip()
    missing = [key for key in ("objectfilename", "resolution", "format") if key not in fields]
    if missing:
        raise FileFormatError(f"the header {path.name} lacks {', '.join(missing)}")
    kind = fields["format"].upper().split("_")[0]
    if kind not in _TYPES:
        raise FileFormatError(f"{path.name} has format {fields['format']!r}; expected one of {', '.join(_TYPES)}")
    data = path.parent / fields["objectfilename"]
    if not data.exists():
        raise FileFormatError(
            f"{path.name} names the data file {data.name!r}, which is not in {data.parent}; keep both together"
        )
    nx, ny, nz = _whole(fields["resolution"], path, "Resolution", 3)
    layout = RawLayout(
        (nx, ny, nz),
        _TYPES[kind],
        "big" if fields.get("endianness", "little").lower().startswith("big") else "little",
        _whole(fields.get("byteoffset", "0"), path, "ByteOffset", 1)[0],
    )
    with np.errstate(over="ignore", invalid="ignore"):  # the volume refuses what is not finite
        matrix = _placed(fields, np.array([nx, ny, nz], dtype=np.float64), path)
    read = read_layout(data, layout, request.component)
    return ScalarVolume(read.name, read.data, matrix)


def _placed(fields: dict[str, str], counts: Matrix, path: Path) -> Matrix:
    """World from index, (4, 4), by the center of the first voxel or by the box of all of them."""
    spacing = np.array(_numbers(fields.get("slicethickness", "1 1 1"), path, "SliceThickness"))
    if "origin" in fields and any(key.lower() in fields for key in ("Offset", *_EDGES)):
        raise FileFormatError(
            f"{path.name} has Origin beside Offset or BasisVector1 to 3, which place the volume in other ways; keep "
            "one of them"
        )
    edges = _matrix(fields, _EDGES, path)
    box: Matrix = np.diag(spacing * counts) if edges is None else edges
    if "offset" in fields:
        corner = np.array(_numbers(fields["offset"], path, "Offset"))
    elif edges is not None:
        corner = -0.5 * box.sum(axis=1)
    else:
        corner = np.array(_numbers(fields.get("origin", "0 0 0"), path, "Origin")) - 0.5 * spacing
    world = _matrix(fields, _WORLD, path)
    matrix = affine(box / counts, np.asarray(corner + box @ (0.5 / counts), dtype=np.float64))
    return matrix if world is None else world @ matrix


def _matrix(fields: dict[str, str], keys: tuple[str, ...], path: Path) -> Matrix | None:
    """The matrix with these rows; None if the header has none of them."""
    missing = [key for key in keys if key.lower() not in fields]
    if len(missing) == len(keys):
        return None
    if missing:
        raise FileFormatError(
            f"the header {path.name} lacks {', '.join(missing)}; expected {keys[0]} to {keys[-1][-1]}"
        )
    return np.array([_numbers(fields[key.lower()], path, key, len(keys)) for key in keys])


def _whole(text: str, path: Path, key: str, count: int) -> list[int]:
    values = _numbers(text, path, key, count)
    if any(value != round(value) for value in values):
        raise FileFormatError(f"{key} of {path.name} is {text!r}; expected whole numbers")
    return [int(value) for value in values]


def _numbers(text: str, path: Path, key: str, count: int = 3) -> list[float]:
    try:
        values = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise FileFormatError(f"{key} of {path.name} is {text!r}; expected {counted(count, 'number')}") from error
    if len(values) != count or not np.isfinite(values).all():
        raise FileFormatError(f"{key} of {path.name} is {text!r}; expected {counted(count, 'number')}")
    return values
