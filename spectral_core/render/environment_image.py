# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of an environment image as Mitsuba reads them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import luminance_from_linear_rgb

BRIGHTER, LEAST = 4.0, 1e-7
"""Ratio of a neighbor's brightness to a pixel's from which on the neighbor determines the pixel's hue, and brightness
of a black pixel beside it, relative to it.
"""
MOST_ROWS, FINEST = 256, 9
"""Rows of an environment whose pixels are divided, at most, and parts of a pixel's side."""


def rows_from_pole_to_pole(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same image with its first and last row at the poles, as Mitsuba reads it.

    An image's rows are centers of equal bands. Twice as many rows and one hold a linear interpolation between them
    exactly; an image of 1024 rows or more is fine enough to keep its size.
    """
    height, width = rows.shape[:2]
    nodes = 2 * height + 1 if height < 1024 else height
    place = np.clip(np.linspace(0, height, nodes) - 0.5, 0, height - 1)
    low = np.minimum(place.astype(int), max(height - 2, 0))
    high = np.minimum(low + 1, height - 1)
    share = (place - low)[:, None, None].astype(np.float32)
    resampled = rows[low] * (1 - share) + rows[high] * share
    if width < 2:
        resampled = np.repeat(resampled, 2, axis=1)
    return np.ascontiguousarray(resampled, dtype=np.float32)


def divided(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same image, interpolated linearly, with divided pixels; at most ``MOST_ROWS`` rows, twice as many columns.

    In spectral transport Mitsuba interpolates the spectra of neighboring pixels and their brightness apart, and
    multiplies the two: between pixels that differ in both, the color is not that between them. Its error falls with
    the square of the number of parts. An odd number keeps the centers of the pixels.
    """
    height, width = pixels.shape[:2]
    parts = min(FINEST, (MOST_ROWS // max(height, -(-width // 2)) - 1) // 2 * 2 + 1)
    if parts < 2:
        return pixels
    modes: tuple[Literal["clip", "wrap"], ...] = ("clip", "wrap")  # the last column lies beside the first one
    for axis, size, mode in zip((0, 1), (height, width), modes, strict=True):
        place = (np.arange(size * parts) + 0.5) / parts - 0.5
        low = np.floor(place).astype(int)
        share = (place - low).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        first, second = (pixels.take(each, axis=axis, mode=mode) for each in (low, low + 1))
        pixels = first * (1 - share) + second * share
    return np.ascontiguousarray(pixels, dtype=np.float32)


def with_hues_of_brighter_neighbors(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """The same image, in which a pixel beside a much brighter one has the hue of that one.

    Between them Mitsuba multiplies a mean of hues by a mean of brightness (``divided``): a sun of one pixel in a black
    sky lost 39 % of its light, and one in a blue sky a part of its red. With equal hues the product is exact. What the
    dim pixel's own hue adds there is little.
    """
    brightness = pixels.max(axis=2)
    most, of = brightness.copy(), pixels.copy()
    for down, across in ((d, a) for d in (-1, 0, 1) for a in (-1, 0, 1) if d or a):
        rows = np.clip(np.arange(len(pixels)) + down, 0, len(pixels) - 1)
        near = np.roll(pixels[rows], across, axis=1)
        larger = near.max(axis=2) > most
        most[larger], of[larger] = near.max(axis=2)[larger], near[larger]
    own = np.clip(BRIGHTER * brightness / np.maximum(most, 1e-30), 0.0, 1.0)[..., None]
    if own.min() >= 1.0:
        return pixels
    dim = np.maximum(luminance_from_linear_rgb(pixels), LEAST * luminance_from_linear_rgb(of))[..., None]
    hue = own * pixels / np.maximum(dim, 1e-30)
    hue = hue + (1 - own) * of / np.maximum(luminance_from_linear_rgb(of)[..., None], 1e-30)
    hue = hue / np.maximum(luminance_from_linear_rgb(hue)[..., None], 1e-30)
    return np.ascontiguousarray(np.where(own < 1.0, hue * dim, pixels), dtype=np.float32)
