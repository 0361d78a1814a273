# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that the demo paints itself, as NumPy arrays: the hidden branch, wood, linen. Row 0 is the bottom."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def branch_mask(height: int = 1024, width: int = 2048) -> NDArray[np.float32]:
    """Coverage (height, width) in [0, 1] of a leafy branch with berries, drawn around the middle of a vase's UV square.

    Coordinates are in units of the vase's height, so that leaves are not stretched. Anti-aliased by distance: a
    shape's edge is one pixel wide.
    """
    coverage = np.zeros((height, width))
    for along in np.linspace(0.0, 1.0, 240):
        x, y, _ = _stem(along)
        _stamp(coverage, (x, y), 0.02, _disk(0.0075 * (1.25 - along)))
    for along, side, length in _leaves():
        x, y, heading = _stem(along)
        _stamp(coverage, (x, y), length, _leaf(heading + side * 0.85, length))
    x, y, heading = _stem(1.0)
    _stamp(coverage, (x, y), 0.17, _leaf(heading, 0.17))
    for x, y, radius in _BERRIES:
        _stamp(coverage, (x, y), radius + 0.01, _disk(radius))
    return coverage.astype(np.float32)


_BERRIES = ((-0.285, -0.035, 0.024), (-0.235, -0.002, 0.019), (0.235, -0.150, 0.024), (0.185, -0.185, 0.019))
"""Center x, y and radius of each."""


def _stamp(coverage: Array, origin: tuple[float, float], reach: float, depth: Callable[[Array, Array], Array]) -> None:
    """Adds a shape within ``reach`` of its origin; ``depth(x, y)`` is its signed distance, positive inside."""
    height, width = coverage.shape
    rows = slice(max(0, int((origin[1] - reach + 0.5) * height)), int((origin[1] + reach + 0.5) * height) + 2)
    columns = slice(max(0, int((origin[0] - reach + 1) / 2 * width)), int((origin[0] + reach + 1) / 2 * width) + 2)
    row, column = np.mgrid[rows, columns][:, : height - rows.start, : width - columns.start]
    x, y = (column + 0.5) / width * 2 - 1 - origin[0], (row + 0.5) / height - 0.5 - origin[1]
    window = coverage[rows, columns]
    np.maximum(window, np.clip(depth(x, y) * height + 0.5, 0.0, 1.0), out=window)


def _disk(radius: float) -> Callable[[Array, Array], Array]:
    return lambda x, y: radius - np.hypot(x, y)


def _stem(along: float) -> tuple[float, float, float]:
    """Point (x, y) and heading (radians) of the branch at a share of its length."""
    x = -0.30 + 0.50 * along
    y = -0.26 + 0.36 * along + 0.05 * np.sin(5.2 * along)
    return x, y, float(np.arctan2(0.36 + 0.05 * 5.2 * np.cos(5.2 * along), 0.50))


def _leaves() -> list[tuple[float, float, float]]:
    """Place along the stem, side of it and length of each leaf, larger in the middle."""
    places = np.linspace(0.10, 0.92, 9)
    return [(float(p), 1.0 if i % 2 else -1.0, 0.15 + 0.07 * float(np.sin(np.pi * p))) for i, p in enumerate(places)]


def _leaf(heading: float, length: float) -> Callable[[Array, Array], Array]:
    """An almond-shaped leaf that starts at the origin, with a vein left free along its middle."""

    def depth(x: Array, y: Array) -> Array:
        along = (x * np.cos(heading) + y * np.sin(heading)) / length
        across = (-x * np.sin(heading) + y * np.cos(heading)) / length
        inside = np.clip(along, 0.0, 1.0)
        half_width = 0.21 * np.sin(np.pi * inside**0.8) * (1 - 0.25 * inside)
        vein = 0.014 * (1 - inside) * (inside < 0.82)
        edge = np.minimum(half_width - np.abs(across), np.abs(across) - vein)
        return np.where((along < 0) | (along > 1), -1.0, edge) * length

    return depth


def _noise(height: int, width: int, scale: tuple[float, float], rng: np.random.Generator) -> Array:
    """Smooth periodic noise in [-1, 1]: random phases under a Gaussian spectrum, ``scale`` in cycles per picture."""
    fy, fx = np.fft.fftfreq(height, 1 / height)[:, None], np.fft.rfftfreq(width, 1 / width)[None, :]
    envelope = np.exp(-((fy / scale[0]) ** 2 + (fx / scale[1]) ** 2) / 2)
    phases = rng.uniform(0, 2 * np.pi, envelope.shape)
    field = np.fft.irfft2(envelope * np.exp(1j * phases), s=(height, width))
    return field / np.abs(field).max()


def wood(height: int = 512, width: int = 1024, seed: int = 5) -> NDArray[np.float32]:
    """A plank table, display-encoded color (height, width, 3): boards along x, grain, and thin dark joints."""
    rng = np.random.default_rng(seed)
    v = (np.arange(height)[:, None] + 0.5) / height
    boards = 4
    board = np.floor(v * boards).astype(int)
    tone = rng.uniform(-0.035, 0.035, boards)[board]
    grain = 0.055 * np.sin(2 * np.pi * (v * 46 + 2.6 * _noise(height, width, (7, 1.6), rng)))
    fiber = 0.09 * _noise(height, width, (180, 5), rng)
    joint = -0.22 * np.exp(-((((v * boards) % 1.0 - 0.5) ** 2 - 0.25) ** 2) / 1e-5)
    light = 1.0 + tone + grain + fiber + joint
    return np.clip(light[..., None] * np.array([0.50, 0.37, 0.27]), 0.02, 1.0).astype(np.float32)


def plaster(size: int = 512, seed: int = 9) -> NDArray[np.float32]:
    """A lime-washed wall, display-encoded color (size, size, 3): broad cloudy brush work."""
    rng = np.random.default_rng(seed)
    clouds = 0.05 * _noise(size, size, (3, 4), rng) + 0.035 * _noise(size, size, (14, 9), rng)
    clouds = clouds + 0.02 * _noise(size, size, (90, 60), rng)
    return np.clip((1 + clouds)[..., None] * np.array([0.60, 0.615, 0.625]), 0.02, 1.0).astype(np.float32)
