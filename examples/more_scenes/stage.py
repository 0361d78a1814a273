# SPDX-License-Identifier: GPL-3.0-or-later
"""A stage: one backdrop and three costumes; two white lamps of LEDs, mixed by recipe, change all of them at once.

The backdrop is a spectral texture (city by day, sea by night); the costumes' spectra are designed by the palette under
the same two lamps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from examples.more_scenes.shapes import box, looking, scene_of
from examples.two_paintings.paintings import hills
from spectral_core.palette import Cell, PaletteLight, PaletteProblem, PaletteReflectance, solve_palette
from spectral_core.palette.texture.lights import design_lights, led_range
from spectral_core.palette.texture.reach import TEXTURE_GRID
from spectral_core.palette.texture.texture import Picture, SpectralTexture, design_texture
from spectral_core.scene import AreaLight, Diffuse, Film, Mesh, Scene, SpectralImage, gray
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance

COSTUMES = {
    "actor left": ([0.45, 0.06, 0.06], [0.06, 0.30, 0.42]),
    "actor middle": ([0.40, 0.38, 0.35], [0.45, 0.36, 0.05]),
    "actor right": ([0.10, 0.32, 0.12], [0.42, 0.10, 0.34]),
}
"""Linear sRGB under the first lamp and under the second."""


def sea(size: int = 512) -> NDArray[np.uint8]:
    """A sea at night with a moon, display colors (size, size, 3)."""
    y, x = np.mgrid[0:size, 0:size] / (size - 1)
    sky = np.stack([0.10 + 0.12 * y, 0.14 + 0.2 * y, 0.34 + 0.22 * y], axis=-1)
    water = np.stack([0.05 + 0.05 * y, 0.18 - 0.05 * y, 0.30 - 0.06 * y], axis=-1)
    waves = np.sin(120 * y**2 + 9 * np.sin(11 * x)) * np.clip((y - 0.55) * 3, 0, 1)
    glitter = np.clip(1 - np.abs(x - 0.3) / (0.04 + 0.25 * np.clip(y - 0.55, 0, 1)), 0, 1) * np.clip(waves, 0, 1)
    picture = np.where((y > 0.55)[..., None], water + 0.04 * waves[..., None], sky)
    picture = picture + (np.array([0.95, 0.93, 0.80]) - picture) * (0.8 * glitter * (y > 0.55))[..., None]
    moon = np.clip((0.075 - np.hypot(x - 0.3, y - 0.22)) * size / 3, 0, 1)[..., None]
    picture = picture + (np.array([0.97, 0.95, 0.85]) - picture) * moon
    return np.asarray(np.round(255 * np.clip(picture, 0.02, 1)), dtype=np.uint8)


def design() -> tuple[tuple[Illuminant, Illuminant], SpectralTexture, list[Reflectance]]:
    """Lamps, backdrop and costumes."""
    lights = design_lights(led_range(20.0)).lights
    backdrop = design_texture([Picture("hills", hills()), Picture("sea", sea())], lights)
    columns = tuple(PaletteLight(normalized(light, luminance=1.0)) for light in lights)
    cells = tuple((Cell.fixed(first), Cell.fixed(second)) for first, second in COSTUMES.values())
    rows = tuple(PaletteReflectance(name) for name in COSTUMES)
    solution = solve_palette(PaletteProblem(TEXTURE_GRID, columns, rows, cells, smoothness=1e-4))
    return lights, backdrop.texture, [Reflectance(r.name, r.grid, r.values) for r in solution.reflectances]


def theater(texture: SpectralTexture, costumes: list[Reflectance], light: Illuminant, film: Film) -> Scene:
    """The stage under one lamp."""
    half, top = 2.2, 3.3
    corners = np.array([(-half, 0, 0), (half, 0, 0), (half, 0, top), (-half, 0, top)], np.float32)
    uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    backdrop = Mesh("backdrop", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uvs=uvs)
    painted = SpectralImage("backdrop", texture.weights[:, ::-1], texture.spectra, TEXTURE_GRID, extension="extend")
    parts = [
        (backdrop, Diffuse(painted)),
        (box("boards", (-4, -5, -0.1), (4, 0.1, 0.0)), Diffuse(gray(0.18))),
        (box("curtain left", (-2.9, -0.25, 0), (-2.2, 0.1, 3.6)), Diffuse(gray(0.08))),
        (box("curtain right", (2.2, -0.25, 0), (2.9, 0.1, 3.6)), Diffuse(gray(0.08))),
    ]
    for number, costume in enumerate(costumes):
        x = -1.15 + 1.15 * number
        parts.append((_figure(costume.name, x, -1.0 - 0.25 * (number == 1)), Diffuse(costume)))
    lamp = AreaLight(
        name="lamp", world_from_light=looking((0.0, -4.2, 4.6), (0.0, 0.0, 1.3)), color=light, power_w=420.0,
        size=(2.4, 0.6), shape="rectangle",
    )  # fmt: skip
    return scene_of(parts, [lamp], (looking((0.0, -7.4, 1.7), (0.0, 0.0, 1.5)), 0.62), film)


def _figure(name: str, x: float, y: float, steps: int = 40) -> Mesh:
    """A standing figure turned on a lathe."""
    height = np.array([0.0, 0.02, 0.5, 0.95, 1.2, 1.28, 1.36, 1.45, 1.55, 1.62])
    radius = np.array([0.0, 0.34, 0.22, 0.16, 0.20, 0.07, 0.10, 0.12, 0.09, 0.0])
    angle = np.linspace(0, 2 * np.pi, steps)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = np.concatenate(
        [
            np.column_stack([x + r * ring[:, 0], y + r * ring[:, 1], np.full(steps, h)])
            for h, r in zip(height, radius, strict=True)
        ]
    ).astype(np.float32)
    index = np.arange(len(points)).reshape(len(height), steps)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]).astype(np.uint32)
    return Mesh(name, points, triangles)
