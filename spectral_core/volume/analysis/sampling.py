# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling of a mapped function g(f(x)) of one variable at a chosen rate, and its reconstruction, as in Figs. 4.1 and
4.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.volume.analysis.signal import require_function, require_interval

Function = Callable[[NDArray], ArrayLike]


@dataclass(frozen=True)
class RegularSamples:
    """Samples of a function at ``start + i * distance`` and the sinc interpolant through them."""

    start: float
    distance: float
    samples: NDArray[np.float64]
    interval: tuple[float, float]
    """The interval of interest; samples lie on both sides of it, so that its ends are reconstructed as well as its
    middle.
    """

    @property
    def positions(self) -> NDArray[np.float64]:
        """(n,) all sample positions, those of the margins included."""
        return self.start + self.distance * np.arange(self.samples.size)

    @property
    def count_inside(self) -> int:
        """Number of samples inside the interval, the cost of the rate."""
        inside = (self.positions >= self.interval[0]) & (self.positions <= self.interval[1])
        return int(inside.sum())

    def __call__(self, x: ArrayLike) -> NDArray[np.float64]:
        """The sinc interpolant at ``x`` (any shape)."""
        place = (np.asarray(x, dtype=np.float64) - self.start) / self.distance
        nearest, number = np.round(place), np.arange(self.samples.size)
        beside = place - nearest
        # sin(π·(place - i)) is the same at all samples i but for its sign, so that one sine per place is enough.
        sine = np.sin(np.pi * beside) / np.pi
        offsets = beside[..., None] + (nearest[..., None] - number)
        weights = np.divide(sine[..., None], offsets, out=np.ones_like(offsets), where=offsets != 0.0)
        return np.where(nearest % 2 == 0, 1.0, -1.0) * (
            weights @ np.where(number % 2 == 0, self.samples, -self.samples)
        )


def sample_composition(
    f: Function,
    g: Function,
    interval: tuple[float, float],
    frequency: float,
    *,
    oversampling: float = 2.0,
    margin: int = 512,
) -> RegularSamples:
    """Samples of g(f(x)) over ``interval`` at ``oversampling`` times the Nyquist rate of the angular ``frequency``.

    Give ``CompositeBandlimit.frequency`` or ``.product_frequency`` to compare the two bounds. ``margin`` more samples
    on each side keep the truncation of the sinc series away from the interval; f and g must be defined there.
    """
    require_function(f)
    require_function(g)
    if not isinstance(interval, tuple | list) or len(interval) != 2:
        raise InvalidInputError(f"the interval is {interval}; expected two numbers, its ends")
    low, high = interval
    require_interval(low, high)
    require_range("frequency", frequency, 1e-300, 1e300, " rad per unit length")
    require_whole("margin", margin, 0, 10_000_000)
    require_range("oversampling", oversampling, 1e-6, 1e6)
    distance = math.pi / (frequency * oversampling)
    inside = math.ceil((high - low) / distance)
    if inside > 10_000_000:
        raise InvalidInputError(
            f"{counted(inside, 'sample')} over {low} to {high} were requested; lower the frequency, {frequency:g}"
        )
    start = low - margin * distance
    positions = start + distance * np.arange(inside + 1 + 2 * margin)
    return RegularSamples(start, distance, np.asarray(g(np.asarray(f(positions))), dtype=np.float64), (low, high))


def reconstruction_snr(samples: RegularSamples, function: Function, count: int = 4096) -> float:
    """Signal to noise ratio in dB, 10 log10(|h|² / |h − r|²), of the interpolant r against ``function`` h."""
    require_kind("the samples", samples, RegularSamples, "sample_composition")
    require_function(function)
    x = np.linspace(*samples.interval, require_whole("count", count, 2, 1 << 30))
    expected = np.asarray(function(x), dtype=np.float64)
    noise = float(np.sum((expected - samples(x)) ** 2))
    return math.inf if noise == 0 else 10 * math.log10(float(np.sum(expected**2)) / noise)
