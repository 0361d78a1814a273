# SPDX-License-Identifier: GPL-3.0-or-later
"""Extreme sizes and strengths: correct, or reported in a note; never a NaN without a message."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import get_args

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render.still import render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Emission,
    Falloff,
    Film,
    Glass,
    Instance,
    Material,
    MixSurface,
    PointLight,
    Principled,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    World,
    gray,
    surface,
)
from tests.render.scenes import matrix, plane, sphere_mesh

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def scaled_scene(scale, surface, falloff=Falloff()):  # noqa: B008
    floor, ball = plane(10.0), sphere_mesh(16)
    floor, ball = (replace(mesh, positions=mesh.positions * np.float32(scale)) for mesh in (floor, ball))
    lamp = AreaLight(
        name="area", world_from_light=matrix((0, 0, 4 * scale)), power_w=100 * scale ** (2 - falloff.power),
        size=(scale, scale), falloff=falloff,
    )  # fmt: skip
    point = PointLight(
        name="ball", world_from_light=matrix((2 * scale, 0, 3 * scale)), power_w=50 * scale**2, radius=0.2 * scale
    )
    return Scene(
        camera=Camera(
            world_from_camera=matrix((0, 0, 5 * scale)),
            near=0.01 * scale,
            far=100 * scale,
            aperture_radius=0.05 * scale,
            focus_distance=max(3 * scale, 1e-9),
        ),
        film=Film(24, 24, samples=128),
        meshes=(floor, ball),
        materials=(Material("floor", Diffuse(gray(0.5))), Material("ball", surface)),
        instances=(
            Instance("floor", floor.name, np.eye(4), ("floor",)),
            Instance("ball", ball.name, matrix((0, 0, 1.2 * scale)), ("ball",)),
        ),
        lights=(lamp, point),
        world=World(gray(0.2)),
    )


def _mean(scene):
    return render_scene(scene).pixels[..., :3].mean()


@pytest.mark.parametrize("surface", [Diffuse(gray(0.7)), Glass(gray(1.0), 0.0, 1.5)], ids=["matt", "glass"])
def test_light_does_not_depend_on_the_size_of_the_scene(surface):
    expected = _mean(scaled_scene(1.0, surface))
    for scale in (1e-6, 1e-3, 1e3, 1e6):
        assert _mean(scaled_scene(scale, surface)) == pytest.approx(expected, rel=0.01), scale


def test_media_the_sun_and_spectral_transport_do_not_depend_on_the_size_of_the_scene():
    def scene(size):
        ball = Material("ball", None, ScatteringMedium(density=1.5 / size, color=gray(0.8), anisotropy=0.3))
        made = scaled_scene(size, Diffuse(gray(0.7)))
        sun = SunLight(name="sun", world_from_light=matrix((0, 0, 5 * size)), irradiance=1.0)
        return replace(
            made,
            lights=(*made.lights, sun),
            materials=(made.materials[0], ball),
            settings=RenderSettings(transport="spectral"),
        )

    expected = _mean(scene(1.0))
    for scale in (1e-6, 1e6):
        assert _mean(scene(scale)) == pytest.approx(expected, rel=0.01), scale


def test_falloff_with_distance_follows_the_units():
    pictures = [
        render_scene(scaled_scene(size, Diffuse(gray(0.7)), Falloff(1, 0.0))).pixels.mean() for size in (1, 1e-4)
    ]
    assert pictures[1] == pytest.approx(pictures[0], rel=0.01)


def test_one_distant_object_does_not_affect_the_others():
    scene = scaled_scene(1.0, Diffuse(gray(0.7)))
    expected = _mean(scene)
    for distance in (1e7, 1e30):
        far = Instance("far", scene.meshes[1].name, matrix((0, 0, -distance)), ("ball",))
        result = render_scene(replace(scene, instances=(*scene.instances, far)))
        assert result.pixels[..., :3].mean() == pytest.approx(expected, rel=0.01)
    assert any("32-bit numbers cannot" in note.message for note in result.notes)


def test_objects_too_small_for_single_precision_get_a_note():
    notes = render_scene(scaled_scene(1e-14, Diffuse(gray(0.7)))).notes
    assert any("32-bit numbers cannot" in note.message for note in notes)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("strength", [1e37, 1e38])
def test_light_that_overflows_is_counted_and_reported(transport, strength):
    scene = scaled_scene(1.0, Emission(gray(1.0), strength))
    film = replace(scene.film, samples=16)
    result = render_scene(replace(scene, film=film, settings=RenderSettings(transport=transport)))
    assert np.isfinite(result.pixels).all()
    lost = [note.message for note in result.notes if "were not finite numbers" in note.message]
    assert lost or result.pixels.max() > 1e30


def test_an_area_light_without_area_gets_a_note():
    scene = scaled_scene(1.0, Diffuse(gray(0.7)))
    tiny = replace(scene.lights[0], size=(1e-20, 1e-20))
    result = render_scene(replace(scene, lights=(tiny,)))
    assert any("without area" in note.message for note in result.notes) and np.isfinite(result.pixels).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_cameras_and_films_refuse_numbers_that_are_not_finite(bad):
    for make in (
        lambda: Camera(world_from_camera=np.eye(4), orthographic_scale=bad),
        lambda: Camera(world_from_camera=np.eye(4), shift=(bad, 0.0)),
        lambda: Camera(world_from_camera=np.eye(4), far=bad),
        lambda: Film(4, 4, exposure=bad),
        lambda: Film(4, 4, pixel_aspect=bad),
        lambda: Film(4, 4, filter_width=bad),
    ):
        with pytest.raises(InvalidInputError, match="expected a value from"):
            make()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, np.float32("nan")])
def test_every_number_of_every_closure_must_be_finite(bad):
    """All closures and the medium, found by their fields, so that a new one is included."""
    kinds = [*get_args(surface.Closure), MixSurface, ScatteringMedium]
    tried = 0
    for kind in kinds:
        numbers = {each.name for each in fields(kind) if isinstance(each.default, float) or each.name == "factor"}
        others = {"first": Diffuse(), "second": Diffuse()} if kind is MixSurface else {}
        for name in numbers:
            with pytest.raises(
                InvalidInputError, match=f"{kind.__name__} {name.replace('_', ' ')} is .*expected a value"
            ):
                kind(**others, **{name: bad})
            tried += 1
    assert tried > 25


@pytest.mark.parametrize(("name", "bad"), [("anisotropy", 5.0), ("density", -1.0)])
def test_a_medium_refuses_impossible_values(name, bad):
    with pytest.raises(InvalidInputError, match=f"ScatteringMedium {name} is {bad}; expected a value from"):
        ScatteringMedium(**{name: bad})


@pytest.mark.parametrize("index", [0.0, -1.5, 1e6])
def test_impossible_indices_of_refraction_are_refused(index):
    for make in (lambda: Glass(ior=index), lambda: Principled(ior=index), lambda: Principled(coat_ior=index)):
        with pytest.raises(InvalidInputError, match="ior is .*; expected a value from 0.001 to 1000"):
            make()
