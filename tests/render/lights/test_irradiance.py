# SPDX-License-Identifier: GPL-3.0-or-later
"""Each light compared with its closed form: a diffuse plane of reflectance ρ reflects ρ E / π."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.mitsuba_scene.paint import emitted_rgb
from spectral_core.scene import AreaLight, Color, ImageTexture, PointLight, SpotLight, SunLight, World, gray
from spectral_core.spectra import catalogue
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")
HEIGHT = 3.0
TRANSPORTS = pytest.mark.parametrize("transport", ["rgb", "spectral"])
INTENSITY_OF_100_W = 100 / (4 * np.pi)
ABOVE = matrix((0, 0, HEIGHT))


def _color(scene):
    return render_scene(scene).pixels[..., :3].mean(axis=(0, 1))


@pytest.mark.parametrize(("radius", "transport"), [(0.0, "rgb"), (0.6, "rgb"), (0.0, "spectral")])
def test_a_ball_light_equals_a_point_light_of_the_same_power(transport, radius):
    light = PointLight(name="lamp", world_from_light=ABOVE, power_w=100, radius=radius, soft_falloff=False)
    expected = 0.5 / np.pi * INTENSITY_OF_100_W / HEIGHT**2
    assert _color(lit_plane(light, transport=transport)) == pytest.approx([expected] * 3, rel=4e-3)


@pytest.mark.parametrize(("radius", "transport"), [(0.0, "rgb"), (0.6, "rgb"), (0.6, "spectral")])
def test_the_center_of_a_spot_is_as_bright_as_a_point(transport, radius):
    light = SpotLight(name="spot", world_from_light=ABOVE, power_w=100, radius=radius, soft_falloff=False)
    expected = 0.5 / np.pi * INTENSITY_OF_100_W / HEIGHT**2
    assert _color(lit_plane(light, transport=transport)) == pytest.approx([expected] * 3, rel=4e-3)


@pytest.mark.parametrize("blend", [0.0, 0.5, 1.0])
def test_a_spot_falls_off_as_in_blender(blend):
    # the plane's center is 0.2 radian off the axis, half the cone is 0.4
    x = HEIGHT * np.tan(0.2)
    light = SpotLight(name="s", world_from_light=matrix((x, 0, HEIGHT)), power_w=100, cone_angle_rad=0.8, blend=blend)
    step = np.clip((np.cos(0.2) - np.cos(0.4)) / max((1 - np.cos(0.4)) * blend, 1e-6), 0, 1)
    expected = 0.5 / np.pi * INTENSITY_OF_100_W * np.cos(0.2) ** 3 / HEIGHT**2 * step**2 * (3 - 2 * step)
    assert _color(lit_plane(light)) == pytest.approx([expected] * 3, rel=1e-2)


@pytest.mark.parametrize(
    ("angle", "transport"), [(0.0, "rgb"), (0.00918, "rgb"), (0.5, "rgb"), (0.0, "spectral"), (0.5, "spectral")]
)
def test_a_sun_gives_its_irradiance(transport, angle):
    light = SunLight(name="sun", world_from_light=ABOVE, irradiance=2.0, angle_rad=angle)
    assert _color(lit_plane(light, transport=transport)) == pytest.approx([1 / np.pi] * 3, rel=4e-3)


@TRANSPORTS
def test_a_small_area_light_emits_its_power(transport):
    light = AreaLight(name="area", world_from_light=ABOVE, power_w=100, size=(0.1, 0.2))
    expected = 0.5 / np.pi * 100 / np.pi / HEIGHT**2
    assert _color(lit_plane(light, transport=transport)) == pytest.approx([expected] * 3, rel=4e-3)


def test_a_wide_disk_light_agrees_with_its_form_factor():
    radius = 2.0
    light = AreaLight(name="disk", world_from_light=ABOVE, power_w=100, size=(2 * radius,) * 2, shape="ellipse")
    irradiance = 100 / (np.pi * radius**2) * radius**2 / (radius**2 + HEIGHT**2)
    assert _color(lit_plane(light)) == pytest.approx([0.5 / np.pi * irradiance] * 3, rel=4e-3)


def test_an_area_light_emits_to_its_front_only():
    away = np.diag([1.0, -1, -1, 1])
    away[2, 3] = HEIGHT
    assert _color(lit_plane(AreaLight(name="area", world_from_light=away, power_w=100))).max() == 0


@TRANSPORTS
def test_the_irradiance_of_a_constant_world(transport):
    scene = lit_plane(world=World(Color([0.7, 0.4, 0.2]), 2.0), transport=transport)
    assert _color(scene) == pytest.approx([0.7, 0.4, 0.2], rel=1e-2)


@TRANSPORTS
def test_an_image_world_has_the_orientation_of_blender(transport):
    """Blender's u = 0.5 - atan2(y, x) / 2π: the quarter around u = 0.25 is +y. Each quarter has another color."""
    image = np.zeros((16, 32, 3), np.float32)
    for quarter, value in ((0, (0.9, 0.1, 0.1)), (1, (0.1, 0.9, 0.1)), (2, (0.1, 0.1, 0.9))):
        image[:, 4 + 8 * quarter : 12 + 8 * quarter] = value  # u from 1/8 on: +y, then +x, then -y
    from dataclasses import replace

    from spectral_core.scene import Camera

    def seen(direction):
        forward = np.asarray(direction, float)
        camera = np.eye(4)
        camera[:3, 2] = -forward
        camera[:3, 1] = (0, 0, 1)
        camera[:3, 0] = np.cross((0, 0, 1), -forward)
        scene = lit_plane(world=World(ImageTexture("sky", image, "linear")), transport=transport)
        scene = replace(scene, instances=(), camera=Camera(world_from_camera=camera, field_of_view_rad=0.1))
        return _color(scene)

    assert seen((0, 1, 0)) == pytest.approx([0.9, 0.1, 0.1], rel=0.02)
    assert seen((1, 0, 0)) == pytest.approx([0.1, 0.9, 0.1], rel=0.02)
    assert seen((0, -1, 0)) == pytest.approx([0.1, 0.1, 0.9], rel=0.02)
    assert seen((-1, 0, 0)) == pytest.approx([0, 0, 0], abs=0.01)


def test_the_lower_half_of_an_image_is_below_the_horizon():
    image = np.zeros((64, 8, 3), np.float32)
    image[32:] = (0.8, 0.4, 0.2)
    scene = lit_plane(
        world=World(ImageTexture("sky", image, "linear")),
    )
    assert _color(scene) == pytest.approx([0.4, 0.2, 0.1], rel=0.02)


@pytest.mark.parametrize(
    "color", [Color([1.0, 0.2, 0.05]), gray(2.0), catalogue.illuminant("HP1"), catalogue.illuminant("FL11")]
)
def test_spectral_light_has_the_color_of_rgb_light(color):
    """Also for measured lamps: spectral transport shows the color of their integral."""
    light = PointLight(name="lamp", world_from_light=ABOVE, power_w=100, color=color)
    expected = 0.5 / np.pi * INTENSITY_OF_100_W / HEIGHT**2 * emitted_rgb(color)
    actual = _color(lit_plane(light, transport="spectral"))
    assert actual == pytest.approx(expected, rel=5e-3, abs=2e-3 * expected.max())
