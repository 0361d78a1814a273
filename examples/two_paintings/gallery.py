# SPDX-License-Identifier: GPL-3.0-or-later
"""The gallery: a wall, a floor, a framed canvas, a bench and a lamp, as a scene of plain data."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import SpectralTexture
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Film,
    Glossy,
    Instance,
    Material,
    Mesh,
    RenderSettings,
    Scene,
    SpectralImage,
    Surface,
    World,
    gray,
)
from spectral_core.scene.paint import Color
from spectral_core.spectra.spectrum import Illuminant

CANVAS = 1.5
"""Side of the painting, in meters."""
CENTER = 1.62
"""Height of its center above the floor."""


def box(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """An axis-parallel box, flat-shaded."""
    corners = np.array([[(low, high)[(k >> axis) & 1][axis] for axis in range(3)] for k in range(8)], np.float32)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.uint32)
    return Mesh(name, corners, triangles)


def canvas() -> Mesh:
    """The painting's square on the wall, in front of y = 0, with UVs from 0 to 1."""
    half = CANVAS / 2
    square = [(-half, CENTER - half), (half, CENTER - half), (half, CENTER + half), (-half, CENTER + half)]
    corners = np.array([(x, -0.04, z) for x, z in square], np.float32)
    uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    return Mesh("canvas", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uvs=uvs)


def frame() -> list[Mesh]:
    """Four bars around the canvas."""
    inner, outer = CANVAS / 2, CANVAS / 2 + 0.07
    low, high = CENTER - inner, CENTER + inner
    return [
        box("frame left", (-outer, -0.07, low - 0.07), (-inner, 0.0, high + 0.07)),
        box("frame right", (inner, -0.07, low - 0.07), (outer, 0.0, high + 0.07)),
        box("frame top", (-inner, -0.07, high), (inner, 0.0, high + 0.07)),
        box("frame bottom", (-inner, -0.07, low - 0.07), (inner, 0.0, low)),
    ]


def looking(origin: tuple[float, float, float], target: tuple[float, float, float]) -> NDArray[np.float64]:
    """World from camera or light: at ``origin``, with -z toward ``target`` and +z of the world up."""
    back = np.subtract(origin, target)
    back = back / np.linalg.norm(back)
    right = np.cross((0.0, 0.0, 1.0), back)
    right = right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    matrix[:3, 3] = origin
    return matrix


def gallery(texture: SpectralTexture, light: Illuminant, film: Film) -> Scene:
    """The gallery under one lamp; only ``light`` differs between two calls."""
    painting = SpectralImage("painting", texture.weights[:, ::-1], texture.spectra, TEXTURE_GRID, extension="extend")
    surfaces: dict[str, Surface] = {
        "wall": Diffuse(gray(0.62)),
        "floor": Diffuse(Color(np.array([0.24, 0.17, 0.11]))),
        "painting": Diffuse(painting),
        "frame": Glossy(Color(np.array([0.16, 0.12, 0.08])), roughness=0.35),
        "bench": Diffuse(Color(np.array([0.35, 0.33, 0.30]))),
    }
    meshes = {
        "wall": [box("wall", (-6, 0, -0.1), (6, 0.2, 5))],
        "floor": [box("floor", (-6, -8, -0.2), (6, 0, 0))],
        "painting": [canvas()],
        "frame": frame(),
        "bench": [
            box("seat", (-0.8, -2.05, 0.40), (0.8, -1.6, 0.47)),
            box("leg left", (-0.7, -2.0, 0), (-0.62, -1.65, 0.40)),
            box("leg right", (0.62, -2.0, 0), (0.7, -1.65, 0.40)),
        ],
    }
    instances = [Instance(mesh.name, mesh.name, np.eye(4), (name,)) for name, group in meshes.items() for mesh in group]
    lamp = AreaLight(
        name="lamp", world_from_light=looking((0.0, -2.6, 3.9), (0.0, 0.0, 1.6)), color=light, power_w=190.0,
        size=(1.6, 0.5), shape="rectangle",
    )  # fmt: skip
    return Scene(
        camera=Camera(world_from_camera=looking((0.7, -5.6, 1.45), (0.02, 0.0, 1.22)), field_of_view_rad=0.62),
        film=film,
        meshes=tuple(mesh for group in meshes.values() for mesh in group),
        materials=tuple(Material(name, surface) for name, surface in surfaces.items()),
        instances=tuple(instances),
        lights=(lamp,),
        world=World(gray(0.0)),
        settings=RenderSettings(transport="spectral", max_bounces=4),
    )
