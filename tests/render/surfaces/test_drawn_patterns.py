# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds with a pattern: sharp rays see it by its formula, and all other light is that of the image drawn of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.render.live.stage import Stage
from spectral_core.render.mitsuba_export import write_mitsuba
from spectral_core.scene import (
    Camera,
    Computed,
    Diffuse,
    DrawnPattern,
    Film,
    Glossy,
    RenderSettings,
    World,
    gray,
)
from spectral_core.scene.shading import Builder
from tests.live.changes.test_live_programs import _pictured
from tests.render.scenes import lit_plane, looking_down

MEAN = np.array([0.5, 0.25, 0.125])
SKYWARD = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""A camera at the horizon: looks along +Y, up is +Z."""
SIZE = 64
WIDTH = 2 * np.tan(0.5 / 2)


def stripes(frequency: float = 100.0, color: np.ndarray = 2 * MEAN) -> Computed:
    """``color`` where sin(frequency · z) of the direction is above 0, else black."""
    builder = Builder()
    none = builder.number(0.0)
    height = builder.add("component", (builder.add("vector_input", (), "position", 0),), 2)
    phase = builder.add("math", (height, builder.number(frequency), none), "MULTIPLY")
    on = builder.add("math", (builder.add("math", (phase, none, none), "SINE"), none, none), "GREATER_THAN")
    factors = (builder.as_width(on, 3), builder.number(color), builder.number(np.zeros(3)), none)
    return Computed(builder.program(builder.add("vector_math", factors, "MULTIPLY")))


def world(**rest) -> World:
    """Stripes that are far finer than their image, which is even."""
    image = np.broadcast_to(MEAN, (16, 32, 3)).astype(np.float32)
    return World(DrawnPattern("stripes", image, "linear", pattern=stripes()), **rest)


def sky(transport: str = "rgb", samples: int = 256, **rest):
    scene = lit_plane(world=world(**rest), settings=RenderSettings(transport=transport))  # type: ignore[arg-type]
    camera = Camera(world_from_camera=SKYWARD, field_of_view_rad=0.5)
    return replace(
        scene, instances=(), camera=camera, film=Film(8, SIZE, samples=samples, filter_width=1.0, filter_kind="box")
    )


def shown(scale: float = 1.0) -> np.ndarray:
    """Rows (SIZE, 3) of the picture of ``sky``, from the formula alone: the mean over each pixel."""
    fine = (np.arange(SIZE * 400) + 0.5) / 400 - SIZE / 2
    across = (np.arange(8) + 0.5 - 4)[:, None]
    step = WIDTH / SIZE
    height = fine * step / np.sqrt(1 + (fine * step) ** 2 + (across * step) ** 2)
    on = (np.sin(100.0 * scale * height) > 0).reshape(8, SIZE, 400).mean(axis=(0, 2))
    return on[:, None] * 2 * MEAN


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_the_camera_sees_the_pattern_itself(transport: str) -> None:
    picture = render_scene(sky(transport)).pixels[..., :3].mean(axis=1)
    np.testing.assert_allclose(picture, shown(), atol=0.04)
    assert np.ptp(picture[:, 0]) > 0.9


def test_a_turned_and_brighter_world_shows_its_pattern_turned_and_brighter() -> None:
    turn = np.eye(4)
    turn[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # z of the pattern lies along x
    scene = sky(world_from_environment=turn, strength=3.0)
    picture = (
        render_scene(replace(scene, film=Film(SIZE, 8, samples=256, filter_width=1.0, filter_kind="box")))
        .pixels[..., :3]
        .mean(axis=0)
    )
    np.testing.assert_allclose(picture, 3 * shown(), atol=0.12)


@pytest.mark.parametrize(("roughness", "is_sharp"), [(0.0, True), (0.02, True), (0.5, False)])
def test_mirrors_show_the_pattern_and_rough_surfaces_its_mean(roughness: float, is_sharp: bool) -> None:
    scene = lit_plane(world=world(), surface=Glossy(gray(1.0), roughness), camera=looking_down(2.0, 1.0),
                      film=Film(16, 16, samples=256))  # fmt: skip
    picture = render_scene(scene).pixels[..., :3]
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), MEAN, rtol=0.06)
    contrast = float((picture / MEAN).std())
    assert contrast > 0.15 if is_sharp else contrast < 0.05


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_diffuse_surface_is_lit_by_the_image_alone(transport: str) -> None:
    scene = lit_plane(world=world(), surface=Diffuse(gray(0.5)), film=Film(8, 8, samples=256),
                      settings=RenderSettings(transport=transport))  # fmt: skip
    picture = render_scene(scene).pixels[..., :3]
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), 0.5 * MEAN, rtol=0.01)


def test_a_pattern_that_its_image_misses_is_seen() -> None:
    """Stars between the pixels: the drawn image is black."""
    scene = sky()
    drawn = scene.world.color
    dark = replace(drawn, pixels=np.zeros_like(drawn.pixels))
    picture = render_scene(replace(scene, world=World(dark))).pixels[..., :3].mean(axis=1)
    np.testing.assert_allclose(picture, shown(), atol=0.04)


def test_numbers_of_a_pattern_change_in_a_loaded_scene() -> None:
    high = np.array(SKYWARD)
    high[2, 3] = 1.0
    scene, stage = replace(lit_plane(world=world()), camera=Camera(world_from_camera=high)), Stage()
    for color in (2 * MEAN, MEAN[::-1]):
        drawn = replace(scene.world.color, pattern=stripes(color=color))
        now = replace(scene, world=World(drawn))
        np.testing.assert_allclose(_pictured(stage, now), _pictured(Stage(), now), rtol=1e-5, atol=1e-6)
    assert stage.loads == 1


def test_scenes_of_equal_geometry_keep_their_own_patterns() -> None:
    scene = sky()
    for color in (2 * MEAN, MEAN):
        drawn = replace(scene.world.color, pattern=stripes(color=color))
        picture = render_scene(replace(scene, world=World(drawn))).pixels[..., :3].mean(axis=1)
        np.testing.assert_allclose(picture, shown() * color / (2 * MEAN), atol=0.04)


def test_an_export_writes_the_image_and_names_the_pattern(tmp_path) -> None:
    notes = write_mitsuba(sky(), tmp_path / "out").notes
    assert any("pattern is written as an image" in note.message for note in notes)
