# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling: samples until a requested error is reached, or for a requested time, where they reduce the error
most.

The picture is kept in two halves with separate random numbers; their difference estimates the error of each tile. After
a few samples everywhere the rest goes to tiles by their error, so that the mean over the picture reaches the requested
error with as few samples as possible.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.allocate import for_error, for_samples
from spectral_core.render.cost.errors import Estimate, Wide, estimated, expected_errors, rarity, rarity_after
from spectral_core.render.cost.model import RareLight
from spectral_core.render.cost.probe import Probe
from spectral_core.render.cost.resample import BLOCK, pools
from spectral_core.render.job import RenderJob

Array = NDArray[np.float64]

TILE_WIDTH, TILE_HEIGHT = 16, 4
"""Size of a tile in pixels; the processor traces a packet of 16 pixels in a row together."""
AIM = 0.95
"""Target as a part of the requested error, so that an estimate slightly above the target still meets the request."""
MOST_SAMPLES = 1 << 16
WATCHED = 16384
"""Pixels at which earlier rounds are kept."""
_GROWTH = 4.0
"""Largest growth of a tile's samples in one round, before its error is estimated again."""
_GOLDEN = 0.6180339887498949
"""Step of numbers in [0, 1) that are evenly spread however many are taken."""
_FEW = 16.0
"""Samples of each half up to which a tile has a power of two."""
LONGEST_LAUNCH_S = 4.0
_LEAST_GROWTH = 1.1
"""Growth of samples in a round, at least."""
_BUDGET_STEP = 0.05
"""Longest launch as a part of a time budget: other programs may slow a launch down, and nothing ends it early."""
_LAUNCH_STEP = 10.0
"""Shortest such part, in launches without paths, so that these take little of the time."""
_BUDGET_END = 0.02
"""Part of a time budget that stays unused, so that the render does not overrun it."""


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
            self._errors = expected_errors(self.halves(), self._pools, self._wide)
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


def _begin(picture: AdaptivePicture, first: int) -> None:
    """Samples everywhere, in two steps: a quarter, which is kept to compare with, and the rest."""
    everywhere = np.ones(len(picture.counts), np.int64)
    quarter = max(1, first // 4)
    picture.add(quarter * everywhere)
    picture.remember()
    if first > quarter:
        picture.add((first - quarter) * everywhere)
    picture.seconds_per_path *= picture.dearer


def until_error(
    picture: AdaptivePicture, wanted: float, first: int, after_round: Callable[[Estimate], bool], slope: float = -0.5
) -> Estimate:
    """Trace until the mean error is ``wanted``; ``first``: samples of each half to begin with everywhere.

    ``after_round`` receives each estimate and returns True to stop. ``slope``: exponent of the error as a function of
    equal samples, which evenly spread numbers make steeper than -1/2.
    """
    _begin(picture, first)
    while True:
        found = picture.estimate()
        picture.remember()
        if after_round(found) or found.delta_e <= wanted:
            return found
        counts = picture.tile_counts()
        # a later round adds the samples that this round lacks; a last remainder that the model misses goes to all tiles
        goal = for_error(picture.tile_errors(), counts, AIM * wanted, picture.tile_pixels)
        slope = min(slope, -0.5)
        more = picture.more_by_tile(counts * (goal / counts) ** (-0.5 / slope), slope)
        if not more.any():
            if counts.min() >= MOST_SAMPLES / 2:
                return found
            more = picture.more_by_tile(_LEAST_GROWTH * counts, slope)
            more = more if more.any() else np.ones(len(picture.counts), np.int64)
        if not picture.add(more):
            return picture.estimate()


def until_time(picture: AdaptivePicture, end: float, first: int, after_round: Callable[[Estimate], bool]) -> Estimate:
    """Trace until ``end`` (of ``time.perf_counter``), where it helps most; ``first``: as for ``until_error``."""
    whole = end - time.perf_counter()
    longest = min(LONGEST_LAUNCH_S, max(_BUDGET_STEP * whole, _LAUNCH_STEP * picture.launch_s))
    _begin(picture, first)
    while True:
        start = time.perf_counter()
        found = picture.estimate()
        picture.remember()
        errors = picture.tile_errors()
        # a round ends with such a comparison
        last = end - _BUDGET_END * whole - (time.perf_counter() - start)
        left = last - time.perf_counter()
        affordable = (left - picture.launch_s) / max(2 * picture.seconds_per_path, 1e-12)
        counts, weights = picture.tile_counts(), picture.tile_pixels
        if after_round(found) or affordable < 0.02 * float(weights @ counts) or affordable < len(weights):
            return found
        # every round but the last leaves time for another estimate
        share = 0.6 if affordable > 0.3 * float(weights @ counts) else 0.95
        goal = for_samples(errors, counts, float(weights @ counts) + share * affordable, weights)
        more = picture.more_by_tile(goal)
        if not more.any():
            more = np.full(len(picture.counts), 1, np.int64) if affordable >= weights.sum() else more
        if not more.any() or not picture.add(more, last, longest):
            return picture.estimate()
