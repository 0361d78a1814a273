# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a sweep read back as linear or display sRGB, and compressed for its page."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import path_of
from spectral_core.errors import FileFormatError, MissingDependencyError
from spectral_core.files.exr import openexr
from spectral_core.spectra.color import linear_from_display_rgb

MAX_PIXELS = 100_000_000


def read_linear(path: str | Path) -> NDArray[np.float32]:
    """Linear sRGB (height, width, 3) of an EXR, PNG, JPEG or .npy file, row 0 at the top."""
    path = path_of(path)
    if path.suffix.lower() == ".npy":
        try:
            return _as_rgb(np.load(path, allow_pickle=False), path)
        except (ValueError, OSError) as error:
            raise FileFormatError(f"{path.name} cannot be read: {error}") from error
    if path.suffix.lower() == ".exr":
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


def read_display(path: str | Path, width: int | None = None) -> NDArray[np.uint8]:
    """Display sRGB bytes (height, width, 3) of a PNG or JPEG; ``width`` scales it down. Needs Pillow."""
    path = path_of(path)
    pillow = _pillow()
    try:
        image = pillow.open(path)
    except pillow.DecompressionBombError as error:
        raise FileFormatError(f"{path.name} is too large ({error}); at most {MAX_PIXELS:,} pixels are read") from error
    if image.width * image.height > MAX_PIXELS:
        raise FileFormatError(f"{path.name} has {image.width}×{image.height} pixels; at most {MAX_PIXELS:,} are read")
    try:
        image = _eight_bits(image).convert("RGB")
    except (OSError, ValueError, SyntaxError) as error:
        raise FileFormatError(f"{path.name} cannot be read: {error}") from error
    if width is not None:
        image.thumbnail((width, width))
    return np.asarray(image)


def _eight_bits(image: Any) -> Any:
    """A gray picture of 16 bits with 8: Pillow's own conversion takes all that is above 255 for white."""
    if not image.mode.startswith("I"):
        return image
    levels = np.clip(np.asarray(image, np.float64), 0, 65535)
    return _pillow().fromarray(np.rint(levels / 257).astype(np.uint8))


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
