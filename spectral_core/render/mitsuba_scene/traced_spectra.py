# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectra that determine the wavelengths to trace and their weights: of the scene's lights and reflectances."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.paint import emitted_rgb, emitted_spectrum, unit_luminance
from spectral_core.render.same import equal
from spectral_core.scene import Color, Material, MixedPaint, Scene, World, emissions_of
from spectral_core.scene.leaves import simple_values_of
from spectral_core.scene.paint import SpectralImage
from spectral_core.spectra.spectrum import WAVELENGTHS_NM, Illuminant, SpectralGrid, Spectrum
from spectral_core.spectra.upsample import is_outside, reflectance_from_rgb

_MOST = 64
"""Most reflectances that are used. The mean of more is as flat as the observer's share."""

_SMOOTH_GRID = SpectralGrid(WAVELENGTHS_NM[::10])

_TEXELS = 4096
"""Most texels of a spectral texture that are examined."""


def light_spectra(scene: Scene, *, since: Scene | None = None) -> list[Spectrum]:
    """Spectra of all emission that determine the wavelengths to trace.

    One for each lamp and for the world; surfaces, media and the world's view from the camera add each different
    spectrum once, and all their colors of sRGB one white, so that many screens do not take the samples of a lamp.
    ``since``: an earlier version of the scene, with the same items; only what differs from it is counted.
    """
    lamps, worlds, materials = list(scene.lights), [scene.world], list(scene.materials)
    if since is not None:
        lamps = [b for a, b in zip(since.lights, lamps, strict=True) if not equal(a.color, b.color)]
        worlds = [] if equal(since.world, scene.world) else worlds
        materials = [b for a, b in zip(since.materials, materials, strict=True) if a is not b]
    white = None if scene.settings.white is None else unit_luminance(scene.settings.white)
    paints: list[Any] = [lamp.color for lamp in lamps] + [world.color for world in worlds if not world.is_black]
    plain = [paint if isinstance(paint, (Color, Spectrum)) else Color(np.ones(3)) for paint in paints]
    found = [emitted_spectrum(paint, white) for paint in plain]
    used = {name for item in scene.instances for name in item.materials}
    others = _emitted([material for material in materials if material.name in used], worlds)
    own = [emitted_spectrum(paint, white) for paint in others if _has_own_spectrum(paint)]
    if any(not _has_own_spectrum(paint) for paint in others):
        found.append(emitted_spectrum(Color(np.ones(3)), white))
    return found + _distinct(own)


def _has_own_spectrum(emitted: Any) -> bool:
    """True if what is emitted needs other wavelengths than white: a spectrum, or a color outside of sRGB."""
    return isinstance(emitted, Spectrum) or (isinstance(emitted, Color) and is_outside(emitted.linear_rgb))


def _emitted(materials: list[Material], worlds: list[World]) -> list[Any]:
    """What surfaces, media and the world's view from the camera emit, each mixed paint divided into its parts."""
    paints = [color for material in materials for color, _ in emissions_of(material.surface)]
    media = [material.medium for material in materials] + [world.medium for world in worlds]
    paints += [medium.emission_color for medium in media if medium is not None and medium.emission_strength != 0]
    views = [world.camera_view for world in worlds if world.camera_view is not None]
    paints += [view.color for view in views if not view.is_black]
    return [part for paint in paints for part in _parts(paint)]


def _distinct(spectra: list[Spectrum]) -> list[Spectrum]:
    """Each different spectrum once, at most ``_MOST``."""
    found: dict[bytes, Spectrum] = {}
    for spectrum in spectra:
        found.setdefault(spectrum.grid.wavelengths_nm.tobytes() + spectrum.values.tobytes(), spectrum)
    return list(found.values())[:_MOST]


def _parts(paint: Any) -> list[Any]:
    """The colors that a mixed paint mixes."""
    return _parts(paint.first) + _parts(paint.second) if isinstance(paint, MixedPaint) else [paint]


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
