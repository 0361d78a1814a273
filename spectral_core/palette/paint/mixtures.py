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

from spectral_core.checks import frozen_array, require_kind, require_range
from spectral_core.errors import InvalidInputError, counted
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.given import sequence_of
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.spectrum import Reflectance

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
    inks = frozen_array("ink coverages", coverages)
    if inks.ndim == 0 or inks.shape[-1] == 0:
        raise InvalidInputError(f"ink coverages have shape {inks.shape}; expected a number for each ink")
    if np.any((inks < 0) | (inks > 1)):
        raise InvalidInputError(f"ink coverages span {np.min(inks):g} to {np.max(inks):g}; expected 0 to 1")
    bits = (np.arange(2 ** inks.shape[-1])[:, None] >> np.arange(inks.shape[-1])) & 1
    return np.prod(np.where(bits == 1, inks[..., None, :], 1 - inks[..., None, :]), axis=-1)


def absorption_from_reflectance(reflectance: ArrayLike) -> Array:
    """K/S of an opaque layer: (1 − R)² / (2 R); infinite for R = 0."""
    surface = _opaque("reflectances", reflectance)
    with np.errstate(divide="ignore"):
        return np.asarray((1 - surface) ** 2 / (2 * surface))


def reflectance_from_absorption(absorption: ArrayLike) -> Array:
    """R of an opaque layer with K/S: 1 + K/S − √((K/S)² + 2 K/S), written so that small R keep their digits."""
    # Infinity, that of a perfect black, is no finite number.
    given = np.ma.filled(absorption, np.nan) if np.ma.is_masked(absorption) else absorption
    is_black = np.equal(given, np.inf) if np.asarray(given).dtype.kind in "fiub" else False
    ratio = np.where(is_black, np.inf, frozen_array("K/S", np.where(is_black, 0.0, given)))
    if np.any(ratio < 0):
        raise InvalidInputError(f"K/S is {np.min(ratio):g} at least; expected it from 0")
    with np.errstate(over="ignore"):  # a K/S whose square overflows is black
        return np.asarray(1 / (1 + ratio + np.sqrt(ratio * (ratio + 2))))


def paint_mixture(concentrations: ArrayLike, reflectances: ArrayLike, scattering: ArrayLike | None = None) -> Array:
    """Reflectance (..., n) of a mixture of opaque paints with reflectances (k, n): Kubelka-Munk.

    ``concentrations``: (..., k), at least 0, summing to 1. ``scattering``: (k,) or (k, n), the paints' scattering S
    relative to each other; 1 for all by default (the single-constant theory).
    """
    weights = _shares(concentrations)
    surfaces = _opaque("reflectances of paints", _surfaces(reflectances, weights.shape[-1]))
    strength = np.ones(surfaces.shape[0]) if scattering is None else frozen_array("scattering", scattering)
    if strength.shape not in ((surfaces.shape[0],), surfaces.shape):
        raise InvalidInputError(
            f"scattering has shape {strength.shape}; expected {(surfaces.shape[0],)} or {surfaces.shape}"
        )
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
    require_kind("the solution", solution, PaletteSolution, "from solve_palette")
    grid, count = solution.problem.grid, len(solution.reflectances)
    white = base_on(base, grid.size)
    pairs = [sequence_of("a pair", each) for each in sequence_of("pairs", pairs)]
    for pair in pairs:
        if len(pair) != 2 or not all(isinstance(k, int | np.integer) and 0 <= k < count for k in pair):
            raise InvalidInputError(f"a pair is {pair}; expected two numbers of reflectances, from 0 to {count - 1}")
    surfaces = [surface.at(grid.wavelengths_nm) for surface in solution.reflectances]
    kernel = color_kernel(grid, solution.problem.observers[:1])  # the observer of the targets
    matrices = np.stack([kernel.matrix_of(light)[0] for light in solution.illuminants])
    found = []
    for level in np.atleast_1d(frozen_array("levels of tints", levels)):
        tints = np.stack([paint_mixture([level, 1 - level], np.stack([surface, white])) for surface in surfaces])
        lab = lab_from_linear_rgb(np.einsum("lcn,rn->rlc", matrices, tints))
        found.append([delta_e_2000(lab[a], lab[b]) for a, b in pairs])
    return np.array(found)


def base_on(base: ArrayLike, size: int) -> Array:
    """Reflectance (n,) of the base of tints, from a number or one for each sample."""
    white = _opaque("the base of tints", base)
    if white.ndim > 1 or white.size not in (1, size):
        raise InvalidInputError(f"the base of tints has shape {white.shape}; expected a number or {size} of them")
    return np.broadcast_to(white, (size,))


def _opaque(name: str, reflectances: ArrayLike) -> Array:
    """Finite reflectances from 0 to 1, as Kubelka and Munk need them."""
    found = frozen_array(name, reflectances)
    if np.any((found < -Reflectance.TOLERANCE) | (found > 1 + Reflectance.TOLERANCE)):
        raise InvalidInputError(f"{name} span {found.min():g} to {found.max():g}; Kubelka-Munk needs 0 to 1")
    return np.clip(found, 0.0, 1.0)


def _shares(shares: ArrayLike) -> Array:
    weights = frozen_array("shares of a mixture", shares)
    if weights.ndim == 0 or np.any(weights < 0) or not np.allclose(weights.sum(axis=-1), 1.0, atol=1e-9):
        raise InvalidInputError(f"shares {weights.tolist()} of a mixture; expected numbers of at least 0 that sum to 1")
    return weights


def _surfaces(reflectances: ArrayLike, count: int) -> Array:
    surfaces = np.atleast_2d(frozen_array("reflectances", reflectances))
    if surfaces.shape[0] != count:
        raise InvalidInputError(
            f"{counted(surfaces.shape[0], 'reflectance')} for {counted(count, 'share')}; expected one each"
        )
    return surfaces
