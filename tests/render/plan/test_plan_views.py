# SPDX-License-Identifier: GPL-3.0-or-later
"""Decisions of the plan that depend on how the camera sees: worlds of its own, panoramas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import plan_effects, plan_from_data
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.scene import (
    Camera,
    Color,
    Emission,
    Film,
    Glass,
    Instance,
    Material,
    PointLight,
    Rays,
    RenderSettings,
    World,
)
from spectral_core.scene.camera import Panorama
from spectral_core.spectra.refraction import index_by_abbe
from tests.render.scenes import lit_plane, looking_down, matrix, plane

LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)


@pytest.mark.parametrize("light", [0.0, 1e-7])
def test_an_environment_that_the_camera_alone_sees_is_kept_where_it_shows(light: float) -> None:
    """The world that lights is as good as black; the picture behind the objects is not."""
    scene = lit_plane(LAMP)
    for strength, is_kept in ((1.0, True), (1e-9, False)):
        seen = World(Color(np.full(3, 0.5)), strength)
        behind = replace(scene, world=World(Color(np.full(3, light)), camera_view=seen))
        plan = plan_from_data(behind)
        assert plan.is_on("environment") is is_kept
        assert (simulated_scene(behind, plan).world.camera_view is not None) is is_kept


@pytest.mark.parametrize(("radius", "value"), [(0.05, "on"), (1e-9, "off")])
@pytest.mark.parametrize(
    "panorama", [Panorama("fisheye_equidistant", (3.0,)), Panorama("equirectangular", (-3.1, 3.1, -1.5, 1.5))]
)
def test_the_lens_of_a_panorama_blurs_what_lies_behind_it(panorama: Panorama, radius: float, value: str) -> None:
    """Its distances are those from the camera, not along its axis."""
    scene = lit_plane(LAMP)
    lens = replace(
        scene.camera, kind="panoramic", panorama=panorama, aperture_radius=radius, focus_distance=0.5,
        world_from_camera=scene.camera.world_from_camera @ np.diag([1.0, -1.0, -1.0, 1.0]),
    )  # fmt: skip
    assert plan_from_data(replace(scene, camera=lens))["depth_of_field"].value == value


def test_a_lamp_of_a_device_stays_however_small_it_is():
    """Three pixels of a large picture were switched off: a mean of ΔE 0.03. Behind the camera it is omitted."""
    pytest.importorskip("mitsuba")
    scene = lit_plane(LAMP, film=Film(1920, 1080, samples=64), camera=looking_down(8.0, 0.5))
    led = Material("led", Emission(Color((1.0, 0.05, 0.05)), 3.0))

    def row(height, **hidden):
        place = Instance("led", "small", matrix((0.3, 0.2, height)), ("led",), **hidden)
        meshes, materials = (*scene.meshes, plane(0.003, "small")), (*scene.materials, led)
        made = replace(scene, meshes=meshes, materials=materials, instances=(*scene.instances, place))
        return plan_effects(replace(made, settings=RenderSettings()))["emissive_meshes"]

    assert row(0.01).is_on and row(0.01).error > 50.0
    assert not row(9.0).is_on and not row(0.01, hidden_from=Rays.CAMERA).is_on


def test_a_3d_view_keeps_what_the_camera_of_its_scene_does_not_see():
    """A view is seen from anywhere: with all objects behind that camera, lamps had hard shadows and glass no colors."""
    away = Camera(world_from_camera=matrix((0, 0, -1)))  # looks down, below the floor
    lamp = replace(LAMP, radius=0.1)
    matt = replace(lit_plane(lamp), camera=away, settings=RenderSettings())
    assert plan_from_data(matt, 0.25)["lamp_bodies"].value == "off"
    assert plan_from_data(matt, 0.0, lights_vary=True)["lamp_bodies"].value == "on"
    glass = replace(matt, materials=(Material("paper", Glass(ior=index_by_abbe(1.6, 30.0))),))
    assert plan_from_data(glass, 0.25)["dispersion"].value == "off"
    view = plan_from_data(glass, 0.0, lights_vary=True)
    assert view["dispersion"].value == "on" and view.is_spectral
