# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of the scene's view: settings of output files have no effect on it and stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.compat import output_settings, set_image_format  # noqa: E402
from blender_addon.translate.display.transform import shown_pixels, view_name, view_transform_of  # noqa: E402
from spectral_core.errors import InvalidInputError  # noqa: E402

GRAY = np.full((2, 2, 3), 0.18)


def kept(render):
    return [(name, value) for _, name, value in output_settings(render)]


def output_as(scene, file_format):
    """Choose the format of output files; returns their settings."""
    settings = scene.render.image_settings
    if file_format == "FFMPEG" and hasattr(settings, "media_type"):
        settings.media_type = "VIDEO"
    elif file_format == "FFMPEG":
        settings.file_format = file_format
    else:
        set_image_format(settings, file_format, color_depth="32")
    return settings


@pytest.mark.parametrize("exposure", [0.0, -1.3, 0.7])
def test_the_table_shows_agx_as_blender_does(blender, exposure):
    """On axes of sRGB it was off by a quarter of a level of 255 in the mean and by twelve at most."""
    scene = bpy.context.scene
    scene.view_settings.view_transform, scene.view_settings.exposure = "AgX", exposure
    linear = 2.0 ** np.random.default_rng(4).uniform(-8, 3, (64, 64, 3))
    away = 255 * np.abs(view_transform_of(scene).shown(linear) - shown_pixels(scene, linear))
    assert away.mean() < 0.02 and away.max() < 1


def test_the_table_is_as_near_to_agx_with_a_look_as_the_page_states(blender):
    """docs/relight.md: of 255 levels less than half in the mean, four in 99 %, 22 at most."""
    scene = bpy.context.scene
    scene.view_settings.view_transform, scene.view_settings.look = "AgX", "AgX - High Contrast"
    linear = 2.0 ** np.random.default_rng(4).uniform(-8, 3, (256, 256, 3))
    away = 255 * np.abs(view_transform_of(scene).shown(linear) - shown_pixels(scene, linear))
    assert away.mean() < 0.5
    assert np.percentile(away, 99) < 4
    assert away.max() < 22


def test_the_table_is_near_to_agx_outside_of_srgb(blender):
    """Light of one wavelength, as of a laser or a sodium lamp: off by 39 levels in the mean on sRGB from 0 on."""
    import colour

    scene = bpy.context.scene
    scene.view_settings.view_transform = "AgX"
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    lines = np.array([observer[wavelength] / observer[wavelength][1] for wavelength in range(440, 660, 10)])
    colors = colour.XYZ_to_RGB(lines, "sRGB", apply_cctf_encoding=False)
    linear = colors[None] * 2.0 ** np.arange(-6, 2)[:, None, None]
    away = 255 * np.abs(view_transform_of(scene).shown(linear) - shown_pixels(scene, linear)).max(axis=-1)
    assert away.mean() < 0.2
    assert away.max() < 10


@pytest.mark.parametrize(
    ("view", "exposure", "most"), [("Standard", 0.3, 1.5), ("Standard", -2.4, 1.5), ("Khronos PBR Neutral", 0.0, 5)]
)
def test_the_table_shows_gray_as_other_views_do(blender, view, exposure, most):
    """Standard was off by 9 levels where it becomes white, at any exposure but 0; gray by 11 in the other view."""
    scene = bpy.context.scene
    try:
        scene.view_settings.view_transform = view
    except TypeError:
        pytest.skip(f"this Blender has no view {view}")
    scene.view_settings.exposure = exposure
    gray = np.repeat(2.0 ** np.linspace(-9, 3, 4096).reshape(64, 64, 1), 3, axis=2) * 2.0**-exposure
    away = 255 * np.abs(view_transform_of(scene).shown(gray) - shown_pixels(scene, gray))
    assert away.max() < most and away.mean() < 0.3


@pytest.mark.parametrize("file_format", ["FFMPEG", "OPEN_EXR_MULTILAYER", "OPEN_EXR"])
def test_output_files_of_any_kind_neither_change_the_view_nor_are_changed(blender, file_format):
    scene = bpy.context.scene
    scene.view_settings.view_transform = "AgX"
    expected = shown_pixels(scene, GRAY)
    settings = output_as(scene, file_format)
    settings.color_management = "OVERRIDE"
    settings.view_settings.view_transform = "Raw"
    before = kept(scene.render)
    np.testing.assert_array_equal(shown_pixels(scene, GRAY), expected)
    assert kept(scene.render) == before


@pytest.mark.parametrize(
    ("container", "codec", "color"),
    [("MPEG4", "MPEG4", "RGB"), ("MKV", "FFV1", "RGBA"), ("OGG", "THEORA", "RGB"), ("QUICKTIME", "PNG", "RGBA")],
)
def test_the_codec_of_a_movie_stays(blender, container, codec, color):
    """Blender replaces the settings of a movie without audio whenever a movie becomes the format."""
    scene = bpy.context.scene
    scene.view_settings.view_transform = "AgX"
    settings, movie = output_as(scene, "FFMPEG"), scene.render.ffmpeg
    movie.format, movie.codec, movie.constant_rate_factor = container, codec, "LOSSLESS"
    settings.color_mode = color
    before = kept(scene.render)
    shown_pixels(scene, GRAY)
    assert kept(scene.render) == before
    assert (movie.format, movie.codec, settings.color_mode) == (container, codec, color)


def test_a_scene_whose_output_is_a_movie_can_be_recorded_and_its_dial_saved(stage, tmp_path):
    scene = bpy.context.scene
    scene.view_settings.view_transform = "AgX"
    settings = output_as(scene, "FFMPEG")
    scene.render.resolution_y = 16  # Blender renders no movie of fewer rows
    assert bpy.ops.spectral.dial_record() == {"FINISHED"}
    assert bpy.ops.spectral.dial_save(filepath=str(tmp_path / "mixed.png")) == {"FINISHED"}
    assert (tmp_path / "mixed.png").stat().st_size and settings.file_format == "FFMPEG"


def change_white_balance(view):
    view.use_white_balance, view.white_balance_temperature = True, 3000


def change_black_level(view):
    view.curve_mapping.black_level = (0.1, 0.1, 0.1)
    view.curve_mapping.update()


def change_handle(view):
    view.curve_mapping.curves[3].points[1].handle_type = "VECTOR"
    view.curve_mapping.update()


@pytest.mark.parametrize("change", [change_white_balance, change_black_level, change_handle])
def test_a_setting_that_changes_the_shown_colors_makes_another_table(blender, change):
    scene = bpy.context.scene
    view = scene.view_settings
    view.view_transform, view.use_curve_mapping = "AgX", True
    view.curve_mapping.curves[3].points.new(0.3, 0.6)
    view.curve_mapping.update()
    name, table = view_name(scene), view_transform_of(scene).table
    change(view)
    assert view_name(scene) != name
    assert np.abs(view_transform_of(scene).table - table).max() > 0.01


def test_a_blender_that_cannot_read_its_color_management_is_refused():
    """Its sRGB pictures had linear numbers, so that they were too dark."""
    from blender_addon.commands._blend import require_readable_colors

    require_readable_colors(bpy.utils.system_resource("DATAFILES"))
    for folder in ("/opt/$blender/datafiles", "/opt/%BLENDER%/datafiles"):
        with pytest.raises(InvalidInputError, match="would be too dark"):
            require_readable_colors(folder)
