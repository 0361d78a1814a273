# SPDX-License-Identifier: GPL-3.0-or-later
"""Three scenes for the relight benchmarks, small to large: a lit corner, glass and textures, a crowd of balls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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
            _placed("ground", "plane", (0, 0, 0), 6, "floor"),
            *corner.instances[1:],
            _placed("glass ball", "ball", (0.9, -0.8, 0.7), 0.7, "glass"),
            _placed("gold ball", "ball", (-1.4, 0.9, 0.5), 0.5, "gold"),
        ),
    )
    colors = tuple(
        Material(f"paint {k}", Principled(Color(rng.uniform(0.05, 0.9, 3)), roughness=0.4)) for k in range(12)
    )
    balls = tuple(
        _placed(f"ball {k}", "ball", (*rng.uniform(-3, 3, 2), 0.25), 0.25, f"paint {k % 12}") for k in range(80)
    )
    crowd = replace(corner, materials=(*corner.materials, *colors), instances=(*corner.instances, *balls))
    return {"corner": corner, "glass and textures": glass, "eighty balls": crowd}


def _base(film: Film) -> Scene:
    plane = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    wall = np.eye(4)
    wall[:3, :3] = 6 * np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    wall[:3, 3] = (0, 3, 0)
    return Scene(
        camera=Camera(world_from_camera=_looking((0, -8, 3.5), (0, 0, 0.6))),
        film=film,
        meshes=(Mesh("plane", plane, [[0, 1, 2], [0, 2, 3]], uvs=(plane[:, :2] + 1) / 2), _ball()),
        materials=(Material("gray", Diffuse(gray(0.6))), Material("red", Diffuse(Color([0.7, 0.15, 0.1])))),
        instances=(
            _placed("ground", "plane", (0, 0, 0), 6, "gray"),
            Instance("wall", "plane", wall, ("red",)),
            _placed("ball", "ball", (0, 0, 1), 1, "gray"),
        ),
        lights=(
            PointLight(name="Key", world_from_light=_at((-3, -3, 4)), power_w=700, radius=0.2, group="Key"),
            AreaLight(
                name="Fill", world_from_light=_looking((4, -2, 4), (0, 0, 1)), power_w=250, size=(2, 2), group="Fill"
            ),
        ),
        world=World(gray(0.25), group="Sky"),
    )


def _ball() -> Mesh:
    polar, around = np.linspace(0, np.pi, 25), np.linspace(0, 2 * np.pi, 49)
    grid = np.stack([np.sin(polar)[:, None] * np.cos(around), np.sin(polar)[:, None] * np.sin(around),
                     np.broadcast_to(np.cos(polar)[:, None], (25, 49))], axis=2).reshape(-1, 3)  # fmt: skip
    index = np.arange(25 * 49).reshape(25, 49)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Mesh("ball", grid, triangles, normals=grid)


def _at(place: tuple[float, float, float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return matrix


def _looking(origin: tuple[float, float, float], target: tuple[float, float, float]) -> np.ndarray:
    back = np.subtract(origin, target).astype(float)
    back /= np.linalg.norm(back)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    matrix = _at(origin)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    return matrix


def _placed(name: str, mesh: str, place: tuple[float, float, float], size: float, material: str) -> Instance:
    matrix = _at(place)
    matrix[:3, :3] *= size
    return Instance(name, mesh, matrix, (material,))
