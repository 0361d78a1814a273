# SPDX-License-Identifier: GPL-3.0-or-later
"""The criteria of section 5.3 that do not come from cells: smoothness and subspace error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.palette.problem import PaletteProblem, SubspaceCriterion
from spectral_core.spectra.spectrum import SpectralGrid

Array = NDArray[np.float64]

REFERENCE_STEP_NM = 10.0
"""Step at which the mended roughness equals the thesis' plain second differences.

Lights enter their roughness as power per this step, as in the thesis, where a light of luminance 6 is about 0.5.
"""


def second_differences(grid: SpectralGrid, operator: str = "mended") -> Array:
    """Roughness matrix D (n, n) of Eq. 5.13; ||D @ values|| is the root mean square roughness.

    ``"thesis"``: Toeplitz [-1, 2, -1] over 6·√n, the norm of the printed Figure 5.2 (the text says √6·√n). Its first
    and last row force the ends to zero. ``"mended"``: the second derivative in units of (10 nm)⁻², weighted by cell
    width, the spectrum mirrored at its ends: the roughness of a constant is 0, and the value does not depend on the
    grid.
    """
    n = grid.size
    if operator == "thesis":
        return (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)) / (6 * np.sqrt(n))
    if operator != "mended":
        raise InvalidInputError(f"smoothness operator {operator!r}; expected 'mended' or 'thesis'")
    steps = np.diff(grid.wavelengths_nm) / REFERENCE_STEP_NM
    slopes = np.diff(np.eye(n), axis=0) / steps[:, None]
    flat = np.zeros((1, n))
    widths = grid.cell_widths_nm / REFERENCE_STEP_NM
    curvature = np.diff(np.concatenate([flat, slopes, flat]), axis=0) / widths[:, None]
    # The thesis' norm again, so that its weights keep their meaning.
    return curvature * np.sqrt(widths / widths.sum())[:, None] / 6


def subspace_color_matrices(criterion: SubspaceCriterion, known: Array, rgb_cmfs: Array) -> Array:
    """Q_rgb,m,n of Eq. 5.10 for k known factors: (k, 3, n).

    ``known``: (k, n) on the grid; ``rgb_cmfs``: (3, n), from a radiance spectrum of the grid to linear RGB.
    """
    basis = criterion.basis
    coefficients_from_values = np.linalg.pinv(basis)
    if criterion.componentwise:
        products = (known @ coefficients_from_values.T)[:, :, None] * coefficients_from_values
    else:
        in_subspace = known @ coefficients_from_values.T @ basis.T  # B B⁺ E, the projection on the subspace
        illumination = (coefficients_from_values * in_subspace[:, None, :]) @ basis  # R of Eq. 5.7
        products = illumination @ coefficients_from_values
    return (rgb_cmfs @ basis) @ products


def subspace_errors(problem: PaletteProblem, known: Array, exact: Array, rgb_cmfs: Array) -> Array:
    """F of Eq. 5.12, (k, 3, n): the exact color matrices minus those of the subspace."""
    assert problem.subspace is not None
    return exact - subspace_color_matrices(problem.subspace, known, rgb_cmfs)


def capped_weights(weights: Array, ratio: float) -> Array:
    """Positive weights limited to ``ratio`` of each other; zeros stay.

    Large weights are reduced to ``ratio`` times the lower median, then small ones are raised: from a ratio of 1e4 on,
    solvers of normal equations return wrong answers without a warning.
    """
    positive = np.sort(weights[weights > 0])
    if positive.size == 0 or positive[-1] <= ratio * positive[0]:
        return weights
    ceiling = min(positive[-1], ratio * positive[(positive.size - 1) // 2])
    return np.where(weights > 0, np.clip(weights, ceiling / ratio, ceiling), 0.0)
