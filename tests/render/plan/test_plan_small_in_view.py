# SPDX-License-Identifier: GPL-3.0-or-later
"""What the plan must not lose though it is small, out of the pilot's reach, or recorded for later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import MissingDependencyError
from spectral_core.render import plan_effects, plan_from_data
from spectral_core.render.plan import effects
from spectral_core.render.plan.light.shown import bodies_in_view, error_of_bodies
from spectral_core.render.plan.pilot import CHANNELS, COUNTS, LEVELS, ROWS, TOTAL, Pilot
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Film,
    Fluorescent,
    Glass,
    Glossy,
    Instance,
    Material,
    MixSurface,
    PointLight,
    Principled,
    RenderSettings,
    World,
    gray,
)
from spectral_core.scene.geometry import VolumeObject, unit_box
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.volume.transfer import Material as Substance
from spectral_core.volume.transfer import TransferFunction
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh

LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)
WIDE = Camera(world_from_camera=matrix((0, 0, 2)), field_of_view_rad=0.8)


def _with_ball(surface, radius=0.001, lights=(), **rest):
    """A ball of two pixels of 1,920 over the middle of the plane."""
    scene = lit_plane(*lights, camera=WIDE, film=Film(1920, 1080, samples=64), settings=RenderSettings(), **rest)
    return replace(
        scene, meshes=(*scene.meshes, sphere_mesh(12)), materials=(*scene.materials, Material("ball", surface)),
        instances=(*scene.instances, Instance("ball", "sphere", matrix((0, 0, 0.01), radius), ("ball",))),
    )  # fmt: skip


def test_small_mirrors_and_a_small_gap_to_the_sky_are_not_black():
    """Balls of up to five pixels and windows of 100 were black, stated as ΔE 0.02 and 0.2 in the mean."""
    pytest.importorskip("mitsuba")
    roof = AreaLight(name="roof", world_from_light=matrix((0, 0, 3)), power_w=100, size=(6, 6))
    sky = World(gray(0.0), camera_view=World(gray(0.5)))
    scene = _with_ball(Glossy(gray(0.9), 0.0), lights=(roof,), world=sky)
    # the floor ends a hundredth of a percent before the border of the view
    floor = replace(scene.instances[0], world_from_object=np.diag([0.03, 0.00951, 1.0, 1.0]))
    plan = plan_effects(replace(scene, instances=(floor, *scene.instances[1:])))
    assert int(plan["glossy_bounces"].value) >= 1 and plan["glossy_bounces"].error > 10
    assert plan.is_on("environment") and plan["environment"].error > 10


def test_a_body_needs_the_bounces_that_carry_most_of_its_light():
    bins = np.zeros((2, 2, 8, ROWS, CHANNELS))
    bins[..., TOTAL, :3] = 0.5
    first = COUNTS.index("transmission") * LEVELS
    bins[0, 0, :, first + 2, :3], bins[0, 0, :, first + 4, :3] = 8e-5, 2e-5
    seen = Pilot(bins, 192, np.zeros((0, 3)))
    errors = [error_of_bodies(seen, "transmission", most) for most in (0, 1, 2, 3, 4)]
    assert errors[0] == errors[1] > 90 and 1 < errors[2] == errors[3] < 20 and errors[4] == 0
    # none met by any path of the pilot
    assert [error_of_bodies(seen, "glossy", most) > 90 for most in (0, 1)] == [True, False]


@pytest.mark.parametrize(
    ("surface", "kinds"),
    [
        (Glossy(), {"glossy"}), (Glass(), {"transmission"}), (Principled(metallic=1.0), {"glossy"}),
        (Principled(transmission=1.0), {"transmission"}), (Principled(), set()), (Diffuse(), set()),
        (MixSurface(0.5, Glass(), Glossy()), {"glossy", "transmission"}), (MixSurface(0.5, Diffuse(), Glossy()), set()),
    ],
)  # fmt: skip
def test_mirrors_and_glass_show_nothing_of_their_own(surface, kinds):
    scene = _with_ball(surface)
    assert bodies_in_view(scene, list(scene.materials)) == kinds
    behind = replace(scene, camera=Camera(world_from_camera=matrix((0, 0, -5)), field_of_view_rad=0.8))
    assert not bodies_in_view(behind, list(behind.materials))


def test_the_pilot_has_the_films_and_dyes_that_send_light_on(monkeypatch):
    """Soap bubbles of index 1 mirrored nothing in the pilot, so their reflections were omitted: ΔE 2.9, stated as 0.06.

    A room whose dyes keep 90 % of red light in three channels had three bounces: ΔE 30, stated as 0.005.
    """
    plans = []

    def noted(scene, plan):
        plans.append(plan)
        raise MissingDependencyError("no pilot")

    monkeypatch.setattr(effects, "run_pilot", noted)
    bubble = Glass(ior=1.0, thin_film_thickness=400.0)
    dye = FluorescentDye.gaussian("orange", 460, 600)
    for surface in (bubble, Glass(thin_film_thickness=1e-3), Fluorescent(gray(0.2), (dye,), (0.3,))):
        plan_effects(lit_plane(LAMP, surface=surface))
    assert [plan.is_on("thin_film") for plan in plans] == [True, False, False]
    assert plans[2].is_on("fluorescence") and not plans[2].is_spectral


def test_volumes_and_visible_lamps_are_out_of_focus_too():
    """A volume alone before an open lens was sharp: ΔE 8.8 in the mean, stated as 0."""
    lens = replace(looking_down(6.0, 0.5), aperture_radius=0.2, focus_distance=2.0)
    curve = TransferFunction((Substance("a", np.array([0.0, 1.0]), np.ones(2), np.ones(3)),))
    volume = VolumeObject("v", np.ones((4, 4, 4), np.float32), matrix((0, 0, 0), 0.2), curve)
    alone = replace(lit_plane(camera=lens, film=Film(64, 64)), instances=(), volumes=(volume,))
    assert plan_from_data(alone).is_on("depth_of_field")
    focused = replace(alone, camera=replace(lens, aperture_radius=1e-6))
    assert not plan_from_data(focused).is_on("depth_of_field")

    lamp = AreaLight(name="lamp", world_from_light=matrix((0, 0, -30)), size=(0.1, 0.1))
    card = replace(lit_plane(lamp, camera=replace(lens, focus_distance=6.0), film=Film(64, 64)), world=World())
    card = replace(card, meshes=(replace(unit_box(), name="plane"),))
    card = replace(card, instances=(replace(card.instances[0], world_from_object=np.diag([1, 1, 1e-4, 1.0])),))
    for visible, beside, kept in ((False, 0, False), (True, 0, True), (True, 50, False)):
        placed = replace(lamp, camera_visible=visible, world_from_light=matrix((beside, 0, -30)))
        assert plan_from_data(replace(card, lights=(placed,))).is_on("depth_of_field") is kept


def test_a_recording_has_the_bulb_of_a_faint_world():
    """A world of 0.00001 had no bulb on the dial, and could not be made brighter there."""
    scene = lit_plane(LAMP, world=World(gray(1.0), strength=1e-5))
    assert not plan_from_data(scene, 0.25).is_on("environment")
    assert plan_from_data(scene, 0.25, lights_vary=True).is_on("environment")
    assert not plan_from_data(replace(scene, world=World()), lights_vary=True).is_on("environment")
