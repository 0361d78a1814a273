# SPDX-License-Identifier: GPL-3.0-or-later
"""Color fidelity Rf and gamut Rg of lamps, by ANSI/IES TM-30-18 (Rf is also CIE 224:2017).

Written for optimization: values that do not depend on the lamp are computed once for each color temperature. A test
compares both numbers with colour-science.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.recipe.white import LAMP_GRID, colour_science, reference_spd
from spectral_core.spectra.catalogue import blackbody
from spectral_core.spectra.observer import observer

Array = NDArray[np.float64]

BINS = 16
_INSIDE: NDArray[np.bool_] = (LAMP_GRID.wavelengths_nm >= 380) & (LAMP_GRID.wavelengths_nm <= 780)
_CAT02: Array = np.array([[0.7328, 0.4296, -0.1624], [-0.7036, 1.6975, 0.0061], [0.0030, 0.0136, 0.9834]])
_HPE: Array = np.array([[0.38971, 0.68898, -0.07868], [-0.22981, 1.18340, 0.04641], [0.0, 0.0, 1.0]])
_ADAPTING, _BACKGROUND, _IMPACT = 100.0, 0.2, 0.69
"""Viewing conditions of CIECAM02 in TM-30: luminance 100 cd/m², background of 20 %, average surround, full
adaptation.
"""


@cache
def _samples() -> tuple[Array, Array]:
    """Reflectances (99, n) of the color evaluation samples, and color matching functions (3, n) of 10°, at 1 nm."""
    colour_science()
    from colour import SpectralShape
    from colour.quality.cfi2017 import load_TCS_CIE2017

    tcs: Any = load_TCS_CIE2017(SpectralShape(380, 780, 1))
    eye = observer("cie_1964_10deg")
    nm = LAMP_GRID.wavelengths_nm[_INSIDE]
    matching = np.stack([np.interp(nm, eye.wavelengths_nm, row, left=0, right=0) for row in eye.cmfs])
    return np.asarray(tcs.values.T, dtype=np.float64), matching


@cache
def _reference(kelvin: float) -> Array:
    """Black body to 4,000 K, daylight from 5,000 K, in between a mixture of equal luminance."""
    if kelvin <= 4000:
        return np.asarray(blackbody(kelvin, LAMP_GRID).values)
    if kelvin >= 5000:
        return reference_spd(kelvin)
    from spectral_core.palette.recipe.white import daylight_spd, xyz_from_spd

    share = (kelvin - 4000) / 1000
    pair = [np.asarray(blackbody(kelvin, LAMP_GRID).values), daylight_spd(kelvin)]
    low, high = (spd / (xyz_from_spd()[1] @ spd) for spd in pair)
    return np.asarray((1 - share) * low + share * high)


class FidelityReference:
    """Rf and Rg of lamps of one color temperature in kelvin."""

    def __init__(self, kelvin: float) -> None:
        self._colors, hues = _uniform_colors(_reference(round(kelvin, 1)))
        bins = np.floor(hues / (360 / BINS)).astype(np.intp) % BINS
        self._means = (bins == np.arange(BINS)[:, None]).astype(np.float64)
        self._means /= self._means.sum(axis=1, keepdims=True)
        self._area = _area(self._means @ self._colors[:, 1:])

    def indices(self, spd: Array) -> tuple[float, float]:
        """(Rf, Rg) of a lamp (n,) on LAMP_GRID."""
        colors, _ = _uniform_colors(spd)
        error = float(np.linalg.norm(colors - self._colors, axis=1).mean())
        fidelity = 10 * np.logaddexp((100 - 6.73 * error) / 10, 0.0)
        return float(fidelity), 100 * _area(self._means @ colors[:, 1:]) / self._area


def _area(corners: Array) -> float:
    """Area of a polygon (k, 2)."""
    following = np.roll(corners, -1, axis=0)
    return float(np.sum(corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]) / 2)


def _uniform_colors(spd: Array) -> tuple[Array, Array]:
    """CAM02-UCS (99, 3) of the samples under a lamp, and their hue angles in degrees (99,)."""
    samples, matching = _samples()
    weighted = matching * spd[_INSIDE]
    white = weighted.sum(axis=1)
    xyz = (samples @ weighted.T) * (100 / white[1])
    white = white * (100 / white[1])
    k = 1 / (5 * _ADAPTING + 1)
    level = 0.2 * k**4 * 5 * _ADAPTING + 0.1 * (1 - k**4) ** 2 * (5 * _ADAPTING) ** (1 / 3)
    induction = 0.725 * _BACKGROUND**-0.2
    gain = 100 / (_CAT02 @ white)
    cones = np.vstack([xyz, white]) @ (_HPE @ np.linalg.inv(_CAT02) @ (gain[:, None] * _CAT02)).T
    driven = (level * np.abs(cones) / 100) ** 0.42
    r, g, b = (np.sign(cones) * 400 * driven / (driven + 27.13) + 0.1).T
    red, yellow = r - 12 * g / 11 + b / 11, (r + g - 2 * b) / 9
    hue = np.arctan2(yellow, red)
    response = (2 * r + g + b / 20 - 0.305) * induction
    lightness = 100 * (response[:-1] / response[-1]) ** (_IMPACT * (1.48 + np.sqrt(_BACKGROUND)))
    eccentricity = 0.25 * (np.cos(hue + 2) + 3.8)
    t = 50000 / 13 * induction * eccentricity * np.hypot(red, yellow) / (r + g + 21 * b / 20)
    chroma = t[:-1] ** 0.9 * np.sqrt(lightness / 100) * (1.64 - 0.29**_BACKGROUND) ** 0.73
    colorfulness = np.log1p(0.0228 * chroma * level**0.25) / 0.0228
    hue = hue[:-1]
    uniform = [1.7 * lightness / (1 + 0.007 * lightness), colorfulness * np.cos(hue), colorfulness * np.sin(hue)]
    return np.column_stack(uniform), np.degrees(hue) % 360
