# SPDX-License-Identifier: GPL-3.0-or-later
"""Which wavelengths are traced, and what they weigh in the picture.

Radiance is integrated against measurement functions (the observer's three, or spectral bands) that are linear between
knots of 1 nm. Four wavelengths per path are drawn where observer and lights have their power, so that a sodium lamp
is as quiet as daylight; the draw is a quarter-spaced comb that slides by the golden ratio from sample to sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array
from spectral_core.errors import InvalidInputError
from spectral_core.spectra.observer import STANDARD, observer
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

FIRST_NM, LAST_NM = 360, 830
"""The range that Mitsuba traces."""
WAVELENGTHS_NM: Array = np.arange(FIRST_NM, LAST_NM + 1, dtype=np.float64)
WAVELENGTHS_NM.setflags(write=False)
_OBSERVER_SHARE = 0.2
"""Share of samples that follow the observer alone: what indirect light or fluorescence may need is never starved."""


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Spectral channels to measure beside the picture.

    ``names``: one per channel. ``responses``: (n_bands, 471) at 360 to 830 nm, 1 nm; a channel is ∫ L · response dλ.
    ``pieces``: (3, n_bands, 470), responses at the start, middle and end of each 1 nm cell, for ones that are quadratic
    within a cell and may jump between two; None where ``responses`` are linear in between.
    """

    names: tuple[str, ...]
    responses: Array
    pieces: Array | None = None

    def __post_init__(self) -> None:
        shape = (len(self.names), WAVELENGTHS_NM.size)
        object.__setattr__(self, "responses", frozen_array("band responses", self.responses, shape))
        if self.pieces is not None:
            pieces = frozen_array("band pieces", self.pieces, (3, shape[0], shape[1] - 1))
            object.__setattr__(self, "pieces", pieces)
        if len(set(self.names)) < len(self.names):
            raise InvalidInputError("two spectral bands share a name; give each its own")

    @classmethod
    def uniform(cls, start_nm: float = 400.0, stop_nm: float = 700.0, count: int = 31) -> Bands:
        """Mean radiance per nm around ``count`` equally spaced wavelengths: triangles that overlap to 1 everywhere.

        Named by their center wavelength in nm. Raises InvalidInputError outside 360 to 830 nm.
        """
        if not (FIRST_NM <= start_nm < stop_nm <= LAST_NM and count >= 2):
            raise InvalidInputError(
                f"{count} bands from {start_nm:g} to {stop_nm:g} nm; "
                f"expected at least 2 between {FIRST_NM} and {LAST_NM} nm"
            )
        centers = np.linspace(start_nm, stop_nm, count)
        step = centers[1] - centers[0]
        if step < 1:
            raise InvalidInputError(f"bands {step:g} nm apart; expected 1 nm or more")
        hats = np.maximum(0.0, 1 - np.abs(WAVELENGTHS_NM - centers[:, None]) / step)
        return cls(tuple(f"{center:.6f}" for center in centers), hats / step)


@dataclass(frozen=True, slots=True, eq=False)
class WavelengthPlan:
    """Density to draw wavelengths from, and what is measured.

    ``cumulative``: (471,) cumulative probability at the 1 nm knots, 0 first and 1 last; constant density in between.
    ``responses``: (n_channels, 471), x̄ ȳ z̄ first; ``pieces``: as in ``Bands``, of the bands among them.
    ``teeth``: different wavelengths per path, 4, or 1 where glass disperses (the path of one wavelength is then not
    that of another).
    """

    cumulative: Array
    responses: Array
    teeth: int = 4
    pieces: Array | None = None

    @property
    def density(self) -> Array:
        """Probability per nm in each of the 470 cells."""
        return np.diff(self.cumulative)


def plan_wavelengths(
    lights: Sequence[Spectrum], bands: Bands | None = None, *, disperses: bool = False, follow_bands: bool = True
) -> WavelengthPlan:
    """Draw in proportion to what the eye gets from ``lights`` together, plus a fifth by the eye's sensitivity alone.

    With ``bands`` half of them follow these, so that no channel is left without samples; not without
    ``follow_bands``, where the same wavelengths must be drawn whatever is measured.
    """
    cmfs = _responses_at_1_nm()
    sensitivity = _cells(cmfs.sum(axis=0))
    density = sensitivity / sensitivity.sum()
    power = np.zeros_like(density)
    for light in lights:
        seen = _cells(light.at(WAVELENGTHS_NM)) * sensitivity
        power += seen / seen.sum() if seen.sum() > 0 else 0.0
    if power.sum() > 0:
        density = _OBSERVER_SHARE * density + (1 - _OBSERVER_SHARE) * power / power.sum()
    responses = cmfs
    if bands is not None:
        responses = np.concatenate([cmfs, bands.responses])
        wanted = _cells(bands.responses.sum(axis=0))
        if wanted.sum() > 0 and follow_bands:
            density = 0.5 * density + 0.5 * wanted / wanted.sum()
    # A response over a cell of zero density would be lost: keep every cell that is measured open.
    measured = _cells(np.abs(responses).sum(axis=0)) > 0
    density = np.where(measured, np.maximum(density, 1e-6), density)
    cumulative = np.concatenate([[0.0], np.cumsum(density)])
    pieces = None if bands is None else bands.pieces
    return WavelengthPlan(cumulative / cumulative[-1], responses, 1 if disperses else 4, pieces)


def _responses_at_1_nm() -> Array:
    viewer = observer(STANDARD)
    return np.stack([np.interp(WAVELENGTHS_NM, viewer.wavelengths_nm, row, left=0, right=0) for row in viewer.cmfs])


def _cells(knots: Array) -> Array:
    return (knots[1:] + knots[:-1]) / 2
