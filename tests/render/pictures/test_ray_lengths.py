# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray Length counts from the last bounce, as in Cycles: surfaces that rays pass straight change nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spectral_core.render import plan_effects
from spectral_core.render.job import RenderJob
from spectral_core.scene import (
    AreaLight,
    Computed,
    Diffuse,
    Emission,
    Film,
    Glossy,
    Instance,
    Material,
    MixSurface,
    PointLight,
    RayPortal,
    Rays,
    RenderSettings,
    Transparent,
    World,
    gray,
)
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, looking_down, matrix, plane
from tests.render.surfaces.test_lamp_patterns import PATHS, picture, ray_length

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")
CLEAR = Transparent(gray(1.0))
BLACK = Diffuse(gray(0.0))
HEIGHT = 2.0
LOW, HIGH = (0.125, 0.25), (0.75, 1.0, 1.5)
"""Heights of clear planes below and above a camera that is 0.5 above the table."""


def share_of_length(factor: float) -> Computed:
    builder = Builder()
    length = builder.add("number_input", (), "ray:Ray Length", 0)
    share = builder.add("math", (length, builder.number(factor), builder.number(0.0)), "MULTIPLY")
    return Computed(builder.program(share))


GLOW = Emission(ray_length(), 1.0)


def with_planes(scene, *planes):
    """The scene with further planes: pairs of a surface and its height, or triples with the rays that do not see it."""
    made = [(surface, height, hidden[0] if hidden else Rays(0)) for surface, height, *hidden in planes]
    return replace(
        scene,
        meshes=(*scene.meshes, plane(half=2.0, name="small")),
        materials=(*scene.materials, *(Material(f"m{k}", surface) for k, (surface, _, _) in enumerate(made))),
        instances=(
            *scene.instances,
            *(
                Instance(f"i{k}", "small", matrix((0, 0, height)), (f"m{k}",), hidden_from=hidden)
                for k, (_, height, hidden) in enumerate(made)
            ),
        ),
    )


def table(*lights, surface=None, camera=0.5, **rest):
    view = replace(looking_down(camera), near=1e-4)  # rays begin there, as in Cycles
    return lit_plane(*lights, surface=surface, camera=view, world=World(gray(0.0)), **rest)


def mean(scene, monkeypatch, mitsubas=False, samples=256):
    return picture(scene, monkeypatch, mitsubas, samples).mean()


def clear_at(*heights):
    return [(CLEAR, height) for height in heights]


UNSEEN = clear_at(-1.0)
"""A clear plane below the table, which changes no picture: scenes with and without clear planes share their kernels."""


@PATHS
@pytest.mark.parametrize("between", [(), (0.5,), (0.25, 0.5, 1.0, 1.5)], ids=len)
def test_rays_of_the_camera(monkeypatch, mitsubas, between):
    scene = with_planes(table(surface=GLOW, camera=HEIGHT), *UNSEEN, *clear_at(*between))
    assert mean(scene, monkeypatch, mitsubas, 16) == pytest.approx(HEIGHT, rel=1e-3)


def test_objects_that_the_camera_does_not_see(monkeypatch):
    scene = with_planes(table(surface=GLOW, camera=HEIGHT), (BLACK, 1.0, Rays.CAMERA))
    assert mean(scene, monkeypatch, False, 16) == pytest.approx(HEIGHT, rel=1e-3)


@PATHS
@pytest.mark.parametrize("kind", ["ceiling", "panel", "ball"])
def test_scattered_rays_and_rays_to_lights(monkeypatch, mitsubas, kind):
    """Light of an emissive ceiling and of lamps, whose rays are sampled and hit, through clear planes."""
    own = {"name": "lamp", "world_from_light": matrix((0, 0, HEIGHT)), "power_w": 100, "pattern": ray_length()}
    lamps = {"panel": AreaLight(**own, size=(2, 2)), "ball": PointLight(**own, radius=0.5, soft_falloff=False)}
    scene = table(*([lamps[kind]] if kind in lamps else []), film=Film(8, 8, samples=256))
    ceiling = [(GLOW, HEIGHT)] if kind == "ceiling" else []
    expected = mean(with_planes(scene, *ceiling, *UNSEEN), monkeypatch, mitsubas)
    found = mean(with_planes(scene, *ceiling, *clear_at(*LOW, *HIGH)), monkeypatch, mitsubas)
    assert expected > 0.1 and found == pytest.approx(expected, rel=0.02)


@PATHS
def test_shadow_rays(monkeypatch, mitsubas):
    """A veil whose opacity is a quarter of the length of the ray, 1 above the table that a lamp far above lights."""
    veil = MixSurface(share_of_length(0.25), CLEAR, BLACK)
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 400)), power_w=1e6)
    plain = mean(with_planes(table(lamp), (veil, -1.0), *UNSEEN), monkeypatch, mitsubas)
    for between in ((), (*LOW, 0.75)):
        found = mean(with_planes(table(lamp), (veil, 1.0), *UNSEEN, *clear_at(*between)), monkeypatch, mitsubas)
        assert found / plain == pytest.approx(0.75, rel=1e-3)


@pytest.mark.parametrize("mixes", [False, True])
def test_colors_where_light_is_sampled(monkeypatch, mixes):
    """Reflectance by the length of the ray from the camera, of one closure and of several."""
    color = Diffuse(share_of_length(0.25))
    surface = MixSurface(0.5, color, Glossy(gray(0.0), 0.5)) if mixes else color
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 400)), power_w=1e6)
    scene = table(lamp, surface=surface, camera=HEIGHT)
    expected, found = (mean(with_planes(scene, *clear_at(*z)), monkeypatch) for z in ((-1.0,), (0.5, 1.0)))
    assert found == pytest.approx(expected, rel=1e-3)


def test_a_portal_begins_anew(monkeypatch):
    builder = Builder()
    exit_, up = (Computed(builder.program(builder.number(v))) for v in ((0.0, 0.0, 300.0), (0.0, 0.0, 1.0)))
    scene = with_planes(table(surface=RayPortal(gray(1.0), exit_, up)), (GLOW, 303.0), *clear_at(0.25, 301.0))
    assert mean(scene, monkeypatch) == pytest.approx(3.0, rel=1e-3)


def test_scenes_without_the_length_do_not_count_it():
    film, settings = Film(4, 4, samples=1), RenderSettings(transport="rgb")
    counts = []
    for surface in (GLOW, Emission(gray(1.0), 1.0)):
        scene = table(surface=surface, film=film, settings=settings)
        counts.append(RenderJob(scene, plan_effects(scene)).loaded.scene.parts.context.tables.reads_lengths)
    assert counts == [True, False]
