# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of an environment image as Mitsuba reads them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
