# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of adaptive sampling: pixels with different numbers of samples, and its error so far.

The picture is kept in two halves with separate random numbers; their difference estimates the error of each tile.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.errors import (
    Estimate,
    Wide,
    estimated,
    expected_errors,
    most_expected,
    rarity,
    rarity_after,
)
from spectral_core.render.cost.model import RareLight
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.resample import BLOCK, pools
from spectral_core.render.job import RenderJob

Array = NDArray[np.float64]

TILE_WIDTH, TILE_HEIGHT = 16, 4
"""Size of a tile in pixels; the processor traces a packet of 16 pixels in a row together."""
MOST_SAMPLES = 1 << 16
WATCHED = 16384
"""Pixels at which earlier rounds are kept."""
_GROWTH = 4.0
"""Largest growth of a tile's samples in one round, before its error is estimated again."""
_GOLDEN = 0.6180339887498949
"""Step of numbers in [0, 1) that are evenly spread however many are taken."""
_FEW = 16.0
"""Samples of each half up to which a tile has a power of two."""
_ENOUGH = 12.0
"""Samples of each half from which on most pixels have met most of their light, so that their halves limit the error."""
_MANY = 1000
"""Pixels from which on this limit is known well enough: the smaller of two uncertain numbers is too small."""
LONGEST_LAUNCH_S = 4.0


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of adaptive sampling: ``delta_e``, the ``spread`` of this estimate, seconds, mean samples per pixel.

    ``rare``: light that samples hardly contain, whose missing part is in ``delta_e``: this is then a lower bound.
    """

    delta_e: float
    spread: float
    seconds: float
    samples: float
    reached: bool = True
    rare: RareLight | None = None


class AdaptivePicture:
    """The two halves of a picture, its tiles, and how many samples each pixel has in each half.

    ``probe``: some of its pixels, traced before, with which it is compared.
    """

    def __init__(self, job: RenderJob, probe: Probe) -> None:
        self._probe = probe
        self._tracer = job.chosen_pixels()
        self.film = job.scene.film
        width, height = self.film.size
        self.size = (width, height)
        pixels = width * height
        self._sums = np.zeros((2, pixels, 3))
        self._covered = np.zeros(pixels)
        self._bands = np.zeros((pixels, self._tracer.band_count)) if self._tracer.band_count else None
        self.counts = np.zeros(pixels, np.int64)
        column, row = np.arange(pixels) % width, np.arange(pixels) // width
        self._across = -(-width // TILE_WIDTH)
        self._up = -(-height // TILE_HEIGHT)
        self.tile = (row // TILE_HEIGHT) * self._across + column // TILE_WIDTH
        self.tile_pixels = np.bincount(self.tile, minlength=self._across * self._up).astype(np.float64)
        self._pools = pools(np.arange(pixels), width)
        self._wide = Wide(pools(np.arange(pixels), width, BLOCK), probe.wide().repeated)
        self._watched = np.flatnonzero(np.random.default_rng(self.film.seed).random(pixels) < WATCHED / pixels)
        self._earlier: list[tuple[Array, Array, Array]] = []
        self._errors: Array | None = None
        self._rarity: float | None = None
        self.lost = 0
        self.seconds_per_path = probe.seconds_per_path * probe.slowness
        self.launch_s = probe.launch_s * probe.slowness
        self.dearer = 1.0
        """Time of a path of later rounds over that of the first samples."""

    def add(self, more: NDArray[np.int64], end: float = np.inf, longest_s: float = LONGEST_LAUNCH_S) -> bool:
        """Trace ``more`` samples of each pixel in each half, in launches of at most about ``longest_s``.

        False if they would not be done at ``end`` (of ``time.perf_counter``): those that fit in were traced.
        """
        left = more.copy()
        while np.any(left > 0):
            paths = 2 * float(left[left > 0].sum())
            parts = max(1.0, paths * self.seconds_per_path / longest_s)
            step = np.ceil(np.maximum(left, 0) / parts).astype(np.int64)
            time_left = end - time.perf_counter() - self.launch_s
            fits = time_left / max(2 * float(step.sum()) * self.seconds_per_path, 1e-9)
            if fits < 1:
                step = np.floor(step * max(fits, 0.0)).astype(np.int64)
            if not step.any():
                return False
            self._trace(step)
            left -= step
            if fits < 1:
                return False
        return True

    def _trace(self, step: NDArray[np.int64]) -> None:
        """Trace ``step`` samples of each pixel in both halves with one launch, and measure the time."""
        chosen = np.flatnonzero(step > 0)
        more = step[chosen]
        start = time.perf_counter()
        sums = self._tracer.trace_halves(chosen, self.counts[chosen], more)
        self._sums[:, chosen] += sums.colors.reshape(2, -1, 3)
        self._covered[chosen] += sums.covered.reshape(2, -1).sum(axis=0)
        if self._bands is not None and sums.bands is not None:
            self._bands[chosen] += sums.bands.reshape(2, len(chosen), -1).sum(axis=0)
        self.lost += sums.lost
        spent = time.perf_counter() - start
        traced = 2 * float(more.sum())
        if traced * max(self.seconds_per_path, 1e-9) > self.launch_s or self.seconds_per_path == 0:
            self.seconds_per_path = max(spent - self.launch_s, 0.2 * spent) / traced
        self.counts[chosen] += more
        self._errors = self._rarity = None

    def halves(self) -> Array:
        """(2, pixels, 3): the halves' means so far."""
        return np.asarray(self._sums / np.maximum(self.counts, 1)[None, :, None])

    def errors(self) -> Array:
        """ΔE2000 of each pixel so far."""
        if self._errors is None:
            halves = self.halves()
            self._errors = expected_errors(halves, self._pools, self._wide)
            if self.counts.mean() >= _ENOUGH and len(self._watched) >= _MANY:
                most = most_expected(halves, self._wide.blocks, self._watched)
                self._errors *= min(1.0, most / max(float(self._errors[self._watched].mean()), 1e-12))
        return self._errors

    def remember(self) -> None:
        """Keep the current halves at some pixels; later rounds compare with them to detect light on rare paths."""
        some = self._watched
        self._earlier.append((self.counts[some].astype(np.float64), self.halves()[:, some], self.errors()[some]))

    def rarity(self) -> float:
        """Factor on the error for light on rare paths, see ``errors.rarity``."""
        if self._rarity is None:
            self._rarity = self._found_rarity()
        return self._rarity

    def _found_rarity(self) -> float:
        told = self._probe.compared(self.halves(), self.counts, self.errors())
        if told is not None:
            return told
        now = self.counts[self._watched].astype(np.float64)
        past = [each for each in self._earlier if 3.9 * each[0].mean() <= now.mean()]
        if not past:
            return self._probe.rarity(float(now.mean()), of_half=False)
        counts, early, errors = past[-1]
        factor = rarity(early, self.halves()[:, self._watched], counts, now, errors)
        return rarity_after(factor, float(counts.mean()), float(now.mean()))

    def estimate(self) -> Estimate:
        """Error of the picture so far."""
        found, factor = estimated(self.errors(), self.halves(), self.tile), self.rarity()
        return Estimate(found.delta_e * factor, found.spread * factor, found.relative_mse)

    def tile_errors(self) -> Array:
        """ΔE2000 of each tile, half of it from its neighbors: a tile alone has too few pixels for a reliable
        estimate.
        """
        errors = np.bincount(self.tile, self.errors(), len(self.tile_pixels)) / self.tile_pixels
        grid = np.pad(errors.reshape(self._up, self._across), 1, mode="edge")
        around = sum(
            grid[y : y + self._up, x : x + self._across] for y in range(3) for x in range(3) if (x, y) != (1, 1)
        )
        return np.asarray((errors + np.ravel(around) / 8) / 2) * self.rarity()

    def tile_counts(self) -> Array:
        """Samples of each half in each tile."""
        return np.bincount(self.tile, self.counts, len(self.tile_pixels)) / self.tile_pixels

    def more_by_tile(self, wanted: Array, slope: float = -0.5) -> NDArray[np.int64]:
        """Samples to add in each pixel so that tiles have ``wanted`` in each half in the mean, within a round's growth.

        ``slope``: exponent of the error as a function of samples. Whole samples are spread evenly over the picture:
        rounded up everywhere, a picture of few samples would be far better than requested. Few samples are powers of
        two, where the random numbers are most even; in between, more of them may even be worse.
        """
        have = self.tile_counts()
        chance = (np.arange(len(have)) + 0.5) * _GOLDEN % 1.0
        power = 2.0 ** np.floor(np.log2(np.maximum(wanted, 1.0)))
        # some tiles have the next power, so that the mean error is that of the wanted samples
        share = (1 - (wanted / power) ** slope) / (1 - 2.0**slope)
        few = power * np.where(chance < share, 2.0, 1.0)
        whole = np.where(wanted < _FEW, few, np.floor(wanted + chance))
        goal = np.minimum(np.minimum(whole, np.maximum(_GROWTH * have, have + 1)), MOST_SAMPLES / 2)
        return np.maximum(0, np.round(goal - have)).astype(np.int64)[self.tile]

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 4) linear sRGB and coverage so far, row 0 at the bottom."""
        width, height = self.size
        total = np.maximum(2 * self.counts, 1)
        pixels = np.empty((len(total), 4), np.float32)
        pixels[:, :3] = self._sums.sum(axis=0) / total[:, None]
        pixels[:, 3] = self._covered / total
        return pixels.reshape(height, width, 4)

    def band_picture(self) -> NDArray[np.float32] | None:
        """(height, width, n_bands) radiance per nm so far, None if none is measured."""
        if self._bands is None:
            return None
        width, height = self.size
        means = self._bands / np.maximum(2 * self.counts, 1)[:, None]
        return means.astype(np.float32).reshape(height, width, -1)

    @property
    def mean_samples(self) -> float:
        """Samples per pixel, of both halves, in the mean."""
        return float(2 * self.counts.mean())
