# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes for sweeps without Blender: plain data, built in a few lines."""

from __future__ import annotations

import numpy as np

from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Film,
    Glossy,
    Instance,
    Material,
    Mesh,
    MixedPaint,
    PointLight,
    Principled,
    RenderSettings,
    Scene,
    World,
    gray,
)
from spectral_core.spectra import catalogue

SIZE = 96


def corner(size: int = SIZE, samples: int = 16) -> Scene:
    """A colored ball and a metal ball in a corner, a lamp named Key and a panel named Fill; rendered spectrally."""
    plane = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    wall = np.eye(4)
    wall[:3, :3] = 6 * np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    wall[:3, 3] = (0, 3, 0)
    red, green = (catalogue.reflectance(name) for name in ("red", "green"))
    return Scene(
        camera=Camera(world_from_camera=_looking((0, -8, 3.5), (0, 0, 0.6))),
        film=Film(size, size, samples=samples),
        meshes=(Mesh("plane", plane, [[0, 1, 2], [0, 2, 3]]), _ball()),
        materials=(
            Material("gray", Diffuse(gray(0.6))),
            Material("warm", Diffuse(Color([0.7, 0.35, 0.15]))),
            Material("mixture", Principled(MixedPaint(0.5, red, green), roughness=0.4)),
            Material("metal", Glossy(Color([0.9, 0.8, 0.6]), roughness=0.3)),
        ),
        instances=(
            _placed("ground", "plane", (0, 0, 0), 6, "gray"),
            Instance("wall", "plane", wall, ("warm",)),
            _placed("ball", "ball", (-0.9, 0, 1), 1, "mixture"),
            _placed("metal ball", "ball", (1.3, -0.8, 0.7), 0.7, "metal"),
        ),
        lights=(
            PointLight(name="Key", world_from_light=_at((-3, -3, 4)), power_w=700, radius=0.2),
            AreaLight(name="Fill", world_from_light=_looking((4, -2, 4), (0, 0, 1)), power_w=250, size=(2, 2)),
        ),
        world=World(gray(0.1)),
        settings=RenderSettings(transport="spectral", max_bounces=3),
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
