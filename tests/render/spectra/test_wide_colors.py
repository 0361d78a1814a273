# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors outside of sRGB, as files with the working spaces Rec.2020 and ACEScg hold: lights keep them, and surfaces,
which no spectrum of a reflectance can give them, say so.
"""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import Color, Diffuse, Emission, Film, Glossy, ImageTexture, SunLight, World, gray
from spectral_core.spectra import catalogue
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.upsample import light_tint

from ..scenes import lit_plane, matrix

pytest.importorskip("mitsuba")

# linear sRGB of the primaries, from the chromaticities in ITU-R BT.2020 and in SMPTE ST 2065 (adapted by Bradford)
REC2020_GREEN, REC2020_RED = (-0.5876, 1.1329, -0.1006), (1.6605, -0.1246, -0.0182)
REC2020_BLUE = (-0.0728, -0.0083, 1.1187)
ACESCG_GREEN = (-0.6218, 1.1388, -0.1282)
WIDE = [REC2020_GREEN, REC2020_RED, REC2020_BLUE, ACESCG_GREEN, (-0.1, 0.5, 0.2)]


def _shown(**scene):
    result = render_scene(lit_plane(transport="spectral", **scene))
    return result.pixels[..., :3].mean((0, 1)), [note.message for note in result.notes]


@pytest.mark.parametrize("color", WIDE)
def test_lights_outside_of_srgb_keep_their_color(color):
    color = np.array(color)
    sun = SunLight(name="sun", world_from_light=matrix((0, 0, 3)), irradiance=np.pi, color=Color(color))
    lit = lit_plane(sun, surface=Diffuse(gray(0.5)), transport="spectral")
    shown = render_scene(lit).pixels[..., :3].mean((0, 1))
    # 0.04: the green of ACEScg is outside of all light
    np.testing.assert_allclose(shown, color / 2, atol=0.04 * color.max())
    for paint in ({"surface": Emission(Color(color))}, {"surface": Diffuse(gray(1.0)), "world": World(Color(color))}):
        shown, notes = _shown(**paint)
        np.testing.assert_allclose(shown, color, atol=0.04 * color.max())
        assert not notes


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_colors_that_no_light_has_have_a_note_in_spectra(transport):
    """A purple beyond the mix of the spectrum's ends: the nearest light differs by a quarter."""
    color = Color(np.array([1.0, -0.5, 1.0]))
    sun = SunLight(name="sun", world_from_light=matrix((0, 0, 3)), irradiance=np.pi, color=color)
    for scene, subject in (
        (lit_plane(sun, transport=transport), "sun"),
        (lit_plane(surface=Emission(color), transport=transport), "paper"),
        (lit_plane(world=World(color), transport=transport), "World"),
    ):
        notes = [(note.subject, note.message) for note in render_scene(scene).notes]
        assert notes == ([] if transport == "rgb" else [
            (subject, "emits a color that no light has; the nearest color of a light is rendered")
        ])  # fmt: skip


@pytest.mark.parametrize("color", WIDE)
def test_their_spectra_are_those_of_lights(color):
    """Never negative, and of the same XYZ, by colour-science's observer and matrices."""
    colour = pytest.importorskip("colour")
    nm = np.arange(360.0, 831.0)
    daylight = normalized(catalogue.illuminant("D65"))
    spectrum = daylight.at(nm) * light_tint(color, daylight, nm)
    assert spectrum.min() >= 0
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].values
    space = colour.RGB_COLOURSPACES["sRGB"]
    reference = space.matrix_XYZ_to_RGB @ (daylight.at(nm) @ observer)
    found = space.matrix_XYZ_to_RGB @ (spectrum @ observer) / reference
    np.testing.assert_allclose(found, color, atol=0.04 * max(color))


@pytest.mark.parametrize("color", WIDE)
def test_rgb_transport_keeps_negative_channels_of_lights(color):
    """As Cycles, in which a gray surface multiplies each channel of the working space."""
    color = np.array(color)
    sun = SunLight(name="sun", world_from_light=matrix((0, 0, 3)), irradiance=np.pi, color=Color(color))
    white = SunLight(name="white", world_from_light=matrix((1, 0, 3)), irradiance=np.pi)
    for lamps, wanted in (((sun,), color / 2), ((sun, white), (color + 1) / 2)):
        result = render_scene(lit_plane(*lamps, transport="rgb", film=Film(8, 8, samples=256)))
        np.testing.assert_allclose(result.pixels[..., :3].mean((0, 1)), wanted, atol=0.01)
        assert not result.notes
    for paint in ({"surface": Emission(Color(color))}, {"surface": Diffuse(gray(1.0)), "world": World(Color(color))}):
        result = render_scene(lit_plane(transport="rgb", **paint))
        np.testing.assert_allclose(result.pixels[..., :3].mean((0, 1)), color, atol=0.01)


@pytest.mark.parametrize("color", [REC2020_RED, (1.2249, -0.0421, -0.0196), (0.9, -0.1, 1.0), (1.0, -0.002, 0.0)])
def test_their_power_is_not_at_the_invisible_ends(color):
    """The smoothest spectrum of a red alone would have most of it near 830 nm, and excite dyes at 360 nm."""
    nm = np.arange(360.0, 831.0)
    tint = light_tint(color, normalized(catalogue.illuminant("D65")), nm)
    assert tint[(nm < 400) | (nm > 700)].max() < 1.25 * max(color)


@pytest.mark.parametrize("place", range(3))
def test_spectra_change_continuously_across_the_border_of_srgb(place):
    """A lamp that is dragged across the border does not jump, on surfaces of any color."""
    nm = np.arange(360.0, 831.0)
    white = normalized(catalogue.illuminant("D65"))
    inside, outside = (np.insert([1.0, 0.3], place, amount) for amount in (0.0, -0.0011))
    np.testing.assert_allclose(light_tint(outside, white, nm), light_tint(inside, white, nm), atol=0.03)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("closure", [Diffuse, lambda color: Glossy(color, 0.0)], ids=["diffuse", "glossy"])
def test_surfaces_outside_of_srgb_have_a_note(transport, closure):
    scene = lit_plane(surface=closure(Color(np.array(REC2020_GREEN))), world=World(gray(1.0)), transport=transport)
    assert any("outside of sRGB" in note.message for note in render_scene(scene).notes)


def test_rounded_colors_have_no_note():
    """sRGB's own green, from single precision and back."""
    scene = lit_plane(surface=Diffuse(Color(np.array([-2e-7, 1.0, 3e-7]))), world=World(gray(1.0)))
    assert not render_scene(scene).notes


def test_emission_images_outside_of_srgb_have_a_note():
    image = ImageTexture("wide", np.tile(np.float32(REC2020_GREEN), (2, 2, 1)), "linear")
    assert any("outside of sRGB" in note.message for note in render_scene(lit_plane(surface=Emission(image))).notes)
