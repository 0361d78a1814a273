# SPDX-License-Identifier: GPL-3.0-or-later
"""Distribute samples over a picture: as few as possible for a wanted mean error, or the smallest error for a number.

A part of the picture with error a/√n after n samples per pixel costs least, for a mean of errors, at n ∝ a^(2/3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEAST_ERROR = 1e-4
_STEPS = 4


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


@dataclass(frozen=True, slots=True, eq=False)
class Laws:
    """Error of each part of a picture by its samples: ``errors`` (counts, parts) after ``counts``, ascending.

    Between the counts the laws are linear in logarithms, outside of them the error is that of independent samples.
    ``weights`` (parts,): shares of the parts.
    """

    counts: Array
    errors: Array
    weights: Array

    def error(self, samples: Array) -> Array:
        """Error of each part after ``samples`` (parts,)."""
        x, grid = np.log(samples), np.log(self.counts)
        logs = np.log(np.maximum(self.errors, _LEAST_ERROR))
        before = np.clip(np.searchsorted(grid, x) - 1, 0, len(grid) - 2)
        parts = np.arange(len(samples))
        low, high = logs[before, parts], logs[before + 1, parts]
        inside = low + (high - low) * (x - grid[before]) / (grid[before + 1] - grid[before])
        outside = np.where(x < grid[0], logs[0] - 0.5 * (x - grid[0]), logs[-1] - 0.5 * (x - grid[-1]))
        return np.asarray(np.exp(np.where((x < grid[0]) | (x > grid[-1]), outside, inside)))

    def mean(self, samples: Array) -> float:
        """Mean error of the picture."""
        return float(self.weights @ self.error(samples)) / float(self.weights.sum())

    def spread(self, scale: float, least: float) -> Array:
        """Samples (parts,), none fewer than ``least``, by the rule of this module."""
        samples = np.full(len(self.weights), float(least))
        for _ in range(_STEPS):  # the strength depends on the samples where light is rare
            strength = np.maximum(self.error(samples), _LEAST_ERROR) * np.sqrt(samples)
            samples = np.maximum(least, scale * strength ** (2 / 3))
        return samples

    def for_error(self, wanted: float, least: float) -> Array:
        """Samples (parts,) after which the mean error is ``wanted``."""
        return self._until(lambda samples: self.mean(samples) <= wanted, least)

    def for_samples(self, total: float, least: float) -> Array:
        """Samples (parts,) of a mean of ``total``."""
        share = self.weights / self.weights.sum()
        return self._until(lambda samples: float(share @ samples) >= total, least)

    def _until(self, reached: Callable[[Array], bool], least: float) -> Array:
        low, high = 1e-4, 1e9
        for _ in range(60):
            middle = np.sqrt(low * high)
            low, high = (low, middle) if reached(self.spread(middle, least)) else (middle, high)
        return self.spread(high, least)
