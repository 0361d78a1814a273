# SPDX-License-Identifier: GPL-3.0-or-later
"""First samples have no outliers: wavelengths are drawn where the scene's reflectances send light to the camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.job import RenderJob
from spectral_core.render.mitsuba_scene.traced_spectra import light_spectra, reflectance_spectra
from spectral_core.render.plan.effects import plan_effects
from spectral_core.render.trace.wavelengths import noise_of, plan_wavelengths
from spectral_core.scene import Color, Film, Glass, MixSurface, Principled, Scene, SpectralImage, SunLight, World
from spectral_core.scene.surface import Diffuse, Emission, ScatteringMedium
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import Illuminant, Reflectance, SpectralGrid, Spectrum
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


SODIUM = Illuminant("sodium", SpectralGrid(np.array([588.0, 589.0, 590.0])), np.array([0.0, 1.0, 0.0]))


def shining(surface, **changes) -> Scene:
    """A plane of the surface in the dark."""
    scene = replace(lit(surface, 4), lights=(), world=World())
    return replace(scene, **changes)


@pytest.mark.parametrize("kind", ["emission", "principled", "mixed", "medium", "fog"])
def test_what_shines_itself_is_sampled_as_a_lamp(kind: str) -> None:
    """The wavelengths followed the lamps alone: a tube that is a mesh had many times the variance of a lamp."""
    glow = ScatteringMedium(emission_color=SODIUM, emission_strength=0.1)
    if kind == "emission":
        scene = shining(Emission(SODIUM, 2.0))
    elif kind == "principled":
        scene = shining(Principled(emission_color=SODIUM, emission_strength=2.0))
    elif kind == "mixed":
        scene = shining(MixSurface(0.5, Diffuse(Color(np.ones(3) / 2)), Emission(SODIUM, 2.0)))
    elif kind == "medium":
        scene = shining(None)
        scene = replace(scene, materials=tuple(replace(m, surface=None, medium=glow) for m in scene.materials))
    else:
        scene = shining(Diffuse(SPIKE), world=World(medium=glow))
    plan = plan_wavelengths(light_spectra(scene), reflectances=reflectance_spectra(scene))
    assert noise_of(SODIUM, plan) < 3.0 < 10.0 < noise_of(SODIUM, plan_wavelengths([catalogue.illuminant("D65")]))


def test_a_shining_surface_has_little_noise_from_the_start() -> None:
    picture = traced(shining(Emission(SODIUM, 2.0)), 4)
    assert np.std(picture[..., 0]) < 0.15 * np.mean(picture[..., 0])


def test_many_screens_leave_a_narrow_lamp_its_samples() -> None:
    scene = shining(Diffuse(SPIKE), lights=(replace(SUN, color=SODIUM),))
    mesh, material, item = scene.meshes[0], scene.materials[0], scene.instances[0]
    screens = [replace(material, name=f"screen {k}", surface=Emission(Color((1.0, k / 40, 0.2)))) for k in range(40)]
    items = [replace(item, name=f"item {k}", mesh=mesh.name, materials=(f"screen {k}",)) for k in range(40)]
    many = replace(scene, materials=(material, *screens), instances=(item, *items))
    assert len(light_spectra(many)) == 2
    assert noise_of(SODIUM, plan_wavelengths(light_spectra(many))) < 4.0
    unused = replace(scene, materials=(material, *screens))
    assert len(light_spectra(unused)) == 1
