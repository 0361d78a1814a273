# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectra that determine the wavelengths to trace and their weights: of the scene's lights and reflectances."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.paint import emitted_rgb, emitted_spectrum, unit_luminance
from spectral_core.scene import Color, Scene
from spectral_core.scene.leaves import simple_values_of
from spectral_core.scene.paint import SpectralImage
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import reflectance_from_rgb

_MOST = 64
"""Most reflectances that are used. The mean of more is as flat as the observer's share."""

_SMOOTH_GRID = SpectralGrid.uniform(360.0, 830.0, 10.0)

_TEXELS = 4096
"""Most texels of a spectral texture that are examined."""


def light_spectra(scene: Scene) -> list[Spectrum]:
    """Spectra of all emission that determine the wavelengths to trace."""
    paints: list[Any] = [light.color for light in scene.lights]
    if not scene.world.is_black:
        paints.append(scene.world.color)
    white = None if scene.settings.white is None else unit_luminance(scene.settings.white)
    plain = [paint if isinstance(paint, (Color, Spectrum)) else Color(np.ones(3)) for paint in paints]
    return [emitted_spectrum(paint, white) for paint in plain]


def reflectance_spectra(scene: Scene) -> list[Spectrum]:
    """Different reflectances that are given as spectra; of a spectral texture, those of its mean and largest weights.

    Colors are omitted: their smooth spectra need no additional wavelengths (``color_spectra``).
    """
    found: dict[bytes, Spectrum] = {}
    for material in scene.materials:
        for value in simple_values_of(material.surface):
            for spectrum in _spectra(value):
                # Values above 1 are an index of refraction or an emission, not a reflectance.
                if 0 < float(spectrum.values.max()) <= 1.0 + 1e-6:
                    found.setdefault(spectrum.grid.wavelengths_nm.tobytes() + spectrum.values.tobytes(), spectrum)
    return list(found.values())[:_MOST]


def color_spectra(scene: Scene) -> list[Spectrum]:
    """Smooth reflectances of the different colors of the scene's materials; of a light's spectrum, its color."""
    found: dict[bytes, Spectrum] = {}
    for material in scene.materials:
        for value in simple_values_of(material.surface):
            if not isinstance(value, (Color, Illuminant)) or len(found) >= _MOST:
                continue
            rgb = np.clip(value.linear_rgb if isinstance(value, Color) else emitted_rgb(value), 0.0, 1.0)
            key = rgb.tobytes()
            if rgb.any() and key not in found:
                found[key] = reflectance_from_rgb(rgb, _SMOOTH_GRID)
    return list(found.values())


def _spectra(value: Any) -> list[Spectrum]:
    if isinstance(value, Illuminant):  # in place of a reflectance its color counts
        return []
    if isinstance(value, Spectrum):
        return [value]
    if not isinstance(value, SpectralImage):
        return []
    weights = value.weights.reshape(len(value.weights), -1)
    weights = weights[:, :: max(1, weights.shape[1] // _TEXELS)].astype(np.float64)
    texels = np.stack([weights.mean(axis=1), *weights[:, weights.argmax(axis=1)].T])
    grid = SpectralGrid(value.grid.wavelengths_nm)
    return [Spectrum("texel", grid, np.clip(row @ value.spectra, 0.0, 1.0)) for row in texels]
