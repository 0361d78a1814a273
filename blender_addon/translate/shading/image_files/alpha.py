# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors multiplied by alpha as Cycles stores them. It reads the file itself, and multiplies what the file keeps apart;
Blender's buffers were multiplied or divided by the alpha mode.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...context import Translation

Array = NDArray[Any]
PNG_START, PNG_TYPE, PNG_GRAY_ALPHA = b"\x89PNG\r\n\x1a\n", 25, 4
"""First bytes of a PNG file, the place of its color type, and the type of gray with alpha."""


def is_from_file(image: Any) -> bool:
    """True if Cycles reads the image's file and not Blender's pixels."""
    return image.packed_file is None and image.source in ("FILE", "SEQUENCE", "TILED")


def is_gray_file(image: Any) -> bool:
    """True if Cycles reads one channel from the image's file, whose alpha is then 1 everywhere, beside it too."""
    return is_from_file(image) and image.depth == (32 if image.is_float else 8)


def averaged(image: Any, colors: Array) -> Array:
    """Colors (height, width, channels) in the scene-linear space as Cycles keeps those of a gray file: one channel, the
    mean of what the conversion from the file's space made of the gray.
    """
    if colors.shape[2] < 3 or not is_gray_file(image):
        return colors
    return np.broadcast_to(colors.mean(axis=2, keepdims=True, dtype=np.float32), colors.shape)


def _is_kept(image: Any) -> bool:
    """True if Cycles keeps the colors of a file that has its alpha apart as they are.

    It takes those of WebP for multiplied ones, and multiplies four channels only, so not a gray PNG with alpha.
    """
    if not is_from_file(image) or image.file_format != "PNG":
        return bool(is_from_file(image) and image.file_format == "WEBP")
    start = b""
    with suppress(OSError), Path(bpy.path.abspath(image.filepath, library=image.library)).open("rb") as file:
        start = file.read(PNG_TYPE + 1)
    return start.startswith(PNG_START) and start[PNG_TYPE:] == bytes([PNG_GRAY_ALPHA])


def multiplied_floats(image: Any, colors: Array, alpha: Array) -> tuple[Array, Array | None]:
    """Float colors (height, width, channels) multiplied by alpha as Cycles stores them.

    With them the divisor (height, width, 1) that gives the colors which Blender decoded from sRGB; None for 1.
    """
    if not is_from_file(image):  # Cycles has Blender's pixels
        return colors, None
    is_straight, share = image.alpha_mode == "STRAIGHT", np.where(alpha > 0, alpha, np.float32(1))
    if image.file_format == "PNG" and not _is_kept(image):  # the one that keeps them apart in every version
        return (colors, share) if is_straight else (colors * alpha, share**2)
    return (colors / share, None) if is_straight else (colors, share)


def file_bytes(translation: Translation, image: Any, colors: Array, alpha: Array) -> Array:
    """Bytes (height, width, channels) of the file, not multiplied by alpha; with a Note where they are not known."""
    if image.alpha_mode != "PREMUL" or image.packed_file is not None or image.source != "FILE":
        return colors
    # Blender divided the file's colors by alpha; those of Cycles count as undivided
    translation.note(image.name, "its colors are stored multiplied by alpha; where they exceed it they are limited")
    return _by_rows(colors, alpha, lambda levels, share: (2 * levels * share + 255) // 510)  # the nearest byte


def multiplied(image: Any, colors: Array, alpha: Array) -> Array:
    """Colors of an image of bytes multiplied by alpha, as Cycles does; bytes are rounded down."""
    if _is_kept(image):
        return colors
    if colors.dtype != np.uint8:
        return colors * alpha
    return _by_rows(colors, alpha, lambda levels, share: levels * share // 255)


def _by_rows(colors: Array, alpha: Array, change: Any) -> Array:
    if (alpha == 255).all():
        return colors
    changed = np.empty_like(colors)
    for row in range(len(colors)):  # whole numbers of a row fit into a cache
        changed[row] = change(colors[row].astype(np.uint32), alpha[row].astype(np.uint32))
    return changed
