# SPDX-License-Identifier: GPL-3.0-or-later
"""The backend for constant folding, baking and tests: NumPy arrays, float64 unless float32 is requested."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


class NumPy:
    """Functions that operations may use, on NumPy arrays that broadcast."""

    sin, cos, tan, atan, exp, tanh = np.sin, np.cos, np.tan, np.arctan, np.exp, np.tanh
    floor, ceil, trunc, absolute = np.floor, np.ceil, np.trunc, np.abs
    atan2, minimum, maximum = np.arctan2, np.minimum, np.maximum
    sinh, cosh = np.sinh, np.cosh

    def __init__(self, dtype: Any = np.float64) -> None:
        self.dtype = np.dtype(dtype)

    def number(self, value: Any) -> Any:
        """An array of this backend's type."""
        return np.asarray(value, dtype=self.dtype)

    def where(self, condition: Any, yes: Any, no: Any) -> Any:
        """Choice per element."""
        return np.where(condition, yes, no)

    def sqrt(self, value: Any) -> Any:
        """Square root, 0 for negative numbers."""
        return np.sqrt(np.maximum(value, 0))

    def log(self, value: Any) -> Any:
        """Natural logarithm."""
        return np.log(value)

    def asin(self, value: Any) -> Any:
        """Arc sine of a number clipped to [-1, 1]."""
        return np.arcsin(np.clip(value, -1, 1))

    def acos(self, value: Any) -> Any:
        """Arc cosine of a number clipped to [-1, 1]."""
        return np.arccos(np.clip(value, -1, 1))

    def power(self, base: Any, exponent: Any) -> Any:
        """Power of a base over 0."""
        return np.power(base, exponent)

    def fmod(self, a: Any, b: Any) -> Any:
        """Remainder of a / b with the sign of ``a``, without rounding."""
        return np.fmod(a, b)

    def isfinite(self, value: Any) -> Any:
        """True for finite numbers."""
        return np.isfinite(value)

    def integer(self, value: Any) -> Any:
        """Whole numbers as 32-bit patterns that wrap around."""
        return np.asarray(value).astype(np.int64).astype(np.uint32)

    def signed(self, value: Any) -> Any:
        """The same pattern as a signed whole number."""
        return np.asarray(value).astype(np.int32)

    def bits(self, value: Any) -> Any:
        """Bit pattern of single-precision numbers."""
        return np.asarray(value, dtype=np.float32).view(np.uint32)

    def real(self, value: Any) -> Any:
        """A whole number as a number."""
        return np.asarray(value).astype(self.dtype)

    def loop(self, state: tuple[Any, ...], goes_on: Callable[..., Any], body: Callable[..., Any]) -> tuple[Any, ...]:
        """Repeat ``body`` on each element while ``goes_on`` holds for it."""
        while True:
            active = np.asarray(goes_on(*state))
            if not active.any():
                return state
            state = tuple(np.where(active, new, old) for new, old in zip(body(*state), state, strict=True))

    def fused(self, a: Any, b: Any, c: Any) -> Any:
        """a · b + c with one rounding: exact in double precision for single-precision numbers."""
        return (np.asarray(a, np.float64) * np.asarray(b, np.float64) + c).astype(self.dtype)

    def entry(self, table: Any, index: Any, column: int) -> Any:
        """Entry of a table (rows, columns) at whole-numbered rows."""
        rows = np.clip(np.asarray(index).astype(np.int64), 0, len(table) - 1)
        return np.asarray(table)[rows, column].astype(self.dtype)

    def last_row(self, table: Any) -> Any:
        """Number of the last row of a table."""
        return float(len(table) - 1)

    def texel(self, image: Any, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
        """Stored color and alpha in [0, 1] or beyond, at integer positions inside the image."""
        pixels = image.pixels
        found = pixels[np.asarray(row).astype(np.int64), np.asarray(column).astype(np.int64)]
        found = found.astype(self.dtype) / (255.0 if pixels.dtype == np.uint8 else 1.0)
        channels = [found[..., min(k, found.shape[-1] - 1)] for k in range(3)]
        return channels[0], channels[1], channels[2], found[..., 3] if found.shape[-1] == 4 else 1.0 + 0 * channels[0]

    def size(self, image: Any) -> tuple[Any, Any]:
        """Width and height of an image."""
        return float(image.pixels.shape[1]), float(image.pixels.shape[0])

    def open_share(self, normal: Any, distance: Any, samples: int, inside: bool, own: bool) -> Any:
        """Where there is no scene, nothing is near."""
        return 1.0 + 0.0 * (normal[0] + distance)

    def rounded(self, normal: Any, radius: Any, samples: int) -> Any:
        """Where there is no scene, there are no edges."""
        return normal

    def edge_distance(self, in_pixels: bool) -> Any:
        """Where there is no scene, there are no triangles."""
        return self.number(1e9)
