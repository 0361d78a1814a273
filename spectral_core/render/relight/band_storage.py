# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance per nm around 31, 61 or 121 wavelengths, under flat light: new spectra, approximately."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.render.images.spectral_exr import LAYOUT, spectral_channel
from spectral_core.render.relight.storage import Array, Storage
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.spectra.observer import STANDARD, linear_rgb_from_product, observer
from spectral_core.spectra.spectrum import FIRST_NM, LAST_NM, WAVELENGTHS_NM, SpectralGrid, Spectrum

BAND_COUNTS = (31, 61, 121)

# Mean ΔE2000 of the worst lamp on the worst surfaces, plus a fifth: `python -m benchmarks relight-bands` with 21 lamps
# and any single laser; a color chart, spectra designed on 10 nm, and two bounces of each. (smooth lamps, sodium and
# fluorescent lamps, lasers)
BAND_ERRORS = {31: (1.7, 7.0, 45.0), 61: (0.5, 2.3, 38.0), 121: (0.13, 0.7, 34.0)}


@dataclass(frozen=True)
class BandStorage(Storage):
    """``count`` bands, 31, 61 or 121, from 400 to 700 nm; the outermost reach to the ends of the spectrum."""

    count: int = 31

    kind: ClassVar[str] = "bands"
    exr_header: ClassVar[dict[str, Any]] = LAYOUT

    def __post_init__(self) -> None:
        if require_whole("count of bands", self.count, 1, WAVELENGTHS_NM.size) not in BAND_COUNTS:
            raise InvalidInputError(f"{counted(self.count, 'band')}; expected one of {BAND_COUNTS}")

    @classmethod
    def choices(cls) -> dict[str, Storage]:
        """A storage for each count."""
        return {f"{cls.kind}{count}": cls(count) for count in BAND_COUNTS}

    @classmethod
    def of_grid(cls, grid: SpectralGrid | None) -> Storage | None:
        """The choice whose bands have these centers."""
        if grid is None or grid.size not in BAND_COUNTS:
            return None
        storage = cls(grid.size)
        return storage if np.allclose(storage.grid.wavelengths_nm, grid.wavelengths_nm, rtol=0, atol=1e-6) else None

    @property
    def grid(self) -> SpectralGrid:
        """Centers of the bands."""
        return SpectralGrid(np.linspace(400.0, 700.0, self.count))

    def channel_names(self) -> tuple[str, ...]:
        """Names of the published layout: ``S0.550,000000nm``."""
        return tuple(spectral_channel(knot) for knot in self.grid.wavelengths_nm)

    def measured(self) -> Bands:
        """Mean radiance per nm under each hat function; beyond the outermost knots a wavelength counts as the observer
        sees it, so that the invisible ends, which a surface may reflect otherwise, do not dilute the visible part.
        """
        hats = _reaching_hats(self.grid) * _seen_beyond(self.grid)
        widths = (hats[:, 1:] + hats[:, :-1]).sum(axis=1) / 2
        return Bands(tuple(f"{knot:.6f}" for knot in self.grid.wavelengths_nm), hats / widths[:, None])

    def rgb_from_channels(self, light: Spectrum) -> Array:
        """Linear sRGB of ``light`` times each hat, integrated exactly: transport is assumed to be constant under a
        hat.
        """
        below, above = np.array([FIRST_NM - 1.0]), np.array([LAST_NM + 1.0])
        reaching = SpectralGrid(np.concatenate([below, self.grid.wavelengths_nm, above]))
        matrix = linear_rgb_from_product(light, reaching)
        matrix[:, 1] += matrix[:, 0]  # up to the first knot both hats sum to 1, like the outermost band
        matrix[:, -2] += matrix[:, -1]
        return matrix[:, 1:-1]

    def stated_error(self) -> str:
        """Text on the difference of a relit picture from a render."""
        smooth, lines, laser = BAND_ERRORS[self.count]
        return (
            f"New spectra: mean ΔE2000 up to {smooth:g} for smooth lamps, {lines:g} for sodium and fluorescent "
            f"ones, {laser:g} for lasers, on designed surfaces"
        )


def _seen_beyond(grid: SpectralGrid) -> Array:
    """Sensitivity of the observer (471,) relative to that at the nearest wavelength within a grid: 1 within it."""
    sensitivity = observer(STANDARD).cmfs.sum(axis=0)
    inside = np.clip(WAVELENGTHS_NM, grid.wavelengths_nm[0], grid.wavelengths_nm[-1])
    seen: Array = sensitivity / np.interp(inside, WAVELENGTHS_NM, sensitivity)
    return seen


def _reaching_hats(grid: SpectralGrid) -> Array:
    """Hat functions (n, 471) at 1 nm that sum to 1 everywhere: the outermost stay at 1 to the ends."""
    inside = np.clip(WAVELENGTHS_NM, grid.wavelengths_nm[0], grid.wavelengths_nm[-1])
    return grid.values_from_knots(inside).T
