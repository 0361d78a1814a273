# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured lights and surfaces that several benchmarks are run over."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra import catalogue, observer
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

LIGHT_GROUPS = {
    "LED": ("LED", "PHOS", "Luxeon"),
    "discharge": ("HP", "LPS", "Mercury", "Metal Halide", "MHC", "H38", "SDW", "C100"),
    "fluorescent": ("FL", "F3", "F4", "T8", "TL-84", "Thorn", "Natural", "Triphosphor"),
}
"""Words in the names of lamps by type; the first type with a match counts; all others are smooth."""


def unique_lights() -> list[Illuminant]:
    """colour-science's lights as shipped, without those that it holds twice, each of luminance 1."""
    lights: list[Illuminant] = []
    for name in catalogue.illuminant_names():
        light = observer.normalized(catalogue.illuminant(name))
        visible = light.at(np.arange(380, 781))
        if not any(np.allclose(visible, other.at(np.arange(380, 781))) for other in lights):
            lights.append(light)
    return lights


def light_group(name: str) -> str:
    """``"LED"``, ``"discharge"``, ``"fluorescent"`` or ``"smooth"``."""
    for group, words in LIGHT_GROUPS.items():
        if any(word in name for word in words):
            return group
    return "smooth"


def measured_reflectances(grid: SpectralGrid) -> tuple[NDArray[np.float64], int]:
    """The 24 patches of the color checker, then the 99 materials of CIE 224:2017: (123, n), and 24.

    The materials come from colour-science; without it only the color checker is returned.
    """
    checker = np.array([catalogue.reflectance(name).at(grid.wavelengths_nm) for name in catalogue.reflectance_names()])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import colour
            from colour.quality.cfi2017 import load_TCS_CIE2017

            materials = load_TCS_CIE2017(colour.SpectralShape(380, 780, 5))
    except ImportError:
        return checker, len(checker)
    resampled = [np.interp(grid.wavelengths_nm, materials.wavelengths, row) for row in materials.values.T]
    return np.concatenate([checker, resampled]), len(checker)
