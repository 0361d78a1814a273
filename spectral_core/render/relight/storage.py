# SPDX-License-Identifier: GPL-3.0-or-later
"""What a transport render stores, for what will be changed later: channels, their error, their memory.

- ``dial``: linear sRGB per light group. Exact for every mixture of the given lights.
- ``bands``: radiance per nm around 31, 61 or 121 wavelengths, under flat light. For new spectra, with an error that
  grows with the spikes of light and surfaces.
- ``exact``: hat function times color matching function, under flat light. Exact for every spectrum of the grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.render.trace.wavelengths import FIRST_NM, LAST_NM, WAVELENGTHS_NM, Bands
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import STANDARD, linear_rgb_from_product, observer
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid, Spectrum

Array = NDArray[np.float64]
StorageKind = Literal["dial", "bands", "exact"]
BAND_COUNTS = (31, 61, 121)

# Mean ΔE2000 of the worst lamp on the worst surfaces, with a fifth to spare: `python -m benchmarks relight-bands`, 21
# lamps, and any single laser; a color chart, spectra designed on 10 nm, and two bounces of each.
# (smooth lamps, sodium and fluorescent lamps, lasers)
BAND_ERRORS = {31: (1.7, 7.0, 45.0), 61: (0.5, 2.3, 38.0), 121: (0.13, 0.7, 34.0)}


@dataclass(frozen=True, slots=True, eq=False)
class Storage:
    """A kind of storage and its wavelengths. ``grid`` is None for ``dial``."""

    kind: StorageKind
    grid: SpectralGrid | None = None

    def __post_init__(self) -> None:
        if self.kind not in ("dial", "bands", "exact"):
            raise InvalidInputError(f"storage is {self.kind!r}; expected 'dial', 'bands' or 'exact'")
        if (self.grid is None) != (self.kind == "dial"):
            raise InvalidInputError("'bands' and 'exact' storages need a wavelength grid, 'dial' has none")

    @classmethod
    def dial(cls) -> Storage:
        """Linear sRGB of the lights as they are."""
        return cls("dial")

    @classmethod
    def bands(cls, count: int = 31) -> Storage:
        """``count`` bands, 31, 61 or 121, from 400 to 700 nm; the outermost reach to the ends of the spectrum."""
        if count not in BAND_COUNTS:
            raise InvalidInputError(f"{count} bands; expected one of {BAND_COUNTS}")
        return cls("bands", SpectralGrid(np.linspace(400.0, 700.0, count)))

    @classmethod
    def exact(cls, grid: SpectralGrid) -> Storage:
        """Every spectrum of ``grid``; its knots must be whole nm from 360 to 830, where the observer is tabulated."""
        knots = grid.wavelengths_nm
        if np.any(knots != np.round(knots)) or knots[0] < FIRST_NM or knots[-1] > LAST_NM:
            raise InvalidInputError(
                f"an exact transport needs knots at whole nm within {FIRST_NM} to {LAST_NM}; got {grid}"
            )
        return cls("exact", grid)

    @property
    def channel_count(self) -> int:
        """Numbers per pixel and light group."""
        if self.grid is None:
            return 3
        return self.grid.size if self.kind == "bands" else 3 * self.grid.size

    def bytes_needed(self, width: int, height: int, groups: int) -> int:
        """Bytes of the stored channels and the coverage, in memory and (uncompressed) on disk."""
        return 4 * width * height * (self.channel_count * groups + 1)

    def stated_error(self) -> str:
        """In words, what a relit picture may differ by from a render."""
        if self.kind == "dial":
            return "exact (float rounding) for any mixture of the given lights; new spectra are not possible"
        if self.kind == "exact":
            return f"exact (float rounding) for every spectrum that is linear between {self.grid}"
        smooth, lines, laser = BAND_ERRORS[self.channel_count]
        return (
            f"mean ΔE2000 on designed surfaces up to {smooth:g} for smooth lamps, {lines:g} for sodium and fluorescent "
            f"ones, {laser:g} for lasers"
        )

    def describe(self, width: int, height: int, groups: int) -> str:
        """One line to show before rendering: size in memory, and error."""
        size = self.bytes_needed(width, height, groups) / 1e6
        channels = f"{self.channel_count} channels × {groups} lights at {width}×{height}"
        return f"{self.kind}: {channels}, {size:,.0f} MB; {self.stated_error()}"

    def measured(self) -> Bands | None:
        """Channels for the renderer; None for ``dial``."""
        if self.grid is None:
            return None
        if self.kind == "bands":
            hats = _reaching_hats(self.grid)
            widths = (hats[:, 1:] + hats[:, :-1]).sum(axis=1) / 2
            return Bands(tuple(f"{knot:.6f}" for knot in self.grid.wavelengths_nm), hats / widths[:, None])
        return _hats_times_cmfs(self.grid)

    def rgb_from_channels(self, light: Spectrum) -> Array:
        """Matrix (3, channels): linear sRGB of a pixel whose channels were recorded under flat light, lit by ``light``.

        ``light``: relative to the flat light, whose value is 1 everywhere; read linearly between its own knots for
        ``bands``, at the grid's knots for ``exact`` (a light of another grid is then an approximation).
        """
        if self.grid is None:
            raise InvalidInputError("a 'dial' transport holds no spectra; record 'bands' or 'exact' for new ones")
        if self.kind == "bands":
            return _rgb_from_reaching_hats(light, self.grid)
        amounts = light.at(self.grid.wavelengths_nm)
        return (amounts[None, :, None] * RGB_FROM_XYZ[:, None, :]).reshape(3, -1)


def flat_light() -> Illuminant:
    """The light that transport is recorded under: 1 at every wavelength that is traced."""
    return Illuminant("flat", SpectralGrid(np.array([float(FIRST_NM), float(LAST_NM)])), np.ones(2))


def _hats_times_cmfs(grid: SpectralGrid) -> Bands:
    """Products of two functions that are linear within each 1 nm cell; the outermost hats end where the grid does."""
    hats, cmfs = grid.values_from_knots(WAVELENGTHS_NM).T, _cmfs()
    knots = grid.wavelengths_nm
    inside = (knots[0] <= WAVELENGTHS_NM[:-1]) & (WAVELENGTHS_NM[1:] <= knots[-1])
    ends = (slice(None, -1), slice(1, None))
    at_ends = [hats[:, None, end] * cmfs[:, end] for end in ends]
    half_way = (hats[:, None, :-1] + hats[:, None, 1:]) * (cmfs[:, :-1] + cmfs[:, 1:]) / 4
    pieces = np.stack([at_ends[0], half_way, at_ends[1]]) * inside
    names = tuple(f"{axis}.{knot:.6f}" for knot in knots for axis in "xyz")
    return Bands(names, (hats[:, None] * cmfs).reshape(len(names), -1), pieces.reshape(3, len(names), -1))


def _cmfs() -> Array:
    return observer(STANDARD).cmfs


def _rgb_from_reaching_hats(light: Spectrum, grid: SpectralGrid) -> Array:
    """Linear sRGB (3, n) of ``light`` times each of ``_reaching_hats``, integrated exactly."""
    ends = (np.array([nm]) for nm in (FIRST_NM - 1.0, LAST_NM + 1.0))
    reaching = SpectralGrid(np.concatenate([next(ends), grid.wavelengths_nm, next(ends)]))
    matrix = linear_rgb_from_product(light, reaching)
    matrix[:, 1] += matrix[:, 0]  # up to the first knot both hats sum to 1, as the outermost band does
    matrix[:, -2] += matrix[:, -1]
    return matrix[:, 1:-1]


def _reaching_hats(grid: SpectralGrid) -> Array:
    """Hat functions (n, 471) at 1 nm that sum to 1 everywhere: the outermost stay at 1 to the ends."""
    inside = np.clip(WAVELENGTHS_NM, grid.wavelengths_nm[0], grid.wavelengths_nm[-1])
    return grid.values_from_knots(inside).T
