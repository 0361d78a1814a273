# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights by which the wavelengths of a recording are drawn."""

from __future__ import annotations

from collections.abc import Iterable

from spectral_core.render.relight.storage import Storage, flat_light
from spectral_core.render.trace.wavelengths import noise_of, plan_wavelengths
from spectral_core.spectra.observer import integration_points
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

SAMPLING_LIGHTS: tuple[Spectrum, ...] = (flat_light(),)
"""Wavelengths of a transport render are drawn for any later light. A render with these ``sampling_lights`` and the same
seed traces the same paths, so that a relit picture equals it up to float rounding. If the scene has narrow lights,
``sampling_lights`` has more.
"""
_NARROW = 4.0
"""Variance of a narrow light, drawn for any light, over that of its own wavelengths. Lamps of sRGB's primaries, HP1 and
FL11 have up to 2.8, those of Rec.2020 up to 16.
"""


def sampling_lights(lights: Iterable[Spectrum | None], storage: Storage) -> tuple[Spectrum, ...]:
    """Lights by which a recording with ``storage`` of a scene with ``lights`` draws its wavelengths.

    A third of the samples of a scene with narrow lights follows these, because few of the others hit them. A recording
    keeps a light's amount of each hat of the storage, so the wavelengths follow these amounts.
    """
    if storage.grid is None:
        return SAMPLING_LIGHTS
    plan = plan_wavelengths(SAMPLING_LIGHTS, follow_bands=False)
    kept = [_on_hats(light, storage.grid) for light in lights if light is not None]
    narrow = [light for light in kept if noise_of(light, plan) > _NARROW]
    return (*SAMPLING_LIGHTS * max(1, 2 * len(narrow)), *narrow)


def _on_hats(light: Spectrum, grid: SpectralGrid) -> Spectrum:
    """The mean of a light under each hat of a grid."""
    points, weights = integration_points(grid.wavelengths_nm, light.grid.wavelengths_nm)
    power = grid.against_hats(points, light.at(points) * weights)[0]
    points, weights = integration_points(grid.wavelengths_nm)
    return Spectrum(light.name, grid, power / grid.against_hats(points, weights)[0])
