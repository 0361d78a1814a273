# SPDX-License-Identifier: GPL-3.0-or-later
"""VTK XML image data (.vti): inline ASCII or base64, appended raw or base64, with or without block compression.

``file layout``: an XML head; payloads are inside DataArray elements or, after ``_``, in AppendedData. A payload is a
header of integers and bytes: plain, one integer with their number; compressed, [blocks, block size, last block size,
packed size of each block] and the blocks. Raw appended bytes are no XML, so the head is cut off before it is parsed.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import math
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError, counted, how_to_install
from spectral_core.files.guarded import half_of_memory, read_bytes, require_room
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.formats.vtk_format import choose_array
from spectral_core.volume.files.payload import BROKEN_STREAM, affine, make_volume, parse_text, pick_component
from spectral_core.volume.files.request import ReadRequest

_TYPES = {f"{kind}{bits}": f"{kind[0].lower()}{bits // 8}" for kind in ("UInt", "Int") for bits in (8, 16, 32, 64)}
_TYPES |= {"Float32": "f4", "Float64": "f8"}
_LZMA_BYTES = 256 << 20
"""Memory for unpacking LZMA beside the data: the dictionary of its strongest setting has 64 MiB."""
_APPENDED = re.compile(rb"<AppendedData[^>]*>\s*_", re.DOTALL)
_AS_BASE64 = re.compile(rb"encoding\s*=\s*[\"']base64[\"']")


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a .vti file; ``request.field`` names one of several arrays."""
    file = _parse(path)
    image = file.root.find("ImageData")
    if file.root.get("type") != "ImageData" or image is None:
        raise FileFormatError(f"{path.name} holds {file.root.get('type')}; expected ImageData")
    try:
        return _read_image(file, image, request)
    except (ValueError, KeyError, binascii.Error, OverflowError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise FileFormatError(f"{path.name} is truncated or invalid: {error}") from error


@dataclass(frozen=True)
class _File:
    path: Path
    root: Any
    appended: bytes
    """The bytes after the ``_`` of AppendedData."""
    appended_base64: bool

    @property
    def order(self) -> str:
        return ">" if self.root.get("byte_order") == "BigEndian" else "<"

    @property
    def header_type(self) -> np.dtype:
        return np.dtype(self.order + _TYPES[self.root.get("header_type", "UInt32")])


def _parse(path: Path) -> _File:
    content = read_bytes(path, half_of_memory())
    mark, appended = _APPENDED.search(content), b""
    head = content
    if mark is not None:
        head = content[: mark.start()] + b"</VTKFile>"
        appended = content[mark.end() :]
    try:
        root = ElementTree.fromstring(head)
    except ElementTree.ParseError as error:
        raise FileFormatError(f"{path.name} is not well formed XML, or it is truncated: {error}") from error
    as_base64 = mark is not None and _AS_BASE64.search(mark.group(0)) is not None
    return _File(path, root, appended, as_base64)


def _read_image(file: _File, image: Any, request: ReadRequest) -> ScalarVolume:
    whole = _extent(image.attrib["WholeExtent"])
    pieces = image.findall("Piece")
    arrays: dict[str, str] = {}
    active = None
    for section in ("PointData", "CellData"):
        for element in pieces[0].findall(f"{section}/DataArray") if pieces else []:
            arrays.setdefault(element.get("Name", ""), section)
        marked = pieces[0].find(section).get("Scalars") if pieces and pieces[0].find(section) is not None else None
        active = active or marked
    names = {name: name for name in arrays}
    name = choose_array(names, request.field, file.path, active)
    of_cells = arrays[name] == "CellData"
    array = _assemble(file, pieces, name, whole, of_cells)
    array = pick_component(array, 0, request.component, file.path)
    return make_volume(file.path.stem, array, _world_from_index(image, whole, of_cells), file.path)


def _assemble(file: _File, pieces: list[Any], name: str, whole: NDArray, of_cells: bool) -> NDArray[Any]:
    """(components, nx, ny, nz) from all pieces, which may share their border points."""
    section = "CellData" if of_cells else "PointData"
    result = None
    shape = _counts(whole, of_cells)
    require_room(math.prod(shape), file.path)
    filled = np.zeros(shape, bool)
    for piece in pieces:
        extent = _extent(piece.attrib["Extent"])
        element = next((e for e in piece.findall(f"{section}/DataArray") if e.get("Name", "") == name), None)
        if element is None:
            raise FileFormatError(f"a piece of {file.path.name} lacks the array {name!r}; the file is invalid")
        components, counts = int(element.get("NumberOfComponents", 1)), _counts(extent, of_cells)
        values = _values(file, element, components * math.prod(counts))
        block = values.reshape(*counts[::-1], components).transpose(3, 2, 1, 0)
        if counts == shape and len(pieces) == 1:
            return block
        if result is None:
            require_room(components * math.prod(shape) * block.itemsize, file.path)
            result = np.zeros((components, *shape), block.dtype, order="F")
        start = extent[::2] - whole[::2]
        if (start < 0).any() or (start + counts > shape).any():
            raise FileFormatError(f"a piece of {file.path.name} has extent {extent.tolist()} outside {whole.tolist()}")
        here = tuple(slice(s, s + n) for s, n in zip(start, counts, strict=True))
        if len(block) != len(result):
            raise FileFormatError(f"the pieces of {file.path.name} hold {len(result)} and {len(block)} components")
        result[(slice(None), *here)] = block
        filled[here] = True
    if result is None or not filled.all():
        raise FileFormatError(f"the pieces of {file.path.name} do not fill its extent {whole.tolist()}")
    return result


def _extent(text: str) -> NDArray[np.int64]:
    values = np.array([int(word) for word in text.split()])
    if values.size != 6 or (values[1::2] < values[::2]).any():
        raise FileFormatError(f"extent {text!r} is empty or invalid; expected six ascending numbers")
    return values


def _counts(extent: NDArray[np.int64], of_cells: bool) -> list[int]:
    points = (extent[1::2] - extent[::2] + 1).tolist()
    return [max(n - 1, 1) for n in points] if of_cells else points


def _world_from_index(image: Any, whole: NDArray, of_cells: bool) -> NDArray[np.float64]:
    def numbers(key: str, default: str, count: int) -> NDArray[np.float64]:
        values = np.array([float(word) for word in image.get(key, default).split()])
        if values.size != count:
            raise FileFormatError(
                f"{key} {image.get(key)!r} of a .vti file has {counted(values.size, 'number')}; expected {count}"
            )
        return values

    directions = numbers("Direction", "1 0 0 0 1 0 0 0 1", 9).reshape(3, 3) * numbers("Spacing", "1 1 1", 3)
    # Origin is the position of index 0, which need not be in the extent; a cell's value is at its center.
    first = whole[::2] + np.where(whole[1::2] > whole[::2], 0.5, 0.0) * of_cells
    return affine(directions, numbers("Origin", "0 0 0", 3) + directions @ first)


def _values(file: _File, element: Any, count: int) -> NDArray[Any]:
    """The numbers of one DataArray."""
    kind, layout = element.get("type", ""), element.get("format", "ascii")
    if kind not in _TYPES:
        raise FileFormatError(f"{file.path.name} holds values of type {kind!r}; expected one of {', '.join(_TYPES)}")
    dtype = np.dtype(file.order + _TYPES[kind])
    if layout == "ascii":
        array = parse_text((element.text or "").encode(), dtype, count, file.path)
    else:
        if layout == "appended":
            text, as_base64 = file.appended[int(element.attrib["offset"]) :], file.appended_base64
        else:
            text, as_base64 = b"".join((element.text or "").encode().split()), True
        plain = np.frombuffer(_decode(file, text, as_base64, count * dtype.itemsize), dtype)
        array = plain.astype(dtype.newbyteorder("="), copy=False)
    if array.size != count:
        raise FileFormatError(
            f"array {element.get('Name')!r} of {file.path.name} has {counted(array.size, 'number')}; expected {count}"
        )
    return array


def _decode(file: _File, text: bytes, as_base64: bool, needed: int) -> bytes:
    """The ``needed`` plain bytes of the payload at the start of ``text``; a payload that states another length is
    refused.
    """
    word = file.header_type.itemsize
    require_room(needed, file.path)

    def take(start: int, length: int) -> bytes:
        """``length`` payload bytes; in base64, ``start`` counts characters and an encoded unit begins there."""
        piece = (
            base64.b64decode(text[start : start + 4 * math.ceil(length / 3)])
            if as_base64
            else text[start : start + length]
        )
        if len(piece) < length:
            raise FileFormatError(
                f"{file.path.name} is truncated: a payload has {len(piece)} bytes where {length} are stated"
            )
        return piece[:length]

    def header(start: int, count: int) -> list[int]:
        return [int(n) for n in np.frombuffer(take(start, count * word), file.header_type)]

    def encoded(length: int) -> int:
        return 4 * math.ceil(length / 3) if as_base64 else length

    compressor = file.root.get("compressor")
    if compressor is None:
        length = _require_stated(header(0, 1)[0], needed, file)
        if as_base64 and text[: encoded(word)].endswith(b"="):  # some writers pad the count into a unit of its own
            return take(encoded(word), length)
        return take(0, word + length)[word:]
    blocks = header(0, 1)[0]
    if blocks == 0:
        return b""
    _, size, last, *packed = header(0, 3 + blocks)
    _require_stated(size * (blocks - bool(last)) + last, needed, file)
    inflate = _inflater(compressor, file.path)
    data = take(encoded((3 + blocks) * word), sum(packed))
    plain, position = [], 0
    for index, length in enumerate(packed):
        expected = last if index == blocks - 1 and last else size
        try:
            plain.append(inflate(data[position : position + length], expected))
        except (*BROKEN_STREAM, MemoryError) as error:
            raise FileFormatError(f"block {index} of {file.path.name} is damaged: {error}") from error
        if len(plain[-1]) != expected:
            raise FileFormatError(f"block {index} of {file.path.name} does not unpack to the {expected} bytes stated")
        position += length
    return b"".join(plain)


def _require_stated(stated: int, needed: int, file: _File) -> int:
    if stated != needed:
        raise FileFormatError(
            f"a payload of {file.path.name} states {stated} bytes where its extent and type need {needed}"
        )
    return stated


def _inflater(compressor: str, path: Path) -> Callable[[bytes, int], bytes]:
    if compressor == "vtkZLibDataCompressor":
        return lambda packed, size: zlib.decompressobj().decompress(packed, size + 1)
    if compressor == "vtkLZMADataCompressor":
        return lambda packed, size: lzma.LZMADecompressor(memlimit=_LZMA_BYTES).decompress(packed, size + 1)
    if compressor == "vtkLZ4DataCompressor":
        try:
            from lz4 import block
        except ImportError as error:
            raise MissingDependencyError(
                f"{path.name} is packed with LZ4, which needs the Python package 'lz4'; {how_to_install('lz4')}"
            ) from error
        return lambda packed, size: block.decompress(packed, uncompressed_size=size)
    raise FileFormatError(f"{path.name} is packed by {compressor!r}; expected ZLib, LZMA or LZ4")
