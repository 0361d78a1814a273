# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of pictures that are drawn again from the noise of their own neighborhoods.

Where bright light comes on rare paths, most pixels have met none of it: both halves agree there and are too dark by the
same amount, and where one half has met it, the other has not. So the difference of the halves is pooled over a few
neighboring pixels: its size in a pixel, or nothing, with equal chances, is the noise of one half above its darker
values. Sums of such draws have the right variance for common noise, and for rare light the right skewness as well; sums
of more draws are pictures with more samples.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb

Array = NDArray[np.float64]

POOL = (4, 2)
"""Columns and rows of the pixels whose noise is pooled. More of them would smear the noise of small caustics."""
BLOCK = (8, 4)
"""Columns and rows of pools in a block. Rare light is estimated per block, because most pools hold none of it."""
_LEAST_SCALE = 0.1
"""Least brightness of a pixel relative to its block by which noise is scaled: noise of a texture follows its albedo."""


class PooledNoise:
    """The noise of the ``halves`` (2, n, 3) of a picture; ``blocks``: (n,) number of each pixel's block, from 0."""

    def __init__(self, halves: Array, blocks: NDArray[np.integer[Any]]) -> None:
        first, second = halves
        self._order = np.argsort(blocks, kind="stable")
        self._sizes = np.bincount(blocks)
        self._starts = np.cumsum(self._sizes) - self._sizes
        self._blocks = blocks
        away = first - second
        upward = luminance_from_linear_rgb(away) >= 0
        away = np.where(upward[:, None], away, -away)
        dark = np.maximum(np.where(upward[:, None], second, first), 0.0)
        light = luminance_from_linear_rgb(dark) + np.maximum(self._means(luminance_from_linear_rgb(away)) / 2, 0.0)
        self._scale = np.maximum(light / np.maximum(self._means(light), 1e-12), _LEAST_SCALE)[:, None]
        self._away = away / self._scale
        self._mean = self._means(self._away) / 2
        self._limit = np.maximum(dark + self._mean * self._scale, 0.0)

    def errors(self, parts: int, some: NDArray[np.int64] | None = None) -> Array:
        """ΔE2000 (n,) of a picture with the samples of one half (``parts`` 1) or of both (2); ``some``: indices of the
        wanted pixels.
        """
        rng = np.random.default_rng(1)
        some = np.arange(len(self._blocks)) if some is None else some
        count = len(some)
        total = np.zeros((count, 3))
        starts, sizes = self._starts[self._blocks[some]], self._sizes[self._blocks[some]]
        for _ in range(parts):
            drawn = self._order[starts + (rng.random(count) * sizes).astype(np.int64)]
            total += self._away[drawn] * (rng.random(count) < 0.5)[:, None]
        # a draw or nothing lacks the square of the mean of the variance of the difference
        mean, limit = self._mean[some], self._limit[some]
        rest = _REST * rng.choice([-1.0, 1.0], count)[:, None] * mean / np.sqrt(parts)
        noise = (total / parts - mean + rest) * self._scale[some]
        return np.asarray(delta_e_2000(_lab(limit + noise), _lab(limit)))

    def _means(self, values: Array) -> Array:
        """Mean of each pixel's block, (n,) or (n, 3)."""
        columns = values.reshape(len(values), -1).T
        sums = np.stack([np.bincount(self._blocks, column) for column in columns], axis=1)
        means = (sums / self._sizes[:, None])[self._blocks]
        return means if values.ndim == 2 else means[:, 0]


def pools(pixels: NDArray[np.integer[Any]], width: int, shape: tuple[int, int] = POOL) -> NDArray[np.int64]:
    """Number (n,) of the pool of each pixel of a picture of that width, row by row from 0."""
    across = -(-width // shape[0])
    return np.asarray(pixels // width // shape[1] * across + pixels % width // shape[0], dtype=np.int64)


_REST = 0.7
"""Part of the missing deviation that is added: 1 is right for common noise, 0 for rare light."""


def _lab(pixels: Array) -> Array:
    return lab_from_linear_rgb(np.maximum(pixels, 0.0))
