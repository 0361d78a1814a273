# SPDX-License-Identifier: GPL-3.0-or-later
"""The colors of a stored spectrum: a material under some lamps, a light itself and on some surfaces."""

from functools import lru_cache

import numpy as np
from bpy.types import PropertyGroup

from spectral_core.errors import SpectralError
from spectral_core.spectra import catalogue
from spectral_core.spectra.color import display_rgb_from_linear, linear_rgb_from_xyz
from spectral_core.spectra.observer import normalized, observer, xyz_of
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

from ..translate.spectra.stored import kind_in, stored_samples

LAMPS = (("Day", "D65"), ("Bulb", "A"), ("Tube", "FL11"), ("Sodium", "HP1"))
SURFACES = (("Skin", "light skin"), ("Red", "red"), ("Green", "green"), ("Blue", "blue"))
NO_SWATCH = None
Swatch = tuple[str, np.ndarray | None]
"""Name, and sRGB (3,) or NO_SWATCH."""


def swatches_of(spectral: PropertyGroup) -> tuple[Swatch, ...]:
    """(name, sRGB (3,)) of a stored spectrum; NO_SWATCH if it has no color, such as a light in the infrared."""
    wavelengths, values = stored_samples(spectral)
    return _swatches(kind_in(spectral), wavelengths.tobytes(), values.tobytes())


@lru_cache(maxsize=256)
def _swatches(kind: str, wavelengths: bytes, values: bytes) -> tuple[Swatch, ...]:
    grid = SpectralGrid(np.frombuffer(wavelengths))
    spectrum = Spectrum("shown", grid, np.frombuffer(values))
    if kind == "reflectance":
        return tuple((name, _display(xyz_of(_lamp(lamp), spectrum))) for name, lamp in LAMPS)
    try:
        light = normalized(Illuminant("shown", grid, np.maximum(spectrum.values, 0.0)))
    except SpectralError:
        return (("No visible light", NO_SWATCH),)
    itself = xyz_of(light)
    shown = linear_rgb_from_xyz(itself)
    own = ("Light", display_rgb_from_linear(np.clip(shown / max(shown.max(), 1e-9), 0, 1)))
    return (own, *((name, _display(xyz_of(light, catalogue.reflectance(patch)))) for name, patch in SURFACES))


@lru_cache(maxsize=8)
def _lamp(name: str) -> Spectrum:
    """A lamp of luminance 1 on the observer's 1 nm grid."""
    lamp = normalized(catalogue.illuminant(name))
    wavelengths = observer().wavelengths_nm
    return Spectrum(name, SpectralGrid(wavelengths), lamp.at(wavelengths))


def _display(xyz: np.ndarray) -> np.ndarray:
    return np.clip(display_rgb_from_linear(linear_rgb_from_xyz(xyz)), 0, 1)
