# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth spectra of colors at a hit point, from Mitsuba's own table."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from spectral_core.render.plugins.numbers import table


@cache
def _file() -> tuple[np.ndarray, np.ndarray]:
    """Lightness nodes (n,) and coefficients, flat over (3, n, n, n, 3)."""
    import mitsuba

    data = (Path(mitsuba.__file__).parent / "data" / "srgb.coeff").read_bytes()
    size = int.from_bytes(data[4:8], "little")
    numbers = np.frombuffer(data, "<f4", offset=8)
    return numbers[:size].copy(), numbers[size : size + 9 * size**3].copy()


class Upsampling:
    """Linear sRGB in [0, 1] to a reflectance at a hit's wavelengths (Jakob and Hanika 2019)."""

    def __init__(self, mi: Any, dr: Any) -> None:
        self.mi, self.dr = mi, dr
        scale, coefficients = _file()
        self.size = len(scale)
        self.scale, self.table = table(mi.Float, scale), table(mi.Float, coefficients)

    def __call__(self, rgb: Any, wavelengths: Any) -> Any:
        """Spectrum of a color (three arrays) at ``wavelengths``."""
        mi, dr, n = self.mi, self.dr, self.size
        r, g, b = (dr.clip(c, 0.0, 1.0) for c in rgb)
        largest = dr.select((r > g) & (r > b), mi.UInt32(0), dr.select(g > b, mi.UInt32(1), mi.UInt32(2)))
        z = dr.maximum(r, dr.maximum(g, b))
        x = dr.select(largest == 0, g, dr.select(largest == 1, b, r))
        y = dr.select(largest == 0, b, dr.select(largest == 1, r, g))
        safe = dr.maximum(z, 1e-4)
        x, y = x / safe * (n - 1.0), y / safe * (n - 1.0)
        xi, yi = (dr.minimum(mi.UInt32(c), n - 2) for c in (x, y))
        zi = dr.binary_search(0, n - 1, lambda k: dr.gather(mi.Float, self.scale, k) <= z)
        zi = dr.minimum(dr.maximum(zi, 1) - 1, n - 2)
        low, high = dr.gather(mi.Float, self.scale, zi), dr.gather(mi.Float, self.scale, zi + 1)
        fx, fy, fz = x - mi.Float(xi), y - mi.Float(yi), dr.clip((z - low) / (high - low), 0.0, 1.0)
        total = mi.Vector3f(0.0)
        for corner in range(8):
            dx, dy, dz = corner & 1, (corner >> 1) & 1, corner >> 2
            weight = (fx if dx else 1.0 - fx) * (fy if dy else 1.0 - fy) * (fz if dz else 1.0 - fz)
            index = ((largest * n + zi + dz) * n + yi + dy) * n + xi + dx
            total += weight * mi.Vector3f(*(dr.gather(mi.Float, self.table, index * 3 + k) for k in range(3)))
        value = dr.fma(dr.fma(total.x, wavelengths, total.y), wavelengths, total.z)
        smooth = 0.5 + 0.5 * value * dr.rsqrt(dr.fma(value, value, 1.0))
        # the table's coefficients of grays are nearly infinite; grays reflect all wavelengths equally
        gray = (r == g) & (g == b)
        return dr.select(gray, mi.Spectrum(z), smooth)
