# SPDX-License-Identifier: GPL-3.0-or-later
"""Narrow lines in the renderer: luminance and chromaticity of the picture equal the exact integral to 1e-4."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.mitsuba_scene.paint import emitted_spectrum
from spectral_core.render.still import render_scene
from spectral_core.render.trace.wavelengths import MOST_LIGHT_KNOTS, plan_wavelengths, single_precision_spectrum
from spectral_core.scene import Film, SunLight
from spectral_core.scene.surface import Diffuse
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import xyz_from_linear_rgb
from spectral_core.spectra.observer import xyz_of
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid
from tests.render.scenes import lit_plane, matrix
from tests.spectra.test_exact_integration import exact_xyz, lines

SUN = SunLight(name="sun", world_from_light=matrix((0, 0, 3)), irradiance=np.pi, angle_rad=0.0)


def rendered_xyz(light: Illuminant, surface: Reflectance | None = None) -> np.ndarray:
    """XYZ of a surface below a vertical sun of irradiance π; for a white surface, that of the sun."""
    white = surface or Reflectance("white", SpectralGrid(np.array([300.0, 900.0])), np.ones(2))
    scene = lit_plane(replace(SUN, color=light), surface=Diffuse(white), film=Film(64, 64, samples=512))
    scene = replace(scene, settings=replace(scene.settings, transport="spectral"))
    return xyz_from_linear_rgb(render_scene(scene).pixels[..., :3].reshape(-1, 3).astype(float).mean(axis=0))


def check(rendered: np.ndarray, exact: np.ndarray) -> None:
    assert rendered[1] == pytest.approx(exact[1], rel=1e-4)
    np.testing.assert_allclose(rendered[:2] / rendered.sum(), exact[:2] / exact.sum(), atol=1e-4)


@pytest.mark.parametrize(
    ("position", "half_width"),
    [(532.0, 0.01), (532.0, 0.5), (532.3, 0.1), (532.3, 2.0), (638.5004, 0.01), (638.5004, 0.5)],
)
def test_a_line_has_its_luminance_and_color(position: float, half_width: float) -> None:
    light = lines([position], half_width)
    exact = exact_xyz(light)
    check(rendered_xyz(light), exact / exact[1])


@pytest.mark.parametrize(("half_width", "values"), [(1e-3, [0.0, 1.0, 0.0]), (0.05, [1.0, 1.0])])
def test_a_line_whose_file_has_no_other_wavelengths(half_width: float, values: list[float]) -> None:
    """The first was off by 2.4 %, since its ends were rounded; the second ended the render in an error."""
    grid = SpectralGrid(532.0 + half_width * np.linspace(-1.0, 1.0, len(values)))
    white = Reflectance("white", SpectralGrid(np.array([300.0, 900.0])), np.ones(2))
    scene = lit_plane(replace(SUN, color=Illuminant("line", grid, np.array(values))), surface=Diffuse(white))
    scene = replace(scene, settings=replace(scene.settings, transport="spectral"))
    rendered = xyz_from_linear_rgb(render_scene(scene).pixels[..., :3].reshape(-1, 3).astype(float).mean(axis=0))
    np.testing.assert_allclose(rendered[1], 1.0, rtol=2e-3)
    # x̄ and ȳ of CIE 1931 at 532 nm
    np.testing.assert_allclose(rendered[0] / rendered[1], 0.21373, rtol=2e-3)


@pytest.mark.parametrize("half_width", [0.013, 0.4])
def test_a_lamp_of_lines_keeps_the_ratio_of_its_lines(half_width: float) -> None:
    light = lines([435.83, 546.07, 576.96, 611.4], half_width, [0.5, 1.0, 0.3, 1.2])
    exact = exact_xyz(light)
    check(rendered_xyz(light), exact / exact[1])


def test_lines_on_a_background_under_a_narrow_filter() -> None:
    daylight = catalogue.illuminant("D65")
    peaks = lines([480.21, 589.59], 0.05, [3000.0, 9000.0])
    grid = SpectralGrid(np.union1d(daylight.grid.wavelengths_nm, peaks.grid.wavelengths_nm))
    light = Illuminant("arc", grid, daylight.at(grid.wavelengths_nm) + peaks.at(grid.wavelengths_nm))
    edge = SpectralGrid(np.array([300.0, 589.4, 589.8, 900.0]))
    surface = Reflectance("edge", edge, np.array([0.1, 0.1, 0.9, 0.9]))
    check(rendered_xyz(light, surface), xyz_of(emitted_spectrum(light), surface))


def test_single_precision_keeps_the_power_of_each_line(rng: np.random.Generator) -> None:
    for half_width in (1e-5, 1e-4, 0.01, 0.3):
        position = float(rng.uniform(400, 700))
        grid = SpectralGrid(position + half_width * np.array([-1.0, 0, 1]))
        knots, values = single_precision_spectrum(Illuminant("x", grid, np.array([0, 1 / half_width, 0])))
        assert np.array_equal(knots, knots.astype(np.float32)) and np.all(np.diff(knots) > 0)
        assert np.dot(np.diff(knots), values[1:] + values[:-1]) / 2 == pytest.approx(1.0, rel=1e-7)


def test_a_spectrum_with_very_many_knots_keeps_its_lines() -> None:
    knots = np.linspace(380.05, 779.95, 50_001)
    values = 1.0 + 1e4 * np.maximum(0, 1 - np.abs(knots - 550.123) / 0.02)
    plan = plan_wavelengths([Illuminant("fine", SpectralGrid(knots), values)])
    assert plan.edges_nm.size <= 471 + MOST_LIGHT_KNOTS
    assert np.sum(np.abs(plan.edges_nm - 550.123) < 0.021) >= 3
    assert plan.probability.sum() == pytest.approx(1.0)
