# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixel filters as densities to draw from: every sample lands in its own pixel with weight 1, as Cycles does.

Drawing the filter instead of splatting through it keeps pixels independent, which makes renders repeatable bit for
bit, lets a picture be rendered in tiles and leaves the noise white.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import Film

OFFSET_TABLE_SIZE = 1024


def filter_offsets(film: Film) -> NDArray[np.float32]:
    """Inverse cumulative distribution (1025,) of the pixel filter: offset from the pixel center, in pixels.

    Blackman-Harris of full width ``film.filter_width`` (Harris 1978, the 4-term window, Cycles' default), a
    Gaussian, exp(-2 (6 x / width)²) at x pixels from the center (Cycles' second), or a box.
    """
    steps = np.linspace(-0.5, 0.5, 8 * OFFSET_TABLE_SIZE + 1)
    if film.filter_kind == "box":
        weights = np.ones_like(steps)
    elif film.filter_kind == "gaussian":
        weights = np.exp(-2.0 * (6.0 * steps) ** 2)
    else:
        phase = 2 * np.pi * (steps + 0.5)
        weights = 0.35875 - 0.48829 * np.cos(phase) + 0.14128 * np.cos(2 * phase) - 0.01168 * np.cos(3 * phase)
    cumulative = np.concatenate([[0.0], np.cumsum((weights[1:] + weights[:-1]) / 2)])
    cumulative /= cumulative[-1]
    draws = np.linspace(0, 1, OFFSET_TABLE_SIZE + 1)
    return (np.interp(draws, cumulative, steps) * film.filter_width).astype(np.float32)
