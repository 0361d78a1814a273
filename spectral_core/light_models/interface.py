# SPDX-License-Identifier: GPL-3.0-or-later
"""Interface of a linear light model: a surface as m numbers, a light as a 3×m matrix."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, real_numbers, require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import Observer, observer_or_standard, xyz_from_product
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]


class LightModel(ABC):
    """Surfaces as m coefficients, linear in their reflectance; lights as 3×m matrices, linear in their power.

    A pixel that stores coefficients is relit by one small matrix, and a sum of lights by the sum of their matrices.
    ``coefficients_from_values``: (m, n), from a spectrum on ``grid``; ``viewer``: whose XYZ the matrices give.
    """

    def __init__(self, grid: SpectralGrid, coefficients_from_values: ArrayLike, viewer: Observer | None = None) -> None:
        self.grid = grid
        self.viewer = observer_or_standard(viewer)
        self.coefficients_from_values: Array = frozen_array(
            "coefficients_from_values", coefficients_from_values, (None, grid.size)
        )

    @property
    def size(self) -> int:
        """Number of coefficients m."""
        return int(self.coefficients_from_values.shape[0])

    @property
    @abstractmethod
    def multiplications_per_reflection(self) -> int:
        """Multiplications for one more reflection of light that is already held in coefficients."""

    @abstractmethod
    def xyz_from_coefficients(self, light: Spectrum) -> Array:
        """Matrix (3, m) from the coefficients of a surface to its XYZ under ``light``."""

    @abstractmethod
    def reflect(self, first: ArrayLike, second: ArrayLike) -> Array:
        """Coefficients (..., m) of two surfaces (..., m) that reflect light one after the other, as one surface."""

    def surface_coefficients(self, reflectances: ArrayLike | Sequence[Spectrum]) -> Array:
        """Coefficients (..., m) of reflectances: values (..., n) on the model's grid, or spectra on any grid."""
        return values_on_grid(reflectances, self.grid) @ self.coefficients_from_values.T

    def linear_rgb_from_coefficients(self, light: Spectrum) -> Array:
        """Matrix (3, m) from the coefficients of a surface to its linear sRGB under ``light``."""
        return RGB_FROM_XYZ @ self.xyz_from_coefficients(light)

    def matrix_of_light(self, light: Spectrum) -> Array:
        """Matrix (3, n) from a reflectance on the model's grid to its true XYZ under ``light``."""
        require_kind("the light", light, Spectrum, "spectra.catalogue.illuminant(NAME)")
        return xyz_from_product(light, self.grid, self.viewer)

    def numbers_of(self, coefficients: ArrayLike) -> Array:
        """Coefficients (..., m), checked. Raises InvalidInputError for another number of them, NaN and infinity."""
        return frozen_array("coefficients", real_numbers("coefficients", coefficients, self.size))

    def xyz_from_reflectance(self, light: Spectrum) -> Array:
        """Matrix (3, n) from a reflectance to the XYZ that this model shows (Q_rgb,m,31 of Eq. 5.10, in XYZ)."""
        return self.xyz_from_coefficients(light) @ self.coefficients_from_values

    def subspace_error(self, light: Spectrum) -> Array:
        """F of Eq. 5.12 in XYZ, (3, n): the true color matrix of a light less this model's."""
        return self.matrix_of_light(light) - self.xyz_from_reflectance(light)


def values_on_grid(spectra: ArrayLike | Sequence[Spectrum], grid: SpectralGrid) -> Array:
    """Values (..., n) of arrays that are on the grid already, or of spectra sampled at its knots.

    Raises InvalidInputError if an array's last axis does not fit the grid.
    """
    require_kind("the grid", grid, SpectralGrid)
    if isinstance(spectra, Sequence) and any(isinstance(each, Spectrum) for each in spectra):
        sampled = [each.at(grid.wavelengths_nm) for each in spectra if isinstance(each, Spectrum)]
        if len(sampled) < len(spectra):
            raise InvalidInputError(
                f"{len(sampled)} of {len(spectra)} reflectances are spectra, the others are not; give spectra alone, "
                "or an array of values"
            )
        return np.array(sampled)
    try:
        values = np.asarray(spectra, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(
            f"reflectances are given as {type(spectra).__name__}; expected an array of values, or a list of spectra, "
            "such as [red]"
        ) from error
    if values.shape[-1:] != (grid.size,):
        raise InvalidInputError(
            f"reflectances have shape {values.shape}; the grid {grid} needs {grid.size} values on the last axis"
        )
    return values


def on_grid(spectrum: Spectrum, grid: SpectralGrid) -> Array:
    """Values of a spectrum at the grid's knots, (n,): as given on the same knots, else averaged over each cell.

    The average keeps the power of lamp lines that are narrower than the grid's step.
    """
    require_kind("the spectrum", spectrum, Spectrum, "spectra.catalogue.illuminant(NAME)")
    if np.array_equal(spectrum.grid.wavelengths_nm, grid.wavelengths_nm):
        return spectrum.values
    return spectrum.resampled(grid, average=True).values
