# SPDX-License-Identifier: GPL-3.0-or-later
"""Distribute samples over a picture: as few as possible for a wanted mean error, or the smallest error for a number.

A part of the picture with error a/√n after n samples per pixel costs least, for a mean of errors, at n ∝ a^(2/3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEAST_ERROR = 1e-4


def for_error(errors: Array, counts: Array, wanted: float, weights: Array) -> Array:
    """Samples (n,), none fewer than ``counts``, after which the weighted mean of ``errors`` is ``wanted``.

    ``errors``: ΔE2000 of each part after ``counts`` samples; ``weights``: pixels of each part.
    """
    if _mean(errors, counts, counts, weights) <= wanted:
        return counts
    low, high = 1e-3, 1e9
    for _ in range(80):
        middle = np.sqrt(low * high)
        reached = _mean(errors, counts, _spread(errors, counts, middle), weights) <= wanted
        low, high = (low, middle) if reached else (middle, high)
    return _spread(errors, counts, high)


def for_samples(errors: Array, counts: Array, total: float, weights: Array) -> Array:
    """Samples (n,), none fewer than ``counts``, of a weighted sum ``total``, that leave the smallest mean error."""
    low, high = 1e-6, 1e12
    for _ in range(100):
        middle = np.sqrt(low * high)
        too_many = float(weights @ _spread(errors, counts, middle)) > total
        low, high = (low, middle) if too_many else (middle, high)
    return _spread(errors, counts, low)


def _spread(errors: Array, counts: Array, scale: float) -> Array:
    strength = np.maximum(errors, _LEAST_ERROR) * np.sqrt(counts)
    return np.asarray(np.maximum(counts, scale * strength ** (2 / 3)))


def _mean(errors: Array, counts: Array, after: Array, weights: Array) -> float:
    return float(weights @ (errors * np.sqrt(counts / after)) / weights.sum())
