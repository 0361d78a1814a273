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
    Told,
    Wide,
    estimated,
    expected_errors,
    pixel_errors,
    rarity,
    rarity_after,
    seen_later,
    splits,
    told_by_later,
)
from spectral_core.render.cost.model import RareLight
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.resample import BLOCK, pools
from spectral_core.render.job import RenderJob

Array = NDArray[np.float64]

TILE, TILE_OF_FEW = (16, 4), (4, 2)
"""Columns and rows of the pixels of a tile; the processor traces a packet of 16 pixels in a row together. Small
pictures would have too few of them.
"""
MOST_SAMPLES = 1 << 16
WATCHED = 16384
"""Pixels at which earlier rounds are kept."""
_GROWTH = 4.0
"""Largest growth of a tile's samples in one round, before its error is estimated again."""
_GOLDEN = 0.6180339887498949
"""Step of numbers in [0, 1) that are evenly spread however many are taken."""
_TURN = 0.7548776662466927
"""Another such step, from round to round."""
FEW = 16.0
"""Samples of each half up to which a tile has a power of two."""
_ENOUGH, _APART = 12.0, 3.9
"""Samples of each half from which on most pixels have met most of their light, so that their halves tell the error; and
the least ratio to those of an earlier round with which a picture is compared.
"""
MANY = 1000
"""Differences of halves, of all pixels together, from which on they tell the error well enough. Halves of smaller
pictures have parts, whose splits give a pixel as many differences as it has parts, less one.
"""
_MOST_PARTS, _OF_A_PART = 8, 4
"""Most parts of a half, and least samples of each before tiles are treated differently."""
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


@dataclass(frozen=True, slots=True, eq=False)
class _Earlier:
    """What a round left at the watched pixels: samples of each half, the halves' means, errors as in ``_Found``."""

    counts: Array
    halves: Array
    own: Array
    pooled: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """ΔE2000 of each pixel: by its halves alone, by pooled noise, and by all that is known, without ``rarity``."""

    own: Array
    pooled: Array
    errors: Array
    rarity: float


class AdaptivePicture:
    """The two halves of a picture, its tiles, and how many samples each pixel has in each half.

    ``probe``: some of its pixels, traced before, with which it is compared.
    """

    def __init__(self, job: RenderJob, probe: Probe) -> None:
        self._probe = probe
        self._tracer = job.chosen_pixels()
        self.film = job.scene.film
        self._undisplayed = job.scene.undisplayed  # the colors that are compared are those that a display shows
        self.size = width, height = self.film.size
        pixels = width * height
        self._sums = np.zeros((1, 2, pixels, 3))
        self._covered = np.zeros(pixels)
        self._bands = np.zeros((pixels, self._tracer.band_count)) if self._tracer.band_count else None
        self.counts = np.zeros(pixels, np.int64)
        shape = TILE if pixels >= MANY else TILE_OF_FEW
        self._across, self._up = -(-width // shape[0]), -(-height // shape[1])
        self.tile = pools(np.arange(pixels), width, shape)
        self.tile_pixels = np.bincount(self.tile, minlength=self._across * self._up).astype(np.float64)
        self._pools = pools(np.arange(pixels), width)
        self._wide = Wide(pools(np.arange(pixels), width, BLOCK), probe.wide().repeated)
        self._watched = np.flatnonzero(np.random.default_rng(self.film.seed).random(pixels) < WATCHED / pixels)
        self._earlier: list[_Earlier] = []
        self._found: _Found | None = None
        self._rounds = 0
        self.lost = 0
        self.seconds_per_path = probe.seconds_per_path * probe.slowness
        self.launch_s = probe.launch_s * probe.slowness
        self.dearer = 1.0
        """Time of a path of later rounds over that of the first samples."""

    def divide(self, first: int) -> None:
        """Give the halves of a small picture parts, before its first sample; ``first``: samples of each half with which
        it begins everywhere.
        """
        parts = 1
        while parts < min(_MOST_PARTS, first // _OF_A_PART) and len(self._watched) * (2 * parts - 1) < MANY:
            parts *= 2
        self._sums = np.zeros((parts, *self._sums.shape[1:]))

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
        """Trace ``step`` samples of each pixel in both halves with one launch, and measure the time.

        Parts of a half have equal numbers of samples, which are rounded up for it.
        """
        parts = len(self._sums)
        chosen = np.flatnonzero(step > 0)
        each = -(-step[chosen] // parts)
        more = parts * each
        start = time.perf_counter()
        sums = self._tracer.trace_halves(chosen, self.counts[chosen] // parts, each, parts)
        self._sums[:, :, chosen] += sums.colors.reshape(parts, 2, -1, 3)
        self._covered[chosen] += sums.covered.reshape(2 * parts, -1).sum(axis=0)
        if self._bands is not None and sums.bands is not None:
            self._bands[chosen] += sums.bands.reshape(2 * parts, len(chosen), -1).sum(axis=0)
        self.lost += sums.lost
        spent = time.perf_counter() - start
        traced = 2 * float(more.sum())
        if traced * max(self.seconds_per_path, 1e-9) > self.launch_s or self.seconds_per_path == 0:
            self.seconds_per_path = max(spent - self.launch_s, 0.2 * spent) / traced
        self.counts[chosen] += more
        self._found = None

    def halves(self) -> Array:
        """(2, pixels, 3): the halves' means so far."""
        return np.asarray(self._sums.sum(axis=0) / np.maximum(self.counts, 1)[None, :, None])

    def errors(self) -> Array:
        """ΔE2000 of each pixel so far, without ``rarity``."""
        return self._errors_found().errors

    def rarity(self) -> float:
        """Factor on the error for light on rare paths, see ``errors.rarity``."""
        return self._errors_found().rarity

    def remember(self) -> None:
        """Keep the current halves at some pixels; later rounds compare with them to detect light on rare paths."""
        some, found = self._watched, self._errors_found()
        counts = self.counts[some].astype(np.float64)
        self._earlier.append(_Earlier(counts, self.halves()[:, some], found.own[some], found.pooled[some]))

    def _errors_found(self) -> _Found:
        if self._found is None:
            every = splits(self._sums, self.counts)
            own = np.mean([pixel_errors(*halves) for halves in every], axis=0)
            pooled = np.mean([expected_errors(halves, self._pools, self._wide) for halves in every], axis=0)
            self._found = self._completed(own, pooled, len(every))
        return self._found

    def _completed(self, own: Array, pooled: Array, differences: int) -> _Found:
        """The errors with what comparisons with earlier or later samples tell."""
        if len(self.counts) < MANY:
            seen = self._probe.seen(self.halves(), self.counts, contained=len(self._sums) == 1)
            if seen is not None:
                return _Found(own, pooled, seen, 1.0)
        compared = self._probe.compared(self.halves(), self.counts, pooled)
        if compared is not None:
            return _Found(own, pooled, pooled, compared)
        now = self.counts[self._watched].astype(np.float64)
        past = next((each for each in reversed(self._earlier) if _APART * each.counts.mean() <= now.mean()), None)
        if past is None:
            return _Found(own, pooled, pooled, self._probe.rarity(float(now.mean()), of_half=False))
        late, share = self.halves()[:, self._watched], float(past.counts.mean() / now.mean())
        if now.mean() >= _ENOUGH and len(now) * differences >= MANY:
            some, later = seen_later(past.halves, late, past.counts, now)
            if some.any():
                told = Told(float(own[self._watched].mean()), float(pooled[self._watched].mean()))
                early = Told(float(past.own[some].mean()), float(past.pooled[some].mean()))
                ratio = told_by_later(told, early, later, share) / max(told.pooled, 1e-12)
                return _Found(own, pooled, pooled * ratio, 1.0)
        factor = rarity(past.halves, late, past.counts, now, past.pooled)
        return _Found(own, pooled, pooled, rarity_after(factor, 1.0, 1.0 / share))

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

    def more_by_tile(self, wanted: Array, slope: Array | float = -0.5) -> NDArray[np.int64]:
        """Samples to add in each pixel so that tiles have ``wanted`` in each half in the mean, within a round's growth.

        ``slope``: exponent of the error as a function of samples, of each tile. Whole samples are spread evenly over
        the picture: rounded up everywhere, a picture of few samples would be far better than requested. Few samples are
        powers of two, where the random numbers are most even; in between, more of them may even be worse.
        """
        have = self.tile_counts()
        # Other tiles in each round: among tiles of similar errors the same few would otherwise grow in every round.
        chance = ((np.arange(len(have)) + 0.5) * _GOLDEN + self._rounds * _TURN) % 1.0
        self._rounds += 1
        power = 2.0 ** np.floor(np.log2(np.maximum(wanted, 1.0)))
        # some tiles have the next power, so that the mean error is that of the wanted samples
        share = (1 - (wanted / power) ** slope) / (1 - 2.0**slope)
        few = power * np.where(chance < share, 2.0, 1.0)
        whole = np.where(wanted < FEW, few, np.floor(wanted + chance))
        goal = np.minimum(np.minimum(whole, np.maximum(_GROWTH * have, have + 1)), MOST_SAMPLES / 2)
        return np.maximum(0, np.round(goal - have)).astype(np.int64)[self.tile]

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 4) linear sRGB and coverage so far, row 0 at the bottom."""
        width, height = self.size
        total = np.maximum(2 * self.counts, 1)
        pixels = np.empty((len(total), 4), np.float32)
        pixels[:, :3] = self._sums.sum(axis=(0, 1)) * self._undisplayed / total[:, None]
        pixels[:, 3] = np.maximum(self._covered / total, 0.0)
        return pixels.reshape(height, width, 4)

    def noise_picture(self) -> NDArray[np.float32]:
        """(height, width, 3) half the difference of the halves so far."""
        first, second = self.halves()
        return ((first - second) * self._undisplayed / 2).astype(np.float32).reshape(*self.size[::-1], 3)

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
