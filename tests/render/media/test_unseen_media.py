# SPDX-License-Identifier: GPL-3.0-or-later
"""Media of objects that types of rays do not see, in closed form; each case has the result of Cycles 5.0."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Diffuse,
    Emission,
    Film,
    Glossy,
    Instance,
    LightPaths,
    Material,
    Rays,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    World,
    gray,
)
from tests.render.media.test_medium import box
from tests.render.scenes import matrix, plane

KINDS = (Rays.NONE, Rays.CAMERA, Rays.DIFFUSE, Rays.GLOSSY, Rays.TRANSMISSION, Rays.VOLUME, Rays.SHADOW)
ABSORBS = ScatteringMedium(density=1.0, color=gray(0.0))
SUN = SunLight(name="sun", world_from_light=matrix((0, 0, 5)), irradiance=np.pi, angle_rad=0.0)


def seen(hidden, *around, medium=ABSORBS, eye=4.0, fog=None, samples=64, **rest):
    """Mean of a picture from above of a cube of fog, two units wide, that rays of a type do not see."""
    scene = Scene(
        camera=Camera(world_from_camera=matrix((0, 0, eye)), field_of_view_rad=0.02, near=1e-4),
        film=Film(8, 8, samples=samples),
        meshes=(box(), plane(20.0, "plane")),
        materials=(
            Material("fog", None, medium),
            Material("white", Diffuse(gray(1.0))),
            Material("mirror", Glossy(gray(1.0), roughness=0.0)),
            Material("lamp", Emission(gray(1.0), 1.0)),
        ),
        instances=(
            Instance("fog", "box", matrix(scale=2.0) if fog is None else fog, ("fog",), hidden_from=hidden),
            *around,
        ),
        **{"world": World(gray(0.0)), "settings": RenderSettings(max_bounces=8), **rest},
    )
    return float(render_scene(scene).pixels[..., :3].mean())


@functools.cache
def through_fog_seen_by_all():
    """Light of an even world on a white plane in the fog."""
    return seen(Rays.NONE, lit("white", 0.0), world=World(gray(1.0)), samples=1024)


@functools.cache
def past_unseen_fog():
    """A wall in a mirror, past fog beside it that no ray sees."""
    wall = replace(lit("lamp", 0.0, np.pi / 2), world_from_object=_wall(6.0))
    return seen(Rays.ALL, lit("mirror", 0.0, np.pi / 4), wall, fog=matrix((3.0, 0, 0), 2.0))


def lit(material, height, tilt=0.0):
    """A plane at a height, turned about the y axis."""
    place = matrix((0, 0, height))
    place[:3, :3] = [[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]]
    return Instance(material, "plane", place, (material,))


@pytest.mark.parametrize("hidden", KINDS)
@pytest.mark.parametrize("eye", [4.0, 0.0])
def test_rays_of_the_camera(hidden, eye):
    expected = 1.0 if hidden is Rays.CAMERA else np.exp(-2.0 if eye else -1.0)
    assert seen(hidden, lit("lamp", -3.0), eye=eye) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("hidden", KINDS)
def test_shadow_rays_and_camera_rays_to_a_surface_in_the_fog(hidden):
    """A ray that has not entered the fog is not in it, although the surface that it meets is."""
    factor = {Rays.CAMERA: 1.0, Rays.SHADOW: np.exp(-1.0)}.get(hidden, np.exp(-2.0))
    assert seen(hidden, lit("white", 0.0), lights=(SUN,)) == pytest.approx(factor, rel=2e-3)


@pytest.mark.parametrize("hidden", KINDS)
def test_an_even_world_is_met_by_scattered_rays_alone(hidden):
    """Light of an even world is sampled here; what the rays of that sampling see has no effect on the mean."""
    found = seen(hidden, lit("white", 0.0), world=World(gray(1.0)), samples=1024)
    factor = {Rays.CAMERA: 1.0, Rays.DIFFUSE: np.exp(-1.0)}.get(hidden)
    if factor is None:
        factor = through_fog_seen_by_all()
    assert found == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize("hidden", [Rays.NONE, Rays.DIFFUSE, Rays.GLOSSY, Rays.SHADOW])
def test_an_even_world_behind_a_screen(hidden):
    screen = replace(lit("mirror", 1.0), name="screen", world_from_object=matrix((0, 0, 0.9), 0.1), hidden_from=hidden)
    above = seen(Rays.ALL, lit("white", 0.0), screen, world=World(gray(1.0)), eye=0.5, samples=1024)
    assert (above > 0.99) == (hidden is Rays.DIFFUSE)


@pytest.mark.parametrize("hidden", KINDS)
def test_reflected_rays(hidden):
    """A mirror at 45° leads the view through the fog beside it to a wall."""
    wall = replace(lit("lamp", 0.0, np.pi / 2), world_from_object=_wall(6.0))
    aside = matrix((3.0, 0, 0), 2.0)
    expected = 1.0 if hidden is Rays.GLOSSY else np.exp(-2.0)
    found = seen(hidden, lit("mirror", 0.0, np.pi / 4), wall, fog=aside)
    assert found / past_unseen_fog() == pytest.approx(expected, rel=3e-3)


def _wall(x):
    place = matrix((x, 0, 0))
    place[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    return place


def test_fog_that_scattered_rays_do_not_see_scatters_once():
    fog = ScatteringMedium(density=0.7, color=gray(1.0))
    once = LightPaths(volume=0)
    rest = {"lights": (SUN,), "samples": 2048, "medium": fog}
    single = seen(Rays.NONE, settings=RenderSettings(max_bounces=8, light_paths=once), **rest)
    assert seen(Rays.VOLUME, **rest) == pytest.approx(single, rel=0.01)
    assert seen(Rays.NONE, **rest) > 1.1 * single
