# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of any space of Blender's OpenColorIO configuration, or of another one that ``$OCIO`` names: Blender converts
them where it reads a picture.
"""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.files.whole_picture import require_written
from spectral_core.spectra.color import display_rgb_from_linear

from .... import compat
from .permitted import permitted

Array = NDArray[Any]

WIDTH = 1024
"""Pixels of a row of the picture that Blender reads."""
ROWS = 64
"""Rows of an image whose intermediate numbers are in memory at a time."""


VIDEO_SPACES = ("Rec.2100-HLG", "Rec.2100-PQ")
VIDEO_WHITE = np.float32(2.03)
"""Colors of video in Cycles against those in Blender: their 1 stands for 100 and 203 cd/m²."""


def holds_numbers(image: Any) -> bool:
    """True if an image holds numbers and no colors; the name of this space depends on the configuration."""
    return bool(image.colorspace_settings.is_data)


def is_linear(image: Any) -> bool:
    """True if the numbers of an image are linear sRGB."""
    space = image.colorspace_settings.name
    if space == "scene_linear":
        return bool(np.array_equal(compat.rec709_from_working(compat.working_space(bpy.data)), np.eye(3)))
    return space in compat.LINEAR_REC709


def scene_linear(colors: Array, space: str) -> Array:
    """Colors (height, width, 3) of a color space as Cycles has them, in Blender's scene-linear space."""
    levels = np.rint(np.clip(colors, 0, 1) * 255).astype(np.uint32)
    packed = (levels[..., 0] << 16) | (levels[..., 1] << 8) | levels[..., 2]
    found, place = np.unique(packed, return_inverse=True)
    rgb = np.stack([(found >> shift) & 255 for shift in (16, 8, 0)], axis=-1) / np.float32(255)
    linear = permitted(lambda: _converted(rgb.astype(np.float32), space))
    if space in VIDEO_SPACES:
        linear *= VIDEO_WHITE
    return linear[place.reshape(packed.shape)]


def as_in_file(colors: Array, alpha: Array | None) -> Array:
    """Linear numbers (height, width, 3 or more) of a file in sRGB, with the curve that Cycles undoes after filtering.

    ``alpha``: (height, width, 1) by which Blender has divided the file's colors before it undid the curve; None for
    none.
    """
    curved = np.array(colors, dtype=np.float32)
    for start in range(0, len(colors), ROWS):
        rows = slice(start, start + ROWS)
        share: Array | float = 1.0 if alpha is None else np.where(alpha[rows] > 0, alpha[rows], 1.0)
        curved[rows, :, :3] = display_rgb_from_linear(colors[rows, :, :3] / share) * share
    return curved


def _converted(rgb: Array, space: str) -> Array:
    """Colors (n, 3) after their way through a file that Blender reads in that space."""
    width = min(WIDTH, len(rgb))
    height = -(-len(rgb) // width)
    pixels = np.ones((height * width, 4), np.float32)
    pixels[: len(rgb), :3] = rgb
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "colors.exr")
        written = bpy.data.images.new("Colors", width, height, float_buffer=True, is_data=True)
        try:
            written.pixels.foreach_set(pixels.ravel())
            written.filepath_raw, written.file_format = path, "OPEN_EXR"
            with suppress(RuntimeError):  # Blender's, on a full disk
                written.save()
            require_written(Path(path))
        finally:
            bpy.data.images.remove(written)
        read = bpy.data.images.load(path, check_existing=False)
        try:
            read.colorspace_settings.name = space
            read.pixels.foreach_get(values := np.empty(height * width * 4, np.float32))
        finally:
            bpy.data.images.remove(read)
    return values.reshape(-1, 4)[: len(rgb), :3]
