# SPDX-License-Identifier: GPL-3.0-or-later
"""Light below a surface against closed forms and a plain walk in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from spectral_core.render.plugins.closures.subsurface import IORS, MODELS, entry_of, packed

mi = pytest.importorskip("mitsuba")


@pytest.fixture(autouse=True)
def dr():
    from spectral_core.render.variant import activate, choose_backend

    activate(choose_backend("rgb"))
    import drjit

    return drjit


def half_space(albedo, g, count=20_000, seed=0):
    """Share of light that leaves a half space which it enters evenly; its scattering by Henyey and Greenstein."""
    rng = np.random.default_rng(seed)
    depth, weight, left = np.zeros(count), 1.0, 0.0
    cosine, inside = np.sqrt(rng.random(count)), np.ones(count, bool)
    for _ in range(600):
        depth = depth - cosine * np.log(rng.random(count))
        out = inside & (depth < 0)
        left, inside = left + weight * out.sum(), inside & ~out
        weight *= albedo
        turn = 2 * rng.random(count) - 1
        if g:
            turn = (1 + g * g - ((1 - g * g) / (1 + g * turn)) ** 2) / (2 * g)
        sines = np.sqrt(np.maximum((1 - cosine**2) * (1 - turn**2), 0))
        cosine = np.clip(cosine * turn + sines * np.cos(2 * np.pi * rng.random(count)), -1, 1)
        if not inside.any() or weight < 1e-4:
            break
    return left / count


@pytest.mark.parametrize("g", [0.0, 0.5])
@pytest.mark.parametrize("color", [0.1, 0.4, 0.7])
def test_a_half_space_shows_the_color(dr, color, g):
    from spectral_core.render.trace.below.medium import scattering_albedo

    albedo = float(scattering_albedo(dr, mi.Float(color), mi.Float(g))[0])
    assert half_space(albedo, g) == pytest.approx(color, rel=0.05)


@pytest.mark.parametrize("ior", [1.1, 1.4])
def test_the_mean_free_path_of_skin_solves_the_dipole(dr, ior):
    """Jensen et al. 2001: the total diffuse reflectance of a dipole with the reduced albedo is the color."""
    from spectral_core.render.trace.below.medium import skin_scale

    color = np.array([0.05, 0.3, 0.6])
    root = np.array(skin_scale(dr, mi.Float(color), mi.Float(ior)))
    albedo = 1 - root**2 / 3
    diffuse = -1.44 / ior**2 + 0.71 / ior + 0.668 + 0.0636 * ior
    boundary = (1 + diffuse) / (1 - diffuse)
    shown = albedo / 2 * (1 + np.exp(-4 / 3 * boundary * root)) * np.exp(-root)
    np.testing.assert_allclose(shown, color, atol=2e-3)


def test_distances_follow_their_profile(dr):
    from spectral_core.render.trace.below.disk import REACH, drawn_distance, profile

    place = np.linspace(0.01, 0.99, 25)
    reached = np.array(drawn_distance(dr, mi.Float(place)))
    density = lambda r: float(profile(dr, mi.Float(1.0), mi.Float(r))[0])  # noqa: E731
    found = [quad(density, 0, float(distance), limit=100)[0] for distance in reached]
    np.testing.assert_allclose(found, place, atol=1e-4)
    assert density(REACH * 1.001) == 0.0


@pytest.mark.parametrize("model", MODELS)
def test_an_entry_survives_its_packing(dr, model):
    bs = dr.zeros(mi.BSDFSample3f)
    bs.eta = mi.Float([-0.5, 0.5, 0.95])
    bs.sampled_component = packed(mi, dr, mi.Float([0.0, 0.3, 1.0]), mi.Float([1.0, 1.4, 9.0]), MODELS.index(model))
    entry = entry_of(mi, dr, bs)
    np.testing.assert_allclose(np.array(entry.anisotropy), [0.0, 0.5, 0.9], rtol=1e-6)
    np.testing.assert_allclose(np.array(entry.ior), [IORS[0], 1.4, IORS[1]], atol=1e-4)
    alpha = [1.0, 1.0, 1.0] if model == "random_walk_skin" else [0.0, 0.3, 1.0]
    np.testing.assert_allclose(np.array(dr.zeros(mi.Float, 3) + entry.alpha), alpha, atol=1e-4)
    assert all(np.array(dr.zeros(mi.UInt32, 3) + mi.UInt32(entry.is_disk)) == (model == "burley"))


def test_entering_light_is_refracted(dr):
    """Without roughness every direction below obeys Snell's law."""
    from spectral_core.render.plugins.closures.subsurface import Entry
    from spectral_core.render.trace.below.walk import entered

    angle = np.linspace(0.05, 1.5, 20)
    toward = mi.Vector3f(np.sin(angle), 0.0, np.cos(angle))
    entry = Entry(mi.Float(0.0), mi.Float(0.0), mi.Float(1.5), mi.Bool(False), mi.Bool(False))
    place = mi.Point2f(np.full(20, 0.3), np.full(20, 0.6))
    inward, enters = entered(mi, dr, entry, mi.Vector3f(0, 0, 1), toward, place)
    sine = np.hypot(np.array(inward.x), np.array(inward.y))
    np.testing.assert_allclose(sine, np.sin(angle) / 1.5, atol=2e-3)
    assert np.all(np.array(inward.z) < 0) and np.all(np.array(enters))


@pytest.mark.parametrize("albedo", [0.2, 0.7, 0.999])
def test_guided_cosines_follow_their_density(dr, albedo):
    """Meng et al. 2016: the share of cosines above a drawn one is the number that it was drawn by."""
    from spectral_core.render.trace.below.guide import cosine_density, diffusion_length, drawn_cosine

    length = diffusion_length(dr, mi.Float(albedo))
    spread = dr.log((length + 1.0) / (length - 1.0))
    place = np.linspace(0.02, 0.98, 13)
    cosines = np.array(drawn_cosine(dr, length, spread, mi.Float(place)), dtype=float)
    of = float(length[0]), float(spread[0])
    above = [quad(lambda c: cosine_density(*of, c), -1, c)[0] for c in cosines]
    assert np.all(np.abs(np.minimum(np.abs(above - place), np.abs(1 - np.array(above) - place))) < 2e-3)
    assert quad(lambda c: cosine_density(*of, c), -1, 1)[0] == pytest.approx(1.0, rel=2e-3)


def test_the_diffusion_length_is_that_of_transport_theory(dr):
    """Of isotropic scattering: the root of 1 = albedo · length · artanh(1 / length) (Case and Zweifel 1967)."""
    from spectral_core.render.trace.below.guide import diffusion_length

    for albedo in (0.5, 0.8, 0.95, 0.99):
        length = float(diffusion_length(dr, mi.Float(albedo))[0])
        assert albedo * length * np.arctanh(1 / length) == pytest.approx(1.0, rel=0.02)


def test_a_step_with_a_foreign_wall_keeps_its_density(dr):
    """Where no turn was drawn, the density is that of the phase function alone."""
    from spectral_core.render.trace.below.guide import Turn

    turn = Turn(dr, None, None, mi.Float(0.75), ((mi.Float(1.0), mi.Float(9.0), mi.Float(0.3)),))
    thick, clear = mi.Float(2.0), mi.Float(0.5)
    assert float(turn.density((thick, clear), mi.Float(0.3), mi.Bool(False), mi.Bool(True))[0]) == 1.0
    assert float(turn.density((thick, clear), mi.Float(0.3), mi.Bool(True), mi.Bool(True))[0]) == 0.5
