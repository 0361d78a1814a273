# SPDX-License-Identifier: GPL-3.0-or-later
"""The color of each material of a transfer function under a light, by which amounts become a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from spectral_core.spectra import catalogue
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import linear_rgb_from_product, normalized, xyz_from_spectrum
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from spectral_core.spectra.upsample import upsampled
from spectral_core.volume.transfer import Array, TransferFunction

WHITE = "D65"


def display_matrix(transfer: TransferFunction, light: Illuminant | None = None) -> Array:
    """Linear sRGB (K, 3) of each material under ``light`` (D65 if None); amounts times this matrix are the picture.

    The light is scaled so that a perfect white has luminance 1, then lit materials reflect it. An emissive material
    keeps its color; as a spectrum, 1 at every wavelength has luminance 1. With colors in linear RGB, the light is
    replaced by its linear RGB, relative to D65.
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


def spectrum_of_color(linear_rgb: ArrayLike, wavelengths_nm: ArrayLike) -> Array:
    """Spectrum (..., n) of a material of linear sRGB (..., 3): the reflectance of a surface of that color.

    A color brighter than 1 is the color of its hue at 1, times its brightness. Colors outside the gamut of sRGB are
    moved to its border, because no reflectance has a negative component.
    """
    color = np.maximum(np.asarray(linear_rgb, dtype=np.float64), 0.0)
    brightness = np.maximum(color.max(axis=-1, keepdims=True), 1.0)
    return upsampled(color / brightness, wavelengths_nm) * brightness


def _linear_rgb(light: Illuminant) -> Array:
    rgb: Array = RGB_FROM_XYZ @ xyz_from_spectrum(light.grid) @ light.values
    return rgb
