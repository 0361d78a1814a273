# SPDX-License-Identifier: GPL-3.0-or-later
"""What three channels cannot show: dyes lit by other surfaces, lamps whose nodes color them, and vivid paints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import plan_from_data
from spectral_core.render.mitsuba_scene.fluorescent import daylight_rgb as dyed_rgb
from spectral_core.render.mitsuba_scene.paint import daylight_rgb, emitted_rgb
from spectral_core.render.plan.errors.spectral import rgb_transport_error
from spectral_core.scene import Color, Diffuse, Emission, Fluorescent, Glass, PointLight, Principled, RenderSettings
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import upsampled
from tests.render.scenes import lit_plane, matrix
from tests.render.surfaces.test_lamp_patterns import tinted

LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 2)), power_w=10.0)
GRID = SpectralGrid(np.arange(380.0, 781.0, 5.0))
SODIUM = Illuminant("sodium", SpectralGrid(np.array([588.0, 589.0, 590.0])), np.array([0.0, 1.0, 0.0]))


def _apart(one, other):
    return float(delta_e_2000(lab_from_linear_rgb(np.asarray(one)), lab_from_linear_rgb(np.asarray(other))))


def test_dyes_are_compared_under_the_light_of_other_surfaces():
    """Walls of a dye that emits red kept 90 % of red light in three channels, 15 % in truth: ΔE 34, stated as 0.01."""
    dye = FluorescentDye.gaussian("orange", 460, 600, widths_nm=(35, 20))
    paint = Fluorescent(Reflectance("dull", GRID, np.full(GRID.size, 0.15)), (dye,), (0.43,))
    scene = lit_plane(LAMP, surface=paint, settings=RenderSettings())
    red = dyed_rgb(paint)
    assert red[0] == pytest.approx(0.9, abs=0.01)  # in daylight; light of 600 nm excites nothing
    assert rgb_transport_error(scene, 1) < 0.1
    assert rgb_transport_error(scene, 2) >= 0.99 * _apart(np.full(3, 0.15), red) > 20
    assert plan_from_data(scene).is_spectral


@pytest.mark.parametrize(("tint", "is_spectral"), [((0.1, 0.9, 0.1), True), (None, False)])
def test_a_pattern_filters_the_spectrum_of_its_lamp(tint, is_spectral):
    """Green slides before sodium lamps gave a green floor in three channels: ΔE 40, stated as 0.1."""
    lamp = replace(LAMP, color=SODIUM, pattern=None if tint is None else tinted(*tint))
    plan = plan_from_data(lit_plane(lamp, settings=RenderSettings()))
    assert plan.is_spectral is is_spectral
    if tint is not None:
        viewer = observer("cie_1931_2deg")
        line = np.array([np.interp(589.0, viewer.wavelengths_nm, row) for row in viewer.cmfs])
        light = RGB_FROM_XYZ @ (line / line[1])
        seen = [np.maximum(light * share, 0) for share in (float(upsampled(tint, np.array([589.0]))[0]), tint)]
        assert plan["transport"].error >= _apart(*seen) > 20


def test_a_paint_outside_of_srgb_is_cut_in_three_channels():
    """A green filter has a red of -0.35, which RGB transport cuts: ΔE 14 in linear light, stated as 0."""
    green = Reflectance("green", GRID, 0.02 + 0.9 * (np.abs(GRID.wavelengths_nm - 520) < 30))
    for paint in (green, catalogue.reflectance("cyan")):
        rgb = daylight_rgb(paint)
        stated = rgb_transport_error(lit_plane(LAMP, surface=Diffuse(paint), settings=RenderSettings()), 1)
        assert stated >= 0.99 * _apart(rgb, np.clip(rgb, 0, 1)) > 2
    inside = lit_plane(LAMP, surface=Diffuse(catalogue.reflectance("yellow")), settings=RenderSettings())
    assert rgb_transport_error(inside, 1) < 0.1


def test_spectra_above_one_are_paints_and_emitted_ones_are_not():
    """A red of up to 1.05, which renders hold to 1, was taken for an index of refraction: ΔE 27 under sodium light,
    stated as 0; so was a lamp's spectrum in place of a paint.
    """
    sodium = replace(LAMP, color=SODIUM)
    red = catalogue.reflectance("red")

    def stated(surface, *lights):
        return rgb_transport_error(lit_plane(*lights, surface=surface, settings=RenderSettings()))

    bright = Spectrum("bright", red.grid, np.minimum(1.5 * red.values, 1.05))
    held = Spectrum("held", red.grid, np.minimum(1.5 * red.values, 1.0))
    assert (
        stated(Diffuse(bright), sodium) == pytest.approx(stated(Diffuse(held), sodium))
        and stated(Diffuse(held), sodium) > 20
    )
    orange = catalogue.illuminant("HP1")
    assert stated(Diffuse(orange), sodium) == stated(Diffuse(Color(np.clip(emitted_rgb(orange), 0, 1))), sodium) > 20
    # an index of refraction, and an emitted spectrum of any scale
    index = Glass(ior=Spectrum("index", red.grid, 1.5 + 0 * red.values))
    faint = Illuminant("faint", orange.grid, orange.values / orange.values.max())
    for surface in (index, Emission(orange), Emission(faint), Emission(Spectrum("plain", red.grid, red.values))):
        assert stated(surface, sodium) < 0.1
    assert stated(Principled(red, emission_color=red, emission_strength=1.0), sodium) > 20
