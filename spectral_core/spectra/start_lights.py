# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that a design starts from."""

from __future__ import annotations

import math

import numpy as np

from spectral_core.checks import require_kind, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.observer import normalized
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

LEAST_PERIOD_NM = 1e-3
"""Least period of a sine light; any period below the distance of two samples is arbitrary, and zero is none."""


def sine_light(period_nm: float, grid: SpectralGrid, *, luminance: float = 1.0) -> Illuminant:
    """1 + sin(2π (λ − 400 nm) / period): the start from which the thesis designed its split lights."""
    period_nm = require_range("the period of a sine light", period_nm, -math.inf, math.inf, " nm")
    if not LEAST_PERIOD_NM <= abs(period_nm) < math.inf:
        raise InvalidInputError(
            f"the period of a sine light is {period_nm:g} nm; expected at least {LEAST_PERIOD_NM:g} nm, such as 45"
        )
    require_kind("the grid of a sine light", grid, SpectralGrid)
    phase = 2 * np.pi * (grid.wavelengths_nm - 400.0) / period_nm
    light = Illuminant(f"sine {period_nm:g} nm", grid, 1 + np.sin(phase), source="section 5.4.1")
    return normalized(light, luminance=luminance)
