# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as files: 8-bit PNG for eyes, EXR with 32-bit floats for numbers; read back as linear sRGB."""

from __future__ import annotations

import io
import struct
import tempfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import FileFormatError, InvalidInputError, MissingDependencyError
from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb

MAX_PIXELS = 100_000_000


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """PNG of (height, width, 3) bytes (ISO/IEC 15948: signature, header, filtered rows, end; marked as sRGB)."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # a leading 0 per row: no filter
    rows[:, 1:] = pixels.reshape(height, 3 * width)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = (_chunk(b"IHDR", head), _chunk(b"sRGB", b"\0"), _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)))
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def display_png(linear_rgb: NDArray[Any]) -> bytes:
    """PNG of linear sRGB (height, width, 3 or more), row 0 on top, display encoded; (height, width) is gray."""
    given = np.asarray(linear_rgb)
    color = np.repeat(given[..., None], 3, axis=2) if given.ndim == 2 else given[..., :3]
    if color.ndim != 3 or color.shape[2] != 3 or not color.size:
        raise InvalidInputError(f"a picture has shape {given.shape}; expected (height, width, 3)")
    shown = np.clip(np.nan_to_num(display_rgb_from_linear(color)), 0.0, 1.0)
    return png_bytes(np.round(shown * 255).astype(np.uint8))


def exr_bytes(linear_rgb: NDArray[Any]) -> bytes:
    """EXR of linear sRGB (height, width, 3), 32-bit floats. Raises MissingDependencyError without OpenEXR."""
    from spectral_core.render.spectral_exr import openexr

    module = openexr()
    channels = {"RGB": np.ascontiguousarray(linear_rgb[..., :3], dtype=np.float32)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        with module.File({"compression": module.ZIP_COMPRESSION, "type": module.scanlineimage}, channels) as file:
            file.write(str(path))
        return path.read_bytes()


def has_exr() -> bool:
    """Whether linear pictures can be stored."""
    from importlib.util import find_spec

    return find_spec("OpenEXR") is not None


def read_linear(path: Path) -> NDArray[np.float32]:
    """Linear sRGB (height, width, 3) of an EXR, PNG, JPEG or .npy file, row 0 on top."""
    if path.suffix.lower() == ".npy":
        try:
            return _as_rgb(np.load(path, allow_pickle=False), path)
        except (ValueError, OSError) as error:
            raise FileFormatError(f"{path.name} cannot be read: {error}") from error
    if path.suffix.lower() == ".exr":
        from spectral_core.render.spectral_exr import openexr

        try:
            with openexr().File(str(path)) as file:
                channels = file.channels()
                if "RGB" in channels:
                    return _as_rgb(channels["RGB"].pixels, path)
                if "RGBA" in channels:
                    return _as_rgb(channels["RGBA"].pixels, path)
                return _as_rgb(np.stack([channels[name].pixels for name in "RGB"], axis=2), path)
        except (RuntimeError, KeyError, ValueError) as error:
            raise FileFormatError(f"{path.name} cannot be read as an RGB picture: {error}") from error
    return linear_from_display_rgb(read_display(path) / 255.0).astype(np.float32)


def read_display(path: Path, width: int | None = None) -> NDArray[np.uint8]:
    """Display sRGB bytes (height, width, 3) of a PNG or JPEG; ``width`` scales it down. Needs Pillow."""
    image = _pillow().open(path)
    if image.width * image.height > MAX_PIXELS:
        raise FileFormatError(f"{path.name} has {image.width}×{image.height} pixels; at most {MAX_PIXELS:,} are read")
    try:
        image = image.convert("RGB")
    except (OSError, ValueError, SyntaxError) as error:
        raise FileFormatError(f"{path.name} cannot be read: {error}") from error
    if width is not None:
        image.thumbnail((width, width))
    return np.asarray(image)


def encode(pixels: NDArray[np.uint8], kind: str = "WEBP", quality: int = 70) -> bytes:
    """Compressed picture of display bytes (height, width, 3), with Pillow."""
    out = io.BytesIO()
    _pillow().fromarray(pixels).save(out, kind, quality=quality)
    return out.getvalue()


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError as error:
        raise MissingDependencyError.package("pillow", "reading pictures back", "explore") from error
    return Image


def _as_rgb(pixels: Any, path: Path) -> NDArray[np.float32]:
    array = np.asarray(pixels, np.float32)
    if array.ndim == 2:
        array = np.repeat(array[..., None], 3, axis=2)
    if array.ndim != 3 or array.shape[2] < 3:
        raise FileFormatError(f"{path.name} has shape {array.shape}; expected (height, width, 3)")
    return np.ascontiguousarray(array[..., :3])
