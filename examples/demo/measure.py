# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of the mark in rendered pixels: its color against the glaze beside it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Color, Emission, Material, MixSurface, RenderSettings, Scene, Surface, World
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MarkContrast:
    """ΔE2000 between mark and ground, over ``places`` windows along the mark's edge; mean colors, linear sRGB (3,)."""

    mean: float
    largest: float
    places: int
    mark_rgb: Array
    ground_rgb: Array


def coverage_scene(scene: Scene, material_name: str) -> Scene:
    """The scene with that material's mask alone visible: its first glaze emits green, its second red.

    Pixels of its picture hold how much of them is ground (green) and mark (red).
    """
    dark = Emission(Color(np.zeros(3)))
    materials = []
    for material in scene.materials:
        surface: Surface = dark
        if material.name == material_name:
            if not isinstance(material.surface, MixSurface):
                raise InvalidInputError(f"material {material_name!r} does not mix two surfaces, so it has no mark")
            green, red = Emission(Color(np.array([0.0, 1, 0]))), Emission(Color(np.array([1.0, 0, 0])))
            surface = MixSurface(material.surface.factor, green, red)
        materials.append(Material(material.name, surface))
    return dataclasses.replace(
        scene,
        materials=tuple(materials),
        lights=(),
        world=World(),
        settings=RenderSettings(transport="rgb", max_bounces=0),
        film=dataclasses.replace(scene.film, samples=32),
    )


def mark_contrast(
    picture: ArrayLike, coverage: ArrayLike, *, reach_pixels: int | None = None, stride: int = 4
) -> MarkContrast:
    """The step in color from ground to mark, in square windows all along the mark's edge.

    ``picture``, ``coverage``: (height, width, 3 or more), linear sRGB; coverage as ``coverage_scene`` renders it. In
    each window the pixels are fitted by a quadratic (the shading of a round vase) plus a step where the mark is; ΔE2000
    is between the quadratic's color at the window's center and that color plus the step.
    """
    pixels, covered = np.asarray(picture, dtype=np.float64)[..., :3], np.asarray(coverage, dtype=np.float64)
    if reach_pixels is None:
        reach_pixels = max(4, pixels.shape[1] // 45)  # 41 pixels across in the picture of the demo
    if pixels.shape[:2] != covered.shape[:2]:
        raise InvalidInputError(f"picture is {pixels.shape[:2]}, its coverage {covered.shape[:2]}; render both alike")
    mark, ground = covered[..., 0] > 0.98, covered[..., 1] > 0.98
    colors, steps = [], []
    for row in range(reach_pixels, pixels.shape[0] - reach_pixels, stride):
        for column in range(reach_pixels, pixels.shape[1] - reach_pixels, stride):
            window = np.s_[
                row - reach_pixels : row + reach_pixels + 1, column - reach_pixels : column + reach_pixels + 1
            ]
            fitted = _step(pixels[window], mark[window], ground[window])
            if fitted is not None:
                colors.append(fitted[0])
                steps.append(fitted[1])
    if not colors:
        raise InvalidInputError("mark and ground are side by side nowhere in the picture; render it larger")
    ground_rgb, mark_rgb = np.array(colors), np.array(colors) + np.array(steps)
    delta_e = delta_e_2000(lab_from_linear_rgb(mark_rgb), lab_from_linear_rgb(ground_rgb))
    return MarkContrast(
        float(delta_e.mean()), float(delta_e.max()), len(colors), mark_rgb.mean(axis=0), ground_rgb.mean(axis=0)
    )


def _step(pixels: Array, mark: NDArray[np.bool_], ground: NDArray[np.bool_]) -> tuple[Array, Array] | None:
    """Ground's color at the window's center and the step to the mark; None if either fills under a quarter."""
    if min(int(mark.sum()), int(ground.sum())) < mark.size // 4:
        return None
    reach = mark.shape[0] // 2
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1] / reach
    known = mark | ground
    shading = [np.ones_like(x), x, y, x * x, x * y, y * y]
    rows = np.stack([*(term[known] for term in shading), mark[known].astype(float)], axis=1)
    fitted = np.linalg.lstsq(rows, pixels[known], rcond=None)[0]
    return fitted[0], fitted[-1]
