# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's view transform, sampled: linear light to display colors by Blender's color management."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.types import Scene

from spectral_core.files.whole_picture import require_written
from spectral_core.spectra.color import display_rgb_from_linear

from ...compat import image_format, rec709_from_working, working_space

if TYPE_CHECKING:
    from spectral_core.render.relight.agx_view import View

NAME = "spectral view transform"
PLAIN_VIEW = "sRGB"
"""The name of the view that is the plain sRGB curve."""
Key = tuple[str, str]
"""The working space, and all settings of the view as text."""
TRIED_LEAST, TRIED_LARGEST = -8.0, 3.0
"""Logarithms of light for which a table is compared with Blender's view."""
AS_AGX = 0.1 / 255
"""Mean difference up to which a view is the table of AgX; a look or curves make it several times as large."""
_latest: dict[Key, View] = {}
"""The last table: saving its picture takes up to 0.1 s, since Blender prepares the view for the processor."""


def view_key(scene: Scene) -> Key:
    """What the transform of ``scene`` depends on."""
    return working_space(bpy.data), view_name(scene)


def view_transform_of(scene: Scene) -> View | None:
    """The transform of ``scene``, its look, exposure, gamma and curves; None for the plain sRGB curve.

    Blender has no function for it, so a picture of all table nodes is saved like a render.
    """
    key = view_key(scene)
    if key[1] == PLAIN_VIEW:
        return None
    if key not in _latest:
        remember(key, sampled(scene))
    return _latest[key]


def is_known(key: Key) -> bool:
    """True if ``view_transform_of`` answers at once."""
    return key[1] == PLAIN_VIEW or key in _latest


def remember(key: Key, transform: View) -> None:
    """Keep the transform of a view until the next one."""
    _latest.clear()
    _latest[key] = transform


def sampled(scene: Scene) -> View:
    """The transform of ``scene`` as a table."""
    from spectral_core.render.relight.view_transform import BELOW, ViewTransform, nodes

    if (agx := _sampled_as_agx(scene)) is not None:
        return agx
    exposure = scene.view_settings.exposure
    light = nodes(below=BELOW) * 2.0**-exposure
    grid = np.stack(np.meshgrid(light, light, light, indexing="ij"), axis=-1)
    shown = shown_pixels(scene, grid.reshape(len(light), -1, 3))
    return ViewTransform(_title(scene), shown.reshape(grid.shape), BELOW, exposure)


def _sampled_as_agx(scene: Scene) -> View | None:
    """The transform as the table of Blender's AgX; None for another view, and for what a look, curves or another color
    configuration make of it.
    """
    from spectral_core.render.relight.agx_view import LOWEST_STOP, AgxView, node_light

    if not scene.view_settings.view_transform.startswith("AgX"):
        return None
    lowest = LOWEST_STOP - scene.view_settings.exposure
    light = node_light(lowest)
    shown = shown_pixels(scene, light.reshape(len(light), -1, 3)).reshape(light.shape)
    found = AgxView.of_shown(_title(scene), shown, lowest)
    tried = 2.0 ** np.random.default_rng(0).uniform(TRIED_LEAST, TRIED_LARGEST, (64, 64, 3))
    away = np.abs(found.shown(tried) - shown_pixels(scene, tried)).mean()
    return found if away <= AS_AGX else None


def _title(scene: Scene) -> str:
    view = scene.view_settings
    return view.view_transform if view.look == "None" else f"{view.view_transform}, {view.look}"


def view_name(scene: Scene) -> str:
    """All settings of the view as text, ``PLAIN_VIEW`` for the plain sRGB curve."""
    view = scene.view_settings
    mapping = view.curve_mapping if view.use_curve_mapping else None
    points = [[tuple(point.location) for point in curve.points] for curve in mapping.curves] if mapping else []
    said = (scene.display_settings.display_device, view.view_transform, view.look, view.exposure, view.gamma, points)
    # settings that few scenes use follow only where they are used: fingerprints of earlier sweeps stay
    further = {name: value for name, value in settings_of(view).items() if name not in USUAL}
    if not further.pop("use_white_balance", False):
        further = {name: value for name, value in further.items() if not name.startswith("white_balance_")}
    if mapping:
        handles = [[point.handle_type for point in curve.points] for curve in mapping.curves]
        further |= {"curves": settings_of(mapping), "handles": handles}
    if said == ("sRGB", "Standard", "None", 0.0, 1.0, []) and not further:
        return PLAIN_VIEW
    return repr((*said, further) if further else said)


USUAL = ("view_transform", "look", "exposure", "gamma", "use_curve_mapping")
"""Settings of a view that its name always has."""


def settings_of(block: Any) -> dict[str, Any]:
    """The settings of a block, as Blender lists them: those of a new version are not overlooked."""
    names = [prop.identifier for prop in block.bl_rna.properties if not prop.is_readonly]
    values = {name: getattr(block, name) for name in names}
    return {
        name: value if isinstance(value, str | bool | float | int) else tuple(value) for name, value in values.items()
    }


def shown_pixels(scene: Scene, linear: np.ndarray) -> np.ndarray:
    """Linear pixels (height, width, 3) as in a 16-bit PNG of a render in the scene's view, 0 to 1, for a display of
    sRGB: pages and pictures show them on that. What another display of the scene shows is converted.
    """
    height, width = linear.shape[:2]
    image = bpy.data.images.new(NAME, width, height, float_buffer=True)
    rgb_from_working = rec709_from_working(working_space(bpy.data))
    read = None
    # without compression it takes a third of the time; a view of the output files' own is not what the artist sees
    how = {"color_mode": "RGB", "color_depth": "16", "compression": 0, "color_management": "FOLLOW_SCENE"}
    try:
        # Blender takes the floats of an image for scene-linear, whatever the image's color space is
        working = linear @ np.linalg.inv(rgb_from_working).T
        pixels = np.concatenate([working, np.ones((height, width, 1))], axis=-1).astype(np.float32)
        image.pixels.foreach_set(pixels.ravel())
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "view.png"
            with image_format(scene.render, "PNG", **how), suppress(RuntimeError):  # Blender's, on a full disk
                image.save_render(str(path), scene=scene)
            require_written(path)
            read = bpy.data.images.load(str(path))
            is_of_srgb = not _read_as_display(read, scene.display_settings.display_device)
            found = np.empty(4 * width * height, np.float32)
            read.pixels.foreach_get(found)
    finally:
        bpy.data.images.remove(image)
        if read is not None:
            bpy.data.images.remove(read)
    shown = found.reshape(height, width, 4)[..., :3].astype(np.float64)
    if is_of_srgb:
        return shown
    light = shown @ rgb_from_working.T
    return np.asarray(display_rgb_from_linear(np.clip(light, 0.0, 1.0)))


def _read_as_display(image: Any, device: str) -> bool:
    """True if the numbers of an image become the light of a display, which has a color space of its own name; else,
    as for sRGB and in configurations without that name, they stay as they are.
    """
    if not device.startswith("sRGB"):
        with suppress(TypeError):  # no such space
            image.colorspace_settings.name = device
            return True
    image.colorspace_settings.is_data = True
    return False
