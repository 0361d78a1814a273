# SPDX-License-Identifier: GPL-3.0-or-later
"""Environment images: colors between their pixels are the same in three channels and in spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.render.environment_image import divided
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
