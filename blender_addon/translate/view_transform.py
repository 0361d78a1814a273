# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's view transform, sampled: linear light to display colors by Blender's color management."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.types import Scene

from ..compat import working_space

if TYPE_CHECKING:
    from spectral_core.render.relight.view_transform import ViewTransform

NAME = "spectral view transform"
PLAIN_VIEW = "sRGB"
"""The name of the view that is the plain sRGB curve."""
_latest: dict[tuple[str, str], ViewTransform] = {}
"""The last table by the working space and the settings of the view: saving its picture takes up to 0.1 s."""


def view_transform_of(scene: Scene) -> ViewTransform | None:
    """The transform of ``scene``, its look, exposure, gamma and curves; None for the plain sRGB curve.

    Blender has no function for it, so a picture of all table nodes is saved like a render.
    """
    from spectral_core.render.relight.view_transform import ViewTransform, nodes

    if view_name(scene) == PLAIN_VIEW:
        return None
    key = working_space(bpy.data), view_name(scene)
    if key in _latest:
        return _latest[key]
    view = scene.view_settings
    light = nodes()
    grid = np.stack(np.meshgrid(light, light, light, indexing="ij"), axis=-1)
    shown = shown_pixels(scene, grid.reshape(len(light), -1, 3))
    name = view.view_transform if view.look == "None" else f"{view.view_transform}, {view.look}"
    _latest.clear()
    _latest[key] = ViewTransform(name, shown.reshape(grid.shape))
    return _latest[key]


def view_name(scene: Scene) -> str:
    """All settings of the view as text, ``PLAIN_VIEW`` for the plain sRGB curve."""
    view = scene.view_settings
    curves = view.curve_mapping.curves if view.use_curve_mapping else ()
    points = [[tuple(point.location) for point in curve.points] for curve in curves]
    said = (scene.display_settings.display_device, view.view_transform, view.look, view.exposure, view.gamma, points)
    return PLAIN_VIEW if said == ("sRGB", "Standard", "None", 0.0, 1.0, []) else repr(said)


def shown_pixels(scene: Scene, linear: np.ndarray) -> np.ndarray:
    """Linear pixels (height, width, 3) as in a 16-bit PNG of a render, 0 to 1."""
    height, width = linear.shape[:2]
    settings = scene.render.image_settings
    kept = (settings.file_format, settings.color_mode, settings.color_depth, settings.compression)
    image = bpy.data.images.new(NAME, width, height, float_buffer=True)
    read = None
    try:
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
        settings.compression = 0  # a third of the time
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
        # the compression belongs to the format
        settings.compression = kept[3]
        settings.file_format, settings.color_mode, settings.color_depth = kept[:3]
    return found.reshape(height, width, 4)[..., :3].astype(np.float64)
