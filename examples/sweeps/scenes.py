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
        camera=Camera(world_from_camera=looking((0, -8, 3.5), (0, 0, 0.6))),
        film=Film(size, size, samples=samples),
        meshes=(Mesh("plane", plane, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)), ball()),
        materials=(
            Material("gray", Diffuse(gray(0.6))),
            Material("warm", Diffuse(Color(np.array([0.7, 0.35, 0.15])))),
            Material("mixture", Principled(MixedPaint(0.5, red, green), roughness=0.4)),
            Material("metal", Glossy(Color(np.array([0.9, 0.8, 0.6])), roughness=0.3)),
        ),
        instances=(
            placed("ground", "plane", (0, 0, 0), 6, "gray"),
            Instance("wall", "plane", wall, ("warm",)),
            placed("ball", "ball", (-0.9, 0, 1), 1, "mixture"),
            placed("metal ball", "ball", (1.3, -0.8, 0.7), 0.7, "metal"),
        ),
        lights=(
            PointLight(name="Key", world_from_light=at((-3, -3, 4)), power_w=700, radius=0.2),
            AreaLight(name="Fill", world_from_light=looking((4, -2, 4), (0, 0, 1)), power_w=250, size=(2, 2)),
        ),
        world=World(gray(0.1)),
        settings=RenderSettings(transport="spectral", max_bounces=3),
    )


def ball() -> Mesh:
    """A unit sphere of 48 by 24 faces, named ball."""
    polar, around = np.linspace(0, np.pi, 25), np.linspace(0, 2 * np.pi, 49)
    grid = np.stack([np.sin(polar)[:, None] * np.cos(around), np.sin(polar)[:, None] * np.sin(around),
                     np.broadcast_to(np.cos(polar)[:, None], (25, 49))], axis=2).reshape(-1, 3)  # fmt: skip
    index = np.arange(25 * 49).reshape(25, 49)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Mesh("ball", grid, triangles, normals=grid)


def at(place: tuple[float, float, float]) -> np.ndarray:
    """The 4×4 matrix that moves the origin there."""
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return matrix


def looking(origin: tuple[float, float, float], target: tuple[float, float, float]) -> np.ndarray:
    """The 4×4 matrix of a camera or lamp at ``origin`` that looks at ``target``, z up."""
    back = np.subtract(origin, target).astype(float)
    back /= np.linalg.norm(back)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    matrix = at(origin)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    return matrix


def placed(name: str, mesh: str, place: tuple[float, float, float], size: float, material: str) -> Instance:
    """An instance of a mesh, scaled by ``size``."""
    matrix = at(place)
    matrix[:3, :3] *= size
    return Instance(name, mesh, matrix, (material,))
