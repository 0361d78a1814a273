# SPDX-License-Identifier: GPL-3.0-or-later
"""A transparent film: lamps that the camera sees shine in front of nothing; the environment is in its own pass."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from benchmarks.render.cases.meshes import at, box, square
from spectral_core.render.still import render_scene
from spectral_core.scene import (
    AddSurface,
    AreaLight,
    Camera,
    Emission,
    Film,
    Instance,
    Material,
    Passes,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    Transparent,
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


def test_what_emits_light_and_covers_nothing_is_seen():
    """Flames without smoke, and Emission added to Transparent, were black; Cycles shows them with alpha 0."""
    flame = ScatteringMedium(0.0, gray(0.0), emission_color=gray(1.0), emission_strength=0.5)
    materials = Material("flame", None, medium=flame), Material("glow", AddSurface(Transparent(), Emission(gray(0.3))))
    instances = (
        Instance("flame", "box", at(-1, 0, -4, 0.9), ("flame",)),
        Instance("glow", "square", at(1, 0, -4, 0.9), ("glow",)),
    )
    scene = Scene(
        camera=Camera(world_from_camera=np.eye(4), kind="orthographic", orthographic_scale=4.0),
        film=Film(2, 1, samples=16, transparent=True, filter_kind="box", filter_width=0.01),
        meshes=(square(), box()),
        materials=materials,
        instances=instances,
        settings=RenderSettings(transport="rgb"),
    )
    thickness = 0.9 * float(np.ptp(box().positions[:, 2]))
    left, right = render_scene(scene).pixels[0]
    np.testing.assert_allclose(left, [0.5 * thickness] * 3 + [0.0], rtol=0.01, atol=1e-6)
    np.testing.assert_allclose(right, [0.3] * 3 + [0.0], rtol=0.01, atol=1e-6)
