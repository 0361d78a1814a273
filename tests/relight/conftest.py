# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene with many types of light, shared by the tests of recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.scene import (
    AreaLight,
    Color,
    Diffuse,
    Film,
    Glass,
    ImageTexture,
    Instance,
    Material,
    PointLight,
    Scene,
    World,
    gray,
)
from spectral_core.spectra.spectrum import SpectralGrid
from tests.render.scenes import lit_plane, looking_down, matrix, sphere_mesh

GRID = SpectralGrid.uniform(380, 780, 20)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Two lights and a world above a painted floor, a glass ball and a red ball: several bounces."""
    above = matrix((0.5, 0, 3))
    scene = lit_plane(
        PointLight(name="Key", world_from_light=above, power_w=60, radius=0.3, color=Color([1, 0.6, 0.3]), group="Key"),
        AreaLight(name="Fill", world_from_light=matrix((-1, 1, 3)), power_w=40, group="Fill"),
        world=World(gray(0.4), group="Sky"),
        camera=looking_down(8, 0.5),
        film=Film(20, 16, samples=32, seed=3, exposure=1.5),
    )
    floor = np.random.default_rng(1).uniform(0.1, 0.9, (4, 4, 3)).astype(np.float32)
    return replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(16)),
        materials=(
            *scene.materials,
            Material("glass", Glass(gray(0.95))),
            Material("red", Diffuse(Color([0.7, 0.1, 0.1]))),
            Material("painted", Diffuse(ImageTexture("floor", floor, "linear"))),
        ),
        instances=(
            *scene.instances,
            Instance("ball", "sphere", matrix((0, 1, 1), 0.7), ("glass",)),
            Instance("apple", "sphere", matrix((0, -1, 1), 0.7), ("red",)),
            Instance("carpet", "sphere", matrix((2, 0, 0.3), 0.6), ("painted",)),
        ),
    )
