# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that a design starts from."""

from __future__ import annotations

import numpy as np

from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


def sine_light(period_nm: float, grid: SpectralGrid, *, luminance: float = 1.0) -> Illuminant:
    """1 + sin(2π (λ − 400 nm) / period): the start from which the thesis designed its split lights."""
    phase = 2 * np.pi * (grid.wavelengths_nm - 400.0) / period_nm
    light = Illuminant(f"sine {period_nm:g} nm", grid, 1 + np.sin(phase), source="section 5.4.1")
    return normalized(light, luminance=luminance)
