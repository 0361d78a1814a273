# SPDX-License-Identifier: GPL-3.0-or-later
"""Observers: color matching functions at 1 nm, and the matrices that integrate spectra into XYZ.

Spectra and color matching functions are linear between their knots. Their products are integrated exactly over the
union of all knots, so that a line of 0.01 nm counts in full at any wavelength; the renderer integrates in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_kind, require_range
from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ, delta_e_2000, lab_from_xyz
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]

OBSERVER_NAMES = ("cie_1931_2deg", "cie_1964_10deg", "cie_2015_2deg", "cie_2015_10deg")


@read_only_when_copied
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
"""The default observer; sRGB and the renderer are defined with it."""


def observer_or_standard(viewer: Observer | None) -> Observer:
    """The observer, the standard one for None. Raises InvalidInputError for a name, and for anything else."""
    if viewer is None:
        return observer(STANDARD)
    require_kind("the observer", viewer, Observer, f"observer({STANDARD!r}) gives one by its name")
    return viewer


def integration_points(*knots_nm: ArrayLike) -> tuple[Array, Array]:
    """Give wavelengths and weights that integrate a product of piecewise linear spectra exactly: ∫ f dλ = Σ w f(λ).

    Between neighboring knots of the union, a product of three linear functions is a cubic, and two Gauss-Legendre
    points integrate a cubic without error (Abramowitz and Stegun 25.4.29). No point is a knot, so that a spectrum which
    jumps to zero at the end of its grid is integrated up to that end.

    Parameters
    ----------
    knots_nm
        Knots of each factor, each (n,), ascending, in nm. At most three factors, or the result is approximate.

    Returns
    -------
    Wavelengths (m,) in nm, ascending, and weights (m,) in nm; m = 0 where the factors share no range.
    """
    factors = [np.asarray(knots, dtype=np.float64) for knots in knots_nm]
    low, high = max(knots[0] for knots in factors), min(knots[-1] for knots in factors)
    union = np.unique(np.concatenate(factors))
    union = union[(union >= low) & (union <= high)]  # beyond, one of the factors is zero
    middle, half = (union[1:] + union[:-1]) / 2, np.diff(union) / 2
    offset = half / np.sqrt(3.0)
    return np.stack([middle - offset, middle + offset], axis=1).ravel(), np.repeat(half, 2)


def xyz_from_spectrum(grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Matrix (3, n) that integrates a radiance spectrum of ``grid`` into XYZ: ∫ hat_j · cmf dλ, in nm."""
    return xyz_from_product(None, grid, viewer)


def xyz_from_product(fixed: Spectrum | None, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Matrix (3, n) from the unknown factor of a product of spectra to XYZ: ∫ fixed · hat_j · cmf dλ (Eq. 5.8).

    Exact for spectra that are linear between knots. On a ``"sampled"`` grid it is the thesis' plain sum over knots.

    Parameters
    ----------
    fixed
        The known factor on any grid: the light when a reflectance is sought, the surface when a light is; None for 1.
    grid
        Grid of the unknown factor, n knots.
    viewer
        The observer; None for the standard one.
    """
    viewer = observer_or_standard(viewer)
    require_kind("the grid", grid, SpectralGrid)
    if fixed is not None:
        require_kind("the known factor", fixed, Spectrum, "spectra.catalogue.illuminant(NAME)")
    if grid.interpolation == "sampled":
        knots = grid.wavelengths_nm
        weights = grid.cell_widths_nm if fixed is None else fixed.at(knots) * grid.cell_widths_nm
        return _cmfs_at(viewer, knots) * weights
    known = () if fixed is None else (fixed.grid.wavelengths_nm,)
    points, weights = integration_points(grid.wavelengths_nm, viewer.wavelengths_nm, *known)
    if fixed is not None:
        weights = weights * fixed.at(points)
    return grid.against_hats(points, _cmfs_at(viewer, points) * weights)


def linear_rgb_from_product(fixed: Spectrum | None, grid: SpectralGrid, viewer: Observer | None = None) -> Array:
    """Matrix (3, n) of xyz_from_product, followed by the sRGB matrix."""
    return RGB_FROM_XYZ @ xyz_from_product(fixed, grid, viewer)


def xyz_of(light: Spectrum, surface: Spectrum | None = None, viewer: Observer | None = None) -> Array:
    """XYZ (3,) of a light, or of a surface under it, both on any grids; exact, not normalized."""
    viewer = observer_or_standard(viewer)
    factors = [light] if surface is None else [light, surface]
    for factor in factors:
        require_kind("a light or surface", factor, Spectrum, "spectra.catalogue.illuminant(NAME)")
    points, weights = integration_points(viewer.wavelengths_nm, *(factor.grid.wavelengths_nm for factor in factors))
    for factor in factors:
        weights = weights * factor.at(points)
    return _cmfs_at(viewer, points) @ weights


def is_seen(light: Spectrum, viewer: Observer | None = None) -> bool:
    """True if the light has any luminance. A lamp of infrared or ultraviolet alone has none."""
    viewer = observer_or_standard(viewer)
    require_kind("the light", light, Spectrum, "spectra.catalogue.illuminant(NAME)")
    knots, values = light.grid.wavelengths_nm, light.values
    if np.any(values[(knots > viewer.wavelengths_nm[0]) & (knots < viewer.wavelengths_nm[-1])] > 0):
        return True
    return float(xyz_of(light, None, viewer)[1]) > 0


@cache
def error_of_ends(low_nm: float, high_nm: float) -> float:
    """ΔE2000, in daylight, of a white that is known from ``low_nm`` to ``high_nm`` alone and black beyond."""
    daylight = catalogue.illuminant("D65")
    cut = Spectrum("cut", SpectralGrid(np.array([low_nm, high_nm])), np.ones(2))
    white = xyz_of(daylight)
    return float(delta_e_2000(lab_from_xyz(xyz_of(daylight, cut), white), lab_from_xyz(white, white)))


def normalized(light: Illuminant, viewer: Observer | None = None, luminance: float = 1.0) -> Illuminant:
    """The light scaled so that a perfect white under it has Y = ``luminance``, on the light's own grid.

    Raises InvalidInputError if the light gives this observer no luminance at all, or ``luminance`` is below 0.
    """
    if not isinstance(light, Spectrum):
        raise InvalidInputError(f"the light is {light!r:.40}; expected a spectrum, such as catalogue.illuminant('D65')")
    luminance = require_range("luminance", luminance, 0.0, 1e30)
    # Summed exactly: the last digits of a product of matrices depend on the processor, and on where arrays lie. Files
    # and hashes of palettes name lights by their luminance, and compare them to the last digit.
    total = math.fsum((xyz_from_spectrum(light.grid, viewer)[1] * light.values).tolist())
    if total <= 0:
        raise InvalidInputError(
            f"illuminant {light.name!r} on {light.grid} has no luminance (Y = {total:g}), so it cannot be normalized; "
            "give it power where the eye sees, 380 to 780 nm"
        )
    return light.scaled(luminance / total)


def sum_of_lights(parts: Sequence[tuple[float, Spectrum]]) -> tuple[Illuminant, float]:
    """The sum of lights, each an amount and a relative spectrum of luminance 1 in that amount; and the total amount.

    Exact: the sum is linear between the knots of all parts, and a part ends where its grid ends. A spectrum of zeros
    adds nothing. Raises InvalidInputError for another light without luminance.
    """
    ends = 1e-3 * np.array([-1.0, 1.0])  # nm; wide enough for the single precision in which Blender stores knots
    knots = [np.concatenate([s.grid.wavelengths_nm, s.grid.wavelengths_nm[[0, -1]] + ends]) for _, s in parts]
    grid = SpectralGrid(np.unique(np.concatenate(knots)))
    lit = [(amount, spectrum) for amount, spectrum in parts if np.any(spectrum.values)]
    total = np.zeros(grid.size)
    for amount, spectrum in lit:
        light = normalized(Illuminant(spectrum.name, spectrum.grid, spectrum.values))
        total += amount * light.at(grid.wavelengths_nm)
    name = " + ".join(dict.fromkeys(spectrum.name for _, spectrum in parts))
    return Illuminant(name, grid, total), float(sum(amount for amount, _ in lit))


def _cmfs_at(viewer: Observer, wavelengths_nm: Array) -> Array:
    """Color matching functions (3, m), zero outside their table."""
    return np.stack([np.interp(wavelengths_nm, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])
