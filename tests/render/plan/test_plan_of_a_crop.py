# SPDX-License-Identifier: GPL-3.0-or-later
"""The pilot of a crop covers the crop: the rest of the picture neither hides its light nor adds to it."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.plan.small_film import small_film
from spectral_core.scene import Camera, Film


@pytest.mark.parametrize("aspect", [1.0, 0.5, 2.0])
@pytest.mark.parametrize(
    "crop", [None, (0, 0, 1920, 1080), (100, 40, 400, 300), (1910, 0, 10, 1080), (5, 1075, 3, 4), (960, 540, 1, 1)]
)
def test_the_film_of_a_pilot_shows_the_crop(crop, aspect):
    film = Film(1920, 1080, crop=crop, pixel_aspect=aspect, exposure=2.0)
    small = small_film(film, 576, 192)
    camera = Camera(world_from_camera=np.eye(4), field_of_view_rad=0.8, shift=(0.1, -0.05))
    assert camera.window(small) == pytest.approx(camera.window(film), rel=0.02)  # the frame is the same view
    assert small.exposure == 2.0 and (small.crop is None) == (crop is None)
    left, bottom, width, height = crop or (0, 0, 1920, 1080)
    own = small.crop or (0, 0, small.width, small.height)
    assert 300 < own[2] * own[3] < 1200 or min(own[2:]) == 4
    for first, size, whole, of_small, own_first, own_size in (
        (left, width, 1920, small.width, own[0], own[2]),
        (bottom, height, 1080, small.height, own[1], own[3]),
    ):
        pixel = 1 / of_small
        assert abs(own_first / of_small - first / whole) <= pixel
        assert abs(own_size / of_small - size / whole) <= pixel + 0.5 * size / whole / own_size


def test_a_dark_corner_that_is_rendered_alone_keeps_its_light():
    pytest.importorskip("mitsuba")
    from dataclasses import replace

    from spectral_core.render import plan_effects
    from spectral_core.scene import AreaLight, Diffuse, Instance, RenderSettings, gray
    from spectral_core.scene.geometry import unit_box
    from tests.render.scenes import lit_plane, matrix

    lamp = AreaLight(name="lamp", world_from_light=matrix((0, 0, 6)), power_w=600, size=(2.0, 2.0))
    view = Camera(world_from_camera=matrix((0, 0, 9)), field_of_view_rad=1.0)
    scene = lit_plane(lamp, surface=Diffuse(gray(0.8)), camera=view, settings=RenderSettings())
    # two walls of a slit that the lamp does not light, 64 × 64 of the picture's 1.2 million pixels
    walls = [np.diag([0.3, 1.0, 2.0, 1.0]), np.diag([0.3, 1.0, 2.0, 1.0])]
    walls[0][:3, 3], walls[1][:3, 3] = (3.3, 0, 0), (3.8, 0, 0)
    placed = tuple(Instance(f"wall {k}", "box", wall, ("paper",)) for k, wall in enumerate(walls))
    scene = replace(
        scene, meshes=(*scene.meshes, replace(unit_box(), name="box")), instances=(*scene.instances, *placed)
    )
    frame = Film(1280, 960, samples=64)
    scale = 1280 / (2 * 9 * np.tan(0.5))
    slit = (round(640 + 3.68 * scale) - 5, round(480 + 0.5 * scale) - 20, 10, 40)
    found = [plan_effects(replace(scene, film=replace(frame, crop=crop)))["bounces"].error for crop in (None, slit)]
    assert found[1] > 2 * found[0]  # in the picture as a whole the slit is a thousandth of the pixels
