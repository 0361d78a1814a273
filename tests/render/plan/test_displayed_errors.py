# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors are those of the picture that is seen: what a display brightens a hundred times is planned and sampled so."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import Film, PointLight, RenderSettings, World, gray, scene_hash
from tests.render.scenes import lit_plane, matrix

LAMP = PointLight(name="lamp", world_from_light=matrix((0.3, 0.2, 2)), power_w=0.4, radius=0.4)
STOPS = 2.0**7


def dim(display: float = 1.0, film: float = 1.0, **settings):
    """A plane that is too dark to see."""
    film_of = Film(24, 16, samples=16, exposure=film)
    chosen = RenderSettings(display_exposure=display, **settings)
    return lit_plane(LAMP, film=film_of, world=World(gray(5e-5)), settings=chosen)


def test_what_a_display_shows_is_planned_as_what_the_film_shows():
    plans = [plan_from_data(scene) for scene in (dim(), dim(display=STOPS), dim(film=STOPS))]
    assert [plan["environment"].value for plan in plans] == ["none", "constant", "constant"]
    assert plans[1] == plans[2]
    assert plan_from_data(dim(display=STOPS), lights_vary=True) == plan_from_data(dim(), lights_vary=True)


def test_the_display_is_no_part_of_what_is_rendered():
    assert scene_hash(dim(display=STOPS)) == scene_hash(dim())
    assert scene_hash(dim(film=STOPS)) != scene_hash(dim())


def test_a_requested_error_is_that_of_the_picture_that_is_seen():
    pytest.importorskip("mitsuba")
    from spectral_core.render import render_scene

    seen = [replace(scene, film=replace(scene.film, width=40, height=30))
            for scene in (dim(display=STOPS, target_error=0.1), dim(film=STOPS, target_error=0.1))]  # fmt: skip
    own, bright = map(render_scene, seen)
    assert own.outcome.samples == bright.outcome.samples > 4
    assert own.outcome.delta_e == pytest.approx(bright.outcome.delta_e, rel=1e-6)
    assert own.pixels[..., :3] * STOPS == pytest.approx(bright.pixels[..., :3], rel=1e-5)
    assert own.noise_pixels * STOPS == pytest.approx(bright.noise_pixels, rel=1e-4, abs=1e-5)
