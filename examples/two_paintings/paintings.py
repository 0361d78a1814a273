# SPDX-License-Identifier: GPL-3.0-or-later
"""The two paintings, drawn by formulas: layered hills under a low sun, and circles after Kandinsky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float64]


def _grid(size: int) -> tuple[Pixels, Pixels]:
    y, x = np.mgrid[0:size, 0:size] / (size - 1)
    return x, y


def _over(ground: Pixels, color: tuple[float, float, float], cover: Pixels) -> Pixels:
    return np.asarray(ground + (np.array(color) - ground) * cover[..., None])


def _grain(size: int, seed: int, strength: float) -> Pixels:
    """Brush strokes: noise that is smooth along the stroke."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(size, size)), (size / 250, size / 60))
    return np.asarray(strength * noise / noise.std())[..., None]


def hills(size: int = 512) -> NDArray[np.uint8]:
    """Hills at sunset, as display colors (size, size, 3)."""
    x, y = _grid(size)
    sky = np.stack([0.95 - 0.35 * (1 - y), 0.60 + 0.10 * y, 0.35 + 0.45 * (1 - y)], axis=-1)
    sun = np.hypot(x - 0.66, y - 0.42)
    picture = _over(sky, (1.0, 0.93, 0.70), np.square(np.clip(1.2 - sun / 0.16, 0, 1)))
    picture = _over(picture, (1.0, 0.97, 0.85), np.clip((0.072 - sun) * size / 2, 0, 1))
    layers = [
        (0.50, 0.060, 2.2, 0.3, (0.62, 0.50, 0.62)),
        (0.60, 0.050, 3.1, 1.9, (0.42, 0.38, 0.55)),
        (0.71, 0.060, 2.4, 4.0, (0.22, 0.33, 0.40)),
        (0.84, 0.050, 3.6, 2.6, (0.10, 0.20, 0.20)),
    ]
    for height, swing, pace, phase, color in layers:
        ridge = height + swing * np.sin(pace * 2 * x * 1.7 + phase) + 0.3 * swing * np.sin(7.3 * pace * x + 2 * phase)
        picture = _over(picture, color, np.clip((y - ridge) * size / 2, 0, 1))
    shaded = picture + _grain(size, 1, 0.018)
    return np.asarray(np.round(255 * np.clip(shaded, 0.02, 1)), dtype=np.uint8)


def circles(size: int = 512) -> NDArray[np.uint8]:
    """Circles and lines on a pale ground, as display colors (size, size, 3)."""
    x, y = _grid(size)
    picture = np.ones((size, size, 3)) * np.array([0.93, 0.89, 0.80])
    rings = [
        (0.30, 0.34, 0.24, [(0.12, 0.20, 0.45), (0.85, 0.20, 0.18), (0.98, 0.78, 0.20), (0.10, 0.10, 0.14)]),
        (0.70, 0.62, 0.19, [(0.90, 0.45, 0.15), (0.16, 0.50, 0.42), (0.95, 0.90, 0.78), (0.55, 0.12, 0.35)]),
        (0.68, 0.20, 0.10, [(0.20, 0.45, 0.70), (0.95, 0.85, 0.35)]),
        (0.24, 0.78, 0.11, [(0.60, 0.15, 0.20), (0.90, 0.70, 0.65)]),
    ]
    for center_x, center_y, radius, colors in rings:
        distance = np.hypot(x - center_x, y - center_y)
        for number, color in enumerate(colors):
            edge = radius * (1 - number / (len(colors) + 0.4))
            picture = _over(picture, color, np.clip((edge - distance) * size / 2, 0, 1))
    for slope, offset, width in ((0.8, 0.05, 0.006), (-0.6, 0.95, 0.004), (2.2, -0.7, 0.005)):
        distance = np.abs(y - slope * x - offset) / np.hypot(1, slope)
        picture = _over(picture, (0.08, 0.08, 0.10), np.clip((width - distance) * size / 2 + 0.5, 0, 1))
    shaded = picture + _grain(size, 2, 0.015)
    return np.asarray(np.round(255 * np.clip(shaded, 0.02, 1)), dtype=np.uint8)
