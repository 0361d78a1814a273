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
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from spectral_core.errors import FileFormatError
from spectral_core.files.guarded import MOST_HEADER_BYTES, read_bytes
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.formats.raw_format import read_layout
from spectral_core.volume.files.request import RawLayout, ReadRequest

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


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume that a .dat header describes."""
    fields: dict[str, str] = {}
    for line in read_bytes(path, MOST_HEADER_BYTES).decode("utf-8", "replace").splitlines():
        key, separator, value = line.partition(":")
        if separator and not line.lstrip().startswith("#"):
            name = key.strip().lower().replace(" ", "")
            fields[_SYNONYMS.get(name, name)] = value.strip()
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
        _triple(fields.get("slicethickness", "1 1 1"), path, "SliceThickness"),
        _triple(fields.get("origin", "0 0 0"), path, "Origin"),
    )
    return read_layout(data, layout, request.component)


def _triple(text: str, path: Path, key: str) -> tuple[float, float, float]:
    x, y, z = _numbers(text, path, key)
    return x, y, z


def _whole(text: str, path: Path, key: str, count: int) -> list[int]:
    values = _numbers(text, path, key, count)
    if any(value != round(value) for value in values):
        raise FileFormatError(f"{key} of {path.name} is {text!r}; expected whole numbers")
    return [int(value) for value in values]


def _numbers(text: str, path: Path, key: str, count: int = 3) -> list[float]:
    try:
        values = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise FileFormatError(f"{key} of {path.name} is {text!r}; expected {count} numbers") from error
    if len(values) != count or not np.isfinite(values).all():
        raise FileFormatError(f"{key} of {path.name} is {text!r}; expected {count} numbers")
    return values
