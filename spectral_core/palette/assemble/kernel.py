# SPDX-License-Identifier: GPL-3.0-or-later
"""From light and reflectance to color, for several observers at once: the bilinear map under every palette.

The same integrals as ``spectral_core.spectra.observer.xyz_from_product``, arranged so that all lights or all
reflectances are integrated in one matrix product; a test holds the two equal.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]


class ColorKernel:
    """Integrals over one grid for O observers, in linear sRGB.

    Further observers are scaled so that an equal-energy light has the same luminance for them as for the first one,
    which makes their colors comparable; ``points_nm`` are the wavelengths of the sums, (m,).
    """

    def __init__(self, grid: SpectralGrid, observers: tuple[str, ...]) -> None:
        self.grid = grid
        self.observers = observers
        standard = observer(STANDARD)
        if grid.interpolation == "sampled":
            self.points_nm, step = grid.wavelengths_nm, grid.cell_widths_nm
            self._at_points: Array | None = None
        else:
            self.points_nm, step = standard.wavelengths_nm, np.ones(standard.wavelengths_nm.size)
            self._at_points = grid.values_from_knots(self.points_nm)
        first = float(observer(observers[0]).cmfs[1].sum())
        self.rgb_cmfs = np.stack([self._rgb_cmfs(name, first) * step for name in observers])

    def _rgb_cmfs(self, name: str, luminance: float) -> Array:
        """Color matching functions (3, m) in linear sRGB at the points."""
        viewer = observer(name)
        cmfs = [np.interp(self.points_nm, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs]
        return RGB_FROM_XYZ @ np.stack(cmfs) * (luminance / viewer.cmfs[1].sum())

    def at_points(self, values: Array) -> Array:
        """Spectra (k, n) of the grid at the points: (k, m)."""
        return values if self._at_points is None else values @ self._at_points.T

    def spectrum_at_points(self, spectrum: Spectrum) -> Array:
        """Any spectrum, on its own grid, at the points: (m,)."""
        return spectrum.at(self.points_nm)

    def matrices(self, known_at_points: Array) -> Array:
        """Color matrices (O, k, 3, n) of k known factors (k, m): color = matrix @ values of the unknown factor."""
        weighted = known_at_points[None, :, None, :] * self.rgb_cmfs[:, None, :, :]
        return weighted if self._at_points is None else weighted @ self._at_points

    def colors(self, reflectances_at_points: Array, lights_at_points: Array) -> Array:
        """Linear RGB (O, R, L, 3) of R reflectances (R, m) under L lights (L, m)."""
        stimuli = lights_at_points[None, :, None, :] * self.rgb_cmfs[:, None, :, :]
        return np.moveaxis(stimuli @ reflectances_at_points.T, 3, 1)


@lru_cache(maxsize=16)
def _kernel(wavelengths: bytes, interpolation: str, observers: tuple[str, ...]) -> ColorKernel:
    grid = SpectralGrid(np.frombuffer(wavelengths), interpolation)  # type: ignore[arg-type]
    return ColorKernel(grid, observers)


def color_kernel(grid: SpectralGrid, observers: tuple[str, ...] = (STANDARD,)) -> ColorKernel:
    """The kernel of a grid, kept for the next call."""
    return _kernel(grid.wavelengths_nm.tobytes(), grid.interpolation, observers)
