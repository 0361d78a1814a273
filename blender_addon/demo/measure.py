# SPDX-License-Identifier: GPL-3.0-or-later
"""How plain the mark is in rendered pixels: its color against the glaze right beside it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.errors import InvalidInputError
from spectral_core.scene import Color, Emission, Material, MixSurface, RenderSettings, Scene, World

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MarkContrast:
    """ΔE2000 between mark and ground, over ``places`` pixels along the mark's edge; mean colors in linear sRGB (3,)."""

    mean: float
    largest: float
    places: int
    mark_rgb: Array
    ground_rgb: Array


def coverage_scene(scene: Scene, material_name: str) -> Scene:
    """The scene with nothing but that material's mask to see: its first glaze glows green, its second red.

    Pixels of its picture hold how much of them is ground (green) and mark (red).
    """
    dark = Emission(Color(np.zeros(3)))
    materials = []
    for material in scene.materials:
        surface = dark
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


def mark_contrast(picture: ArrayLike, coverage: ArrayLike, *, reach_pixels: int = 9) -> MarkContrast:
    """Compare mark and ground wherever both lie within ``reach_pixels`` of each other, so that shading cancels.

    ``picture``, ``coverage``: (height, width, 3 or more), linear sRGB; coverage as ``coverage_scene`` renders it.
    Each place compares the mean of the mark's pixels with the mean of the ground's in one square window.
    """
    from scipy.ndimage import uniform_filter

    pixels, covered = np.asarray(picture, dtype=np.float64)[..., :3], np.asarray(coverage, dtype=np.float64)
    if pixels.shape[:2] != covered.shape[:2]:
        raise InvalidInputError(f"picture is {pixels.shape[:2]}, its coverage {covered.shape[:2]}; render both alike")
    mark, ground = (covered[..., 0] > 0.98), (covered[..., 1] > 0.98)
    window = 2 * reach_pixels + 1

    def local_mean(where: NDArray[np.bool_]) -> tuple[Array, Array]:
        share = uniform_filter(where.astype(float), window, mode="constant")
        total = uniform_filter(pixels * where[..., None], (window, window, 1), mode="constant")
        return total / np.maximum(share, 1e-12)[..., None], share

    mark_mean, mark_share = local_mean(mark)
    ground_mean, ground_share = local_mean(ground)
    places = (mark | ground) & (mark_share > 0.2) & (ground_share > 0.2)
    if not places.any():
        raise InvalidInputError("nowhere in the picture do mark and ground lie side by side; render it larger")
    delta_e = delta_e_2000(lab_from_linear_rgb(mark_mean[places]), lab_from_linear_rgb(ground_mean[places]))
    return MarkContrast(
        float(delta_e.mean()), float(delta_e.max()), int(places.sum()),
        mark_mean[places].mean(axis=0), ground_mean[places].mean(axis=0),
    )  # fmt: skip
