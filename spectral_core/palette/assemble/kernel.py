# SPDX-License-Identifier: GPL-3.0-or-later
"""From light and reflectance to color, for several observers at once: the bilinear map under every palette.

The same integrals as ``spectral_core.spectra.observer.xyz_from_product``, arranged so that all lights or all
reflectances are integrated in one matrix product; a test holds the two equal.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import STANDARD, Observer, integration_points, observer
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]


class ColorKernel:
    """Integrals over one grid for O observers, in linear sRGB.

    Further observers are scaled so that an equal-energy light has the same luminance for them as for the first one,
    which makes their colors comparable. ``points_nm``, (m,), are the wavelengths of the sums: all knots of the grid and
    of the observer with the middles between them, on which Simpson's rule integrates the product of light, reflectance
    and color matching function without error.
    """

    def __init__(self, grid: SpectralGrid, observers: tuple[str, ...], knots_nm: Array | None = None) -> None:
        self.grid = grid
        self.observers = observers
        self._edges: Array | None = None
        if grid.interpolation == "sampled":
            self.points_nm, step = grid.wavelengths_nm, grid.cell_widths_nm
            self._at_points: Array | None = None
        else:
            self._edges = self._cell_edges(knots_nm)
            self.points_nm = np.empty(2 * self._edges.size - 1)
            self.points_nm[::2], self.points_nm[1::2] = self._edges, (self._edges[1:] + self._edges[:-1]) / 2
            step = _summed_by_cell(np.diff(self._edges)[:, None] * np.array([1.0, 4.0, 1.0]) / 6)
            self._at_points = grid.values_from_knots(self.points_nm)
        self._step = step
        first = _equal_energy_luminance(observer(observers[0]))
        self.rgb_cmfs = np.stack([self._rgb_cmfs(observer(name), first) * step for name in observers])

    def _cell_edges(self, knots_nm: Array | None) -> Array:
        standard, knots = observer(STANDARD).wavelengths_nm, self.grid.wavelengths_nm
        low, high = max(knots[0], standard[0]), min(knots[-1], standard[-1])
        union = np.unique(np.concatenate([knots, standard] if knots_nm is None else [knots, standard, knots_nm]))
        inside = union[(union >= low) & (union <= high)]
        return inside if inside.size > 1 else standard  # a grid that no eye sees has colors of zero

    def _rgb_cmfs(self, viewer: Observer, luminance: float) -> Array:
        """Color matching functions (3, m) in linear sRGB at the points."""
        cmfs = [np.interp(self.points_nm, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs]
        return RGB_FROM_XYZ @ np.stack(cmfs) * (luminance / _equal_energy_luminance(viewer))

    def at_points(self, values: Array) -> Array:
        """Spectra (k, n) of the grid at the points: (k, m)."""
        return values if self._at_points is None else values @ self._at_points.T

    def spectrum_at_points(self, spectrum: Spectrum) -> Array:
        """Any spectrum, on its own grid, as values at the points: (m,).

        They are the spectrum's own where its knots are among the points. A line between two points becomes the three
        values that give the same integral with everything quadratic within the cell, as the product of the unknown
        spectrum and the observer is.
        """
        if self._edges is None:
            return spectrum.at(self.points_nm)
        edges = self._edges
        wavelengths, weights = integration_points(edges, spectrum.grid.wavelengths_nm)
        cell = np.clip(np.searchsorted(edges, wavelengths, side="right") - 1, 0, edges.size - 2)
        t = (wavelengths - edges[cell]) / (edges[cell + 1] - edges[cell])
        amount = weights * spectrum.at(wavelengths)
        quadratics = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
        moments = [np.bincount(cell, amount * each, edges.size - 1) for each in quadratics]
        return _summed_by_cell(np.stack(moments, axis=1)) / self._step

    def matrices(self, known_at_points: Array) -> Array:
        """Color matrices (O, k, 3, n) of k known factors (k, m): color = matrix @ values of the unknown factor."""
        weighted = known_at_points[None, :, None, :] * self.rgb_cmfs[:, None, :, :]
        return weighted if self._at_points is None else weighted @ self._at_points

    def colors(self, reflectances_at_points: Array, lights_at_points: Array) -> Array:
        """Linear RGB (O, R, L, 3) of R reflectances (R, m) under L lights (L, m)."""
        stimuli = lights_at_points[None, :, None, :] * self.rgb_cmfs[:, None, :, :]
        return np.moveaxis(stimuli @ reflectances_at_points.T, 3, 1)


def _summed_by_cell(values: Array) -> Array:
    """Values (c, 3) at the start, middle and end of each cell as sums over the points, (2c + 1,)."""
    total = np.zeros(2 * len(values) + 1)
    total[1::2] = values[:, 1]
    total[:-2:2] += values[:, 0]
    total[2::2] += values[:, 2]
    return total


def _equal_energy_luminance(viewer: Observer) -> float:
    """∫ ȳ dλ, exactly: ȳ is linear between its knots."""
    y = viewer.cmfs[1]
    return float(np.dot(np.diff(viewer.wavelengths_nm), (y[1:] + y[:-1]) / 2))


@lru_cache(maxsize=16)
def _kernel(wavelengths: bytes, interpolation: str, observers: tuple[str, ...], knots: bytes) -> ColorKernel:
    grid = SpectralGrid(np.frombuffer(wavelengths), interpolation)  # type: ignore[arg-type]
    return ColorKernel(grid, observers, np.frombuffer(knots) if knots else None)


def color_kernel(
    grid: SpectralGrid, observers: tuple[str, ...] = (STANDARD,), given: Iterable[Spectrum] = ()
) -> ColorKernel:
    """Give the kernel of a grid, kept for the next call.

    ``given``: reflectances that are known and may stand under lights that are known too, on any grids: their knots
    between whole nm become points, so that their product is exact as well.
    """
    knots = np.unique(np.concatenate([np.zeros(0), *(each.grid.wavelengths_nm for each in given)]))
    between = knots[knots != np.round(knots)]
    return _kernel(grid.wavelengths_nm.tobytes(), grid.interpolation, observers, between.tobytes())
