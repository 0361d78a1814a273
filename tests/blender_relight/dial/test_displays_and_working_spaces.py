# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the dial, of pages and of sweeps in files for other displays than sRGB, and in other working spaces."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.editing.dial.picture import fill, linear_pixels, new_picture  # noqa: E402
from blender_addon.editing.dial.picture_files import write_picture  # noqa: E402
from blender_addon.translate.display.transform import shown_pixels  # noqa: E402

LINEAR = np.array([[[0.9, 0.05, 0.02], [0.1, 0.5, 0.2], [0.18, 0.18, 0.18], [0.1, 0.3, 0.8], [1.0, 1.0, 1.0]]])
WORKING_SPACES = ["ACEScg", "Linear Rec.2020"]
has_working_spaces = pytest.mark.skipif(bpy.app.version < (5, 0), reason="files have no working space before 5.0")


def srgb(linear):
    """IEC 61966-2-1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)


def saved(path):
    """The numbers of a picture (height, width, 4), as they are in the file."""
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.is_data = True
    return np.array(image.pixels).reshape(image.size[1], image.size[0], 4)


@pytest.mark.parametrize("device", ["Display P3", "Rec.1886", "Rec.2020", "Rec.2100-PQ", "Rec.2100-HLG"])
def test_the_picture_of_another_display_is_shown_in_srgb(blender, device):
    """Its numbers were those of that display, which pages and PNG files take for sRGB: red was (0.92, 0.2, 0.14)."""
    scene = bpy.context.scene
    known = [item.identifier for item in scene.display_settings.bl_rna.properties["display_device"].enum_items]
    try:
        scene.display_settings.display_device = device
    except TypeError:
        pytest.skip(f"this Blender has no display {device}, but {known}")
    scene.view_settings.view_transform = "Standard"
    np.testing.assert_allclose(shown_pixels(scene, LINEAR), srgb(LINEAR), atol=2e-3)
    assert scene.display_settings.display_device == device


@has_working_spaces
@pytest.mark.parametrize("space", WORKING_SPACES)
@pytest.mark.parametrize("device", ["sRGB", "Display P3"])
def test_another_working_space_shows_the_same_picture(blender, space, device):
    """Linear sRGB was taken for numbers of that space: (0.1, 0.5, 0.2) had no red."""
    bpy.context.scene.display_settings.display_device = device
    bpy.context.scene.view_settings.view_transform = "AgX"
    expected = shown_pixels(bpy.context.scene, LINEAR[:, 1:])
    bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=True)
    np.testing.assert_allclose(shown_pixels(bpy.context.scene, LINEAR[:, 1:]), expected, atol=2e-3)


@has_working_spaces
@pytest.mark.parametrize("space", WORKING_SPACES)
def test_the_relit_picture_is_the_same_in_another_working_space(blender, tmp_path, space):
    """The image of the dial, and PNG files of it, had linear sRGB where Blender takes floats for scene-linear."""
    bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=True)
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.color_mode = "RGBA"
    pixels = np.concatenate([LINEAR, np.ones((1, 5, 1))], axis=2).astype(np.float32)
    image = new_picture("Relit", 5, 1)
    fill(image, pixels)
    np.testing.assert_allclose(linear_pixels(image), pixels, atol=1e-5)
    write_picture(scene, image, tmp_path / "relit.png")
    write_picture(scene, image, tmp_path / "relit.exr")
    np.testing.assert_allclose(saved(tmp_path / "relit.png")[..., :3], srgb(LINEAR), atol=6e-3)
    np.testing.assert_allclose(saved(tmp_path / "relit.exr")[..., :3], LINEAR, atol=1e-4)
