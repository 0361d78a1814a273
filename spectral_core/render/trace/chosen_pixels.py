# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples for some pixels of a picture: those of a probe, or those that adaptive sampling has not finished.

A pixel has the samples of a render of the whole picture, but in two halves with different random numbers, whose
difference estimates the error of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.plugins.numbers import table
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.render.trace.first_hit import FirstHit
from spectral_core.render.trace.path.sampler import hashed_seed
from spectral_core.render.trace.wavelengths import WavelengthPlan
from spectral_core.scene import Camera, Film
from spectral_core.spectra.color import RGB_FROM_XYZ

_SEED_STEP = 0x5BD1E995
"""Difference between the seeds of the halves."""


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Sums over samples, by pixel: ``colors`` (n, 3) linear sRGB with exposure, ``covered`` (n,), ``lost`` samples.

    ``bands``: (n, n_bands), or None if none are measured.
    """

    colors: NDArray[np.float64]
    covered: NDArray[np.float64]
    lost: int
    bands: NDArray[np.float64] | None = None


class ChosenPixels(Accumulator):
    """Traces pixels by number (row · width + column, row 0 at the bottom) through one loaded scene."""

    keeps_light = False

    def __init__(
        self,
        mitsuba: Any,
        view: tuple[Camera, Film],
        wavelengths: WavelengthPlan | None,
        first_hit: FirstHit,
        integrator: Any,
    ) -> None:
        camera, film = view
        super().__init__(mitsuba, camera, film, wavelengths, keep=False)
        self._first_hit, self._integrator = first_hit, integrator
        self._chosen: Any = None
        self._seeds: Any = None
        self._samples_of: tuple[Any, Any] = (None, None)

    def trace(
        self,
        pixels: NDArray[np.integer[Any]],
        done: NDArray[np.integer[Any]],
        more: NDArray[np.integer[Any]],
        half: int | NDArray[np.integer[Any]],
    ) -> Sums:
        """Trace samples ``done`` to ``done + more`` of ``pixels``, (n,) each. ``half``: whose random numbers, one for
        all pixels or one for each.
        """
        mi = self._mi
        # each lane is one pixel, so that pixels far apart take the same launch
        self._chosen = table(mi.UInt32, pixels)
        self._samples_of = table(mi.UInt32, done), table(mi.UInt32, np.add(done, more))
        # Another seed gives the other half independent numbers, so that their difference is the noise of both.
        numbers, lanes = np.unique(np.broadcast_to(half, np.shape(pixels)), return_inverse=True)
        seeds = [hashed_seed((self.film.seed + int(number) * _SEED_STEP) % (1 << 31)) for number in numbers]
        self._seeds = table(mi.UInt32, np.array(seeds, dtype=np.uint32)[lanes])
        tile = self._new_tile(0, len(pixels))
        self._trace(self._first_hit, self._integrator, tile, 0)
        colors = tile.of_pixels(tile.sums).T
        colors = colors if self.plan is None else colors @ RGB_FROM_XYZ.T
        bands = None
        if self.band_count:
            bands = tile.of_pixels(tile.bands).reshape(len(pixels), -1)
        lost = int(tile.of_pixels(tile.lost).sum())
        return Sums(colors * self.film.exposure, tile.of_pixels(tile.covered), lost, bands)

    def trace_halves(
        self,
        pixels: NDArray[np.integer[Any]],
        done: NDArray[np.integer[Any]],
        more: NDArray[np.integer[Any]],
        parts: int = 1,
    ) -> Sums:
        """``trace`` for both halves in one launch: the sums of the first half, then of the second, (2n, …).

        ``parts``: of each half, with random numbers of their own, one after the other: (2·parts·n, …).
        """
        groups = 2 * parts
        every, done, more = (np.tile(each, groups) for each in (pixels, done, more))
        return self.trace(every, done, more, np.repeat(np.arange(groups), len(pixels)))

    def _seed(self) -> Any:
        return self._seeds

    def _pixels(self, tile: Any) -> Any:
        return self._chosen

    def _span(self, tile: Any, samples: int) -> tuple[Any, Any]:
        return self._samples_of
