# SPDX-License-Identifier: GPL-3.0-or-later
"""Rounds of adaptive sampling: samples until a requested error is reached, or for a requested time.

After a few samples everywhere the rest goes to tiles by their error, so that the mean over the picture reaches the
requested error with as few samples as possible.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.adaptive import FEW, LONGEST_LAUNCH_S, MANY, MOST_SAMPLES, AdaptivePicture
from spectral_core.render.cost.allocate import for_error, for_samples
from spectral_core.render.cost.errors import Estimate

Array = NDArray[np.float64]

AIM = 0.95
"""Target as a part of the requested error, so that an estimate slightly above the target still meets the request."""
_FAR, _CAUTION = 1.3, 0.2
"""Error over the requested one from which on a round does not aim at the request, and the power of this ratio by which
its aim is larger.
"""
_SLOPES = (-3.0, -0.5)
"""Steepest and least exponent of the error by samples that rounds assume."""
_STEEP = -1.0
"""Exponent below which tiles of few samples are doubled one by one, in pictures with enough pixels to tell them
apart: by chance those with little left to gain grow, too.
"""
_LEAST_GROWTH = 1.1
"""Growth of samples in a round, at least."""
_BUDGET_STEP = 0.05
"""Longest launch as a part of a time budget: other programs may slow a launch down, and nothing ends it early."""
_LAUNCH_STEP = 10.0
"""Shortest such part, in launches without paths, so that these take little of the time."""
_BUDGET_END = 0.02
"""Part of a time budget that stays unused, so that the render does not overrun it."""


def _begin(picture: AdaptivePicture, first: int) -> None:
    """Samples everywhere, in two steps: a quarter, which is kept to compare with, and the rest."""
    picture.divide(first)
    everywhere = np.ones(len(picture.counts), np.int64)
    quarter = max(1, first // 4)
    picture.add(quarter * everywhere)
    picture.remember()
    if first > quarter:
        picture.add((first - quarter) * everywhere)
    picture.seconds_per_path *= picture.dearer


def _aim(error: float, wanted: float) -> float:
    """The error that a next round approaches: somewhat more than the wanted one from afar, as the law may be steeper
    there than it is known to be.
    """
    return AIM * wanted * (error / wanted) ** (_CAUTION if error > _FAR * wanted else 0.0)


def _remainder(picture: AdaptivePicture, slope: Array | float, missing: float) -> NDArray[np.int64]:
    """Samples to add in each pixel of a picture of few samples, whose mean error is ``missing`` too large.

    Few samples are doubled in whole tiles, which lowers the error in large steps where its law is steep: only as many
    tiles as that takes are doubled, those first that gain most for their samples. None in a picture of more samples.
    """
    counts, weights = picture.tile_counts(), picture.tile_pixels
    more = np.zeros(len(counts), np.int64)
    if counts.mean() < FEW:
        gain = weights * picture.tile_errors() * (1 - 2.0**slope) / weights.sum()
        order = np.argsort(-gain / (weights * counts))
        order = order[4 * counts[order] <= MOST_SAMPLES]
        chosen = order[: 1 + int(np.searchsorted(np.cumsum(gain[order]), missing))]
        more[chosen] = np.round(counts[chosen]).astype(np.int64)
    return np.asarray(more[picture.tile])


def until_error(
    picture: AdaptivePicture,
    wanted: float,
    first: int,
    after_round: Callable[[Estimate], bool],
    slope_from: Callable[[float], float] = lambda _: _SLOPES[1],
) -> Estimate:
    """Trace until the mean error is ``wanted``; ``first``: samples of each half to begin with everywhere.

    ``after_round`` receives each estimate and returns True to stop. ``slope_from``: exponent of the error as a function
    of equal samples, by their number, which evenly spread numbers make steeper than -1/2.
    """
    _begin(picture, first)
    while True:
        found = picture.estimate()
        picture.remember()
        if after_round(found) or found.delta_e <= wanted:
            return found
        counts = picture.tile_counts()
        # a later round adds the samples that this round lacks; a last remainder goes to the fewest tiles
        aim = _aim(found.delta_e, wanted)
        goal = for_error(picture.tile_errors(), counts, aim, picture.tile_pixels)
        known, index = np.unique(counts, return_inverse=True)
        slope = np.clip([slope_from(2 * each) for each in known], *_SLOPES)[index]
        steep = slope.min() < _STEEP and len(picture.counts) >= MANY
        more = _remainder(picture, slope, found.delta_e - aim) if steep else np.zeros(0, np.int64)
        more = more if more.any() else picture.more_by_tile(counts * (goal / counts) ** (-0.5 / slope), slope)
        if not more.any():
            if counts.min() >= MOST_SAMPLES / 2:
                return found
            more = _remainder(picture, slope, found.delta_e - AIM * wanted)
            more = more if more.any() else picture.more_by_tile(_LEAST_GROWTH * counts, slope)
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
