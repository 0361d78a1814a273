# SPDX-License-Identifier: GPL-3.0-or-later
"""TIFF stacks: the pages of one file, or the files of a folder in the order of their numbers, through tifffile.

Columns are x, rows are y (downward, as stored), pages are z. Spacing comes from ImageJ or OME metadata; the plain
resolution tag of a TIFF is a print size without depth, so without those a voxel is 1×1×1.
"""

from __future__ import annotations

import logging
import math
import re
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError, SpectralError
from spectral_core.files.guarded import open_regular, require_regular, require_room
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.files.payload import affine, make_volume, pick_component, require_choice
from spectral_core.volume.files.request import ReadRequest
from spectral_core.volume.files.slice_names import in_order
from spectral_core.volume.files.units import unit_factors

_DEFLATE, _DEFLATE_RATIO, _SLACK_BYTES = (8, 32946), 1040, 16 << 20
_MOST_PAGES = 1_000_000
_DEPTH = "ZIQ"
"""tifffile's axis letters for depth: Z stated, I a page sequence, Q unknown."""


def read(path: Path, request: ReadRequest) -> ScalarVolume:
    """The volume of a multipage file or of a folder of single pages; channels and times need ``request.component``."""
    tifffile = _tifffile()
    if path.is_dir():
        return _read_folder(tifffile, path, request)
    pages, spacing = _read_file(tifffile, path, request)
    if pages.shape[0] == 1 and path.is_file():
        neighbors = sum(not each.name.startswith("._") for each in path.parent.glob(f"*{path.suffix}"))
        if neighbors > 1:
            raise InvalidInputError(
                f"{path.name} holds one page; to read the {neighbors} files as a stack open {path.parent}"
            )
    return make_volume(path.stem, pages.transpose(2, 1, 0), affine(np.diag(spacing), np.zeros(3)), path)


def _tifffile() -> Any:
    try:
        import tifffile
    except ImportError as error:
        raise MissingDependencyError.package("tifffile", "reading TIFF stacks", "volumes") from error
    return tifffile


def _read_folder(tifffile: Any, folder: Path, request: ReadRequest) -> ScalarVolume:
    # macOS keeps a file "._a.tif" with the properties of "a.tif" beside it on other file systems.
    images = (f for f in folder.iterdir() if f.suffix.lower() in (".tif", ".tiff") and not f.name.startswith("._"))
    files = in_order(images, folder)
    if not files:
        raise FileFormatError(f"{folder} holds no .tif or .tiff files; a folder is read as a stack of them")
    slices: list[NDArray[Any]] = []
    spacing = np.ones(3)
    for file in files:
        require_regular(file)
        pages, own = _read_file(tifffile, file, request)
        spacing = spacing if slices else own
        if not np.allclose(own, spacing, rtol=1e-4):
            raise FileFormatError(
                f"{file.name} in {folder} has voxels of {own.tolist()}, {files[0].name} has voxels of "
                f"{spacing.tolist()}; the slices of a stack must be alike"
            )
        if pages.shape[0] != 1:
            raise FileFormatError(
                f"{file.name} in {folder} holds {pages.shape[0]} pages; expected one page per file in a stack"
            )
        first = slices[0] if slices else pages[0]
        if (pages[0].shape, pages.dtype) != (first.shape, first.dtype):
            raise FileFormatError(
                f"{file.name} in {folder} is {pages[0].shape[::-1]} of {pages.dtype}, {files[0].name} is "
                f"{first.shape[::-1]} of {first.dtype}; the slices of a stack must be alike"
            )
        slices.append(pages[0])
    return make_volume(folder.name, np.stack(slices).transpose(2, 1, 0), affine(np.diag(spacing), np.zeros(3)), folder)


def _read_file(tifffile: Any, path: Path, request: ReadRequest) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Pages (z, y, x) and spacing (3,) of one file."""
    try:
        _require_ending_chain(path)
        with _collected_errors() as complaints, tifffile.TiffFile(path) as file:
            _refuse_cut(file, path)
            if len(file.series) != 1:
                shapes = ", ".join(str(series.shape) for series in file.series)
                raise FileFormatError(f"{path.name} holds images of different shapes ({shapes}); expected one stack")
            series = file.series[0]
            require_room(series.nbytes, path, held=path.stat().st_size)
            array, axes = series.asarray(), series.axes
            spacing = _spacing(file, series)
        if complaints:
            raise FileFormatError(f"{path.name} is truncated or damaged: {complaints[0]}")
    except Exception as error:
        if isinstance(error, SpectralError):
            raise
        packing = re.search(r"COMPRESSION\.(\w+).*'imagecodecs'", str(error))
        if packing:
            raise MissingDependencyError(
                f"{path.name} is compressed as {packing[1]}, which needs the Python package imagecodecs; install it, "
                "or save the file without compression or with Deflate (ZIP)"
            ) from error
        raise FileFormatError(f"{path.name} is not a TIFF that can be read, or it is truncated: {error}") from error
    others = [a for a in axes if a not in "YX" + _DEPTH]
    require_choice(request.component, [array.shape[axes.index(letter)] for letter in others], path)
    for letter in others:
        what = {"S": "color channels", "C": "channels", "T": "time steps"}.get(letter, f"entries along {letter}")
        several = array.shape[axes.index(letter)] > 1
        array = pick_component(array, axes.index(letter), request.component if several else None, path, what)
        axes = axes.replace(letter, "")
    if len(axes) == 2:
        array, axes = array[None], "Z" + axes
    if len(axes) != 3 or axes[1:] != "YX":
        raise FileFormatError(f"{path.name} has axes {axes}; expected pages of rows and columns")
    return array, spacing


@contextmanager
def _collected_errors() -> Iterator[list[str]]:
    """Errors in tifffile's log, such as a page beyond the file's end; tifffile then continues without that page."""
    complaints: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            complaints.append(record.getMessage())

    collector, logger = Collector(logging.ERROR), logging.getLogger("tifffile")
    propagated, logger.propagate = logger.propagate, False
    logger.addHandler(collector)
    try:
        yield complaints
    finally:
        logger.removeHandler(collector)
        logger.propagate = propagated


def _refuse_cut(file: Any, path: Path) -> None:
    """Raise FileFormatError if a page's bytes are not in the file; tifffile may fill them with zeros."""
    size = path.stat().st_size
    for number, page in enumerate(file.pages):
        page = page.aspage()
        for offset, count in zip(page.dataoffsets, page.databytecounts, strict=True):
            if offset + count > size:
                raise FileFormatError(
                    f"{path.name} is truncated: page {number} needs {offset + count} bytes, the file has {size}"
                )
        _require_stated_strips(page, number, path)
        _require_honest_strips(page, number, path)


def _require_stated_strips(page: Any, number: int, path: Path) -> None:
    """Raise FileFormatError if a page's size needs more strips than the file states: tifffile makes up the others, one
    at a time, which takes minutes for a damaged size.
    """
    needed, stated = math.prod(page.chunked), len(page.dataoffsets)
    if needed > stated and not page.is_contiguous:
        raise FileFormatError(
            f"{path.name} is damaged: page {number} of {'×'.join(map(str, page.shape))} needs {needed} strips, "
            f"the file states {stated}"
        )


def _require_honest_strips(page: Any, number: int, path: Path) -> None:
    """Raise FileFormatError if a strip unpacks to more than a page needs: the codecs themselves set no limit."""
    if int(page.compression) not in _DEFLATE:
        return
    most = page.nbytes + _SLACK_BYTES
    with open_regular(path) as stream:
        for offset, count in zip(page.dataoffsets, page.databytecounts, strict=True):
            if count * _DEFLATE_RATIO <= most:
                continue
            stream.seek(offset)
            inflate = zlib.decompressobj()
            packed, length = stream.read(count), 0
            while packed and not inflate.eof and length <= most:
                length += len(inflate.decompress(packed, _SLACK_BYTES))
                packed = inflate.unconsumed_tail
            if length > most:
                raise FileFormatError(f"{path.name} is damaged: a strip of page {number} unpacks to over {most} bytes")


def _require_ending_chain(path: Path) -> None:
    """Raise FileFormatError if the list of pages is cyclic, which tifffile would follow forever."""
    with open_regular(path) as stream:
        head = stream.read(16)
        order = "<" if head[:2] == b"II" else ">"
        big = head[2:4] in (b"+\0", b"\0+")
        count_format, entry, offset_format = (f"{order}Q", 20, f"{order}Q") if big else (f"{order}H", 12, f"{order}I")
        (offset,) = struct.unpack_from(offset_format, head, 8 if big else 4)
        seen: set[int] = set()
        while offset:
            if offset in seen or len(seen) >= _MOST_PAGES:
                raise FileFormatError(f"{path.name} is damaged: its list of pages does not end")
            seen.add(offset)
            stream.seek(offset)
            (entries,) = struct.unpack(count_format, stream.read(struct.calcsize(count_format)))
            stream.seek(entry * entries, 1)
            (offset,) = struct.unpack(offset_format, stream.read(struct.calcsize(offset_format)))


def _spacing(file: Any, series: Any) -> NDArray[np.float64]:
    if file.is_ome:
        for element in ElementTree.fromstring(file.ome_metadata).iter():
            if element.tag.endswith("}Pixels"):
                return _ome_spacing(element)
    if file.is_imagej:
        tags, metadata = series.pages[0].aspage().tags, file.imagej_metadata or {}
        sizes = [_pixel_size(tags, key) for key in ("XResolution", "YResolution")]
        # A slice of its own has no depth: cubes, as ImageJ makes of a folder.
        sizes.append(abs(metadata.get("spacing", 1.0 if metadata.get("images", 1) > 1 else sizes[0])))
        unit = str(metadata.get("unit", ""))  # of all axes, where those of y and z are not stated
        units = [unit, *(str(metadata.get(key, unit)) for key in ("yunit", "zunit"))]
        return np.array(sizes, float) * unit_factors(units, "the ImageJ metadata state")
    return np.ones(3)


def _ome_spacing(pixels: Any) -> NDArray[np.float64]:
    """Voxel sizes of OME metadata, in the unit of x; each axis may have a unit of its own, by default micrometers."""
    sizes = np.array([float(pixels.get(f"PhysicalSize{axis}", 1.0)) for axis in "XYZ"])
    units = [pixels.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"]
    return sizes * unit_factors(units, "the OME metadata state")


def _pixel_size(tags: Any, key: str) -> float:
    """Read spacing from the resolution tags, in which ImageJ stores pixels per unit."""
    if key not in tags:
        return 1.0
    pixels, units = tags[key].value
    return units / pixels if pixels and units else 1.0
