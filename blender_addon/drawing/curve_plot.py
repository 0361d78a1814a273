# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry of a plot of spectra in pixels, without Blender, for the overlay and for tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .curve_image import SPAN_NM

Array = NDArray[np.float64]
TICKS_NM = (400, 500, 600, 700)


@dataclass(frozen=True, slots=True)
class Plot:
    """A rectangle of pixels, (x, y) its lower left corner; values from ``low`` to ``high`` fill its height."""

    x: float
    y: float
    width: float
    height: float
    low: float = 0.0
    high: float = 1.0

    def across(self, wavelengths_nm: ArrayLike) -> Array:
        """Pixels along x of wavelengths."""
        first, last = SPAN_NM
        return self.x + self.width * (np.asarray(wavelengths_nm, dtype=np.float64) - first) / (last - first)

    def up(self, values: ArrayLike) -> Array:
        """Pixels along y of values."""
        return self.y + self.height * (np.asarray(values, dtype=np.float64) - self.low) / (self.high - self.low)

    def line(self, wavelengths_nm: Array, values: Array) -> Array:
        """Points (n, 2) of a spectrum, cut at the plot's left and right edge."""
        first, last = SPAN_NM
        inside = (wavelengths_nm > first) & (wavelengths_nm < last)
        x = np.concatenate([[first], wavelengths_nm[inside], [last]])
        y = np.interp(x, wavelengths_nm, values, left=0.0, right=0.0)
        keep = (x >= wavelengths_nm[0]) & (x <= wavelengths_nm[-1])  # no line down to zero outside the measured range
        return np.stack([self.across(x[keep]), self.up(y[keep])], axis=1)

    def corners(self) -> Array:
        """Two triangles (6, 2) that fill the rectangle."""
        left, right, bottom, top = self.x, self.x + self.width, self.y, self.y + self.height
        return np.array([(left, bottom), (right, bottom), (right, top), (left, bottom), (right, top), (left, top)])

    def within(self, *, left: float, bottom: float, right: float, top: float) -> Plot:
        """A smaller plot inside this one: the margins, in pixels, have room for numbers and names."""
        return Plot(
            self.x + left,
            self.y + bottom,
            self.width - left - right,
            self.height - bottom - top,
            self.low,
            self.high,
        )

    def rules(self) -> list[Array]:
        """The two ends (2, 2) of the horizontal lines at the least and the greatest value."""
        return [
            np.array([(self.x, self.up(value)), (self.x + self.width, self.up(value))])
            for value in (self.low, self.high)
        ]

    def ticks(self) -> list[tuple[int, Array]]:
        """Each marked wavelength and the two ends (2, 2) of its line."""
        return [
            (mark, np.array([(self.across(mark), self.y), (self.across(mark), self.y + self.height)]))
            for mark in TICKS_NM
        ]


def side_by_side(
    region: tuple[float, float],
    ranges: list[tuple[float, float]],
    margin: float,
    left: float = 0.0,
    bottom: float = 0.0,
) -> list[Plot]:
    """One plot per range of values, along the bottom of a region of (width, height) pixels; none if it is too small.

    Plots begin above ``bottom`` and share the width past ``left``; they are at most a third of the height, and two
    thirds as high as wide.
    """
    width = min((region[0] - left - margin) / len(ranges) - margin, 2.4 * region[1] / 3)
    height = min(region[1] / 3, width * 0.55)
    if width < 120 or height < 60:
        return []
    return [
        Plot(left + margin + number * (width + margin), bottom + margin, width, height, low, high)
        for number, (low, high) in enumerate(ranges)
    ]
