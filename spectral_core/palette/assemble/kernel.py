# SPDX-License-Identifier: GPL-3.0-or-later
"""From light and reflectance to color, for several observers at once: the bilinear map of every palette.

The same integrals as ``spectral_core.spectra.observer``: exact for spectra that are linear between their knots. If both
factors are designed on the palette's grid, only neighboring samples interact, so that three diagonals hold the map.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import (
    STANDARD,
    Observer,
    integration_points,
    observer,
    xyz_from_product,
    xyz_of,
)
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]


class ColorKernel:
    """Integrals over one grid for O observers, in linear sRGB.

    Further observers are scaled so that an equal-energy light has the same luminance for them as for the first one,
    which makes their colors comparable.
    """

    def __init__(self, grid: SpectralGrid, observers: tuple[str, ...]) -> None:
        self.grid = grid
        self.observers = observers
        self._viewers = [observer(name) for name in observers]
        first = _equal_energy_luminance(self._viewers[0])
        self._scales = [first / _equal_energy_luminance(viewer) for viewer in self._viewers]
        self.bare = self.matrix_of(None)
        """(O, 3, n): from a light on the grid to its color."""
        if grid.interpolation == "sampled":
            points, weights = grid.wavelengths_nm, grid.cell_widths_nm
        else:
            points, weights = integration_points(grid.wavelengths_nm, observer(STANDARD).wavelengths_nm)
        hats = grid.values_from_knots(points)
        stimuli = np.stack(
            [
                scale * RGB_FROM_XYZ @ _cmfs_at(viewer, points) * weights
                for viewer, scale in zip(self._viewers, self._scales, strict=True)
            ]
        )
        # A sample interacts with itself and the next one; on a sampled grid the hats are 1 at their knot and 0
        # elsewhere.
        self._own = stimuli @ hats**2  # (O, 3, n)
        self._next = stimuli @ (hats[:, :-1] * hats[:, 1:])  # (O, 3, n - 1)

    def matrices(self, values: Array) -> Array:
        """Color matrices (O, k, 3, n) of k factors (k, n) on the grid: color = matrix @ values of the other factor."""
        known = values[None, :, None, :]
        found = known * self._own[:, None]
        found[..., 1:] += known[..., :-1] * self._next[:, None]
        found[..., :-1] += known[..., 1:] * self._next[:, None]
        return np.asarray(found)

    def bent(self, observers: NDArray[np.intp], forces: Array) -> Array:
        """(m, n, n): second derivatives of force · color by both factors on the grid, for m observers and forces."""
        n = self.grid.size
        own = np.matmul(forces[:, None, :], self._own[observers])[:, 0]
        beside = np.matmul(forces[:, None, :], self._next[observers])[:, 0]
        found = np.zeros((len(forces), n * n))
        found[:, :: n + 1] = own
        found[:, 1 :: n + 1] = beside
        found[:, n :: n + 1] = beside
        return found.reshape(-1, n, n)

    def matrix_of(self, spectrum: Spectrum | None) -> Array:
        """Color matrix (O, 3, n) of a factor on any grid; None: 1 at every wavelength."""
        return np.stack(
            [
                scale * RGB_FROM_XYZ @ xyz_from_product(spectrum, self.grid, viewer)
                for viewer, scale in zip(self._viewers, self._scales, strict=True)
            ]
        )

    def color_of(self, light: Spectrum, surface: Spectrum | None = None) -> Array:
        """Linear RGB (O, 3) of a light, or of a surface under it, each on any grid."""
        if self.grid.interpolation == "sampled":
            shown = self.matrix_of(light)
            knots = self.grid.wavelengths_nm
            return shown @ (np.ones(self.grid.size) if surface is None else surface.at(knots))
        return np.stack(
            [
                scale * RGB_FROM_XYZ @ xyz_of(light, surface, viewer)
                for viewer, scale in zip(self._viewers, self._scales, strict=True)
            ]
        )


def _cmfs_at(viewer: Observer, points: Array) -> Array:
    return np.stack([np.interp(points, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])


def _equal_energy_luminance(viewer: Observer) -> float:
    """∫ ȳ dλ, exactly: ȳ is linear between its knots."""
    y = viewer.cmfs[1]
    return float(np.dot(np.diff(viewer.wavelengths_nm), (y[1:] + y[:-1]) / 2))


@lru_cache(maxsize=16)
def _kernel(wavelengths: bytes, interpolation: str, observers: tuple[str, ...]) -> ColorKernel:
    grid = SpectralGrid(np.frombuffer(wavelengths), interpolation)  # type: ignore[arg-type]
    return ColorKernel(grid, observers)


def color_kernel(grid: SpectralGrid, observers: tuple[str, ...] = (STANDARD,)) -> ColorKernel:
    """The kernel of a grid, kept for the next call."""
    return _kernel(grid.wavelengths_nm.tobytes(), grid.interpolation, observers)
