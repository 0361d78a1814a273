# SPDX-License-Identifier: GPL-3.0-or-later
"""What colour each material of a transfer function shows under a light: what turns amounts into a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from spectral_core.checks import frozen_array
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import linear_rgb_from_product, normalized, xyz_from_spectrum
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from spectral_core.volume.transfer import Array, TransferFunction

WHITE = "D65"


def display_matrix(transfer: TransferFunction, light: Illuminant | None = None) -> Array:
    """Linear sRGB (K, 3) of each material under ``light`` (D65 where None); times the amounts it is the picture.

    The light is scaled so that a perfect white has luminance 1, then lit materials reflect it. A material that shines
    by itself keeps its colour; as a spectrum, 1 at every wavelength has luminance 1. With colours in linear RGB the
    light counts by its own linear RGB, relative to D65.
    """
    lamp = normalized(catalogue.illuminant(WHITE) if light is None else light)
    lit = np.array([material.lit for material in transfer.materials])
    if transfer.wavelengths_nm is None:
        tint = np.ones(3) if light is None else _linear_rgb(lamp) / _linear_rgb(normalized(catalogue.illuminant(WHITE)))
        return transfer.colors * np.where(lit[:, None], tint, 1.0)
    grid = SpectralGrid(transfer.wavelengths_nm)
    reflected = transfer.colors @ linear_rgb_from_product(lamp, grid).T
    own = xyz_from_spectrum(grid)
    shining = transfer.colors @ (RGB_FROM_XYZ @ own / own[1].sum()).T
    return np.where(lit[:, None], reflected, shining)


def smooth_reflectance(linear_rgb: ArrayLike, grid: SpectralGrid) -> Array:
    """The smoothest reflectance (n,) on ``grid`` that has this linear sRGB (3,) under D65, as near as one can.

    Least curvature within [0, 1], the colour weighed so that it is met to 1e-3 where any reflectance has it. For
    colours beside spectra; a material that matters should have a spectrum of its own.
    """
    from scipy.optimize import lsq_linear

    wanted = frozen_array("linear_rgb", linear_rgb, (3,))
    matrix = linear_rgb_from_product(normalized(catalogue.illuminant(WHITE)), grid)
    bend = np.diff(np.eye(grid.size), 2, axis=0)
    solved = lsq_linear(np.vstack([100 * matrix, bend]), np.concatenate([100 * wanted, np.zeros(len(bend))]), (0, 1))
    reflectance: Array = np.clip(solved.x, 0.0, 1.0)
    return reflectance


def _linear_rgb(light: Illuminant) -> Array:
    rgb: Array = RGB_FROM_XYZ @ xyz_from_spectrum(light.grid) @ light.values
    return rgb
