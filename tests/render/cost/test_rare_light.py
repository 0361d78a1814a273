# SPDX-License-Identifier: GPL-3.0-or-later
"""Light on paths that samples hardly contain: a sun's caustic, a narrow cone in smoke, sources that grow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.errors import InvalidInputError
from spectral_core.render import cost_curve, render_scene
from spectral_core.render.cost import asked
from spectral_core.render.cost.errors import pixel_errors, rarity
from spectral_core.render.cost.model import RareLight
from spectral_core.render.cost.softened import SOFT_CONE_RAD, SOFT_RAD, narrow_cones, softened
from spectral_core.scene import (
    AreaLight,
    Color,
    Diffuse,
    Emission,
    Film,
    Glass,
    ImageTexture,
    Instance,
    LightPaths,
    Material,
    Mesh,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    SpotLight,
    SunLight,
    World,
    gray,
)
from spectral_core.spectra.color import luminance_from_linear_rgb
from tests.render.scenes import lit_plane, looking_down, matrix

CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (-1, 1) for x in (-1, 1)], np.float32)
SIDES = ((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
         (1, 3, 7), (1, 7, 5))  # fmt: skip
SUN = SunLight(name="sun", world_from_light=matrix((0, 0, 5)), irradiance=3.0)
FAR = lambda point: np.inf  # noqa: E731


def under_water(lamp, **settings):
    """A floor below a slab of glass, in a gray sky."""
    slab = Mesh("slab", CORNERS * np.array([0.4, 0.4, 0.2], np.float32) + np.array([0, 0, 0.1], np.float32),
                np.array(SIDES, np.uint32))  # fmt: skip
    scene = lit_plane(
        lamp, surface=Diffuse(gray(0.5)), film=Film(24, 16, samples=16, filter_kind="box", filter_width=1.0),
        camera=looking_down(2.0, 0.9), world=World(gray(0.2)),
    )  # fmt: skip
    return replace(
        scene,
        meshes=(*scene.meshes, slab),
        materials=(*scene.materials, Material("water", Glass(ior=1.33))),
        instances=(*scene.instances, Instance("water", "slab", np.eye(4), ("water",))),
        settings=RenderSettings(transport="rgb", max_bounces=8, **settings),
    )


def test_the_light_of_a_sun_through_glass_makes_the_error_a_lower_bound(monkeypatch):
    curve = cost_curve(under_water(SUN))
    assert curve.now.rare is not None and curve.now.delta_e > 1.5 * curve.model.error(16)
    assert "at least" in curve.now.rare.text and "light of 'sun' over glass" in curve.now.rare.text
    # the missing light exceeds the request, so the render ends after a multiple of the predicted samples
    monkeypatch.setattr(asked, "_HOPELESS", 0.1)
    made = render_scene(under_water(SUN, target_error=5.0))
    assert not made.outcome.reached and made.outcome.rare is not None and made.outcome.delta_e > 5.0
    assert "at least" in made.header["spectral.outcome"] and made.header["spectral.rare"] == made.outcome.rare.text
    assert any(made.outcome.rare.text in note.message for note in made.notes)


def test_the_light_of_a_wide_lamp_through_glass_is_not_rare():
    wide = AreaLight(name="lamp", world_from_light=matrix((0, 0, 1.5)), power_w=15, size=(1.0, 1.0))
    assert cost_curve(under_water(wide)).now.rare is None


def test_a_short_time_states_the_limit_of_rare_light():
    """Half a second leaves no time for larger sources: the error is a lower bound all the same."""
    rare = render_scene(under_water(SUN, time_budget_s=0.5)).outcome.rare
    assert rare is not None and max(rare.delta_e, rare.limit or 0.0) > 1.0 and "missing" in rare.text
    assert "a part of it may be missing" in RareLight(0.0, None, "light").text


def test_clamped_light_cannot_be_rare():
    scene = under_water(SUN, light_paths=LightPaths(clamp_indirect=10.0))
    assert cost_curve(scene).now.rare is None


def test_a_source_that_cannot_grow_limits_the_missing_light():
    scene = under_water(PointLight(name="lamp", world_from_light=matrix((0, 0, 2)), power_w=30, radius=0.0))
    bead = Instance("bead", scene.meshes[0].name, matrix((0.0, 0.0, 1.9)) @ np.diag([5e-5, 5e-5, 1, 1]), ("bead",))
    scene = replace(
        scene,
        materials=(*scene.materials, Material("bead", Emission(gray(1.0), 1e7))),
        instances=(*scene.instances, bead),
    )
    panel = AreaLight(name="panel", world_from_light=matrix((0, 0, 1.5)), power_w=2, size=(0.1, 0.1))
    for lamps in (scene.lights, (panel,)):  # alone, and beside one that grows
        rare = cost_curve(replace(scene, lights=lamps)).now.rare
        assert rare is not None and rare.delta_e == 0 < rare.limit and "up to ΔE" in rare.text and "'bead'" in rare.text


def test_grown_sources_have_equal_power():
    rng = np.random.default_rng(2)
    pixels = rng.uniform(0.1, 0.3, (256, 512, 3)).astype(np.float32)
    pixels[160, 120] = 20000.0
    spot = SpotLight(name="spot", world_from_light=matrix((0, 0, 3)), power_w=50, cone_angle_rad=0.03, radius=0.01)
    panel = AreaLight(name="panel", world_from_light=matrix((0, 0, 3)), power_w=9, size=(0.1, 0.2))
    scene = replace(under_water(SUN), lights=(SUN, spot, panel), world=World(ImageTexture("sky", pixels, "linear")))
    large = softened(scene, FAR)
    sun, cone, wide = large.lights
    assert sun.irradiance == SUN.irradiance and sun.angle_rad == SOFT_RAD and wide.power_w == panel.power_w
    assert wide.size == pytest.approx((0.5, 1.0)) and cone.cone_angle_rad == SOFT_CONE_RAD and cone.radius == 0.05
    solid = [1 - np.cos(each / 2) for each in (0.03, SOFT_CONE_RAD)]
    assert cone.power_w * solid[1] == pytest.approx(spot.power_w * solid[0]) and narrow_cones(scene) == ["spot"]
    area = np.sin(np.pi * (np.arange(256) + 0.5) / 256)[:, None]
    light = [luminance_from_linear_rgb(each.color.pixels.astype(float)) for each in (scene.world, large.world)]
    assert (light[1] * area).sum() == pytest.approx((light[0] * area).sum(), rel=1e-3)
    assert light[1].max() < 0.05 * light[0].max() and np.abs(light[1] - light[0])[:80].max() < 1e-6
    fine = ImageTexture("sky", np.repeat(np.repeat(pixels, 5, axis=0), 5, axis=1), "linear")
    coarse = softened(replace(scene, world=World(fine)), FAR).world.color.pixels
    assert coarse.shape[:2] == (427, 854) and coarse.max() < 1.2 * large.world.color.pixels.max()
    near = softened(replace(scene, lights=(panel,), world=World(gray(0.1))), lambda point: 0.2)
    assert near.lights[0] is panel


def test_a_number_is_no_color():
    with pytest.raises(InvalidInputError, match=r"ScatteringMedium extinction is the number 0.6; expected a color"):
        ScatteringMedium(0.5, gray(0.9), 0.6)
    with pytest.raises(InvalidInputError, match="Diffuse color is the number"):
        Diffuse(0.5)
    assert ScatteringMedium(0.5, gray(0.9), Color(np.ones(3))).extinction is not None


def test_pixels_without_new_samples_do_not_hide_rare_light(rng):
    drawn = 0.2 + 2.0 * (rng.random((2, 64, 4096, 1)) < 0.03) * np.ones(3)
    counts = np.where(np.arange(4096) < 2048, 64, 8)
    late = np.where(counts[:, None] == 64, drawn.mean(axis=1), drawn[:, :8].mean(axis=1))
    early = drawn[:, :8].mean(axis=1)
    first, second = early
    errors = pixel_errors(first, second)
    every = rarity(early, drawn.mean(axis=1), np.full(4096, 8), np.full(4096, 64), errors)
    assert rarity(early, late, np.full(4096, 8), counts, errors) == pytest.approx(every, rel=0.15)
