# SPDX-License-Identifier: GPL-3.0-or-later
"""A recording of a render border stands at its place in the frame, and its files are as large as those of F12."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")


def _read(path):
    image = bpy.data.images.load(str(path))
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)


def _border(scene, *, cropped):
    scene.render.use_border, scene.render.use_crop_to_border = True, cropped
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0


@pytest.mark.parametrize("cropped", [False, True])
def test_a_border_is_shown_and_saved_at_its_place(stage, picture, tmp_path, cropped):
    """The camera view stretches the image over the whole frame, so the image is the whole frame."""
    stage.render.resolution_x, stage.render.resolution_y, stage.spectral.render.samples = 16, 12, 64
    stage.camera.data.shift_x = 0.1  # nothing is symmetric
    bpy.ops.spectral.dial_record()
    whole = picture().copy()
    _border(stage, cropped=cropped)
    bpy.ops.spectral.dial_record()

    shown = picture()

    assert shown.shape == (12, 16, 4)
    inside = shown[6:12, 4:12]
    assert inside[..., :3].mean(axis=(0, 1)) == pytest.approx(whole[6:12, 4:12, :3].mean(axis=(0, 1)), rel=0.1)
    assert not shown[:6].any() and not shown[:, :4].any() and not shown[:, 12:].any()
    assert stage.camera.data.background_images[0].frame_method == "STRETCH"
    bpy.ops.spectral.dial_save(filepath=str(tmp_path / "relit.exr"))
    stage.render.image_settings.file_format = "OPEN_EXR"
    stage.render.filepath = str(tmp_path / "f12.exr")
    bpy.ops.render.render(write_still=True)
    saved, rendered = _read(tmp_path / "relit.exr"), _read(tmp_path / "f12.exr")
    assert saved.shape == rendered.shape == ((6, 8, 4) if cropped else (12, 16, 4))
    for rows in (slice(None, 6), slice(-6, None)):
        expected = rendered[rows, ..., :3].mean()
        assert saved[rows, ..., :3].mean() == pytest.approx(expected, rel=0.05, abs=1e-6)


def test_a_saved_exr_has_the_numbers_of_the_picture(stage, dial, picture, tmp_path):
    """Read without Blender, which undoes an encoding that it has stated in an attribute of its own."""
    from spectral_core.files.exr import read_exr

    stage.render.film_transparent = True
    bpy.data.objects["Plane"].scale = (0.2, 0.2, 1.0)
    bpy.ops.spectral.dial_record()
    bpy.ops.spectral.dial_save(filepath=str(tmp_path / "relit.exr"))
    (part,) = read_exr(tmp_path / "relit.exr")
    for number, name in enumerate("RGBA"):
        np.testing.assert_array_equal(part.channels[name].pixels[::-1], picture()[..., number])
    assert 0.0 < picture()[..., 3].mean() < 1.0


@pytest.mark.parametrize("colors", ["RGBA", "RGB"])
def test_a_saved_png_is_as_transparent_as_that_of_a_render(stage, dial, picture, tmp_path, colors):
    stage.render.film_transparent, stage.render.image_settings.color_mode = True, colors
    bpy.data.objects["Plane"].scale = (0.2, 0.2, 1.0)
    bpy.ops.spectral.dial_record()
    bpy.ops.spectral.dial_save(filepath=str(tmp_path / "relit.png"))
    alpha = picture()[..., 3] if colors == "RGBA" else np.ones((12, 16))
    assert _read(tmp_path / "relit.png")[..., 3] == pytest.approx(alpha, abs=0.5 / 255)
    assert stage.render.image_settings.color_mode == colors


@pytest.mark.parametrize("view", ["Standard", "AgX"])
def test_a_saved_png_is_as_gray_as_that_of_a_render(stage, tmp_path, view):
    """A saturated emission, which is free of noise, so that F12 writes the same file. Encoded values that are made gray
    are darker by up to 38 of 255 levels.
    """
    emission = next(n for n in bpy.data.materials["Glow"].node_tree.nodes if n.type == "EMISSION")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1.0, 0.2, 0.05, 1.0), 2.0
    bpy.data.objects["Ball"].scale, bpy.data.objects["Ball"].location = (20, 20, 1), (0, 0, 4)
    settings, stage.render.dither_intensity = stage.render.image_settings, 0.0
    stage.view_settings.view_transform = view
    settings.file_format, settings.color_mode = "PNG", "BW"
    bpy.ops.spectral.dial_record()
    bpy.ops.spectral.dial_save(filepath=str(tmp_path / "relit.png"))
    stage.render.filepath = str(tmp_path / "render.png")
    bpy.ops.render.render(write_still=True)
    relit, render = _read(tmp_path / "relit.png")[..., :3], _read(tmp_path / "render.png")[..., :3]
    assert np.ptp(relit, axis=-1).max() == 0.0
    assert relit == pytest.approx(render, abs=1.5 / 255)


def test_a_border_that_was_changed_after_the_recording_moves_no_picture(stage, picture):
    """The panel reports the change; the picture stays as it was recorded."""
    from blender_addon.editing.dial import live

    bpy.ops.spectral.dial_record()
    before = picture().copy()
    _border(stage, cropped=False)
    live.show(stage)
    np.testing.assert_array_equal(picture(), before)
