# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear pictures as files, without Blender: 8-bit PNG for display, EXR (32-bit floats) and NumPy for numbers."""

from __future__ import annotations

import struct
import tempfile
import zlib
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import path_of, require_finite, require_unmasked
from spectral_core.errors import InvalidInputError
from spectral_core.files.exr import openexr, write_exr
from spectral_core.files.whole import make_folder, whole_file, write_bytes
from spectral_core.spectra.color import display_rgb_from_linear

ENDINGS = (".png", ".exr", ".npy")
BAND_PIXELS = 1 << 20
"""Pixels that are encoded at a time where a picture is written band by band."""
_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def require_ending(path: str | Path) -> Path:
    """``path`` if a picture can be written under that name; else raises InvalidInputError."""
    path = path_of(path)
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInputError(f"cannot tell the picture format of {str(path)!r}; end it with {', '.join(ENDINGS)}")
    return path


def write_picture(path: str | Path, linear_rgb: ArrayLike) -> None:
    """Write linear sRGB (height, width, 3), row 0 on top: display encoded in 8 bits as PNG, as it is otherwise.

    Pixels of a render have row 0 at the bottom and a fourth channel: write ``pixels[::-1, :, :3]``. Raises
    InvalidInputError for another ending or shape, and for numbers that are not finite.
    """
    path = require_ending(path)
    linear_rgb = _checked(linear_rgb)
    make_folder(path.parent)
    if path.suffix.lower() == ".npy":
        with whole_file(path) as unfinished:
            np.save(unfinished, linear_rgb)
    elif path.suffix.lower() == ".exr":
        with _exr(linear_rgb) as file:
            write_exr(path, file)
    else:
        write_bytes(path, png_bytes(_display_bytes(linear_rgb)))


def write_picture_with_alpha(path: str | Path, pixels: NDArray[Any]) -> None:
    """Write linear sRGB times alpha, and alpha (height, width, 4), row 0 on top: as EXR, or in 8 bits for display as
    PNG, whose colors are those of what covers a pixel.

    Raises InvalidInputError for another ending, and for numbers that are not finite.
    """
    path = require_ending(path)
    color, alpha = _checked(pixels[..., :3]), np.clip(pixels[..., 3:], 0.0, 1.0)
    make_folder(path.parent)
    if path.suffix.lower() == ".exr":
        write_exr_with_alpha(path, pixels)
        return
    if path.suffix.lower() != ".png":
        raise InvalidInputError(f"{path.name} holds no alpha; end it with .png or .exr")
    straight = np.divide(color, alpha, out=np.array(color), where=alpha > 0)
    shown = [_display_bytes(straight), np.round(alpha * 255).astype(np.uint8)]
    write_bytes(path, png_bytes(np.concatenate(shown, axis=2)))


def write_exr_with_alpha(path: str | Path, pixels: NDArray[Any]) -> None:
    """Write linear sRGB times alpha, and alpha (height, width, 4), row 0 on top, as an EXR of 32-bit floats.

    Raises FileWriteError, and MissingDependencyError without OpenEXR.
    """
    with _exr(pixels, "RGBA") as file:
        write_exr(path, file)


def _checked(linear_rgb: ArrayLike) -> NDArray[Any]:
    given = np.asarray(linear_rgb)
    if given.dtype.kind != "f" or given.ndim != 3 or given.shape[2] != 3 or not given.size:
        raise InvalidInputError(
            f"a picture has shape {given.shape} and type {given.dtype}; expected linear sRGB as floats (height, width, "
            "3), row 0 on top; of a render pass pixels[::-1, :, :3]"
        )
    require_unmasked("the picture", linear_rgb)
    require_finite("the picture", given)
    return given


def write_png_rows(path: Path, size: tuple[int, int], rows: Callable[[int, int], NDArray[Any]]) -> None:
    """Write a PNG of ``size`` (height, width) band by band, so that memory does not grow with the picture.

    ``rows(first, last)``: linear sRGB (last - first, width, 3).
    """
    height, width = size
    band = max(1, BAND_PIXELS // width)
    packer = zlib.compressobj(4)
    with whole_file(path) as unfinished, unfinished.open("wb") as stream:
        stream.write(_SIGNATURE + _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)))
        stream.write(_chunk(b"sRGB", b"\0"))
        for first in range(0, height, band):
            last = min(first + band, height)
            lines = np.zeros((last - first, 1 + 3 * width), np.uint8)  # a leading 0 per row: no filter
            lines[:, 1:] = _display_bytes(rows(first, last)).reshape(last - first, 3 * width)
            data = packer.compress(lines.tobytes())
            if data:
                stream.write(_chunk(b"IDAT", data))
        stream.write(_chunk(b"IDAT", packer.flush()) + _chunk(b"IEND", b""))


def _display_bytes(linear_rgb: NDArray[Any]) -> NDArray[np.uint8]:
    shown = np.clip(display_rgb_from_linear(np.asarray(linear_rgb)), 0.0, 1.0)
    return np.round(shown * 255).astype(np.uint8)


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """PNG of (height, width, 3) bytes, or 4 with straight alpha (ISO/IEC 15948: signature, header, filtered rows, end;
    marked as sRGB).
    """
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + channels * width), np.uint8)  # a leading 0 per row: no filter
    rows[:, 1:] = pixels.reshape(height, channels * width)
    head = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    chunks = (_chunk(b"IHDR", head), _chunk(b"sRGB", b"\0"), _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)))
    return _SIGNATURE + b"".join(chunks) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def display_png(linear_rgb: NDArray[Any]) -> bytes:
    """PNG of linear sRGB (height, width, 3 or more), row 0 on top, display encoded; (height, width) is gray."""
    given = np.asarray(linear_rgb)
    color = np.repeat(given[..., None], 3, axis=2) if given.ndim == 2 else given[..., :3]
    if color.ndim != 3 or color.shape[2] != 3 or not color.size:
        raise InvalidInputError(f"a picture has shape {given.shape}; expected (height, width, 3)")
    return png_bytes(_display_bytes(np.nan_to_num(color)))


def exr_bytes(linear_rgb: NDArray[Any]) -> bytes:
    """EXR of linear sRGB (height, width, 3 or more), 32-bit floats. Raises MissingDependencyError without OpenEXR."""
    with tempfile.TemporaryDirectory() as folder, _exr(linear_rgb) as file:
        path = Path(folder) / "picture.exr"
        file.write(str(path))
        return path.read_bytes()


def _exr(pixels: NDArray[Any], names: str = "RGB") -> Any:
    """An ``OpenEXR.File`` of the first channels of pixels (height, width, channels), by their ``names``."""
    module = openexr()
    channels = {names: np.ascontiguousarray(pixels[..., : len(names)], dtype=np.float32)}
    return module.File({"compression": module.ZIP_COMPRESSION, "type": module.scanlineimage}, channels)


def has_exr() -> bool:
    """True if pictures can be stored as EXR."""
    return find_spec("OpenEXR") is not None
