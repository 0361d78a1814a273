# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes unlike those of the other suites: tiny active regions, very flat voxels, few values, odd cameras."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

_COLORS = ([0.2, 0.7, 0.3], [0.9, 0.6, 0.1], [0.4, 0.3, 0.9])


def fields(size: int, rng: np.random.Generator) -> Iterator[ScalarVolume]:
    """Twelve fields of about ``size`` voxels per axis, each odd in one way."""
    line = np.linspace(-1, 1, size)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    radius = np.sqrt(x * x + y * y + z * z)
    sparse = np.zeros(x.shape, np.float32)
    for _ in range(3):
        a, b, c = rng.integers(3, size - 6, 3)
        sparse[a : a + 4, b : b + 3, c : c + 4] = rng.uniform(0.2, 1.0, (4, 3, 4))
    yield ScalarVolume("sparse", sparse)
    wave = np.sin(rng.uniform(3, 8) * x + z) * np.cos(rng.uniform(3, 8) * y)
    yield ScalarVolume.from_spacing("flat", wave.astype(np.float32), (0.05, 1.0, 8.0))
    yield ScalarVolume("few", np.array([0, 50, 100, 200], np.uint8)[np.digitize(radius + 0.2 * wave, [0.4, 0.7, 0.9])])
    yield ScalarVolume("constant", np.full(x.shape, 7.25, np.float32))
    near = 30000 + np.round(1.4 * wave + rng.normal(0, 0.3, x.shape))
    yield ScalarVolume("integers", near.astype(np.uint16))
    yield ScalarVolume("levels", (128 + np.sign(wave) * (np.abs(wave) > 0.4) + (radius < 0.3)).astype(np.uint8))
    yield ScalarVolume("slice", wave[:, :, size // 2 : size // 2 + 1].astype(np.float32))
    yield ScalarVolume("stack", wave[:, : size // 2, :3].astype(np.float32))
    yield ScalarVolume("signed", np.round(100 * wave * (radius < 0.9)).astype(np.int8))
    filled = np.where(radius < 0.8, wave, -9999.0)
    yield ScalarVolume("filled", filled.astype(np.float32))
    yield ScalarVolume("offset", 1e5 + 0.05 * wave)
    mirrored = np.array([[0, -2.0, 0, 5], [1.0, 0, 0.3, -4], [0, 0, 0.2, 1], [0, 0, 0, 1.0]])
    yield ScalarVolume("turned", np.exp(-3 * radius**2 + 0.3 * wave).astype(np.float32), mirrored)


def functions(volume: ScalarVolume, rng: np.random.Generator) -> Iterator[tuple[str, TransferFunction]]:
    """Five functions whose knots lie at values of the data, between them, and outside."""
    voxel = float(np.prod(volume.voxel_size) ** (1 / 3))
    distinct = np.unique(volume.data[volume.data > -9000].astype(np.float64))
    low, high = float(distinct[0]), float(distinct[-1])
    span = (high - low) or 1.0

    def material(number: int, at: Any, heights: Any) -> Material:
        return Material(
            f"m{number}", np.asarray(at, float), np.array(heights, float) / voxel, np.array(_COLORS[number])
        )

    picked = distinct[np.unique(np.linspace(0, distinct.size - 1, min(distinct.size, 4)).astype(int))]
    yield "plateaus", TransferFunction((material(0, *_steps(picked, rng)),))
    ends = _around(picked[-1], span), _around(picked[0], span)
    yield (
        "at values",
        TransferFunction(
            (material(0, ends[0], [0, 0.8, 0]), material(1, ends[1], [0, float(rng.uniform(0.02, 0.3)), 0]))
        ),
    )
    yield (
        "everywhere",
        TransferFunction((material(2, [low - span, high + span], [0.02, float(rng.uniform(0.05, 0.4))]),)),
    )
    cut = low + span * float(rng.uniform(0.3, 0.7))
    yield "wall", TransferFunction((material(1, [cut, cut, high + span], [0, 50.0, 50.0]),))
    many = np.sort(rng.uniform(low - 0.1 * span, high + 0.1 * span, 12))
    yield (
        "drawn",
        TransferFunction((material(0, many, np.append(rng.uniform(0, 0.5, 11) * (rng.random(11) < 0.6), 0)),)),
    )


def _steps(values: NDArray[Any], rng: np.random.Generator) -> tuple[NDArray[Any], list[float]]:
    """A function that jumps exactly at each of some values, level between them, and 0 from the last one on."""
    at, heights = [], []
    level = 0.0
    for number, value in enumerate(values):
        after = 0.0 if number == values.size - 1 and values.size > 1 else float(rng.uniform(0.05, 0.5))
        at += [value, value]
        heights += [level, after]
        level = after
    return np.array(at), heights


def _around(value: float, span: float) -> NDArray[Any]:
    return value + 0.02 * span * np.array([-1.0, 0.0, 1.0])


def views(volume: ScalarVolume, pixels: int, rng: np.random.Generator) -> Iterator[View]:
    """Inside the field; along an axis without perspective; wide and near; orthographic from any side."""
    middle = volume.corners_world.mean(axis=0)
    extent = np.ptp(volume.corners_world, axis=0)
    within = middle + rng.uniform(-0.2, 0.2, 3) * extent
    size = {"width": pixels, "height": pixels}
    yield View.looking(within, middle + rng.uniform(0.3, 0.5, 3) * extent, fov_deg=90.0, **size)
    yield View.around(volume, 0.0, 0.0, fov_deg=None, **size)
    yield View.around(volume, float(rng.uniform(0, 360)), float(rng.uniform(-60, 60)), zoom=3.0, fov_deg=70.0, **size)
    yield View.around(volume, float(rng.uniform(0, 360)), float(rng.uniform(-60, 60)), zoom=1.5, fov_deg=None, **size)
