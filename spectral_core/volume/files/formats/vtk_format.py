# SPDX-License-Identifier: GPL-3.0-or-later
"""VTK legacy files with a STRUCTURED_POINTS (image) dataset, ASCII or binary.

The format is a list of keyword lines with payloads between them; every payload's length follows from its line, so the
requested one is found by skipping the others. Binary payloads are big-endian by definition.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, UnknownNameError, counted
from spectral_core.files.guarded import half_of_memory, read_bytes, require_room
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import affine, make_volume, parse_words, pick_component, read_numbers, x_first
from spectral_core.volume.files.request import ReadRequest

_TYPES = {
    "unsigned_char": "u1",
    "char": "i1",
    "signed_char": "i1",
    "unsigned_short": "u2",
    "short": "i2",
    "unsigned_int": "u4",
    "int": "i4",
    "unsigned_long": "u8",
    "long": "i8",
    "vtktypeint64": "i8",
    "vtktypeuint64": "u8",
    "vtkIdType": "i4",
    "float": "f4",
    "double": "f8",
}
_LONGEST_LINE, _MANY_WORDS = 16 << 20, 1_000_000
_FIXED_COMPONENTS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}


@dataclass(frozen=True)
class _Array:
    name: str
    values: NDArray[Any]
    """(components, n) with the components of one voxel side by side in the file."""
    of_cells: bool


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a legacy file; ``request.field`` names one of several arrays."""
    parser = _Parser(path)
    try:
        arrays = parser.parse()
    except (ValueError, IndexError, OverflowError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise FileFormatError(
            f"{path.name} is truncated or invalid near byte {parser.stream.tell()}: {error}"
        ) from error
    chosen = choose_array({array.name: array for array in arrays}, request.field, path)
    cells = chosen.of_cells
    shape = [max(n - 1, 1) for n in parser.shape] if cells else parser.shape
    values = chosen.values.reshape(chosen.values.shape[0], *shape[::-1]).transpose(0, 3, 2, 1)
    array = pick_component(values, 0, request.component, path)
    origin = parser.origin + np.where(np.array(parser.shape) > 1, parser.spacing / 2, 0) * cells
    return make_volume(path.stem, array, affine(np.diag(parser.spacing), origin), path)


def choose_array(arrays: dict[str, Any], field: str | None, path: Path, active: str | None = None) -> Any:
    """The named array, the one the file marks as active, or the only one there is."""
    if field is not None:
        if field not in arrays:
            raise UnknownNameError.among(f"array of {path.name}", field, arrays)
        return arrays[field]
    if active in arrays:
        return arrays[active]
    if len(arrays) != 1:
        held = ", ".join(arrays) or "no data array"
        raise InvalidInputError(f"{path.name} holds {held}; say which is the volume with field")
    return next(iter(arrays.values()))


class _Parser:
    """Reads the keyword lines of one file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.stream = io.BytesIO(read_bytes(path, half_of_memory()))
        self.shape: list[int] = []
        self.spacing, self.origin = np.ones(3), np.zeros(3)
        self._arrays: list[_Array] = []
        self._count, self._of_cells = 0, False

    def parse(self) -> list[_Array]:
        self.stream.readline(), self.stream.readline()  # version and title
        encoding = self.stream.readline().strip().upper()
        if encoding not in (b"ASCII", b"BINARY"):
            raise FileFormatError(f"{self.path.name} is encoded as {encoding[:20]!r}; expected ASCII or BINARY")
        self._binary = encoding == b"BINARY"
        while words := self._line():
            self._section(words[0].upper(), words[1:])
        if not self.shape:
            raise FileFormatError(f"{self.path.name} ends before its DIMENSIONS; the file is truncated")
        return self._arrays

    def _line(self) -> list[str]:
        """Words of the next line that is not blank; empty at the end."""
        for line in self.stream:
            if line.strip():
                return line.decode("ascii", "replace").split()
        return []

    def _section(self, key: str, words: list[str]) -> None:
        if key == "DATASET":
            if words[0].upper() != "STRUCTURED_POINTS":
                raise FileFormatError(
                    f"{self.path.name} holds a {words[0]} dataset; expected STRUCTURED_POINTS (image data)"
                )
        elif key == "DIMENSIONS":
            self.shape = [int(word) for word in words]
            if len(self.shape) != 3 or min(self.shape) < 1:
                raise FileFormatError(
                    f"{self.path.name} has DIMENSIONS {words}; expected three counts, each at least 1"
                )
        elif key in ("SPACING", "ASPECT_RATIO"):
            self.spacing = np.array([float(word) for word in words])
        elif key == "ORIGIN":
            self.origin = np.array([float(word) for word in words])
        elif key in ("POINT_DATA", "CELL_DATA"):
            self._start_data(key, int(words[0]))
        elif key == "METADATA":
            while self.stream.readline().strip():  # a block of text up to a blank line
                pass
        else:
            self._attribute(key, words)

    def _start_data(self, key: str, count: int) -> None:
        self._of_cells, self._count = key == "CELL_DATA", count
        expected = math.prod(max(n - 1, 1) if self._of_cells else n for n in self.shape)
        if count != expected or not self.shape:
            raise FileFormatError(
                f"{self.path.name} states {counted(count, 'value')} for dimensions {self.shape}; expected {expected}"
            )

    def _attribute(self, key: str, words: list[str]) -> None:
        if key == "SCALARS":
            components = int(words[2]) if len(words) > 2 else 1
            position = self.stream.tell()
            following = self._line()
            if not following or following[0].upper() != "LOOKUP_TABLE":  # the line is optional in practice
                self.stream.seek(position)
            self._keep(words[0], words[1], components)
        elif key == "FIELD":
            for _ in range(int(words[1])):
                name, components, count, kind = self._field_line()
                self._keep(name, kind, components, count)
        elif key in _FIXED_COMPONENTS:
            self._keep(words[0], words[1], _FIXED_COMPONENTS[key])
        elif key == "TEXTURE_COORDINATES":
            self._keep(words[0], words[2], int(words[1]))
        elif key == "COLOR_SCALARS":
            self._keep(words[0], "unsigned_char" if self._binary else "float", int(words[1]))
        elif key == "LOOKUP_TABLE":
            self._numbers("unsigned_char" if self._binary else "float", 4 * int(words[1]))
        else:
            raise FileFormatError(
                f"{self.path.name} has the unknown section {key[:30]!r}; the file is damaged or of a newer format"
            )

    def _field_line(self) -> tuple[str, int, int, str]:
        words = self._line()
        if words and words[0].upper() == "METADATA":
            self._section("METADATA", [])
            words = self._line()
        name, components, count, kind = words
        return name, int(components), int(count), kind

    def _keep(self, name: str, kind: str, components: int, count: int | None = None) -> None:
        if components < 1:
            raise FileFormatError(f"{self.path.name} states {components} components for {name!r}; expected at least 1")
        values = self._numbers(kind, components * (self._count if count is None else count))
        if count is None or (count == self._count and count):  # field data of the dataset itself have other lengths
            self._arrays.append(_Array(name, x_first(values, [components, values.size // components]), self._of_cells))

    def _numbers(self, kind: str, count: int) -> NDArray[Any]:
        if kind not in _TYPES:
            raise FileFormatError(
                f"{self.path.name} holds values of type {kind!r}; expected one of {', '.join(_TYPES)}"
            )
        if self._binary:
            return read_numbers(self.stream, np.dtype(">" + _TYPES[kind]), count, self.path, exact=False)
        return self._ascii(np.dtype(_TYPES[kind]), count)

    def _ascii(self, dtype: np.dtype, count: int) -> NDArray[Any]:
        require_room(count * dtype.itemsize, self.path)
        parts, found, words = [], 0, []
        while found < count and (line := self.stream.readline(_LONGEST_LINE)):
            if len(line) == _LONGEST_LINE:
                raise FileFormatError(f"{self.path.name} has a line of over {_LONGEST_LINE >> 20} MiB; it is damaged")
            words += (row := line.split())
            found += len(row)
            if len(words) > _MANY_WORDS:
                parts.append(parse_words(words, dtype, self.path))
                words = []
        if found != count:
            raise FileFormatError(
                f"{self.path.name} lists {counted(found, 'number')} where {count} are stated; the file is truncated "
                "or invalid"
            )
        return np.concatenate([*parts, parse_words(words, dtype, self.path)])
