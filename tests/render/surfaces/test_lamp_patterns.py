# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps whose emission varies, lamps around their receivers, and lamps that remove light, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import job as job_module
from spectral_core.render import plan_effects, render_scene
from spectral_core.render.job import RenderJob
from spectral_core.scene import AreaLight, Camera, Color, Computed, Film, PointLight, SunLight
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, looking_down, matrix

pytest.importorskip("mitsuba")
HEIGHT, INTENSITY = 3.0, 100 / (4 * np.pi)
ABOVE = matrix((0, 0, HEIGHT))
PATHS = pytest.mark.parametrize("mitsubas", [False, True], ids=["tables", "mitsuba"])


def picture(scene, monkeypatch, mitsubas, samples=64):
    """(height, width, 3) with the light tables, or with Mitsuba's emitters as in live views."""
    if mitsubas:
        load = job_module.load_scene
        monkeypatch.setattr(job_module, "load_scene", lambda *a, **k: load(*a, **{**k, "own_lights": False}))
    job = RenderJob(scene, plan_effects(scene))
    job.trace(samples)
    return job.picture()[..., :3].astype(np.float64)


def part(builder, name, axis):
    """Absolute value of a component of an input."""
    value = builder.add("component", (builder.add("vector_input", (), name, 0),), axis)
    return builder.add("math", (value, builder.number(0.0), builder.number(0.0)), "ABSOLUTE")


def ray_length():
    """A pattern: the ray's length."""
    builder = Builder()
    return Computed(builder.program(builder.add("number_input", (), "ray:Ray Length", 0)))


def parts(first, axis):
    """A pattern: red is a component of an input, green the ray's length, and blue 1."""
    builder = Builder()
    length = builder.add("number_input", (), "ray:Ray Length", 0)
    return Computed(builder.program(builder.add("joined", (part(builder, first, axis), length, builder.number(1.0)))))


def tinted(red, green, blue):
    """A constant color that the renderer cannot know to be constant: a point's component times 0 plus a color."""
    builder = Builder()
    none = builder.add("component", (builder.add("vector_input", (), "incoming", 0),), 0)
    zero = builder.add("math", (none, builder.number(0.0), builder.number(0.0)), "MULTIPLY")
    color = builder.add("vector_math", (builder.as_width(zero, 3), builder.number((red, green, blue)),
                                        builder.number((0.0, 0.0, 0.0)), builder.number(0.0)), "ADD")  # fmt: skip
    return Computed(builder.program(color))


@PATHS
def test_disks_and_a_ball_around_their_receiver_and_one_another(monkeypatch, mitsubas):
    """Each lights one channel, also along rays that meet the bodies of the others first.

    On the axis of a disk of radius r and intensity I the irradiance is I / (d² + r²). Within a ball, the radiance is
    I / (π r²) in every direction, so the irradiance is I / r².
    """
    lamps = (
        PointLight(name="low", world_from_light=matrix((0, 0, 0.5)), color=Color([1.0, 0, 0])),
        PointLight(name="high", world_from_light=matrix((0, 0, 1.0)), color=Color([0, 1.0, 0])),
        PointLight(name="ball", world_from_light=matrix((0.1, 0, 0.2)), color=Color([0, 0, 1.0]), soft_falloff=False),
    )
    scene = replace(lit_plane(), lights=tuple(replace(lamp, power_w=100, radius=0.8) for lamp in lamps))
    expected = 0.5 / np.pi * INTENSITY / np.array((0.5**2 + 0.8**2, 1.0**2 + 0.8**2, 0.8**2))
    found = picture(scene, monkeypatch, mitsubas, 512).mean(axis=(0, 1))
    assert found == pytest.approx(expected, rel=2e-2)


@PATHS
def test_by_wavelengths_a_pattern_is_a_factor_and_a_negative_power_removes_light(monkeypatch, mitsubas):
    own = {"world_from_light": ABOVE}
    lights = (
        PointLight(name="patterned", power_w=100, pattern=tinted(2.0, 0.5, 0.25), **own),
        PointLight(name="plain", power_w=50, **own),
        PointLight(name="taken", power_w=-20, **own),
    )
    expected = 0.5 / np.pi * INTENSITY / HEIGHT**2 * np.array((2.3, 0.8, 0.55))
    found = picture(replace(lit_plane(transport="spectral"), lights=lights), monkeypatch, mitsubas, 256)
    assert found.mean(axis=(0, 1)) == pytest.approx(expected, rel=1e-2)


@PATHS
def test_a_pattern_reads_the_direction_toward_the_receiver_and_the_distance(monkeypatch, mitsubas):
    """The cosine of the direction about the vertical, at a receiver that the lamp is 45 degrees away from."""
    place = matrix((HEIGHT, 0, HEIGHT))
    light = PointLight(name="lamp", world_from_light=place, power_w=100, pattern=parts("incoming", 2))
    plain = 0.5 / np.pi * INTENSITY * np.sqrt(0.5) / (2 * HEIGHT**2)
    found = picture(lit_plane(light), monkeypatch, mitsubas).mean(axis=(0, 1))
    assert found / plain == pytest.approx([np.sqrt(0.5), np.sqrt(2) * HEIGHT, 1.0], rel=1e-2)


@PATHS
def test_a_pattern_reads_the_point_of_a_panel_and_the_distance(monkeypatch, mitsubas):
    """The mean of |x| over a small panel of width w is w / 4; a receiver below it gets power / π / d² per area."""
    own = {"world_from_light": ABOVE, "power_w": 100, "size": (0.2, 0.2)}
    light = AreaLight(name="lamp", pattern=parts("position", 0), **own)
    plain = 0.5 / np.pi * 100 / np.pi / HEIGHT**2
    found = picture(lit_plane(light), monkeypatch, mitsubas, 256).mean(axis=(0, 1))
    assert found / plain == pytest.approx([0.05, HEIGHT, 1.0], rel=2e-2)


@PATHS
def test_a_pattern_reads_the_direction_of_a_sun(monkeypatch, mitsubas):
    """Of a sharp one in red and of a wide one in green."""
    builder = Builder()
    upright = Computed(builder.program(builder.as_width(part(builder, "normal", 2), 3)))
    own = {"world_from_light": ABOVE, "irradiance": 2.0, "pattern": upright}
    lights = (
        SunLight(name="sharp", color=Color([1.0, 0, 0]), angle_rad=0.0, **own),
        SunLight(name="wide", color=Color([0, 1.0, 0]), angle_rad=0.3, **own),
    )
    found = picture(replace(lit_plane(), lights=lights), monkeypatch, mitsubas, 256).mean(axis=(0, 1))
    assert found == pytest.approx([1 / np.pi, 1 / np.pi, 0], rel=2e-2)


@PATHS
def test_several_patterns_and_a_negative_power_stay_with_their_lamps(monkeypatch, mitsubas):
    own = {"world_from_light": ABOVE, "power_w": 100}
    lights = (
        PointLight(name="red", pattern=tinted(1.0, 0.0, 0.0), **own),
        PointLight(name="plain", color=Color([0.0, 1.0, 0.0]), **own),
        AreaLight(name="blue", pattern=tinted(0.0, 0.0, 0.5), world_from_light=ABOVE, power_w=25, size=(0.1, 0.1)),
        PointLight(name="taken", color=Color([0.0, 1.0, 0.0]), **{**own, "power_w": -60}),
    )
    scene = replace(lit_plane(lights[0]), lights=lights)
    unit = 0.5 / np.pi * INTENSITY / HEIGHT**2
    found = picture(scene, monkeypatch, mitsubas, 256).mean(axis=(0, 1))
    assert found == pytest.approx([unit, 0.4 * unit, 0.5 * unit], rel=3e-2)


def test_the_camera_sees_the_disk_of_a_lamp():
    """A disk of radius r at distance d covers the angle atan(r / d), where a ball covers asin(r / d)."""
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 0)), power_w=100, radius=1.0, camera_visible=True)
    scene = lit_plane(lamp)
    camera = Camera(world_from_camera=matrix((0, 0, 1.5)), field_of_view_rad=1.6, near=1e-3)
    scene = replace(scene, instances=(), camera=camera)
    scene = replace(scene, film=replace(scene.film, width=64, height=64, samples=16))
    shown = render_scene(scene).pixels[..., 0] > 0.5 * INTENSITY / np.pi
    edge = np.tan(1.6 / 2)
    assert shown.mean() == pytest.approx(np.pi * (1 / 1.5) ** 2 / (2 * edge) ** 2, rel=0.03)


@PATHS
def test_a_panel_of_spread_zero_lights_the_column_below_it(monkeypatch, mitsubas):
    """Watts per area below the panel, nothing beside it; half a degree would blur the edge by a fifth of a pixel."""
    panel = AreaLight(name="panel", world_from_light=ABOVE, power_w=8, size=(1.0, 1.0), spread_rad=0.0)
    scene = lit_plane(panel, camera=looking_down(4.0, 2 * np.arctan(0.25)), film=Film(16, 16, samples=64))
    scene = replace(scene, film=replace(scene.film, filter_kind="box", filter_width=1.0))
    found = picture(scene, monkeypatch, mitsubas, 64)[..., 1]
    expected = np.zeros((16, 16))
    expected[4:12, 4:12] = 0.5 / np.pi * 8
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=0.05)
