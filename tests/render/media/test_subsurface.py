# SPDX-License-Identifier: GPL-3.0-or-later
"""Subsurface scattering: energy is conserved, and a short radius looks like a diffuse surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.trace.below import guide
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Film,
    Instance,
    Material,
    MixSurface,
    Principled,
    RenderSettings,
    Scene,
    Subsurface,
    SunLight,
    World,
    gray,
)
from tests.render.scenes import matrix, sphere_mesh

pytest.importorskip("mitsuba")


def _ball(surface, transport="rgb", samples=64, seed=0, whole=False, among=()):
    """Mean color of the center of a ball under a uniform sky; ``whole``: its pixels.

    ``among``: surfaces, the ball's own too, of which the others are far off; scenes of equal ones share their kernel.
    """
    camera = Camera(world_from_camera=matrix((0, 0, 4)), field_of_view_rad=0.25)
    surfaces = among or (surface,)
    places = [np.eye(4) if each is surface else matrix((200.0 * (k + 1), 0, 0)) for k, each in enumerate(surfaces)]
    scene = Scene(
        camera=camera,
        film=Film(8, 8, samples=samples, seed=seed),
        meshes=(sphere_mesh(24),),
        materials=tuple(Material(f"m{k}", each) for k, each in enumerate(surfaces)),
        instances=tuple(Instance(f"ball {k}", "sphere", place, (f"m{k}",)) for k, place in enumerate(places)),
        world=World(gray(1.0)),
        settings=RenderSettings(transport=transport, max_bounces=8),
    )
    pixels = render_scene(scene).pixels
    assert np.isfinite(pixels).all()
    return pixels[..., :3] if whole else pixels[..., :3].mean((0, 1))


@pytest.mark.parametrize("color", [0.3, 0.8, 1.0])
def test_under_a_uniform_sky_a_ball_shows_its_color(color):
    """Refracted light goes deeper than the even light for which the albedo is fitted, and is absorbed more, as in
    Cycles; a ball of color 1 absorbs nothing.
    """
    seen = _ball(Subsurface(gray(color), (1.0, 1.0, 1.0), 0.3))
    assert np.all(seen < 1.02 * color)
    # walks of more than 256 steps are lost
    assert np.all(seen > (0.93 if color == 1 else 0.85) * color)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_disk_shows_the_color(transport):
    """The profile of Christensen and Burley keeps all light that a diffuse surface of its color reflects."""
    color = Color([0.7, 0.4, 0.2])
    disk = Subsurface(color, (1.0, 0.2, 0.1), 0.05, model="burley")
    np.testing.assert_allclose(_ball(disk, transport), _ball(Diffuse(color), transport), rtol=0.03)


def test_channels_without_a_radius_stay():
    """Blue light, whose radius is 0, is reflected diffusely."""
    seen = _ball(Subsurface(gray(0.5), (0.5, 0.2, 0.0), 0.3))
    assert seen[2] == pytest.approx(0.5, rel=0.02)
    assert seen[0] < 0.485


def test_short_paths_look_diffuse():
    color = Color([0.7, 0.4, 0.2])
    near, matt = _ball(Subsurface(color, (1.0, 0.2, 0.1), 0.01, model="random_walk_skin")), _ball(Diffuse(color))
    np.testing.assert_allclose(near, matt, rtol=0.12)
    assert np.all(near < 1.02 * matt)


@pytest.mark.parametrize(("model", "radius"), [("random_walk_skin", 1e-3), ("random_walk", 1e-6)])
def test_paths_shorter_than_the_offset_of_their_start_keep_the_light(model, radius):
    """The paths of white skin are 600 times shorter than its radius: a fifth of its light was lost, beside the tenth
    that walks of more than 256 steps lose in Cycles too.
    """
    seen = _ball(Subsurface(gray(1.0), (1.0, 1.0, 1.0), radius, model=model))
    assert np.all((seen > 0.87) & (seen < 0.95)), seen


def test_transports_agree_and_principled_has_its_share():
    color = Color([0.7, 0.4, 0.2])
    pair = Principled(color, subsurface_weight=1.0, subsurface_scale=0.2), Principled(color)
    whole = {transport: _ball(pair[0], transport, among=pair) for transport in ("rgb", "spectral")}
    np.testing.assert_allclose(whole["spectral"], whole["rgb"], rtol=0.06)
    plain = _ball(pair[1], among=pair)
    assert np.all(whole["rgb"] > 0.85 * plain)
    assert np.all(whole["rgb"] < 1.02 * plain)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_coat_colors_light_that_enters_below_it(transport):
    """Light of a short radius has the color of the diffuse part below the same coat, alone and mixed."""
    coated = Principled(gray(0.7), coat_weight=1.0, coat_tint=Color([0.2, 0.6, 0.9]))
    values = {"subsurface_weight": 1.0, "subsurface_radius": (1.0, 1.0, 1.0), "subsurface_scale": 0.01}
    below = replace(coated, **values)
    white = replace(below, coat_tint=gray(1.0))
    surfaces = coated, below, white, MixSurface(0.5, below, white)
    matt, colored, plain, mixed = (_ball(each, transport, among=surfaces) for each in surfaces)
    assert matt[0] < 0.7 * matt[2]
    share = colored / matt
    np.testing.assert_allclose(share, share.mean(), rtol=0.02)
    assert 0.85 < share.mean() < 1.02
    np.testing.assert_allclose(mixed, (colored + plain) / 2, rtol=0.03)


def _through(model, thickness, anisotropy, seed):
    """Mean color of the center of a thin lens with the sun behind it."""
    skin = Subsurface(Color([0.8, 0.5, 0.4]), (1.0, 0.3, 0.1), 0.5, scattering_anisotropy=anisotropy, model=model)
    scene = Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 4)), field_of_view_rad=0.25),
        film=Film(8, 8, samples=256, seed=seed),
        meshes=(sphere_mesh(24),),
        materials=(Material("m", skin),),
        instances=(Instance("ball", "sphere", np.diag([1.0, 1.0, thickness, 1.0]), ("m",)),),
        lights=(SunLight(name="sun", world_from_light=np.diag([1.0, -1.0, -1.0, 1.0]), irradiance=3.0),),
        settings=RenderSettings(max_bounces=8),
    )
    return render_scene(scene).pixels[..., :3].mean((0, 1))


@pytest.mark.parametrize(
    ("model", "thickness", "anisotropy"),
    [("random_walk", 0.02, 0.0), ("random_walk", 0.05, 0.8), ("random_walk_skin", 0.03, 0.3)],
)
def test_guided_turns_change_no_mean(monkeypatch, model, thickness, anisotropy):
    """Light that reaches the opposite side is guided most."""
    guided = np.array([_through(model, thickness, anisotropy, seed) for seed in range(6)])
    monkeypatch.setattr(guide, "GUIDED", 0.0)
    plain = np.array([_through(model, thickness, anisotropy, seed) for seed in range(6)])
    error = np.sqrt(guided.var(0, ddof=1) / 6 + plain.var(0, ddof=1) / 6)
    assert guided.mean(0)[0] > 0.3
    assert np.all(np.abs(guided.mean(0) - plain.mean(0)) < 4.5 * error + 0.002 * plain.mean(0) + 1e-6)


def test_the_noise_of_channels_with_different_radii(monkeypatch):
    """The relative variance of a sample under a sky is 0.47, and 1.06 without guided turns."""

    def noise():
        skin = Subsurface(Color([0.8, 0.5, 0.4]), (1.0, 0.2, 0.1), 0.05)
        found = np.array([_ball(skin, samples=16, seed=seed, whole=True) for seed in range(8)])
        return float((found.var(0, ddof=1) / found.mean((0, 1, 2)) ** 2).mean()) * 16

    guided = noise()
    monkeypatch.setattr(guide, "GUIDED", 0.0)
    assert guided < 0.6
    assert noise() > 1.5 * guided
