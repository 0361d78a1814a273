# SPDX-License-Identifier: GPL-3.0-or-later
"""Coarse smooth-shaded meshes: light at grazing angles starts from the rounded surface of their normals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Diffuse,
    Film,
    Glossy,
    Instance,
    Material,
    RenderSettings,
    Scene,
    SunLight,
    World,
    gray,
)

from ..scenes import plane, sphere_mesh

pytest.importorskip("mitsuba")

SIZE, SCALE, HEIGHT = 48, 2.4, 0.2


def _ball(cosine, surface=None, **rest):
    """A ball of few triangles from above, lit from +x and slightly from above."""
    up, along = np.sin(HEIGHT), np.cos(HEIGHT)
    sideways = np.array([[up, 0, along, 0], [0, 1, 0, 0], [-along, 0, up, 0], [0, 0, 0, 1]])
    above = np.eye(4)
    above[2, 3] = 5.0
    return Scene(
        camera=Camera(world_from_camera=above, kind="orthographic", orthographic_scale=SCALE),
        film=Film(SIZE, SIZE, samples=16),
        meshes=(sphere_mesh(8),),
        materials=(Material("white", surface or Diffuse(gray(1.0))),),
        instances=(Instance("ball", "sphere", np.eye(4), ("white",), terminator_cosine=cosine),),
        lights=(SunLight(name="sun", world_from_light=sideways, irradiance=np.pi, angle_rad=0.0),),
        settings=RenderSettings(transport="rgb", max_bounces=0),
        **rest,
    )


def test_light_reaches_the_horizon_of_the_normals():
    """Near the terminator the picture is the cosine to the smooth normal, not cut off along triangles."""
    x, y = np.meshgrid(*(((np.arange(SIZE) + 0.5) / SIZE - 0.5) * SCALE,) * 2)
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0.0))
    cosine = x * np.cos(HEIGHT) + z * np.sin(HEIGHT)
    near = (np.abs(cosine) < 0.3) & (np.hypot(x, y) < 0.8)
    expected = np.maximum(cosine, 0.0)[near]
    flat, lifted = (np.abs(render_scene(_ball(cutoff)).pixels[..., 0][near] - expected).mean() for cutoff in (0.0, 0.1))
    assert lifted < 0.6 * flat
    assert lifted < 0.02


def test_nothing_changes_for_an_even_environment():
    """Cycles does not sample it, so that its light starts from the triangles."""
    dark = {"lights": (), "world": World(color=gray(1.0))}
    pictures = [render_scene(replace(_ball(cosine), **dark)).pixels[..., :3] for cosine in (0.0, 0.1)]
    np.testing.assert_allclose(*pictures, atol=1e-6)


def test_mirrors_are_lit_there_too():
    def light(cosine):
        return render_scene(_ball(cosine, Glossy(gray(1.0), 0.6))).pixels[..., 0].mean()

    assert light(0.1) > 1.0008 * light(0.0)


def test_a_cosine_beyond_1_is_refused():
    with pytest.raises(InvalidInputError, match="terminator_cosine"):
        Instance("ball", "sphere", np.eye(4), terminator_cosine=1.5)


@pytest.mark.parametrize("shift", [0.0, 0.5])
def test_a_moved_terminator_changes_the_cosine(shift):
    """A sun 60° from the normal of a plane: the cosine is that of the angle times 1 / (1 - shift / 2)."""
    angle = np.pi / 3
    scene = _ball(0.0)
    turned = np.eye(4)
    turned[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    square = plane(2.0)
    scene = replace(
        scene,
        meshes=(square,),
        instances=(Instance("plane", square.name, np.eye(4), ("white",), terminator_shift=shift),),
        lights=(replace(scene.lights[0], world_from_light=turned),),
    )
    level = render_scene(scene).pixels[10:-10, 10:-10, 0]
    np.testing.assert_allclose(level, np.cos(angle / (1 - shift / 2)), rtol=1e-3)


def test_a_shift_beyond_the_range_is_refused():
    with pytest.raises(InvalidInputError, match="terminator_shift"):
        Instance("ball", "sphere", np.eye(4), terminator_shift=2.0)
