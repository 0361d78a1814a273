# SPDX-License-Identifier: GPL-3.0-or-later
"""Realism against independence: contrast that is lost by daylight in both designed lights, and by the width of their
LEDs.

Designing lights takes seconds, but a slider must respond at once. So the contrast is interpolated bilinearly in a table
of designs (``python -m benchmarks spectral-textures --realism`` prints a new one).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError
from spectral_core.palette.given import require_each, sequence_of
from spectral_core.palette.texture.reach import stimulus_matrix
from spectral_core.spectra.color import RGB_FROM_XYZ, WHITE_XYZ, delta_e_2000, lab_from_linear_rgb
from spectral_core.spectra.observer import OBSERVER_NAMES, observer, xyz_from_spectrum
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

Array = NDArray[np.float64]

LED_WIDTHS_NM: Array = np.array([10.0, 20.0, 30.0, 40.0, 60.0])
DAYLIGHT_SHARES: Array = np.array([0.0, 0.1, 0.2, 0.3, 0.5, 0.7])
_CONTRAST: Array = np.array([
    [20.0, 18.98, 15.6, 11.25, 5.85, 3.27],
    [19.89, 17.39, 11.18, 8.66, 3.83, 2.25],
    [16.76, 13.16, 8.81, 6.19, 2.92, 2.28],
    [9.34, 7.22, 5.69, 4.57, 3.02, 1.95],
    [3.52, 3.09, 2.7, 2.36, 1.82, 1.43],
])  # fmt: skip
"""Contrast that every pair of pictures keeps at floor 0.05, by LED width and share of daylight."""
_RENDERING: Array = np.array([
    [10.8, 10.5, 8.4, 6.8, 6.5, 4.2],
    [11.1, 10.2, 8.9, 5.6, 8.1, 5.2],
    [10.1, 9.3, 8.5, 7.6, 7.2, 3.2],
    [8.9, 7.8, 7.2, 6.1, 4.1, 2.7],
    [4.8, 4.5, 3.7, 3.2, 2.5, 1.7],
])  # fmt: skip
"""Mean ΔE2000 of the 24 color checker patches against D65, of the worse of both lights; it depends on the start of the
design as well, hence not smooth."""


@dataclass(frozen=True, slots=True)
class RealismCost:
    """``contrast``: approximate contrast of unrelated pictures; ``rendering_delta_e``: mean color error of 24 test
    colors under the worse of both lights.
    """

    contrast: float
    rendering_delta_e: float


def realism_cost(daylight_share: float, led_width_nm: float) -> RealismCost:
    """Estimate the contrast and color rendering of two designed lights. ``daylight_share``: 0 to 0.9; ``led_width_nm``:
    5 to 60.
    """
    share = require_range("daylight_share", daylight_share, 0.0, 0.9)
    width = require_range("LED width", led_width_nm, 5.0, 60.0, " nm")
    # A contrast c corresponds to the slope 0.05 (c - 1); the slope is interpolated between entries, and goes to 0
    # beyond 70 %.
    shares = np.append(DAYLIGHT_SHARES, 1.0)
    slopes = np.column_stack([0.05 * (_CONTRAST - 1), np.zeros(len(_CONTRAST))])
    rendering = np.column_stack([_RENDERING, np.zeros(len(_RENDERING))])

    def between(table: Array) -> float:
        along = np.array([np.interp(share, shares, row) for row in table])
        return float(np.interp(width, LED_WIDTHS_NM, along))

    return RealismCost(1 + between(slopes) / 0.05, between(rendering))


@dataclass(frozen=True, slots=True)
class WhiteDifference:
    """Difference between two whites for one standard observer.

    ``between``: ΔE2000 between both lights; ``to_daylight``: the larger of both to D65, for this observer.
    """

    observer: str
    between: float
    to_daylight: float


def white_differences(lights: Sequence[Illuminant]) -> tuple[WhiteDifference, ...]:
    """Differences for other observers: lights that match for the standard observer do not match for all others."""
    from spectral_core.spectra.catalogue import illuminant

    lights = sequence_of("lights", lights)
    require_each("lights", lights, Illuminant, "an Illuminant, such as catalogue.illuminant('D65')")
    if not lights:
        raise InvalidInputError("no light is given; the differences are those of at least one")
    found = []
    for name in OBSERVER_NAMES:
        eye = observer(name)

        def white(light: Illuminant, eye: object = eye) -> Array:
            xyz = np.asarray(xyz_from_spectrum(light.grid, eye) @ light.values)  # type: ignore[arg-type]
            return np.asarray(xyz / xyz[1])

        daylight = white(illuminant("D65"))
        labs = [lab_from_linear_rgb(RGB_FROM_XYZ @ (white(light) / daylight * WHITE_XYZ)) for light in lights]
        neutral = lab_from_linear_rgb(np.ones(3))
        pairs = [float(delta_e_2000(a, b)) for k, a in enumerate(labs) for b in labs[:k]]
        found.append(
            WhiteDifference(name, max(pairs, default=0.0), max(float(delta_e_2000(lab, neutral)) for lab in labs))
        )
    return tuple(found)


def rendering_delta_e(light: Illuminant, reflectances: Array, grid: SpectralGrid) -> float:
    """Mean ΔE2000 of surfaces (m, n) on ``grid`` under ``light`` against D65, each relative to its own white."""
    from spectral_core.spectra.catalogue import illuminant

    labs = [lab_from_linear_rgb(reflectances @ stimulus_matrix([each], grid).T) for each in (light, illuminant("D65"))]
    return float(np.mean(delta_e_2000(labs[0], labs[1])))
