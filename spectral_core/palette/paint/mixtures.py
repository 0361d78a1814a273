# SPDX-License-Identifier: GPL-3.0-or-later
"""Mixtures of designed materials: which mixtures keep a match, and a design that also holds for paints.

Additive mixtures (unresolved patches, halftones, blended textures) are linear in reflectance, so a match under a light
is kept by mixing. Paints are not: absorption K and scattering S mix, and reflectance follows from K/S (Kubelka and Munk
1931). Section 5.5.1 names both; ``tint_differences`` measures the effect of paint on a match, and
``spectral_core.palette.paint.tints`` designs for it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]


def additive_mixture(shares: ArrayLike, reflectances: ArrayLike) -> Array:
    """Mean reflectance (..., n) of surfaces (k, n) that cover shares (..., k) of an area.

    The shares are at least 0 and sum to 1. Linear: colors under any light mix as the reflectances do.
    """
    weights = _shares(shares)
    return weights @ _surfaces(reflectances, weights.shape[-1])


def halftone_shares(coverages: ArrayLike) -> Array:
    """Shares (..., 2**k) of the overprints of k inks with coverages (..., k), printed independently (Demichel 1924).

    Overprint number b holds ink i where bit i of b is set; mix the overprints' reflectances with additive_mixture.
    """
    inks = np.asarray(coverages, dtype=np.float64)
    if inks.ndim == 0 or np.any((inks < 0) | (inks > 1)) or not np.all(np.isfinite(inks)):
        raise InvalidInputError(f"ink coverages span {np.min(inks):g} to {np.max(inks):g}; expected 0 to 1")
    bits = (np.arange(2 ** inks.shape[-1])[:, None] >> np.arange(inks.shape[-1])) & 1
    return np.prod(np.where(bits == 1, inks[..., None, :], 1 - inks[..., None, :]), axis=-1)


def absorption_from_reflectance(reflectance: ArrayLike) -> Array:
    """K/S of an opaque layer: (1 − R)² / (2 R); infinite for R = 0."""
    surface = np.asarray(reflectance, dtype=np.float64)
    if np.any((surface < 0) | (surface > 1)):
        raise InvalidInputError(f"reflectances span {surface.min():g} to {surface.max():g}; Kubelka-Munk needs 0 to 1")
    with np.errstate(divide="ignore"):
        return (1 - surface) ** 2 / (2 * surface)


def reflectance_from_absorption(absorption: ArrayLike) -> Array:
    """R of an opaque layer with K/S: 1 + K/S − √((K/S)² + 2 K/S), written so that small R keep their digits."""
    ratio = np.asarray(absorption, dtype=np.float64)
    return 1 / (1 + ratio + np.sqrt(ratio * (ratio + 2)))


def paint_mixture(concentrations: ArrayLike, reflectances: ArrayLike, scattering: ArrayLike | None = None) -> Array:
    """Reflectance (..., n) of a mixture of opaque paints with reflectances (k, n): Kubelka-Munk.

    ``concentrations``: (..., k), at least 0, summing to 1. ``scattering``: (k,) or (k, n), the paints' scattering S
    relative to each other; 1 for all by default (the single-constant theory).
    """
    weights = _shares(concentrations)
    surfaces = _surfaces(reflectances, weights.shape[-1])
    strength = np.ones(surfaces.shape[0]) if scattering is None else np.asarray(scattering, dtype=np.float64)
    strength = np.broadcast_to(strength[:, None] if strength.ndim == 1 else strength, surfaces.shape)
    if np.any(strength <= 0):
        raise InvalidInputError(f"scattering spans {strength.min():g} to {strength.max():g}; expected it above 0")
    absorption = np.where(surfaces > 0, absorption_from_reflectance(np.where(surfaces > 0, surfaces, 1.0)), np.inf)
    present = weights[..., None] > 0
    # A share of 0 must not count, even with the infinite K of a perfect black.
    total = np.where(present, np.where(present, absorption, 0.0) * strength * weights[..., None], 0.0).sum(axis=-2)
    return reflectance_from_absorption(total / (strength * weights[..., None]).sum(axis=-2))


def paint_slope(concentration: float, paint: Array, base: Array) -> Array:
    """d(reflectance of the tint) / d(reflectance of the paint), (n,), wavelength by wavelength.

    ``concentration``: of the paint in the ``base``, above 0. For R = 0 it is the limit, 1 / concentration.
    """
    share = require_range("concentration", concentration, 1e-9, 1.0)
    tint = paint_mixture([share, 1 - share], np.stack([paint, base]))
    # dR/dx = −2 R² / (1 − R²) for x = K/S, so the slope is c · (dx/dR of the paint) / (dx/dR of the tint).
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = share * (tint / paint) ** 2 * (1 - paint**2) / (1 - tint**2)
    slope = np.where(paint > 0, slope, 1 / share)
    return np.where((paint < 1) | (base < 1), slope, np.sqrt(share))  # both perfectly white: R ≈ 1 − √(2x)


def tint_differences(
    solution: PaletteSolution, pairs: Sequence[tuple[int, int]], *, base: ArrayLike = 0.9, levels: ArrayLike = (0.5,)
) -> Array:
    """ΔE2000 (levels, pairs, lights) between pairs of a solution's reflectances, each mixed as paint into ``base``.

    ``base``: reflectance of the white, a number or (n,) on the palette's grid; ``levels``: concentrations of the paint.
    """
    grid = solution.problem.grid
    white = np.broadcast_to(np.asarray(base, dtype=np.float64), (grid.size,))
    surfaces = [surface.at(grid.wavelengths_nm) for surface in solution.reflectances]
    kernel = color_kernel(grid)
    matrices = np.stack([kernel.matrix_of(light)[0] for light in solution.illuminants])
    found = []
    for level in np.atleast_1d(np.asarray(levels, dtype=np.float64)):
        tints = np.stack([paint_mixture([level, 1 - level], np.stack([surface, white])) for surface in surfaces])
        lab = lab_from_linear_rgb(np.einsum("lcn,rn->rlc", matrices, tints))
        found.append([delta_e_2000(lab[a], lab[b]) for a, b in pairs])
    return np.array(found)


def _shares(shares: ArrayLike) -> Array:
    weights = np.asarray(shares, dtype=np.float64)
    if weights.ndim == 0 or np.any(weights < 0) or not np.allclose(weights.sum(axis=-1), 1.0, atol=1e-9):
        raise InvalidInputError(f"shares {weights.tolist()} of a mixture; expected numbers of at least 0 that sum to 1")
    return weights


def _surfaces(reflectances: ArrayLike, count: int) -> Array:
    surfaces = np.atleast_2d(np.asarray(reflectances, dtype=np.float64))
    if surfaces.shape[0] != count:
        raise InvalidInputError(f"{surfaces.shape[0]} reflectances for {count} shares; expected one each")
    return surfaces
