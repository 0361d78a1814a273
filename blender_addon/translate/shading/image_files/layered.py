# SPDX-License-Identifier: GPL-3.0-or-later
"""EXR files of several layers as images: Blender gives scripts no pixels of them, Cycles shows their first layer."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import SpectralError
from spectral_core.files.exr import read_exr

from .... import compat
from ...context import Translation
from .color_spaces import holds_numbers, is_linear


def is_layered(image: Any) -> bool:
    """True if Blender has read an image as a file of several layers, which then has no pixels."""
    return bool(image.type == "MULTILAYER" and image.source == "FILE" and image.packed_file is None)


def first_layer(image: Any) -> NDArray[np.float32] | None:
    """Colors and alpha (height, width, 4) of the first layer, bottom row first, as the file has them: that of Combined.

    None without such a layer, or if the file cannot be read.
    """
    with suppress(SpectralError):
        channels = read_exr(bpy.path.abspath(image.filepath, library=image.library))[0].channels
        layers = sorted(name.removesuffix("R") for name in channels if name == "R" or name.endswith(".R"))
        if layers and all(f"{layers[0]}{letter}" in channels for letter in "GB"):
            colors = [np.asarray(channels[f"{layers[0]}{letter}"].pixels, np.float32) for letter in "RGB"]
            alpha = channels.get(f"{layers[0]}A")
            whole = np.ones_like(colors[0]) if alpha is None else np.asarray(alpha.pixels, np.float32)
            return np.ascontiguousarray(np.stack([*colors, whole], axis=-1)[::-1])
    return None


def colors_of_layer(translation: Translation, image: Any, layer: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear sRGB (height, width, 3) of a layer, or its numbers; with a Note for a space that only Blender converts."""
    if holds_numbers(image) or is_linear(image):
        return np.ascontiguousarray(layer[..., :3])
    space = image.colorspace_settings.name
    if space not in ("scene_linear", compat.working_space(bpy.data)):
        text = f"the color space {space!r} of a file of several layers is not read; its colors count as scene-linear"
        translation.note(image.name, text)
    return np.ascontiguousarray(translation.linear_rgb(layer), dtype=np.float32)
