# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures as arrays of pixels: a spectrum as a curve filled with its colors, and color swatches. No Blender.

Pictures are (height, width, 4) float32 sRGB with alpha, row 0 at the bottom, as Blender keeps images.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import RGB_FROM_XYZ, display_rgb_from_linear
from spectral_core.spectra.observer import STANDARD, observer

Picture = NDArray[np.float32]

SPAN_NM = (380.0, 780.0)
"""Wavelengths from the left edge to the right edge of every plot, so that plots can be compared by eye."""
BACKGROUND = np.array([0.11, 0.11, 0.12])
GRID_LINE = np.array([0.30, 0.30, 0.32])
LINE = np.array([0.96, 0.96, 0.96])
BARE = 0.45
"""Share of its color that a wavelength keeps above the curve: darker than the filled part."""
MARGIN = 0.06


@cache
def wavelength_colors(count: int) -> NDArray[np.float64]:
    """sRGB (count, 3) of wavelengths across SPAN_NM: hue of the spectral line, fading with the observer's sensitivity.

    No screen shows spectral lines; negative channels are lifted to zero by mixing with gray, which keeps the hue.
    """
    viewer = observer(STANDARD)
    wavelengths = np.linspace(*SPAN_NM, count)
    xyz = np.stack([np.interp(wavelengths, viewer.wavelengths_nm, row) for row in viewer.cmfs], axis=1)
    linear = xyz @ RGB_FROM_XYZ.T
    linear = linear - np.minimum(linear.min(axis=1, keepdims=True), 0.0) * 0.6
    linear = np.clip(linear, 0.0, None)
    peak = linear.max(axis=1, keepdims=True)
    share = np.clip(peak / 0.25, 0.0, 1.0) ** 0.5
    return np.clip(display_rgb_from_linear(linear / np.maximum(peak, 1e-9)), 0, 1) * share + 0.25 * (1 - share)


def value_range(values: NDArray[np.float64], kind: str) -> tuple[float, float]:
    """Values at the bottom and top of a plot: 0 to 1 for reflectances, 0 to the peak for lights.

    Widened where unphysical values reach outside.
    """
    top = 1.0 if kind == "reflectance" else 0.0
    low, high = min(0.0, float(values.min(initial=0.0))), max(top, float(values.max(initial=top)))
    return low, high if high > low else low + 1.0


def curve_picture(
    wavelengths_nm: NDArray[np.float64], values: NDArray[np.float64], kind: str, size: int = 128
) -> Picture:
    """A spectrum as a square plot of ``size`` pixels; values are linear between wavelengths and zero outside."""
    low, high = value_range(values, kind)
    fine = np.linspace(*SPAN_NM, 8 * size)  # the maximum of each column: no line is lost between two
    known = np.interp(fine, wavelengths_nm, values, left=0.0, right=0.0).reshape(size, 8).max(axis=1)
    # single precision: a solve changes the curve of each material, and the panel waits for all of them
    height = ((MARGIN + (1 - 2 * MARGIN) * (known - low) / (high - low)) * size).astype(np.float32)
    zero = np.float32((MARGIN + (1 - 2 * MARGIN) * (0.0 - low) / (high - low)) * size)
    y = np.arange(size, dtype=np.float32)[:, None] + np.float32(0.5)

    between = np.clip(np.maximum(height, zero) - y + 0.5, 0, 1) * np.clip(y - np.minimum(height, zero) + 0.5, 0, 1)
    slope = np.gradient(height)
    width = max(size / 64, 1.0)
    distance = np.abs(y - height) / np.sqrt(1 + slope**2)
    beside = np.stack([np.roll(height, 1), height, np.roll(height, -1)])[:, None]
    past_end = np.maximum(beside.min(axis=0) - y, y - beside.max(axis=0))  # a spike ends at the vertex of its line
    line = np.clip(width / 2 + 0.5 - np.maximum(distance, past_end), 0, 1)
    ground, fill, pen = _layers(size)
    picture = ground + (0.9 * between)[..., None] * (fill - ground)
    picture += line[..., None] * (pen - picture)
    return picture


@cache
def _layers(size: int) -> tuple[Picture, Picture, Picture]:
    """Premultiplied pictures of one size: the background with grid lines, the colors below a curve, and its line."""
    colors, alpha = wavelength_colors(size)[None], rounded_alpha(size, size / 12)
    ground = np.broadcast_to(BACKGROUND + 0.10 * BARE * colors, (size, size, 3))
    coverage = _grid_coverage(np.linspace(*SPAN_NM, size), size)[..., None]
    ground = ground + (GRID_LINE - ground) * coverage
    fill, pen = (np.broadcast_to(color, ground.shape) for color in (colors, LINE))
    return _opaque(ground, alpha), _opaque(fill, alpha), _opaque(pen, alpha)


def _grid_coverage(x: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Fine lines at 400, 500, 600 and 700 nm."""
    step = x[1] - x[0]
    nearest = np.min([np.abs(x - mark) for mark in (400.0, 500.0, 600.0, 700.0)], axis=0) / step
    return np.broadcast_to(0.6 * np.clip(max(size / 256, 0.5) + 0.5 - nearest, 0, 1), (size, size))


def swatch_picture(display_rgb: NDArray[np.float64], size: int = 32) -> Picture:
    """One color with round corners; ``display_rgb``: sRGB (3,), clipped to [0, 1]."""
    picture = np.broadcast_to(np.clip(display_rgb, 0, 1), (size, size, 3))
    return _opaque(picture, rounded_alpha(size, size / 8))


@cache
def rounded_alpha(size: int, radius: float) -> NDArray[np.float64]:
    """Coverage (size, size) of a square with round corners."""
    center = np.abs(np.arange(size) + 0.5 - size / 2) - (size / 2 - radius)
    outside = np.hypot(np.maximum(center[:, None], 0), np.maximum(center[None, :], 0))
    return np.clip(radius - outside + 0.5, 0, 1)


def _opaque(picture: NDArray[np.float64], alpha: NDArray[np.float64]) -> Picture:
    """With alpha; Blender draws icons with premultiplied colors."""
    return np.concatenate([picture * alpha[..., None], alpha[..., None]], axis=-1).astype(np.float32)
