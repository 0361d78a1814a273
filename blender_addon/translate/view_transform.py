# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's view transform, sampled: what Blender's color management makes of linear light."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.types import Scene

if TYPE_CHECKING:
    from spectral_core.render.relight.view_transform import ViewTransform

NAME = "spectral view transform"


def view_transform_of(scene: Scene) -> ViewTransform | None:
    """The transform of ``scene``, its look, exposure, gamma and curves; None for the plain sRGB curve.

    Blender offers no call for it, so a picture of all table nodes is saved as it would save a render.
    """
    from spectral_core.render.relight.view_transform import ViewTransform, nodes

    view = scene.view_settings
    plain = view.view_transform == "Standard" and view.look == "None" and not view.use_curve_mapping
    if plain and view.exposure == 0 and view.gamma == 1:
        return None
    light = nodes()
    grid = np.stack(np.meshgrid(light, light, light, indexing="ij"), axis=-1)
    shown = _as_saved(scene, grid.reshape(len(light), -1, 3))
    name = view.view_transform if view.look == "None" else f"{view.view_transform}, {view.look}"
    return ViewTransform(name, shown.reshape(grid.shape))


def _as_saved(scene: Scene, linear: np.ndarray) -> np.ndarray:
    """Pixels (height, width, 3) as a 16-bit PNG of a render would hold them."""
    height, width = linear.shape[:2]
    settings = scene.render.image_settings
    kept = (settings.file_format, settings.color_mode, settings.color_depth)
    image = bpy.data.images.new(NAME, width, height, float_buffer=True)
    read = None
    try:
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
        pixels = np.concatenate([linear, np.ones((height, width, 1))], axis=-1).astype(np.float32)
        image.colorspace_settings.name = "Linear Rec.709"
        image.pixels.foreach_set(pixels.ravel())
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "view.png"
            image.save_render(str(path), scene=scene)
            read = bpy.data.images.load(str(path))
            read.colorspace_settings.name = "Non-Color"
            found = np.empty(4 * width * height, np.float32)
            read.pixels.foreach_get(found)
    finally:
        bpy.data.images.remove(image)
        if read is not None:
            bpy.data.images.remove(read)
        settings.file_format, settings.color_mode, settings.color_depth = kept
    return found.reshape(height, width, 4)[..., :3].astype(np.float64)
