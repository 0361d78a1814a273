# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights chosen by their possible contribution: normalized probabilities, and the light of Mitsuba's emitters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import job as job_module
from spectral_core.render import plan_effects
from spectral_core.render.job import RenderJob
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Falloff,
    Film,
    Glossy,
    ImageTexture,
    Instance,
    Material,
    PointLight,
    RenderSettings,
    Scene,
    SpotLight,
    SunLight,
    Translucent,
    World,
    gray,
)
from tests.render.scenes import matrix, plane, sphere_mesh

mi = pytest.importorskip("mitsuba")


def _picture(scene, samples=128, *, mitsubas=False):
    """The picture with the light tables, or with Mitsuba's emitters at equal probabilities."""
    with pytest.MonkeyPatch.context() as patch:
        if mitsubas:
            load = job_module.load_scene
            patch.setattr(job_module, "load_scene", lambda *a, **k: load(*a, **{**k, "own_lights": False}))
        job = RenderJob(scene, plan_effects(scene))
        job.trace(samples)
        return job.picture()[..., :3].astype(np.float64)


def _turned(translation, x=0.0, y=0.0, scale=(1.0, 1.0, 1.0)):
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    result = np.eye(4)
    result[:3, :3] = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    result[:3, :3] *= np.asarray(scale)
    result[:3, 3] = translation
    return result


STRIPES = ImageTexture("stripes", np.kron(np.eye(4), np.ones((2, 2)))[..., None].repeat(3, 2).astype(np.float32))

LAMPS = {
    "balls": (
        PointLight(name="a", world_from_light=matrix((1, 1, 1.5)), power_w=60, radius=0.3, soft_falloff=False),
        PointLight(name="b", world_from_light=matrix((-1.2, 0.3, 0.9)), power_w=20, radius=0.15),
        PointLight(name="c", world_from_light=matrix((0, -1.5, 2.5)), power_w=80, color=Color([1, 0.4, 0.1])),
    ),
    "spots": (
        SpotLight(name="a", world_from_light=_turned((1, 0, 2), 0.3, 0.2), power_w=200, radius=0.2, blend=0.3),
        SpotLight(name="b", world_from_light=matrix((-1, -1, 2)), power_w=90, cone_scale=(1.0, 2.0, 1.0), blend=0.5),
        SpotLight(name="c", world_from_light=_turned((-1, 1, 2), -0.4), power_w=90, blend=0.0, cone_angle_rad=0.5),
    ),
    "panels": (
        AreaLight(name="a", world_from_light=_turned((1, 0, 1.8), 0.2, 0.4), power_w=40, size=(1.2, 0.5)),
        AreaLight(name="b", world_from_light=_turned((-1, 0, 1.4), -0.5), power_w=30, shape="ellipse", size=(0.9, 0.6)),
        AreaLight(name="c", world_from_light=_turned((0, 1, 2), scale=(1, -1, 1)), power_w=30, spread_rad=1.0),
        AreaLight(name="d", world_from_light=matrix((0, -1, 1.7)), power_w=30, shape="ellipse", spread_rad=0.8),
        AreaLight(name="e", world_from_light=matrix((0, 0, 2.1)), power_w=5, falloff=Falloff(1, 0.2)),
    ),
    "suns": (
        SunLight(name="d", world_from_light=_turned((0, 0, 0), 0.5, 0.2), irradiance=1.0, angle_rad=0.4),
        SunLight(name="e", world_from_light=_turned((0, 0, 0), -0.9), irradiance=0.7, angle_rad=0.0),
    ),
}


GLOWS = {"even": Emission(Color([3.0, 2.0, 1.0]), 1.0), "striped": Emission(STRIPES, 4.0)}


def _scene(lights=(), world=None, glows=False, transport="rgb"):
    """A floor with a diffuse, a glossy and a thin ball; ``glows``: two balls above emit light, one of them an image."""
    places = (((-0.8, 0.6, 0.5), "matt"), ((0.9, 0.8, 0.5), "glossy"), ((0.7, -0.7, 0.5), "thin"))
    balls = tuple(Instance(n, "sphere", matrix(at, 0.5), (n,)) for at, n in places)
    ball = sphere_mesh(16)
    ball = replace(ball, uvs=ball.positions[:, :2] * 0.5 + 0.5)
    lit = tuple(
        Instance(name, "sphere", matrix(at, 0.3), (name,))
        for name, at in (("even", (0, 0, 1.2)), ("striped", (-0.9, -0.8, 0.8)))
    )
    return Scene(
        camera=Camera(world_from_camera=_turned((0, -2.4, 5.5), 0.4), field_of_view_rad=0.7, near=0.01),
        film=Film(16, 16, seed=3, filter_kind="box", filter_width=1.0),
        meshes=(plane(4.0), ball),
        materials=(
            Material("floor", Diffuse(Color([0.6, 0.5, 0.4]))),
            Material("matt", Diffuse(gray(0.5))),
            Material("glossy", Glossy(gray(0.8), 0.6)),
            Material("thin", Translucent(gray(0.6))),
            *(Material(name, glow) for name, glow in GLOWS.items()),
        ),
        instances=(Instance("floor", "plane", np.eye(4), ("floor",)), *balls, *(lit if glows else ())),
        lights=lights,
        world=world or World(),
        settings=RenderSettings(transport=transport, max_bounces=2),
    )


CASES = {
    "balls and suns": _scene(LAMPS["balls"] + LAMPS["suns"]),
    "panels": _scene(LAMPS["panels"]),
    "glow": _scene(LAMPS["balls"][2:], World(gray(0.1)), glows=True),
    "spots and world": _scene(LAMPS["spots"], World(ImageTexture("sky", STRIPES.pixels), 0.5)),
    "spectral": _scene(LAMPS["balls"] + LAMPS["panels"][3:], World(Color([0.1, 0.2, 0.3])), transport="spectral"),
}


@pytest.mark.parametrize("name", CASES)
def test_the_light_equals_that_of_mitsubas_emitters(name):
    """Two samplers that share only the closures agree in each block within their noise."""
    ours, theirs = _picture(CASES[name], 640), _picture(CASES[name], 2560, mitsubas=True)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
    blocks = [p.reshape(2, 8, 2, 8, 3).mean(axis=(1, 3, 4)) for p in (ours, theirs)]
    # a block without direct light is dim and noisy, so its error counts relative to the picture
    np.testing.assert_allclose(*blocks, rtol=0.03, atol=0.01 * theirs.mean())


def _drawn_and_told(count, seed, far=True):
    """Draw items with stratified numbers at random receivers; returns their frequency and the stated probability."""
    import drjit as dr

    from spectral_core.render.lights.choice import Choice, Receiver
    from spectral_core.render.lights.hierarchy import FAR_SUN, Rows, build
    from spectral_core.render.variant import activate, choose_backend

    kit = activate(choose_backend("rgb"))
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    near = Rows(
        rng.normal(size=(count, 3)) * 5, rng.uniform(0, 0.5, count), 10 ** rng.uniform(-3, 3, count), axes,
        np.zeros(count), np.full(count, 0.01), rng.random(count) < 0.5,
    )  # fmt: skip
    suns = 2 if far else 0
    beyond = Rows(
        axes[:suns], np.full(suns, FAR_SUN), np.full(suns, 3.0), np.zeros((suns, 3)), np.ones(suns), np.zeros(suns),
        np.zeros(suns, bool),
    )  # fmt: skip
    choice = Choice(kit, build(near, beyond))
    told = np.zeros(count + suns)
    to = lambda width: Receiver(kit.Point3f(0.3, 0.1, -0.2), kit.Normal3f(0, 0.6, 0.8), kit.Bool(False))  # noqa: E731
    items = dr.arange(kit.UInt32, count + suns)
    told[:] = np.array(choice.probability(items, to(1), kit.Bool(True)))
    draws = 1 << 18
    sample = (dr.arange(kit.Float, draws) + 0.5) / draws
    item, probability, _ = choice.draw(to(1), sample, kit.Bool(True))
    return np.bincount(np.array(item), minlength=count + suns) / draws, told, np.array(item), np.array(probability)


@pytest.mark.parametrize(("count", "far"), [(3, True), (128, True), (129, False), (1500, True), (40_000, True)])
def test_the_stated_probability_is_the_frequency_of_an_item(count, far):
    frequency, told, item, probability = _drawn_and_told(count, count, far)
    assert told.sum() == pytest.approx(1, abs=2e-3)
    np.testing.assert_allclose(probability, told[item], rtol=2e-3)
    # evenly spaced numbers give each share to within one draw, except for rounding in 32-bit sums of weights
    np.testing.assert_allclose(frequency, told, atol=2e-4, rtol=0.02)


def test_a_uniform_world_beside_a_sun_is_not_sampled_as_a_light():
    """The picture equals one with world sampling and has a tenth of the noise, because every ray can hit the world."""
    from dataclasses import replace

    from benchmarks.render.cases.meshes import at, box, square
    from spectral_core.render.job import RenderJob
    from spectral_core.render.plan.effects import plan_effects
    from spectral_core.scene import (
        Camera,
        Color,
        Diffuse,
        Film,
        Instance,
        Material,
        RenderSettings,
        Scene,
        SunLight,
        World,
        gray,
    )

    scene = Scene(
        camera=Camera(world_from_camera=at(0, -9, 3.5, turn=("x", 72)), field_of_view_rad=0.8),
        film=Film(32, 18, 16),
        meshes=(square(), box()),
        materials=(Material("gray", Diffuse(gray(0.6))),),
        instances=(
            Instance("floor", "square", at(scale=30.0), ("gray",)),
            *(Instance(f"block {k}", "box", at(1.5 * k - 3, 0, 0.4, 0.5), ("gray",)) for k in range(5)),
        ),
        lights=(SunLight(name="sun", world_from_light=at(turn=("x", 40)), irradiance=3.0, angle_rad=0.01),),
        world=World(Color([0.3, 0.45, 0.8])),
        settings=RenderSettings("rgb"),
    )

    def traced(samples, seed, even):
        film = replace(scene.film, samples=samples, seed=seed)
        job = RenderJob(replace(scene, film=film), plan_effects(scene, pilot=False))
        lights = job._loaded.parts.context.lights
        assert lights.world_is_constant
        if not even:  # sample the world by its irradiance, for comparison
            lights.world_is_constant = False
            from spectral_core.render.mitsuba_scene.assemble import _scene_lights

            job._integrators[""].lights = _scene_lights(
                job._loaded.parts.context, lights, job._loaded.scene, job._loaded.rules
            )
        job.trace(samples)
        return job.picture()[..., :3].astype(float)

    limit, asked = traced(2048, 1, True), traced(2048, 1, False)
    assert abs(limit.mean() / asked.mean() - 1) < 2e-3
    errors = [((traced(16, 2, even) - limit) ** 2).mean() for even in (True, False)]
    assert errors[0] < 0.3 * errors[1]


def test_runs_are_halved_together_as_they_are_one_by_one():
    from spectral_core.render.lights import hierarchy

    def one_by_one(centers, branches, levels):
        order = np.arange(len(centers))

        def divide(low, high, unit):
            while unit > 1 and high - low <= unit:
                unit //= branches
            if high - low <= unit or high - low < 3:
                return
            part = order[low:high]
            longest = int(np.argmax(np.ptp(centers[part], axis=0)))
            order[low:high] = part[np.argsort(centers[part, longest], kind="stable")]
            middle = low + unit * max(1, -(-(high - low) // unit) // 2)
            divide(low, middle, unit)
            divide(middle, high, unit)

        divide(0, len(centers), branches ** (levels - 1))
        return order

    rng = np.random.default_rng(5)
    for count, branches, levels in ((5, 2, 3), (300, 18, 2), (777, 10, 3), (4000, 16, 3)):
        centers = rng.normal(size=(count, 3))
        centers[::3] = centers[::3].round(1)  # equal coordinates keep their order
        np.testing.assert_array_equal(
            hierarchy._order(centers, branches, levels), one_by_one(centers, branches, levels)
        )
