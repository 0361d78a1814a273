# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures from files, read by Mitsuba's own readers: PNG, JPEG, EXR, HDR, BMP, TGA."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import path_of
from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.files.guarded import no_file, open_regular

MOST_EXIF = 1 << 18
"""Bytes of a file that are searched for its orientation: of a photograph, Exif data are the first or second segment."""
APP1, ORIENTATION = 0xE1, 0x0112


def read_picture(path: str | Path) -> NDArray[Any]:
    """Pixels (height, width, 3), top row first: integers are display values (sRGB), floats are linear.

    An alpha channel is refused unless it is 1 everywhere; gray pictures have three equal channels. A photograph whose
    camera was turned is turned upright, as its Exif data state.

    Raises
    ------
    InvalidInputError : there is no such file, or it is partly transparent. FileFormatError : it cannot be read.
    """
    path = path_of(path)
    if not path.is_file():
        raise InvalidInputError(no_file(path))
    try:
        import mitsuba

        if mitsuba.variant() is None:  # pictures need some variant; that of the caller stays
            mitsuba.set_variant("scalar_rgb")
        bitmap = mitsuba.Bitmap(str(path))
        pixels = np.array(bitmap)
    except ImportError as error:
        raise MissingDependencyError.package("mitsuba", "a picture file", "render") from error
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise FileFormatError(
            f"{path} cannot be read as a picture ({reason}); expected PNG, JPEG, EXR, HDR, BMP or TGA, in RGB or gray"
        ) from error
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.shape[2] in (2, 4):
        alpha = pixels[..., -1]
        if alpha.min() < (np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1):
            raise InvalidInputError(f"{path} is partly transparent; lay it on a background first")
        pixels = pixels[..., :-1]
    with open_regular(path) as stream:
        start = stream.read(MOST_EXIF)
    colors = _color_table(start)
    if colors is not None and pixels.shape[2] == 1:
        pixels = colors[pixels[..., 0]]
    pixels = _upright(pixels, _exif_orientation(start))
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels


def _color_table(start: bytes) -> NDArray[np.uint8] | None:
    """Colors (256, 3) of the indices in a BMP file of 8 bits, as its first bytes state them; None for other files.

    Mitsuba's reader gives the indices.
    """
    if not start.startswith(b"BM") or len(start) < 54:
        return None
    (header,) = struct.unpack_from("<I", start, 14)
    (bits,) = struct.unpack_from("<H", start, 24 if header == 12 else 28)
    if bits != 8:
        return None
    (first,) = struct.unpack_from("<I", start, 10)
    entry = 3 if header == 12 else 4  # bytes; blue, green, red, and in all but the oldest form a reserved one
    stored = np.frombuffer(start[14 + header : min(first, 14 + header + 256 * entry)], np.uint8)
    table = np.zeros((256, 3), np.uint8)
    entries = stored[: stored.size // entry * entry].reshape(-1, entry)
    table[: len(entries)] = entries[:, 2::-1]
    return table


def _upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """The picture (height, width, channels) as it is meant to be seen; ``orientation``: 1 to 8, as Exif counts them."""
    if orientation >= 5:  # rows and columns are exchanged
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def _exif_orientation(start: bytes) -> int:
    """Orientation that the first bytes of a JPEG file state (Exif 2.3, tag 0x0112); 1 if they state none."""
    place = 2 if start.startswith(b"\xff\xd8") else len(start)
    while start[place : place + 1] == b"\xff" and place + 4 <= len(start):
        marker, size = struct.unpack_from(">xBH", start, place)
        segment = start[place + 4 : place + 2 + size]
        if marker == APP1 and segment.startswith(b"Exif\0\0"):
            return _orientation_of_tiff(segment[6:])
        place += 2 + size
    return 1


def _orientation_of_tiff(tiff: bytes) -> int:
    order = {b"II": "<", b"MM": ">"}.get(tiff[:2], "")
    try:
        (first,) = struct.unpack_from(f"{order}I", tiff, 4)
        (count,) = struct.unpack_from(f"{order}H", tiff, first)
        entries = [struct.unpack_from(f"{order}HHIH", tiff, first + 2 + 12 * k) for k in range(count)]
    except struct.error:
        return 1  # damaged data beside a picture that can be read
    stated = [value for tag, _, _, value in entries if tag == ORIENTATION and 1 <= value <= 8]
    return stated[0] if order and stated else 1
