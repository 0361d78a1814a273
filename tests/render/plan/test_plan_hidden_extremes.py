# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan bounds what a scene shows at its extremes: late bounces, mirrored distance, small colors, hidden lamps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spectral_core.render import plan_effects, plan_from_data
from spectral_core.render.plan.bounds import error_of_medium, error_of_share, optical_depth
from spectral_core.render.plan.light.sources import radiances
from spectral_core.render.plan.pilot import CHANNELS, LEVELS, PILOT_BOUNCES, ROWS, TOTAL, Pilot
from spectral_core.render.plan.simulated import simulated_scene
from spectral_core.scene import (
    Camera,
    Color,
    Computed,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    ImageTexture,
    Instance,
    Material,
    PointLight,
    Principled,
    RenderSettings,
    ScatteringMedium,
    SpectralImage,
    World,
    gray,
)
from spectral_core.scene.geometry import unit_box
from spectral_core.scene.paint import MOST_TEXELS, some_texels
from spectral_core.spectra import catalogue
from tests.render.scenes import lit_plane, looking_down, matrix, plane, sphere_mesh
from tests.render.surfaces.test_lamp_patterns import tinted

LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)
RED = np.full((4, 4, 3), (255, 10, 10), np.uint8)


@pytest.mark.parametrize("surface", [Principled(), Glass(), Glossy()])
def test_light_whose_loss_is_not_known_is_followed_as_far_as_the_scene_says(surface: Any) -> None:
    """A closed room of Principled had 12 bounces of 256, and lost 27 % of its light."""

    def followed(limit: int | None) -> int:
        settings = RenderSettings(scene_bounces=limit)
        return plan_from_data(lit_plane(LAMP, surface=surface, settings=settings)).bounces

    assert [followed(limit) for limit in (3, 12, 256, 1 << 20, None)] == [3, 12, 256, 1024, 64]


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.8, 0.9, 0.97])
def test_the_stated_error_of_diffuse_bounces_is_of_all_light(reflectance: float) -> None:
    """Limits of 64 in a room of 90 % lost 3 %, and of 256 in one of 97 % lost 27 %, stated as ΔE 0."""
    settings = RenderSettings(tolerance_delta_e=0.25)
    plan = plan_from_data(lit_plane(LAMP, surface=Diffuse(gray(reflectance)), settings=settings))
    lost = reflectance ** (plan.bounces + 1) / (1 - reflectance) / 2  # in half of the ways, as in an ordinary room
    assert lost / 0.025 <= plan["bounces"].accepted + 1e-9 <= 0.25


def test_an_even_white_image_reflects_what_it_says() -> None:
    white = Diffuse(ImageTexture("white", np.full((8, 8, 3), 252, np.uint8)))
    assert (
        plan_from_data(lit_plane(LAMP, surface=white)).bounces
        > plan_from_data(lit_plane(LAMP, surface=Diffuse(gray(0.9)))).bounces
    )


def test_more_bounces_by_the_artist_have_no_limit_by_type() -> None:
    """A limit of 64 by type stood for none, and ended the 256 bounces that were asked for."""
    settings = RenderSettings(scene_bounces=256, overrides=(("bounces", "256"),))
    scene = lit_plane(LAMP, surface=Diffuse(gray(0.97)), settings=settings)
    assert simulated_scene(scene, plan_from_data(scene)).settings.light_paths == scene.settings.light_paths
    fewer = replace(settings, overrides=(*settings.overrides, ("diffuse_bounces", "100")))
    scene = replace(scene, settings=fewer)
    assert simulated_scene(scene, plan_from_data(scene)).settings.light_paths.diffuse == 100


def test_light_beyond_the_pilot_follows_from_its_last_bounces() -> None:
    for kept in (0.5, 0.9, 0.97):
        bins = np.zeros((1, 1, 1, ROWS, CHANNELS))
        bins[..., : LEVELS - 1, :3] = kept ** np.arange(LEVELS - 1)[:, None]
        bins[..., LEVELS - 1, :3] = np.sum(kept ** np.arange(LEVELS - 1, PILOT_BOUNCES + 1))
        bins[..., TOTAL, :3] = bins[..., :LEVELS, :3].sum(axis=-2)
        found = Pilot(bins, 192, np.zeros((0, 3))).after_last_bounce("bounces")[..., :3]
        assert found == pytest.approx(kept ** (PILOT_BOUNCES + 1) / (1 - kept), rel=1e-6)
    assert not Pilot(0 * bins, 192, np.zeros((0, 3))).after_last_bounce("bounces").any()


def test_what_a_mirror_in_focus_shows_is_out_of_focus() -> None:
    camera = Camera(
        world_from_camera=matrix((0, 0, 2)), field_of_view_rad=0.8, aperture_radius=0.05, focus_distance=2.0
    )

    def lens(surface: Any) -> Any:
        return plan_from_data(lit_plane(LAMP, surface=surface, camera=camera, film=Film(64, 48)))["depth_of_field"]

    assert not lens(Diffuse(gray(0.5))).is_on and not lens(Glossy(roughness=0.5)).is_on
    assert lens(Glossy(roughness=0.0)).is_on and lens(Glass()).is_on


def transport(surface: Any, *lights: Any, **rest: Any) -> Any:
    return plan_from_data(lit_plane(*lights, surface=surface, settings=RenderSettings(), **rest))["transport"]


def test_a_small_letter_of_an_image_counts() -> None:
    """A red letter on a gray page under sodium light was red, with an error stated as 0."""
    sodium = replace(LAMP, color=catalogue.illuminant("HP1"))
    page = np.full((200, 210, 3), 200, np.uint8)
    assert transport(Diffuse(ImageTexture("page", page)), sodium).value == "rgb"
    page[90:110, 95:120] = 200, 20, 20
    lettered = transport(Diffuse(ImageTexture("page", page)), sodium)
    even = transport(Diffuse(ImageTexture("letter", page[90:110, 95:120])), sodium)
    assert lettered.value == "spectral" and lettered.error == pytest.approx(even.error)

    paint = catalogue.reflectance("red")
    weights = np.zeros((2, 200, 210), np.float16)
    weights[0] = 1.0
    weights[:, 90:110, 95:120] = [[[0.0]], [[1.0]]]
    spectra = np.stack([np.full(paint.values.shape, 0.1), 0.9 * paint.values])

    def image(part: np.ndarray) -> Any:
        return transport(Diffuse(SpectralImage("page", part, spectra, paint.grid)), LAMP).error

    assert image(weights) == image(weights[:, 90:110, 95:120]) > 1 > image(weights[:, :50])


def test_colored_light_of_an_image_or_a_program_counts() -> None:
    paint = Diffuse(catalogue.reflectance("dark skin"))
    red = ImageTexture("red", RED)
    even = transport(paint, world=World(Color([1.0, 0.003, 0.003]))).error
    assert even > 10 > transport(paint, world=World(gray(1.0))).error
    assert transport(paint, world=World(red)).error == pytest.approx(even, rel=0.02)
    assert transport(paint, world=World(tinted(1.0, 0.0, 0.0))).error > 5

    scene = lit_plane(surface=paint, settings=RenderSettings())
    neon = Material("neon", Emission(red, 5.0))
    scene = replace(scene, meshes=(*scene.meshes, plane(1.0, "sign")), materials=(*scene.materials, neon),
                    instances=(*scene.instances, Instance("sign", "sign", matrix((0, 3, 1)), ("neon",))))  # fmt: skip
    assert plan_from_data(scene)["transport"].error > 10


@pytest.mark.parametrize("shape", [(3, 5), (512, 512), (600, 333), (1, 200_000), (200_000, 1), (256, 4096)])
def test_texels_are_drawn_from_every_column_and_row(shape: tuple[int, int]) -> None:
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    drawn = some_texels(places)
    assert len(drawn) <= MOST_TEXELS and len(drawn) >= min(MOST_TEXELS // 4, shape[0] * shape[1])
    for axis in (0, 1):
        assert len(np.unique(drawn[:, axis])) == min(shape[axis], len(drawn))


def test_a_lamp_that_is_off_does_not_hide_the_error_of_fog() -> None:
    """0 W times the unbounded pattern of its nodes was not a number, and the fog under another lamp was omitted."""
    fog = Material("fog", None, ScatteringMedium(density=0.1, color=gray(1.0)))

    def stated(*lamps: PointLight) -> float:
        scene = lit_plane(*lamps)
        scene = replace(
            scene, meshes=(*scene.meshes, unit_box()), materials=(*scene.materials, fog),
            instances=(*scene.instances, Instance("fog", unit_box().name, matrix((0, 0, 0.5)), ("fog",))),
        )  # fmt: skip
        return error_of_medium(scene, fog)

    patterned = PointLight(name="off", world_from_light=matrix((1, 0, 3)), power_w=0.0, pattern=tinted(1, 1, 1))
    dark = replace(patterned, name="dark", power_w=5.0, color=gray(0.0))
    assert stated(LAMP, patterned, dark) == stated(LAMP) > 1
    assert stated(LAMP, replace(patterned, power_w=1.0)) > stated(LAMP)


def test_a_row_of_boxes_of_thin_fog_counts_as_one_path() -> None:
    """Sixty cubes took 17 % of the light and were omitted at a stated ΔE of 0.12, that of one of them."""
    fog = Material("fog", None, ScatteringMedium(density=0.031, color=gray(0.0)))

    def stated(count: int) -> tuple[float, float]:
        scene = lit_plane(LAMP)
        row = [
            Instance(f"fog {k}", unit_box().name, matrix((0, 0, 0.2 + 0.05 * k), 0.049), ("fog",)) for k in range(count)
        ]
        scene = replace(scene, meshes=(*scene.meshes, unit_box()), materials=(*scene.materials, fog),
                        instances=(*scene.instances, *row))  # fmt: skip
        return error_of_medium(scene, fog), optical_depth(scene, fog)

    (one, depth), (all_of_them, depths) = stated(1), stated(60)
    assert depths == pytest.approx(60 * depth) and one < 0.2
    assert all_of_them > error_of_share(1 - np.exp(-2 * 0.031 * 0.049 * 60)) > 2


def test_a_strength_by_nodes_is_not_1() -> None:
    bright: Computed = tinted(500.0, 500.0, 500.0)
    ((radiance, _),) = radiances(lit_plane(), [Material("wire", Emission(gray(1.0), bright))])
    assert radiance == pytest.approx(500.0)


def test_a_wire_in_a_bulb_stays_although_the_pilot_does_not_meet_it() -> None:
    """No path of the pilot met it, so that the only lamp of the scene was switched off at a stated ΔE of 0."""
    scene = lit_plane(film=Film(48, 36, samples=64), camera=looking_down(2.0, 0.7))
    ball = sphere_mesh(24)
    scene = replace(
        scene, meshes=(*scene.meshes, ball),
        materials=(*scene.materials, Material("glass", Glass()), Material("wire", Emission(gray(1.0), 4e5))),
        instances=(*scene.instances, Instance("bulb", ball.name, matrix((0, 0, 3.5), 0.1), ("glass",)),
                   Instance("wire", ball.name, matrix((0, 0, 3.5), 3e-4), ("wire",))),
    )  # fmt: skip
    kept = plan_effects(scene)["emissive_meshes"]
    assert kept.is_on and kept.how == "measured" and kept.error is not None and kept.error > 1
