# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment images: colors between their pixels are the same in three channels and in spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.render.images.environment import divided, with_hues_of_brighter_neighbors
from spectral_core.scene import Camera, ImageTexture, World
from tests.render.scenes import lit_plane

SKYWARD = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""A camera at the horizon: looks along +Y."""


def test_colors_between_the_pixels_of_an_environment_are_the_same_in_spectral_transport() -> None:
    """Pixels that differ in color and brightness between which the picture lies."""
    levels = np.where(np.indices((8, 16)).sum(0)[..., None] % 2, [0.8, 0.5, 0.15], [0.06, 0.1, 0.2])
    world = World(ImageTexture("checks", levels.astype(np.float32), color_space="linear"))
    scene = lit_plane()
    scene = replace(
        scene, world=world, instances=(), camera=Camera(world_from_camera=SKYWARD),
        film=replace(scene.film, width=24, height=18, samples=256),
    )  # fmt: skip
    rgb, spectral = (
        render_scene(replace(scene, settings=replace(scene.settings, transport=kind))).pixels[..., :3]
        for kind in ("rgb", "spectral")
    )
    assert np.ptp(rgb[..., 0]) > 0.3
    np.testing.assert_allclose(spectral, rgb, atol=0.006)


@pytest.mark.parametrize("sky", [(0.0, 0.0, 0.0), (0.2, 0.35, 0.7)])
@pytest.mark.parametrize("lamp", [(60000.0, 60000.0, 60000.0), (60000.0, 9000.0, 500.0)])
def test_a_lamp_of_one_pixel_gives_the_same_light_in_spectral_transport(lamp: tuple[float], sky: tuple[float]) -> None:
    pixels = np.full((256, 512, 3), sky, np.float32)
    pixels[170, 100] = lamp
    scene = lit_plane()
    world = World(ImageTexture("lamp", pixels, color_space="linear"))
    scene = replace(scene, lights=(), world=world, film=replace(scene.film, width=8, height=6, samples=256))
    rgb, spectral = (
        render_scene(replace(scene, settings=replace(scene.settings, transport=kind))).pixels[..., :3].mean(axis=(0, 1))
        for kind in ("rgb", "spectral")
    )
    np.testing.assert_allclose(spectral, rgb, rtol=0.01, atol=0.002 * rgb.max())


def test_pixels_of_little_contrast_keep_their_hues() -> None:
    pixels = np.random.default_rng(3).uniform(0.3, 1.0, size=(9, 16, 3)).astype(np.float32)
    assert with_hues_of_brighter_neighbors(pixels) is pixels
    pixels[4, 15] = (500.0, 300.0, 200.0)
    changed = np.any(with_hues_of_brighter_neighbors(pixels) != pixels, axis=2)
    expected = np.zeros((9, 16), bool)
    expected[3:6, [14, 15, 0]] = True
    expected[4, 15] = False
    np.testing.assert_array_equal(changed, expected)


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (8, 16), (85, 50), (86, 4), (8, 400)])
def test_division_keeps_the_centers_of_pixels_and_joins_the_sides(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(3).uniform(size=(*shape, 3)).astype(np.float32)
    finer = divided(pixels)
    parts = finer.shape[0] // shape[0]
    assert parts % 2 == 1 and finer.shape[1] == parts * shape[1]
    np.testing.assert_allclose(finer[parts // 2 :: parts, parts // 2 :: parts], pixels, atol=1e-6)
    between = (pixels[:, 0] + pixels[:, -1]) / 2
    np.testing.assert_allclose((finer[parts // 2 :: parts, 0] + finer[parts // 2 :: parts, -1]) / 2, between, atol=1e-6)


def test_an_image_of_many_rows_stays_as_it_is() -> None:
    pixels = np.zeros((86, 8, 3), np.float32)
    assert divided(pixels) is pixels
