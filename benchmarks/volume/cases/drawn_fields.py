# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields and transfer functions drawn by a seed: no constant of the renderer can have been chosen with them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.volume.cases.strange_fields import turbulence
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import Material, TransferFunction

_COLORS = ([0.8, 0.2, 0.3], [0.1, 0.6, 0.4], [0.7, 0.7, 0.9])


def fields(size: int, rng: np.random.Generator) -> Iterator[ScalarVolume]:
    """Twelve fields of ``size`` voxels per axis, of six data types; noise, labels and places are drawn."""
    line = np.linspace(-1, 1, size)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    radius = np.sqrt(x * x + y * y + z * z)
    yield ScalarVolume("sponge", (_sponge(line) * 200 + rng.integers(0, 3, x.shape)).astype(np.uint8))
    yield ScalarVolume("ridges", (1 - np.abs(turbulence(rng, size))).astype(np.float32))
    head = np.full(x.shape, -1000.0)
    for value, center, axes in ((700, (0, 0, 0), (0.9, 0.7, 0.8)), (20, (0, 0, 0), (0.85, 0.64, 0.75)),
                                (-200, (0.2, 0, 0.1), (0.2, 0.3, 0.4)), (60, (-0.3, 0.1, 0), (0.25, 0.15, 0.3)),
                                (1200, (0, 0.35, -0.2), (0.06, 0.06, 0.06))):  # fmt: skip
        inside = sum(((u - c) / a) ** 2 for u, c, a in zip((x, y, z), center, axes, strict=True)) < 1
        head[inside] = value
    yield ScalarVolume("head", (head + rng.normal(0, 8, x.shape)).astype(np.int16))
    squares = (np.floor(4 * x) + np.floor(4 * y) + np.floor(4 * z)) % 2
    yield ScalarVolume("checker", squares * 100 + 50 * (x + 1))
    yield ScalarVolume("saddle", (np.exp(3 * x * y) - np.exp(2 * z)).astype(np.float32))
    yield ScalarVolume("orbital", ((3 * z * z - radius**2) ** 2 * np.exp(-6 * radius)).astype(np.float32))
    seeds = rng.uniform(-1, 1, (25, 3))
    nearest = np.stack([(x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2 for a, b, c in seeds]).argmin(0)
    yield ScalarVolume("labels", rng.integers(0, 256, 25)[nearest].astype(np.uint8))
    yield ScalarVolume("ripples", (np.sin(25 * radius) / (radius + 0.1)).astype(np.float32))
    yield ScalarVolume("lognormal", np.exp(2.0 * turbulence(rng, size)).astype(np.float32))
    around = (x - 0.5 * np.cos(5 * z)) ** 2 + (y - 0.5 * np.sin(5 * z)) ** 2
    yield ScalarVolume.from_spacing("helix", np.exp(-around / 0.01).astype(np.float32), (0.8, 1.0, 2.5))
    cloud = np.clip(20000 + 9000 * turbulence(rng, size) * (radius < 0.9), 0, 65535)
    yield ScalarVolume("cloud", cloud.astype(np.uint16))
    yield ScalarVolume("plane", (5 * x).astype(np.float32))


def _sponge(line: NDArray[Any]) -> NDArray[Any]:
    solid = np.ones((line.size,) * 3, bool)
    places = (line + 1) / 2 * 0.999
    for depth in range(3):
        a = np.floor(places * 3 ** (depth + 1)) % 3 == 1
        x, y, z = a[:, None, None], a[None, :, None], a[None, None, :]
        solid &= ~((x & y) | (x & z) | (y & z))
    return solid


def functions(volume: ScalarVolume, rng: np.random.Generator) -> Iterator[tuple[str, TransferFunction]]:
    """Up to six functions whose places, widths and heights are drawn, extinctions per voxel."""
    values = np.sort(volume.data.astype(np.float64).ravel())
    low, high = float(values[0]), float(values[-1])
    voxel = float(np.prod(volume.voxel_size) ** (1 / 3))

    def places(*shares: float) -> NDArray[Any]:
        return low + (high - low) * np.array(shares)

    def material(number: int, at: Any, heights: Any, emission: Any = None, **rest: Any) -> Material:
        scaled = None if emission is None else np.array(emission, float) / voxel
        return Material(f"m{number}", at, np.array(heights, float) / voxel, _COLORS[number], scaled, **rest)

    middle, width = rng.uniform(0.2, 0.8), rng.uniform(0.02, 0.1)
    tent = material(0, places(middle - width, middle, middle + width), [0, rng.uniform(0.1, 2), 0])
    yield "tent", TransferFunction((tent, material(1, places(0.05, 0.95), [0, 0.1])))
    edges = np.repeat(places(*np.sort(rng.uniform(0.05, 0.95, 4))), 2)
    yield "edges", TransferFunction((material(0, edges, [0, 0.3, 0.3, 0, 0, 0.6, 0.6, 0.1]),))
    teeth = int(rng.integers(8, 24))
    heights = np.zeros(2 * teeth + 1)
    heights[1::2] = 0.5
    yield "comb", TransferFunction((material(0, places(*np.linspace(0.02, 0.98, 2 * teeth + 1)), heights),))
    above = values[values > low]
    quantiles = np.unique(np.quantile(above, [0.2, 0.5, 0.7, 0.9, 0.97, 0.995]))
    if quantiles.size > 3:
        shells = material(0, quantiles, np.resize([0, 0.4, 0.05], quantiles.size))
        yield "quantile", TransferFunction((shells, material(1, places(0.9, 1), [0, 1.0])))
    (surface,) = places(rng.uniform(0.3, 0.7))
    solid = material(0, [surface, surface, high], [0, 30.0, 30.0])
    yield "solid", TransferFunction((solid, material(2, places(0.05, 0.25), [0, 0.06])))
    fire = material(0, places(0.1, 0.4, 0.7, 1), [0.0, 0.02, 0.02, 0], [0, 0.1, 0.0, 0.3], lit=False)
    yield "fire", TransferFunction((fire,))
