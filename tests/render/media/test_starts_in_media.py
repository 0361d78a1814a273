# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that begin in another medium than the camera is in: behind a border before the near clip, or beside the camera
of an orthographic picture. Closed forms of absorption, which Cycles 5.0 has as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.scene import Camera, Color, Film, Instance, Material, RenderSettings, ScatteringMedium, Scene, World
from spectral_core.scene import gray as gray_of
from tests.render.media.test_medium import box
from tests.render.scenes import matrix

pytest.importorskip("mitsuba")

RED = np.array([0.3, 0.8, 1.2])


def looking_down(height, *, near=0.1, scale=None, transparent=False):
    """From above at a box of fog from -1 to 1, before a white world; ``scale``: of an orthographic camera."""
    lens = {"field_of_view_rad": 2e-3} if scale is None else {"kind": "orthographic", "orthographic_scale": scale}
    return Scene(
        camera=Camera(world_from_camera=matrix((0.0, 0.0, height)), near=near, **lens),
        film=Film(8, 8, samples=16, transparent=transparent, filter_kind="box", filter_width=0.01),
        meshes=(box(),),
        materials=(Material("fog", None, ScatteringMedium(1.0, gray_of(0.0), Color(RED))),),
        instances=(Instance("fog", "box", np.diag([2.0, 2.0, 2.0, 1.0]), ("fog",)),),
        world=World(gray_of(1.0)),
        settings=RenderSettings(max_bounces=2),
    )


@pytest.mark.parametrize(
    ("height", "near", "length"),
    [
        (1.05, 0.1, 1.95),  # the camera is above the fog, its rays begin in it
        (1.05, 0.02, 2.0),
        (0.5, 0.1, 1.4),
        (-0.95, 0.1, 0.0),  # the camera is in the fog, its rays begin below
        (1.05, 2.5, 0.0),  # two borders before the near clip
    ],
)
def test_rays_begin_in_the_medium_behind_the_near_clip(height, near, length):
    seen = render_scene(looking_down(height, near=near)).pixels[..., :3].mean((0, 1))
    np.testing.assert_allclose(seen, np.exp(-RED * length), rtol=1e-3)


@pytest.mark.parametrize("transparent", [False, True])
def test_each_ray_of_an_orthographic_camera_begins_in_a_medium_of_its_own(transparent):
    """The camera is in the fog, and half of the picture beside it."""
    scene = looking_down(0.5, scale=4.0, transparent=transparent)
    pixels = render_scene(scene).pixels
    inside = np.zeros((8, 8), bool)
    inside[2:6, 2:6] = True
    clear = np.where(inside[..., None], np.exp(-RED * 1.4), 1.0)
    if transparent:
        np.testing.assert_allclose(pixels[..., 3], 1.0 - clear.mean(axis=-1), atol=1e-3)
    else:
        np.testing.assert_allclose(pixels[..., :3], clear, rtol=1e-3)


def test_fog_that_the_camera_does_not_see_is_not_entered_before_the_near_clip():
    from spectral_core.scene import Rays

    scene = looking_down(1.05)
    hidden = tuple(replace(item, hidden_from=Rays.CAMERA) for item in scene.instances)
    seen = render_scene(replace(scene, instances=hidden)).pixels[..., :3].mean((0, 1))
    np.testing.assert_allclose(seen, 1.0, rtol=1e-3)
