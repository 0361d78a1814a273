# SPDX-License-Identifier: GPL-3.0-or-later
"""First samples have no outliers: wavelengths are drawn where the scene's reflectances send light to the camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.job import RenderJob
from spectral_core.render.mitsuba_scene.traced_spectra import reflectance_spectra
from spectral_core.render.plan.effects import plan_effects
from spectral_core.render.trace.wavelengths import plan_wavelengths
from spectral_core.scene import Film, Glass, MixSurface, Scene, SpectralImage, SunLight
from spectral_core.scene.surface import Diffuse
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Reflectance, SpectralGrid, Spectrum
from tests.render.scenes import lit_plane, matrix

GRID = SpectralGrid(np.array([380.0, 684, 694, 704, 780]))
SPIKE = Reflectance("spike", GRID, np.array([0.01, 0.01, 0.9, 0.01, 0.01]))
SUN = SunLight(name="sun", world_from_light=matrix((0, 0, 3)), irradiance=np.pi, angle_rad=0.0)


def lit(surface, samples: int) -> Scene:
    scene = lit_plane(replace(SUN, color=catalogue.illuminant("D65")), surface=surface, film=Film(48, 48, samples))
    return replace(scene, settings=replace(scene.settings, transport="spectral"))


def traced(scene: Scene, samples: int) -> np.ndarray:
    job = RenderJob(scene, plan_effects(scene, pilot=False))
    job.trace(samples)
    return job.picture()[..., :3].astype(np.float64)


def test_a_spike_far_in_the_red_is_sampled_from_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = lit(Diffuse(SPIKE), 4)
    ours = traced(scene, 4)
    converged = traced(scene, 1024).mean(axis=(0, 1))
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), converged, rtol=0.03)
    # If sampling ignores the reflectance, the same samples have several times the variance.
    monkeypatch.setattr("spectral_core.render.job.reflectance_spectra", lambda scene: [])
    plain = traced(scene, 4)
    np.testing.assert_allclose(plain.mean(axis=(0, 1)), converged, rtol=0.1)
    red = [np.var(picture[..., 0]) for picture in (ours, plain)]
    assert red[0] < 0.3 * red[1]


def test_surfaces_without_a_spike_keep_most_of_their_samples() -> None:
    light = [catalogue.illuminant("D65")]
    plain, ours = plan_wavelengths(light), plan_wavelengths(light, reflectances=[SPIKE])
    assert np.all(ours.probability >= 0.45 * plain.probability)
    assert ours.probability.sum() == pytest.approx(1.0)


def test_a_light_without_power_at_the_spike_changes_nothing() -> None:
    dark = Reflectance("dark", GRID, np.zeros(5))
    light = [catalogue.illuminant("FL11")]
    np.testing.assert_array_equal(
        plan_wavelengths(light).probability, plan_wavelengths(light, reflectances=[dark]).probability
    )


def test_reflectances_are_found_in_mixes_and_textures_and_indices_are_ignored() -> None:
    plain = Reflectance("plain", GRID, np.full(5, 0.5))
    weights = np.stack([np.full((2, 2), 0.25), np.eye(2)]).astype(np.float16)
    image = SpectralImage("texture", weights, np.array([[0.5] * 5, [0.2] * 5]), GRID)
    glass = Glass(ior=Spectrum("index", GRID, np.full(5, 1.5)))
    surface = MixSurface(0.5, MixSurface(0.5, Diffuse(SPIKE), Diffuse(plain)), MixSurface(0.5, glass, Diffuse(image)))
    found = reflectance_spectra(lit(surface, 1))
    assert {spectrum.name for spectrum in found} == {"texel", "plain", "spike"}
