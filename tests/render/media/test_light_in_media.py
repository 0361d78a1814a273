# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights sampled along segments in media: compared with the integral and with scattering points alone; noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import plan_effects, render_scene
from spectral_core.render.job import RenderJob
from spectral_core.render.trace.media import in_media
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    ImageTexture,
    Instance,
    LightPaths,
    Material,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SpotLight,
    SunLight,
    World,
    gray,
)
from tests.render.media.test_medium import box
from tests.render.scenes import matrix, plane, sphere_mesh

pytest.importorskip("mitsuba")

DENSITY, ALBEDO = 0.6, 0.7
LAMPS = (
    PointLight(name="near", world_from_light=matrix((0.3, 0.1, 0.2)), power_w=20.0),
    PointLight(name="far", world_from_light=matrix((-0.9, 0.6, -0.3)), power_w=200.0),
)


def _column(*, floor: bool, transport: str = "rgb") -> Scene:
    """A narrow downward view through fog between -1 and 1, or to a black floor at -0.5; single scattering."""
    black = (Instance("floor", "plane", matrix((0, 0, -0.5)), ("black",)),) if floor else ()
    medium = ScatteringMedium(density=DENSITY, color=gray(ALBEDO))
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 4.0)), field_of_view_rad=5e-4, near=0.01),
        film=Film(16, 16, samples=256),
        meshes=(box(), plane(3.0)),
        materials=(Material("fog", None, medium), Material("black", Diffuse(gray(0.0)))),
        instances=(Instance("cube", "box", np.diag([4.0, 4.0, 2.0, 1.0]), ("fog",)), *black),
        lights=LAMPS,
        settings=RenderSettings(transport=transport, max_bounces=0, light_paths=LightPaths(volume=0)),
    )


def _once_scattered(*, floor: bool, lamps: tuple[PointLight, ...] = LAMPS) -> float:
    """The same by the trapezoidal rule: fog, inverse square law and an isotropic phase function."""
    z = np.linspace(-0.5 if floor else -1.0, 1.0, 100_001)
    total = np.zeros_like(z)
    for lamp in lamps:
        away = np.linalg.norm(np.stack([0 * z, 0 * z, z], axis=1) - lamp.world_from_light[:3, 3], axis=1)
        irradiance = lamp.power_w / (4 * np.pi) / away**2
        total += ALBEDO * DENSITY / (4 * np.pi) * irradiance * np.exp(-DENSITY * (1 - z + away))
    return float(np.sum((total[1:] + total[:-1]) / 2 * np.diff(z)))


@pytest.mark.parametrize(("floor", "transport"), [(False, "rgb"), (True, "rgb"), (True, "spectral")])
def test_single_scattering_is_the_integral_along_the_ray(floor, transport):
    pixels = render_scene(_column(floor=floor, transport=transport)).pixels[..., :3]
    assert pixels.mean() == pytest.approx(_once_scattered(floor=floor), rel=0.008)


def _foggy(lamps, world=None, glow=None) -> Scene:
    """A ball on a floor in fog."""
    medium = ScatteringMedium(density=0.5, color=Color([0.9, 0.7, 0.5]), anisotropy=0.3)
    lit = () if glow is None else (Instance("lit", "sphere", matrix((0.4, 0, 1.2), 0.25), ("lit",)),)
    tilted = np.eye(4)
    tilted[1:3, 1:3] = [[np.cos(1.2), -np.sin(1.2)], [np.sin(1.2), np.cos(1.2)]]
    tilted[:3, 3] = 0, -5, 2.5
    return Scene(
        camera=Camera(world_from_camera=tilted, field_of_view_rad=0.7, near=0.01),
        film=Film(16, 16, seed=3, filter_kind="box", filter_width=1.0),
        meshes=(box(), plane(4.0), sphere_mesh(8)),
        materials=(
            Material("fog", None, medium),
            Material("gray", Diffuse(gray(0.5))),
            *(() if glow is None else (Material("lit", glow),)),
        ),
        instances=(
            Instance("cube", "box", np.diag([6.0, 6.0, 6.0, 1.0]), ("fog",)),
            Instance("floor", "plane", np.eye(4), ("gray",)),
            Instance("ball", "sphere", matrix((-0.6, 0.3, 0.5), 0.5), ("gray",)),
            *lit,
        ),
        lights=lamps,
        world=world or World(),
        settings=RenderSettings(transport="rgb", max_bounces=3),
    )


def _spot(place, angle):
    turned = np.eye(4)
    turned[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turned[:3, 3] = place
    return turned


SKY = ImageTexture("sky", np.kron(np.eye(4), np.ones((2, 2)))[..., None].repeat(3, 2).astype(np.float32))
BALLS = (
    PointLight(name="a", world_from_light=matrix((0.8, -0.5, 1.2)), power_w=60, radius=0.2, soft_falloff=False),
    PointLight(name="b", world_from_light=matrix((-1, 1, 2)), power_w=90),
)
CASES = {
    "beams": _foggy((
        SpotLight(name="a", world_from_light=_spot((0.3, 1.5, 2.5), -0.7), power_w=200, radius=0.1, blend=0.2),
        AreaLight(name="b", world_from_light=matrix((-0.8, 0, 2.2)), power_w=40, size=(0.8, 0.5)),
        AreaLight(name="c", world_from_light=matrix((1, 0.3, 2)), power_w=30, spread_rad=0.8),
    )),
    "balls and afar": _foggy(
        (SunLight(name="sun", world_from_light=_spot((0, 0, 0), 0.6), irradiance=2.0, angle_rad=0.1), *BALLS),
        World(SKY, 0.3),
    ),
    "glow": _foggy((), glow=Emission(Color([3.0, 2.0, 1.0]), 2.0)),
}  # fmt: skip


def _traced(scene, samples, *, along=True):
    """The picture; if ``along`` is False, lights are sampled from scattering points alone."""
    with pytest.MonkeyPatch.context() as patch:
        if not along:
            patch.setattr(in_media, "BY_ANGLE", 0.0)
            patch.setattr(in_media, "asks_light", lambda flight, ends, lights: flight.scatters)
        job = RenderJob(scene, plan_effects(scene, pilot=False))
        job.trace(samples)
        return job.picture()[..., :3].astype(np.float64)


@pytest.mark.parametrize("name", CASES)
def test_the_mean_equals_that_of_scattering_points(name):
    """Every block agrees within the noise, which is that of scattering points near the lamps, and within them."""
    ours, plain = _traced(CASES[name], 1536), _traced(CASES[name], 1536, along=False)
    assert ours.mean() == pytest.approx(plain.mean(), rel=0.02)
    blocks = [p.reshape(2, 8, 2, 8, 3).mean(axis=(1, 3, 4)) for p in (ours, plain)]
    np.testing.assert_allclose(*blocks, rtol=0.03, atol=0.01 * plain.mean())


def test_sampling_along_segments_has_less_noise():
    """The squared error is at most a half; the fog within a lamp is lit, too, and equally noisy in both."""
    scene = _foggy(BALLS)
    limit = _traced(scene, 2048)
    seeds = [replace(scene, film=replace(scene.film, seed=seed)) for seed in (11, 12, 13, 14)]
    along, plain = (
        float(np.mean([np.square(_traced(each, 16, along=of) - limit) for each in seeds])) for of in (True, False)
    )
    assert along < plain / 2


def test_points_on_a_segment_are_drawn_with_their_density():
    import drjit as dr

    from spectral_core.render.lights.stretch import Stretch
    from spectral_core.render.variant import activate, choose_backend

    kit = activate(choose_backend("rgb"))
    count = 1 << 16
    even = (dr.arange(kit.Float, count) + 0.5) / count
    for center, length in (((0.3, 0, 1), 3.0), ((0.01, 0, -50), 2.0), ((40, 0, 1), 1e12), ((0, 0, 0.5), 0.7)):
        way = Stretch(kit.Point3f(0, 0, 0), kit.Vector3f(0, 0, 1), kit.Float(length))
        view = way.seen_from(kit.Point3f(*center), kit.Float(0.1))
        drawn = np.sort(np.array(view.draw(even)).astype(np.float64))
        assert drawn[0] >= 0 and drawn[-1] <= length
        # neighbors enclose equal shares of the numbers: the density is the share divided by the distance
        middle, told = (drawn[1:] + drawn[:-1]) / 2, 1 / (count * np.maximum(np.diff(drawn), 1e-12))
        wide = np.diff(drawn) > 2e-6 * max(1.0, float(middle[len(middle) // 2]))
        density = np.array(view.density(kit.Float(middle[wide])))
        assert np.median(np.abs(density / told[wide] - 1)) < 0.05
        assert np.array(view.fluence)[0] > 0


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_lamp_in_a_medium_is_attenuated_up_to_itself_alone(transport):
    """Not up to the surface behind it: the lamp hangs in the middle of a deep, absorbing box."""
    radius, density, power = 0.3, 0.8, 50.0
    lamp = PointLight(name="lamp", world_from_light=matrix(), power_w=power, radius=radius, soft_falloff=False,
                      camera_visible=True)  # fmt: skip
    scene = Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 4.0)), field_of_view_rad=1e-3, near=0.01),
        film=Film(8, 8, samples=16),
        meshes=(box(),),
        materials=(Material("fog", None, ScatteringMedium(density=density, color=gray(0.0))),),
        instances=(Instance("cube", "box", np.diag([4.0, 4.0, 4.0, 1.0]), ("fog",)),),
        lights=(lamp,),
        settings=RenderSettings(transport=transport, max_bounces=2),
    )
    emitted = power / (4 * np.pi) / (np.pi * radius**2)
    half = 2.0  # the box reaches from -2 to 2
    expected = emitted * np.exp(-density * (half - radius))
    np.testing.assert_allclose(render_scene(scene).pixels[..., :3].mean((0, 1)), expected, rtol=0.01)
