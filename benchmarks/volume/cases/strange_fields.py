# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields and transfer functions that were not used to choose any constant of the renderer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import Material, TransferFunction

_COLORS = ([0.9, 0.3, 0.1], [0.2, 0.5, 0.9], [0.85, 0.85, 0.4])


def fields(size: int) -> Iterator[ScalarVolume]:
    """A dozen fields of about ``size`` voxels per axis, of seven data types."""
    rng = np.random.default_rng(20261122)
    line = np.linspace(-1, 1, size)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    radius = np.sqrt(x**2 + y**2 + z**2)

    boxes = sum(
        (np.maximum(np.maximum(abs(x - 0.1 * i), abs(y)), abs(z + 0.1 * i)) < 0.9 - 0.22 * i) * 60 for i in range(4)
    )
    yield ScalarVolume("boxes", np.asarray(boxes).astype(np.uint8))
    spikes = 20 + 5 * np.sin(4 * x) * np.cos(3 * y + z)
    for _ in range(max(6, size // 2)):
        spikes[tuple(rng.integers(2, size - 2, 3))] = rng.uniform(120, 250)
    yield ScalarVolume("spikes", spikes.astype(np.uint8))
    yield ScalarVolume("wrapped", ((7 * x + 3 * y - 2 * z) % 1.0).astype(np.float32))
    yield ScalarVolume("halo", (1.0 / (radius**2 + 1e-3) ** 2).astype(np.float32))
    gyroid = np.sin(6 * x) * np.cos(6 * y) + np.sin(6 * y) * np.cos(6 * z) + np.sin(6 * z) * np.cos(6 * x)
    yield ScalarVolume("gyroid", gyroid.astype(np.float32))
    yield ScalarVolume("turbulence", (2000 * turbulence(rng, size)).astype(np.int16))
    phantom = 1000.0 * (radius < 0.9) + 300 * (np.hypot(x - 0.2, y) < 0.4) - 900 * (np.hypot(x + 0.4, z) < 0.2)
    phantom += rng.normal(0, 15, phantom.shape)
    phantom[size // 2, size // 2 : size // 2 + 2, size // 3] = 30000
    yield ScalarVolume("phantom", phantom.astype(np.int16))
    shear = np.array([[1.0, 0.4, 0.1, 0], [0.0, 0.7, -0.3, 0], [0.2, 0.0, 1.5, 0], [0, 0, 0, 1.0]])
    yield ScalarVolume("sheared", 1e6 + 3 * np.exp(-4 * ((x - 0.1) ** 2 + 2 * y**2 + z**2)), shear)
    atoms = np.zeros_like(x)
    for a in np.linspace(-0.7, 0.7, 4):
        for b in np.linspace(-0.7, 0.7, 4):
            atoms += np.exp(-((x - a) ** 2 + (y - b) ** 2 + (z - 0.8 * a * b) ** 2) / 0.01)
    yield ScalarVolume("atoms", atoms)
    sheets = np.zeros((size, size, size), np.uint16)
    sheets[size // 4 :: size // 4] = 40000
    sheets[:, size // 3] += 9000
    yield ScalarVolume("sheets", sheets)
    tubes = sum(
        np.exp(-((x - 0.5 * np.sin(4 * z + p)) ** 2 + (y - 0.5 * np.cos(3 * z + p)) ** 2) / 0.006) for p in range(4)
    )
    yield ScalarVolume.from_spacing("tubes", np.asarray(tubes).astype(np.float32), (1.0, 0.6, 2.0))
    ball = np.clip(0.5 + (0.7 - radius) * size / 2, 0, 1)
    yield ScalarVolume(
        "ball", (255 * ball + rng.integers(0, 4, ball.shape) * (radius > 0.8)).clip(0, 255).astype(np.uint8)
    )


def turbulence(rng: np.random.Generator, size: int) -> NDArray[Any]:
    """Gaussian noise with a spectrum of k^-11/6 in amplitude, zero mean, unit deviation."""
    k = np.fft.fftfreq(size) * size
    square = k[:, None, None] ** 2 + k[None, :, None] ** 2 + k[None, None, :] ** 2
    amplitude = np.where(square > 0, np.maximum(square, 1.0) ** (-11 / 12), 0.0)
    noise = np.fft.ifftn(np.fft.fftn(rng.normal(size=(size,) * 3)) * amplitude).real
    return np.asarray(noise / noise.std())


def functions(volume: ScalarVolume) -> Iterator[tuple[str, TransferFunction]]:
    """Seven functions over the values of ``volume``, extinctions per voxel."""
    values = np.sort(volume.data.astype(np.float64).ravel())
    low, high = float(values[0]), float(values[-1])
    voxel = float(np.prod(volume.voxel_size) ** (1 / 3))
    span = high - low

    def material(number: int, at: Any, heights: Any, emission: Any = None, **rest: Any) -> Material:
        scaled = None if emission is None else np.array(emission, float) / voxel
        return Material(f"m{number}", at, np.array(heights, float) / voxel, _COLORS[number % 3], scaled, **rest)

    def places(*shares: float) -> NDArray[Any]:
        return low + span * np.array(shares)

    yield (
        "broad",
        TransferFunction((material(0, places(0.05, 0.4, 0.7), [0, 0.08, 0]), material(1, places(0.3, 1.0), [0, 0.3]))),
    )
    cuts = places(0.1, 0.1, 0.35, 0.35, 0.6, 0.6, 1.0)
    yield (
        "steps",
        TransferFunction(
            (material(0, cuts, [0, 0.05, 0.05, 0, 0, 0.4, 0.4]), material(1, cuts, [0, 0, 0, 0.2, 0.2, 0, 0]))
        ),
    )
    half = 0.5 if volume.data.dtype.kind in "iu" and span < 1e4 else 5e-4 * span
    middle = np.round(places(0.27, 0.62)) if volume.data.dtype.kind in "iu" else places(0.27, 0.62)
    yield (
        "peaks",
        TransferFunction(
            tuple(material(i, m + half * np.array([-1, 0, 1]), [0, 3.0, 0]) for i, m in enumerate(middle))
        ),
    )
    teeth = np.repeat(places(*np.linspace(0.05, 1, 15)), 2)[1:-1]
    yield "sawtooth", TransferFunction((material(0, teeth, np.tile([0, 0.25], 14)),))
    solid = places(0.45, 0.45, 1.0)
    yield (
        "opaque",
        TransferFunction((material(0, solid, [0, 20.0, 20.0]), material(1, places(0.2, 0.3, 0.45), [0, 0.1, 0]))),
    )
    # Five shells evenly spaced in the logarithm of the distance from the least value.
    first = max(float(values[values > low][0]) - low, 1e-6 * span)
    decades = low + np.geomspace(max(first, 1e-5 * span), 0.8 * span, 5)
    half = 0.3 * min(0.5, 1 - (decades[0] - low) / (decades[1] - low))  # shells never overlap
    shells = (low + np.outer(decades - low, [1 - half, 1, 1 + half])).ravel()
    yield (
        "log",
        TransferFunction((material(0, shells, np.tile([0, 0.8, 0], 5)), material(1, places(0.9, 1.0), [0, 0.5]))),
    )
    glow = material(0, places(0.1, 0.5, 0.5, 0.9), [0, 0, 0, 0], [0, 0.05, 0, 0.1], lit=False)
    yield "glow", TransferFunction((glow, material(1, places(0.3, 0.5, 0.8), [0, 0.15, 0.1])))
