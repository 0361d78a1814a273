# SPDX-License-Identifier: GPL-3.0-or-later
"""Light model on any basis with its full illumination matrix R (Eqs. 5.2 to 5.7); principal components."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind, require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.light_models.interface import LightModel, on_grid, values_on_grid
from spectral_core.spectra.observer import Observer, xyz_from_spectrum
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]


def representative_spectra(
    lights: Sequence[Spectrum], reflectances: ArrayLike | Sequence[Spectrum], grid: SpectralGrid
) -> Array:
    """Lights, reflectances and all their products on ``grid``, each at unit length: (k, n).

    ``reflectances``: (r, n). Unit length makes a dim lamp count as much as a bright one.
    """
    surfaces = np.atleast_2d(values_on_grid(reflectances, grid))
    if isinstance(lights, Spectrum) or not lights:
        raise InvalidInputError(f"lights are {str(lights)[:40]!r}; expected a list of at least one spectrum")
    powers = np.array([on_grid(light, grid) for light in lights])
    products = (powers[:, None, :] * surfaces).reshape(-1, grid.size)
    stacked = np.concatenate([powers, surfaces, products])
    lengths = np.linalg.norm(stacked, axis=1, keepdims=True)
    return stacked[lengths[:, 0] > 0] / lengths[lengths[:, 0] > 0]


def principal_components(spectra: ArrayLike, size: int) -> Array:
    """The first ``size`` principal components of spectra (k, n), not centered on their mean: orthonormal (n, size)."""
    stacked = frozen_array("spectra", spectra, (None, None))
    size = require_whole("size", size, -1 << 30, 1 << 30)
    if not 1 <= size <= min(stacked.shape):
        raise InvalidInputError(
            f"{size} components of {counted(stacked.shape[0], 'spectrum', 'spectra')} with {stacked.shape[1]} "
            f"samples; expected 1 to {min(stacked.shape)}"
        )
    return np.linalg.svd(stacked, full_matrices=False)[2][:size].T


class BasisModel(LightModel):
    """Spectra as weights of basis vectors, every reflection by the illumination matrix R. ``basis``: (n, m)."""

    def __init__(self, grid: SpectralGrid, basis: ArrayLike, viewer: Observer | None = None) -> None:
        require_kind("the grid", grid, SpectralGrid)
        self.basis: Array = frozen_array("basis", basis, (grid.size, None))
        if np.linalg.matrix_rank(self.basis) < self.basis.shape[1]:
            raise InvalidInputError(
                f"the {self.basis.shape[1]} basis vectors depend on each other; leave out those that the others span"
            )
        super().__init__(grid, np.linalg.pinv(self.basis), viewer)
        self._xyz_from_coefficients = xyz_from_spectrum(grid, self.viewer) @ self.basis  # Q_rgb,m = Q_rgb,31 B

    @property
    def multiplications_per_reflection(self) -> int:
        """m², with R of the reflecting surface formed beforehand."""
        return self.size**2

    def light_coefficients(self, light: Spectrum) -> Array:
        """Coefficients (m,) of a light (Eq. 5.4)."""
        return self.coefficients_from_values @ on_grid(light, self.grid)

    def illumination_matrix(self, coefficients: ArrayLike) -> Array:
        """R (..., m, m) of a light or surface with the given coefficients (..., m): Eq. 5.7."""
        spectrum = self.numbers_of(coefficients) @ self.basis.T
        return (self.coefficients_from_values * spectrum[..., None, :]) @ self.basis

    def xyz_from_coefficients(self, light: Spectrum) -> Array:
        """Q_m R(e), (3, m)."""
        return self._xyz_from_coefficients @ self.illumination_matrix(self.light_coefficients(light))

    def reflect(self, first: ArrayLike, second: ArrayLike) -> Array:
        """R(first) second, projected back into the basis."""
        return (self.illumination_matrix(first) @ self.numbers_of(second)[..., None])[..., 0]
