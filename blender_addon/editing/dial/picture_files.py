# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the relit picture: PNG in the scene's view, EXR in linear light."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.types import Image, Scene
from numpy.typing import NDArray

from spectral_core.errors import FileWriteError, InvalidInputError
from spectral_core.files.whole import whole_file
from spectral_core.files.whole_picture import require_whole_picture
from spectral_core.spectra.pictures import write_exr_with_alpha

from ... import compat
from .picture import fill, linear_pixels, new_picture

ENDINGS = (".png", ".exr")


def require_ending(path: Path) -> Path:
    """``path``; raises InvalidInputError if its ending is not one of a picture."""
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInputError(f"{path.name} is neither .png nor .exr")
    return path


@dataclass(frozen=True)
class Output:
    """A scene's settings for the files of renders, as plain values."""

    image: tuple[tuple[str, Any], ...]
    dither: float

    @classmethod
    def of(cls, scene: Scene) -> Output | None:
        """Those of a scene; None if they have a view of their own."""
        settings = scene.render.image_settings
        if getattr(settings, "color_management", "") == "OVERRIDE":
            return None
        names = [name for name in compat.OF_IMAGE_FORMATS if hasattr(settings, name)]
        return cls(tuple((name, getattr(settings, name)) for name in names), scene.render.dither_intensity)

    def set_in(self, scene: Scene) -> None:
        """Give a scene these settings."""
        for name, value in self.image:
            setattr(scene.render.image_settings, name, value)
        scene.render.dither_intensity = self.dither


def write_pixels(scene: Scene, pixels: NDArray[np.float32], path: Path) -> None:
    """Write linear pixels (height, width, 4), bottom row first. Raises FileWriteError."""
    if path.suffix.lower() == ".exr":
        # Image.save of Blender 5 encodes an image that no file holds as sRGB, and only its own attribute tells
        write_exr_with_alpha(path, pixels[::-1])
        return
    if scene.render.image_settings.color_mode == "BW":
        pixels = _gray(pixels)
    image = new_picture("spectral picture to save", pixels.shape[1], pixels.shape[0])
    try:
        fill(image, pixels)
        _write_png(scene, image, path)
    finally:
        bpy.data.images.remove(image)


def write_picture(scene: Scene, image: Image, path: Path) -> None:
    """Write an image. Raises FileWriteError."""
    if path.suffix.lower() == ".exr" or scene.render.image_settings.color_mode == "BW":
        write_pixels(scene, linear_pixels(image), path)
    else:
        _write_png(scene, image, path)


def _gray(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear pixels of the same luminance. Blender makes a render gray before its view transform, but an image after
    it, which is darker in saturated colors.
    """
    from spectral_core.spectra.color import luminance_from_linear_rgb

    made = pixels.copy()
    made[..., :3] = luminance_from_linear_rgb(pixels[..., :3])[..., None]
    return made


def _write_png(scene: Scene, image: Image, path: Path) -> None:
    chosen = scene.render.image_settings.color_mode
    try:
        with (
            compat.image_format(scene.render, "PNG", color_mode=chosen),
            whole_file(path, check=require_whole_picture) as unfinished,
        ):
            image.save_render(str(unfinished), scene=scene)
    except RuntimeError as error:  # Blender's
        raise FileWriteError(f"{path} could not be written: {error}") from error
