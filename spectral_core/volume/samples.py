# SPDX-License-Identifier: GPL-3.0-or-later
"""Analytic sample fields, computed at any size, so that no data file is needed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.volume.field import ScalarVolume

Array = NDArray[np.float32]


def sample_volume(name: str, size: int = 64) -> ScalarVolume:
    """Sample field ``name`` (see ``SAMPLES``), ``size`` voxels per axis, unit spacing, first voxel at the origin."""
    if name not in SAMPLES:
        raise UnknownNameError.among("sample volume", name, SAMPLES)
    return ScalarVolume(name, SAMPLES[name](require_whole("size", size, 1, 1024, " voxels")))


def sample_named(text: str, usual: int) -> tuple[str, int]:
    """Name and size of ``sample:NAME:SIZE``, or of ``sample:NAME`` with the size ``usual``.

    Raises InvalidInputError, UnknownNameError.
    """
    _, name, *size = text.split(":")
    if len(size) > 1 or not all(word.isdecimal() and 2 <= int(word) <= 1024 for word in size):
        raise InvalidInputError(f"{text!r} names no sample; expected sample:NAME or sample:NAME:SIZE, size 2 to 1024")
    if name not in SAMPLES:
        raise UnknownNameError.among("sample volume", name, SAMPLES)
    return name, int(size[0]) if size else usual


def _unit_grid(size: int) -> tuple[Array, Array, Array]:
    """x, y and z from -1 to 1, broadcastable."""
    line = np.linspace(-1.0, 1.0, size, dtype=np.float32) if size > 1 else np.zeros(1, np.float32)
    return line[:, None, None], line[None, :, None], line[None, None, :]


def _bytes(field: Array) -> NDArray[np.uint8]:
    return np.asfortranarray(np.clip(np.rint(255.0 * field), 0, 255).astype(np.uint8))


def marschner_lobb(size: int) -> Array:
    """The test signal of Marschner and Lobb 1994 (f_M = 6, α = 0.25), values 0 to 1."""
    x, y, z = _unit_grid(size)
    wave = np.cos(2.0 * np.pi * 6.0 * np.cos(0.5 * np.pi * np.sqrt(x**2 + y**2)))
    return np.asfortranarray((1.0 - np.sin(0.5 * np.pi * z) + 0.25 * (1.0 + wave)) / 2.5)


def gaussians(size: int) -> Array:
    """Fourteen overlapping blobs, values 0 to 1: smooth, like a simulation."""
    rng = np.random.default_rng(7)
    x, y, z = _unit_grid(size)
    field = np.zeros((size, size, size), np.float32)
    for _ in range(14):
        a, b, c = rng.uniform(-0.65, 0.65, 3)
        width = rng.uniform(0.08, 0.3)
        field += rng.uniform(0.4, 1.0) * np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / (2 * width**2))
    return np.asfortranarray(field / field.max())


def shells(size: int) -> NDArray[np.uint8]:
    """Three sharp shells (0.6 voxel wide) with slow ripples between them."""
    x, y, z = _unit_grid(size)
    radius = np.sqrt(x**2 + (1.2 * y) ** 2 + z**2)
    voxel = 2.0 / size
    field = np.zeros((size, size, size), np.float32)
    for at, rise in ((0.85, 0.3), (0.6, 0.35), (0.3, 0.25)):
        field += rise / (1.0 + np.exp(np.clip((radius - at) / (0.6 * voxel), -50, 50)))
    return _bytes(field + 0.04 * (field > 0.05) * np.sin(5 * x) * np.cos(4 * y) * np.sin(3 * z + 1))


def noise(size: int) -> NDArray[np.uint8]:
    """White noise: no rule can adapt its steps to it."""
    return np.asfortranarray(np.random.default_rng(3).integers(0, 256, (size, size, size), dtype=np.uint8))


def engine(size: int) -> NDArray[np.uint8]:
    """An engine-like block, as a scan would show it: housing at 110, liners and pipes at 215, noise under 40.

    Anti-aliased edges one voxel wide and a haze of reconstruction noise around the block, so that the palette of
    thesis Fig. 5.6 (equal, split, smoke) needs its three objects to color.
    """
    x, y, z = _unit_grid(size)
    edge = 1.0 / size

    def inside(distance: Array) -> Array:
        return np.clip(0.5 - distance / (2 * edge), 0.0, 1.0)

    def cylinder(a: float, b: float, radius: float, low: float, high: float) -> Array:
        around = np.sqrt((x - a) ** 2 + (y - b) ** 2) - radius
        return inside(np.maximum(around, np.maximum(low - z, z - high)))

    def lying(c: float, height: float, radius: float) -> Array:
        around = np.sqrt((y - c) ** 2 + (z - height) ** 2) - radius
        return inside(np.maximum(around, np.abs(x) - 0.86))

    block = inside(np.maximum(np.maximum(np.abs(x) - 0.78, np.abs(y) - 0.46), np.abs(z + 0.1) - 0.55))
    block = np.maximum(block, inside(np.maximum(np.maximum(np.abs(x) - 0.6, np.abs(y) - 0.62), np.abs(z + 0.5) - 0.15)))
    hard = np.zeros((size, size, size), np.float32)
    for a in (-0.5, 0.0, 0.5):
        block = block * (1.0 - cylinder(a, 0.0, 0.17, -0.4, 0.9))
        hard = np.maximum(hard, cylinder(a, 0.0, 0.21, -0.4, 0.52) * (1.0 - cylinder(a, 0.0, 0.16, -0.5, 0.9)))
        hard = np.maximum(hard, cylinder(a + 0.12, 0.32, 0.05, 0.2, 0.75))
    for c in (-0.34, 0.34):
        block = block * (1.0 - lying(c, -0.35, 0.08))
        hard = np.maximum(hard, lying(c, -0.35, 0.09) * (1.0 - lying(c, -0.35, 0.055)))
    field = np.maximum(110.0 * block * (1.0 - hard), 215.0 * hard)
    haze = 26.0 * np.exp(
        -3.0 * (np.maximum(np.abs(x) - 0.7, 0) + np.maximum(np.abs(y) - 0.5, 0) + np.maximum(np.abs(z) - 0.5, 0))
    )
    rough = np.random.default_rng(1).normal(0.0, 4.0, field.shape)
    return _bytes((field + (1.0 - np.minimum(field / 40.0, 1.0)) * haze + rough).astype(np.float32) / 255.0)


SAMPLES: dict[str, Callable[[int], NDArray[np.float32] | NDArray[np.uint8]]] = {
    "marschner-lobb": marschner_lobb,
    "gaussians": gaussians,
    "shells": shells,
    "noise": noise,
    "engine": engine,
}
