# SPDX-License-Identifier: GPL-3.0-or-later
"""Observers: color matching functions at 1 nm, and the matrices that integrate spectra into XYZ.

All integrals are sums over 1 nm steps of the tables that the CIE publishes. A product of two spectra that are
linear between knots (a light on a surface) is integrated as such, tri-linearly, not as a product of bins.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]

OBSERVER_NAMES = ("cie_1931_2deg", "cie_1964_10deg", "cie_2015_2deg", "cie_2015_10deg")


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """Color matching functions. ``wavelengths_nm``: (n,), 1 nm steps; ``cmfs``: (3, n) for x̄, ȳ, z̄."""

    name: str
    wavelengths_nm: Array
    cmfs: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "wavelengths_nm", frozen_array("wavelengths_nm", self.wavelengths_nm, (None,)))
        object.__setattr__(self, "cmfs", frozen_array("cmfs", self.cmfs, (3, self.wavelengths_nm.size)))


@cache
def observer(name: str = "cie_1931_2deg") -> Observer:
    """Standard observer by name (OBSERVER_NAMES). Raises UnknownNameError."""
    if name not in OBSERVER_NAMES:
        raise UnknownNameError.among("observer", name, OBSERVER_NAMES)
    wavelengths, cmfs = catalogue.color_matching_functions(name)
    return Observer(name, wavelengths, cmfs)


STANDARD = "cie_1931_2deg"
"""The observer used where none is named; the one that sRGB and the renderer are defined with."""


def xyz_from_spectrum(grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Matrix (3, n) that integrates a radiance spectrum of ``grid`` into XYZ: ∫ hat_j · cmf dλ, in nm."""
    return xyz_from_product(None, grid, viewer)


def xyz_from_product(fixed: Spectrum | None, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Matrix (3, n) from the unknown factor of a product of spectra to XYZ: ∫ fixed · hat_j · cmf dλ (Eq. 5.8).

    ``fixed`` is the known factor on any grid (the light when a reflectance is sought, the surface when a light is),
    None for 1. On a ``"sampled"`` grid this is the thesis' plain sum over knots.
    """
    viewer = viewer or observer(STANDARD)
    if grid.interpolation == "sampled":
        knots = grid.wavelengths_nm
        cmfs = np.stack([np.interp(knots, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])
        weights = grid.cell_widths_nm if fixed is None else fixed.at(knots) * grid.cell_widths_nm
        return cmfs * weights
    wavelengths = viewer.wavelengths_nm
    known = np.ones_like(wavelengths) if fixed is None else fixed.at(wavelengths)
    return (viewer.cmfs * known) @ grid.values_from_knots(wavelengths)


def linear_rgb_from_product(fixed: Spectrum | None, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """xyz_from_product followed by the sRGB matrix: (3, n)."""
    return RGB_FROM_XYZ @ xyz_from_product(fixed, grid, viewer)


def xyz_of(light: Spectrum, surface: Spectrum | None = None, viewer: Observer | None = None) -> Array:
    """XYZ (3,) of a light, or of a surface under it, both on any grids; not normalized."""
    viewer = viewer or observer(STANDARD)
    stimulus = light.at(viewer.wavelengths_nm)
    if surface is not None:
        stimulus = stimulus * surface.at(viewer.wavelengths_nm)
    return viewer.cmfs @ stimulus


def normalized(light: Illuminant, viewer: Observer | None = None, luminance: float = 1.0) -> Illuminant:
    """The light scaled so that a perfect white under it has Y = ``luminance``, on the light's own grid.

    Raises InvalidInputError where the light gives this observer no luminance at all.
    """
    total = float((xyz_from_spectrum(light.grid, viewer) @ light.values)[1])
    if total <= 0:
        raise InvalidInputError(
            f"illuminant {light.name!r} on {light.grid} has no luminance (Y = {total:g}), so it cannot be normalized; "
            "give it power where the eye sees, 380 to 780 nm"
        )
    return light.scaled(luminance / total)


def xyz_of_values(values: ArrayLike, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """XYZ (..., 3) of radiance spectra (..., n) of one grid."""
    return np.asarray(values, dtype=np.float64) @ xyz_from_spectrum(grid, viewer).T
