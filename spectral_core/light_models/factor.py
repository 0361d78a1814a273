# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral factor model: a basis sharpened so that products of coefficients stand for products of spectra.

Drew and Finlayson 2003, "Multispectral processing without spectra", J. Opt. Soc. Am. A 20(7); sharpening after
Finlayson, Drew and Funt 1994. Section 5.1.2 of the thesis renders with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array
from spectral_core.errors import InvalidInputError
from spectral_core.light_models.basis import BasisModel
from spectral_core.spectra.color import delta_e_2000, lab_from_xyz
from spectral_core.spectra.observer import Observer, xyz_from_product
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

Array = NDArray[np.float64]


def sharpened_basis(basis: ArrayLike, edges: Sequence[int] | None = None) -> Array:
    """Basis (n, m) of the same span, each vector mostly in one interval, scaled so that a flat 1 is all ones.

    Vector i holds the largest share of its energy inside samples ``edges[i]`` to ``edges[i + 1]`` (m + 1 rising
    indices from 0 to n; equal intervals by default): the top eigenvector of B_Iᵀ B_I for an orthonormal B. Flat white
    then has all-unity coefficients, as post-illumination needs (section 5.4.4).
    """
    orthonormal = np.linalg.qr(frozen_array("basis", basis, (None, None)))[0]
    samples, size = orthonormal.shape
    if not size:
        raise InvalidInputError("the basis has no vector; expected (n, m) with m of at least 1")
    bounds = np.round(np.linspace(0, samples, size + 1)).astype(int)
    if edges is not None:
        bounds = np.atleast_1d(frozen_array("edges", edges)).astype(int)
    if bounds.size != size + 1 or bounds[0] != 0 or bounds[-1] != samples or np.any(np.diff(bounds) < 1):
        raise InvalidInputError(
            f"edges {bounds.tolist()} do not cut {samples} samples into {size} intervals; give {size + 1} rising "
            f"indices from 0 to {samples}"
        )
    inside = (orthonormal[low:high] for low, high in pairwise(bounds))
    sharpening = np.stack([np.linalg.eigh(part.T @ part)[1][:, -1] for part in inside], axis=1)
    if np.linalg.matrix_rank(sharpening) < size:
        raise InvalidInputError(
            f"intervals {bounds.tolist()} sharpen two vectors into one; choose others or a smaller m"
        )
    sharp = orthonormal @ sharpening
    of_flat = np.linalg.lstsq(sharp, np.ones(samples), rcond=None)[0]
    if np.any(np.abs(of_flat) < 1e-9 * np.abs(of_flat).max()):
        raise InvalidInputError(
            "a sharpened vector has no part in a flat spectrum, so it cannot be scaled to one there"
        )
    return sharp * of_flat


class FactorModel(BasisModel):
    """Products coefficient by coefficient: R of a sharpened basis is taken for diagonal.

    Right as far as the basis vectors do not overlap; good for smooth lights, poor for lines and designed spectra.
    """

    def __init__(
        self,
        grid: SpectralGrid,
        basis: ArrayLike,
        viewer: Observer | None = None,
        *,
        edges: Sequence[int] | None = None,
    ) -> None:
        super().__init__(grid, sharpened_basis(basis, edges), viewer)

    @property
    def multiplications_per_reflection(self) -> int:
        """m."""
        return self.size

    def xyz_from_coefficients(self, light: Spectrum) -> Array:
        """Q_m diag(e), (3, m)."""
        return self._xyz_from_coefficients * self.light_coefficients(light)

    def reflect(self, first: ArrayLike, second: ArrayLike) -> Array:
        """Coefficient by coefficient."""
        return self.numbers_of(first) * self.numbers_of(second)


def optimized_edges(
    pairs: Sequence[tuple[Spectrum, Array]], basis: ArrayLike, grid: SpectralGrid, *, sweeps: int = 4
) -> list[int]:
    """Interval edges (m + 1 indices) with the least mean ΔE2000 over pairs of a light and reflectances (r, n).

    Each inner edge moves to its best position between its neighbors, until none moves: a local optimum.
    """
    basis = np.asarray(basis, dtype=np.float64)
    size = basis.shape[1]
    truths = [(light, surfaces, xyz_from_product(light, grid)) for light, surfaces in pairs]

    def error(candidate: list[int]) -> float:
        try:
            model = FactorModel(grid, basis, edges=candidate)
        except InvalidInputError:
            return np.inf
        found = []
        for light, surfaces, matrix in truths:
            white = matrix.sum(axis=1)
            shown = lab_from_xyz(surfaces @ model.xyz_from_reflectance(light).T, white)
            found.append(delta_e_2000(lab_from_xyz(surfaces @ matrix.T, white), shown).mean())
        return float(np.mean(found))

    edges = [int(edge) for edge in np.round(np.linspace(0, grid.size, size + 1))]
    best = error(edges)
    for _ in range(sweeps):
        before = best
        for index in range(1, size):
            for position in range(edges[index - 1] + 1, edges[index + 1]):
                candidate = [*edges[:index], position, *edges[index + 1 :]]
                found = error(candidate)
                if found < best:
                    best, edges = found, candidate
        if best == before:
            break
    return edges
