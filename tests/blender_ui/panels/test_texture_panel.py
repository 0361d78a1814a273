# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Spectral Texture without a window: images as input; texture, material, lamps and messages as output."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("OpenEXR")

from blender_addon.translate.spectra.stored import spectrum_of
from blender_addon.translate.texture.costs import realism_words
from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture.file import read_texture
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, linear_from_display_rgb

SIZE = 12


def image(bpy, name: str, seed: int):
    made = bpy.data.images.new(name, SIZE, SIZE)
    rng = np.random.default_rng(seed)
    pixels = np.ones((SIZE, SIZE, 4), np.float32)
    pixels[..., :3] = np.round(rng.uniform(0.2, 0.9, (SIZE, SIZE, 3)) * 255) / 255
    made.pixels.foreach_set(pixels.ravel())
    return made, pixels[::-1, :, :3]


@pytest.fixture
def design(blender, tmp_path):
    panel = blender.context.scene.spectral.texture
    panel.folder = str(tmp_path / "texture")
    return panel


def errors(texture, light, shown, wanted) -> float:
    """Largest ΔE2000 between the texture's picture and the wanted one."""
    found = texture.picture(light)
    return float(delta_e_2000(lab_from_linear_rgb(found), lab_from_linear_rgb(wanted)).max())


@pytest.mark.slow
def test_two_images_become_a_texture_a_material_and_lamps(blender, design) -> None:
    bpy = blender
    design.first, first = image(bpy, "first", 1)
    design.second, second = image(bpy, "second", 2)
    design.floor, design.slope = 0.05, 0.85
    assert bpy.ops.spectral.texture_design() == {"FINISHED"}
    assert design.status == ""
    texture = read_texture(design.texture_file)
    for light, wanted in zip(texture.lights, (first, second), strict=True):
        assert errors(texture, light, None, 0.05 + 0.85 * linear_from_display_rgb(wanted)) < 0.5
    assert "Both lights look white" in design.report
    assert "Other observers see tinted whites" in design.report
    assert tuple(design.lost_1.size) == (SIZE, SIZE)
    lamps = [bpy.data.lights.new(name, "POINT") for name in ("one", "two")]
    design.lamp_1, design.lamp_2 = lamps
    assert bpy.ops.spectral.texture_lights() == {"FINISHED"}
    for lamp, light in zip(lamps, texture.lights, strict=True):
        stored = spectrum_of(lamp)
        np.testing.assert_allclose(stored.at(light.grid.wavelengths_nm), light.values, rtol=1e-4, atol=1e-6)
    assert bpy.ops.spectral.texture_material() == {"FINISHED"}
    node = next(n for n in bpy.data.materials["Spectral Texture"].node_tree.nodes if n.bl_label == "Spectral Texture")
    assert node.message == ""
    assert node.filepath == design.texture_file


def test_one_image_with_a_wanted_color_under_given_lamps(blender, design) -> None:
    bpy = blender
    design.kind = "ONE"
    design.first, shown = image(bpy, "only", 3)
    for number, name in ((1, "D65"), (2, "HP1")):
        light = getattr(design, f"light_{number}").spectral
        light.kind, light.source, light.catalogue_name = "ILLUMINANT", "CATALOGUE", name
    bpy.ops.spectral.texture_wanted_color()
    design.wanted_colors[0].color, design.wanted_colors[0].wanted = (0.6, 0.3, 0.3), (0.7, 0.5, 0.2)
    assert bpy.ops.spectral.texture_design() == {"FINISHED"}
    texture = read_texture(design.texture_file)
    assert errors(texture, texture.lights[0], None, linear_from_display_rgb(shown)) < 0.3
    assert design.wanted_colors[0].outcome.startswith("ΔE")
    assert any(design.wanted_colors[0].reached)


def test_missing_input_is_reported(blender, design) -> None:
    bpy = blender
    with pytest.raises(RuntimeError, match="picture 1 is not chosen"):
        bpy.ops.spectral.texture_design()
    design.first, _ = image(bpy, "a", 1)
    design.second = bpy.data.images.new("b", SIZE, SIZE + 1)
    with pytest.raises(RuntimeError, match="differ in size: a 12×12, b 12×13"):
        bpy.ops.spectral.texture_design()
    design.second, _ = image(bpy, "c", 2)
    design.lights = "GIVEN"
    with pytest.raises(RuntimeError, match="light 1 has no spectrum"):
        bpy.ops.spectral.texture_design()
    with pytest.raises(RuntimeError, match="no texture is designed yet"):
        bpy.ops.spectral.texture_material()
    with pytest.raises(RuntimeError, match="no texture is being designed"):
        bpy.ops.spectral.texture_cancel()


def test_realism_costs_contrast() -> None:
    contrasts = [float(realism_words(share, 20)[0].split("about ")[1].split(":")[0]) for share in (0, 0.1, 0.3, 0.6)]
    assert contrasts == sorted(contrasts, reverse=True)
    assert contrasts[0] > 15
    assert contrasts[-1] < 5


def test_settings_and_painted_images_reach_the_project(blender, design, tmp_path) -> None:
    from blender_addon.translate.texture.project import project_of
    from spectral_core.render.images.pictures import read_picture

    design.first, first = image(blender, "a", 1)
    design.second, _ = image(blender, "b", 2)
    design.daylight_share, design.led_width_nm, design.importance, design.spectra = 0.25, 30, 4, 7
    design.mapping = "uniform_contrast"
    project = project_of(design, tmp_path)
    settings = project.settings
    assert (settings.daylight_share, settings.led_width_nm, settings.importance) == pytest.approx((0.25, 30, 4))
    assert (settings.spectra, settings.mapping, project.lights) == (7, "uniform_contrast", ())
    np.testing.assert_array_equal(read_picture(project.pictures[0]), np.round(first * 255).astype(np.uint8))
    design.mapping, design.slope, design.floor = "least_delta_e", 0.9, 0.2
    with pytest.raises(InvalidInputError, match="together more than 1"):
        project_of(design, tmp_path)
    for thousandths in range(501):  # as much contrast as the panel says
        design.floor, design.slope = thousandths / 1000, 1 - thousandths / 1000
        found = project_of(design, tmp_path).settings
        assert (found.floor, found.slope) == pytest.approx((thousandths / 1000, 1 - thousandths / 1000), abs=1e-9)


def test_settings_that_the_panel_does_not_offer_stop_no_design(blender, design, tmp_path) -> None:
    """The contrast is greyed out where all contrast is lowered, and hidden for one picture."""
    from blender_addon.translate.texture.project import project_of

    design.first, _ = image(blender, "a", 1)
    design.second, _ = image(blender, "b", 2)
    design.floor, design.slope = 0.2, 0.95
    design.mapping = "uniform_contrast"
    assert project_of(design, tmp_path).settings.floor == pytest.approx(0.2)
    design.mapping, design.kind = "least_delta_e", "ONE"
    for number in (1, 2):
        light = getattr(design, f"light_{number}").spectral
        light.source, light.catalogue_name = "CATALOGUE", "D65"
    assert len(project_of(design, tmp_path).pictures) == 1


# Matrices from primaries and white (SMPTE RP 177), as in ITU-R BT.2087 and by Apple; linear Rec.709 of each space.
REC709_FROM = {
    "Display P3": [[1.22494, -0.22494, 0.0], [-0.04206, 1.04206, 0.0], [-0.01964, -0.07864, 1.09827]],
    "Linear Rec.2020": [[1.66049, -0.58764, -0.07285], [-0.12455, 1.13290, -0.00835], [-0.01815, -0.10058, 1.11873]],
}


@pytest.mark.parametrize("space", ["sRGB", "Display P3", "Non-Color"])
def test_a_picture_of_bytes_has_the_colors_of_its_color_space(blender, tmp_path, space: str) -> None:
    from blender_addon.translate.texture.project import _file_of
    from spectral_core.render.images.pictures import read_picture
    from spectral_core.spectra.color import display_rgb_from_linear
    from spectral_core.spectra.pictures import png_bytes

    levels = np.array([[[200, 100, 50], [90, 120, 130]]], np.uint8)
    (tmp_path / "file.png").write_bytes(png_bytes(levels))
    loaded = blender.data.images.load(str(tmp_path / "file.png"))
    loaded.colorspace_settings.name = space
    linear = levels / 255 if space == "Non-Color" else linear_from_display_rgb(levels / 255)
    linear = linear @ np.transpose(REC709_FROM.get(space, np.eye(3)))
    expected = np.round(255 * display_rgb_from_linear(linear))
    found = read_picture(_file_of(loaded, tmp_path, 1))
    assert np.abs(found.astype(float) - expected).max() <= 1


@pytest.mark.parametrize("space", ["Linear Rec.709", "Linear Rec.2020", "Non-Color"])
def test_a_picture_of_floats_has_the_colors_of_its_color_space(blender, tmp_path, space: str) -> None:
    from blender_addon.translate.texture.project import _file_of
    from spectral_core.render.images.pictures import read_picture
    from spectral_core.spectra.pictures import write_picture

    given = np.array([[[0.5, 0.4, 0.3], [0.2, 0.3, 0.25]]], np.float32)
    write_picture(tmp_path / "file.exr", given)
    loaded = blender.data.images.load(str(tmp_path / "file.exr"))
    loaded.colorspace_settings.name = space
    expected = given @ np.transpose(REC709_FROM.get(space, np.eye(3)))
    np.testing.assert_allclose(read_picture(_file_of(loaded, tmp_path, 1)), expected, atol=2e-4)


def test_alpha_that_blender_ignores_is_no_transparency(blender, tmp_path) -> None:
    from blender_addon.translate.texture.project import _file_of
    from spectral_core.render.images.pictures import read_picture

    colors, made = image(blender, "opaque", 3)[1], blender.data.images.new("coat", SIZE, SIZE, alpha=True)
    pixels = np.ones((SIZE, SIZE, 4), np.float32)
    pixels[..., :3], pixels[..., 3] = colors[::-1], 0.5
    made.pixels.foreach_set(pixels.ravel())
    made.filepath_raw, made.file_format = str(tmp_path / "coat.png"), "PNG"
    made.save()
    loaded = blender.data.images.load(str(tmp_path / "coat.png"))
    with pytest.raises(InvalidInputError, match="partly transparent"):
        read_picture(_file_of(loaded, tmp_path, 1))
    loaded.alpha_mode = "CHANNEL_PACKED"
    found = read_picture(_file_of(loaded, tmp_path, 1))
    np.testing.assert_allclose(found, np.round(255 * colors), atol=1)
