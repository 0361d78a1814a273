# SPDX-License-Identifier: GPL-3.0-or-later
"""A transparent film: lamps that the camera sees shine in front of nothing; the environment is in its own pass."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.still import render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Film,
    Passes,
    PointLight,
    RenderSettings,
    Scene,
    SunLight,
    World,
    gray,
)

BEHIND = np.eye(4)
BEHIND[2, 3] = -5.0
FACING = BEHIND @ np.diag([1.0, -1.0, -1.0, 1.0])
"""Five units in front of the camera, and turned toward it."""


def _film(light, *, world=None, passes=None):
    film = Film(9, 9, samples=16, transparent=True)
    settings = RenderSettings(transport="rgb", passes=passes)
    return render_scene(
        Scene(
            camera=Camera(world_from_camera=np.eye(4)),
            film=film,
            lights=light,
            world=world or World(),
            settings=settings,
        )
    )


@pytest.mark.parametrize(
    ("light", "radiance"),
    [
        (AreaLight(name="panel", world_from_light=FACING, power_w=8.0, size=(0.5, 0.5), camera_visible=True),
         8.0 / (np.pi * 0.25)),
        (PointLight(name="ball", world_from_light=BEHIND, power_w=8.0, radius=0.4, camera_visible=True),
         8.0 / (4 * np.pi * np.pi * 0.16)),
        (SunLight(name="sun", world_from_light=FACING, irradiance=1.0, angle_rad=0.3, camera_visible=True),
         1.0 / (np.pi * np.sin(0.15) ** 2)),
    ],
)  # fmt: skip
def test_a_lamp_that_the_camera_sees_shines_without_covering(light, radiance):
    middle = _film((light,)).pixels[4, 4]
    np.testing.assert_allclose(middle[:3], radiance, rtol=0.02)
    assert middle[3] == 0.0


def test_the_pass_of_the_environment_holds_what_the_picture_leaves_out():
    made = _film((), world=World(gray(0.3)), passes=Passes(("Environment",)))
    assert np.all(made.pixels == 0.0)
    np.testing.assert_allclose(made.passes["Environment"], 0.3, rtol=1e-3)
