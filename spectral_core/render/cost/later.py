# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of more samples than a probe has, block by block.

Noise that is drawn from a neighborhood (``resample``) has the long tails of rare light, whose error hardly falls at
first. Where light is common, a pixel's own noise, halved, predicts better; signs of rare light weigh the two.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.allocate import Laws
from spectral_core.render.cost.errors import pixel_errors
from spectral_core.render.cost.resample import PooledNoise

Array = NDArray[np.float64]

PARTS = (1, 2, 8, 32, 128)
"""Halves whose samples the drawn pictures have."""
DRAWN_PIXELS = 2048
"""Pixels at which they are drawn."""
FEWER = 4
"""Ratio of samples by which a law is compared with another."""
RARE_SHARE = 0.25
"""Share of the error in pixels that have met none of the light, from which on all noise counts as rare."""
LAG = 0.5
"""Part of the measured lag behind common noise that is expected after twice the samples."""


def later_laws(halves: Array, blocks: NDArray[np.integer[Any]], error: float, trend: float) -> Laws:
    """Laws of the blocks, by the number of halves whose samples a picture has.

    Parameters
    ----------
    halves
        (2, n, 3) means of the halves.
    blocks
        (n,) number of each pixel's block, from 0.
    error
        Mean ΔE2000 of a half, with light that most pixels have not met.
    trend
        Measured ratio of errors of four times as many samples, up to these.
    """
    parts = np.array(PARTS, dtype=np.float64)
    drawn = _drawn(halves, blocks)
    own = own_errors(halves, 1.0)
    fall = np.clip(own_errors(halves, FEWER**-0.5) / max(own, 1e-12), FEWER**-0.75, FEWER**-0.4)
    slow = float(np.clip(_at(drawn.mean(axis=1), FEWER) / max(float(drawn[0].mean()), 1e-12), fall, 1.0))
    missed = max(0.0, 1 - own / max(error, 1e-12)) / RARE_SHARE
    lags = LAG * (trend - fall) / max(slow - fall, 1e-6)
    rare = min(max(missed, lags, 0.0), 1.0)
    common = drawn[0] * parts[:, None] ** (np.log(fall) / np.log(FEWER))
    return Laws(parts, rare * drawn + (1 - rare) * np.minimum(common, drawn), np.bincount(blocks) / len(blocks))


def own_errors(halves: Array, scale: float) -> float:
    """Mean ΔE2000 of a half with the noise of each pixel alone, times ``scale``."""
    first, second = halves
    mean, away = (first + second) / 2, (first - second) / 2 * scale
    return float(np.mean(pixel_errors(mean + away, mean - away, of_half=True)))


def _at(errors: Array, count: float) -> float:
    """The error of a number of halves between those of ``PARTS``."""
    return float(np.exp(np.interp(np.log(count), np.log(PARTS), np.log(np.maximum(errors, 1e-12)))))


def _drawn(halves: Array, blocks: NDArray[np.integer[Any]]) -> Array:
    """(parts, blocks): error of each block, drawn from its noise so far."""
    noise = PooledNoise(halves, blocks)
    some, size = np.arange(len(blocks))[:: max(1, len(blocks) // DRAWN_PIXELS)], int(blocks.max()) + 1
    sums = np.array([np.bincount(blocks[some], noise.errors(parts, some), size) for parts in PARTS])
    counts = np.bincount(blocks[some], minlength=size)
    independent = np.array(PARTS)[:, None] ** -0.5
    return np.where(sums[0] > 1e-6 * counts, sums / np.maximum(counts, 1), independent)
