# SPDX-License-Identifier: GPL-3.0-or-later
"""Three scenes for the relight benchmarks, small to large: a lit corner, glass and textures, many balls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from examples.sweeps.scenes import at, ball, looking, placed
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Film,
    Glass,
    Glossy,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    PointLight,
    Principled,
    Scene,
    World,
    gray,
)
from spectral_core.spectra.spectrum import Spectrum


def scenes(width: int, height: int, samples: int) -> dict[str, Scene]:
    """Scenes by name, three light groups each: Key, Fill and Sky."""
    film = Film(width, height, samples=samples, seed=1)
    corner = _base(film)
    rng = np.random.default_rng(4)
    floor = rng.uniform(0.1, 0.9, (32, 32, 3)).astype(np.float32)
    glass = replace(
        corner,
        materials=(
            *corner.materials,
            Material("glass", Glass(gray(0.97), 0.0)),
            Material("gold", Glossy(Color([1, 0.7, 0.3]), 0.3)),
            Material("floor", Diffuse(ImageTexture("floor", floor, "linear"))),
        ),
        instances=(
            placed("ground", "plane", (0, 0, 0), 6, "floor"),
            *corner.instances[1:],
            placed("glass ball", "ball", (0.9, -0.8, 0.7), 0.7, "glass"),
            placed("gold ball", "ball", (-1.4, 0.9, 0.5), 0.5, "gold"),
        ),
    )
    colors = tuple(
        Material(f"paint {k}", Principled(Color(rng.uniform(0.05, 0.9, 3)), roughness=0.4)) for k in range(12)
    )
    balls = tuple(
        placed(f"ball {k}", "ball", (*rng.uniform(-3, 3, 2), 0.25), 0.25, f"paint {k % 12}") for k in range(80)
    )
    crowd = replace(corner, materials=(*corner.materials, *colors), instances=(*corner.instances, *balls))
    return {"corner": corner, "glass and textures": glass, "eighty balls": crowd}


def _base(film: Film) -> Scene:
    plane = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    wall = np.eye(4)
    wall[:3, :3] = 6 * np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    wall[:3, 3] = (0, 3, 0)
    return Scene(
        camera=Camera(world_from_camera=looking((0, -8, 3.5), (0, 0, 0.6))),
        film=film,
        meshes=(Mesh("plane", plane, [[0, 1, 2], [0, 2, 3]], uvs=(plane[:, :2] + 1) / 2), ball()),
        materials=(Material("gray", Diffuse(gray(0.6))), Material("red", Diffuse(Color([0.7, 0.15, 0.1])))),
        instances=(
            placed("ground", "plane", (0, 0, 0), 6, "gray"),
            Instance("wall", "plane", wall, ("red",)),
            placed("ball", "ball", (0, 0, 1), 1, "gray"),
        ),
        lights=(
            PointLight(name="Key", world_from_light=at((-3, -3, 4)), power_w=700, radius=0.2, group="Key"),
            AreaLight(
                name="Fill", world_from_light=looking((4, -2, 4), (0, 0, 1)), power_w=250, size=(2, 2), group="Fill"
            ),
        ),
        world=World(gray(0.25), group="Sky"),
    )


def under_lights(scene: Scene, spectra: Mapping[str, Spectrum]) -> Scene:
    """The scene with the given spectrum for the lights of each named group, as a reference for relit pictures."""

    def lit(item: Any) -> Any:
        return replace(item, color=spectra[item.group]) if item.group in spectra else item

    return replace(scene, lights=tuple(lit(light) for light in scene.lights), world=lit(scene.world))
