# SPDX-License-Identifier: GPL-3.0-or-later
"""Error of a picture, estimated from two halves of it with independent random numbers.

The mean of the halves differs from the limit as much, statistically, as half the difference of the halves. That
difference is added to the mean pixel by pixel; the color difference between this picture and the mean is the estimate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.cost.resample import PooledNoise
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb

Array = NDArray[np.float64]
Numbers = NDArray[np.integer[Any]]

DARK_SHARE = 0.05
"""Part of the mean luminance that is added to a pixel's luminance where a squared error is divided by it."""

RARITY_POWER = 0.25
"""Power of the number of samples by which the factor for light on rare paths approaches 1."""

MOST_RARITY, LEAST_RARITY, UNMET = 3.0, 0.2, 0.8
"""Limits of that factor. Later samples may have met little of the rare light either: they lower the estimate only where
they see less than 1 minus ``UNMET`` times the early part of the samples.
"""
LEAST_SHARE = 0.1
"""Least share of pixels that must have twice their early samples for a factor."""

COMMON, RARE = 1.15, 1.65
"""Error over that of the halves up to which light is common, and from which on it is rare."""
UNEVEN, MISSED = 0.4, 0.7
"""The same of the place of an early error between that of its halves, 0, and that of their pooled noise, 1: up to the
first neighbors only differ in noise, from the second on they miss the same light.
"""
LOCAL, IN_BLOCK = 1.5, 2.0
"""Factors of the two correlations of ``Wide``: the noise of a neighborhood counts by 1 minus such a multiple."""

_DEVIATION = 0.75
"""Standard deviation over mean of the absolute value of a number with a normal distribution."""


@dataclass(frozen=True, slots=True, eq=False)
class Wide:
    """Larger neighborhoods than pools, for light so rare that most pools have met none of it.

    ``blocks``: (n,) number of each pixel's block of several pools, from 0. ``repeated``: correlation of the errors of
    early and of later samples, of pixels within pools and of pools within blocks (``repetition``). Light on rare paths
    comes anywhere, so the correlation is 0; noise at edges and of small caustics stays in its place, and its neighbors
    do not have it.
    """

    blocks: Numbers
    repeated: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Estimate:
    """Mean ΔE2000 of a picture against its limit, ``spread``: standard deviation of that estimate, relative MSE."""

    delta_e: float
    spread: float
    relative_mse: float


def pixel_errors(first: Array, second: Array, *, of_half: bool = False) -> Array:
    """ΔE2000 of each pixel (n,) of the mean of two halves (n, 3); with ``of_half`` of one half as a picture."""
    mean = (first + second) / 2
    away = (first - second) / (np.sqrt(2.0) if of_half else 2.0)
    return np.asarray(delta_e_2000(_lab(mean + away), _lab(mean)))


def relative_errors(first: Array, second: Array, *, of_half: bool = False) -> Array:
    """Squared error of luminance of each pixel over its square, (n,)."""
    mean = luminance_from_linear_rgb((first + second) / 2)
    away = luminance_from_linear_rgb((first - second) / (np.sqrt(2.0) if of_half else 2.0))
    floor = DARK_SHARE * max(float(mean.mean()), 1e-12)
    return np.asarray(away**2 / (mean**2 + floor**2))


def expected_errors(halves: Array, pools: Numbers, wide: Wide | None = None, *, of_half: bool = False) -> Array:
    """ΔE2000 (n,) of each pixel, where light on rare paths counts also in pixels of a pool that have met none of it.

    ``halves``: (2, n, 3); ``pools``: (n,) number of each pixel's pool of neighbors, from 0; ``wide``: larger ones.
    """
    first, second = halves
    own, parts = pixel_errors(first, second, of_half=of_half), 1 if of_half else 2
    pooled = PooledNoise(halves, pools).errors(parts)
    if wide is not None:
        in_pool, in_block = wide.repeated
        if IN_BLOCK * in_block < 1:
            share = 1 - IN_BLOCK * max(in_block, 0.0)
            pooled = pooled + share * (PooledNoise(halves, wide.blocks).errors(parts) - pooled)
        pooled = own + max(0.0, 1 - LOCAL * max(in_pool, 0.0)) * (pooled - own)
    return with_missed(own, pooled, pools)


def splits(sums: Array, counts: Numbers) -> list[Array]:
    """Halves (2, n, 3) of a picture whose halves have parts: every way to make two halves of them whose differences are
    independent of each other. ``sums``: (parts, 2, n, 3), a power of two of parts; ``counts``: (n,) samples of a half.
    """
    groups = sums.reshape(-1, *sums.shape[2:])
    signs = np.ones((1, 1))
    while len(signs) < len(groups):  # Sylvester's construction of Hadamard's matrix
        signs = np.block([[signs, signs], [signs, -signs]])
    some = np.maximum(counts, 1)[None, :, None]
    return [np.stack([groups[row > 0].sum(axis=0), groups[row < 0].sum(axis=0)]) / some for row in signs[1:]]


def scatter(errors: Array, parts: float = 1.0) -> float:
    """Relative standard deviation of a picture's mean error about the expected one: its pixels' own errors (n,) are
    larger or smaller by chance. ``parts``: pixels of the picture over those of ``errors``.
    """
    strong = float(np.sqrt(np.sum(errors**2))) / max(float(np.sum(errors)), 1e-12)
    return _DEVIATION * strong / float(np.sqrt(parts))


@dataclass(frozen=True, slots=True)
class Told:
    """Mean ΔE2000 of a picture: by the difference of its halves alone (``own``), and by their pooled noise."""

    own: float
    pooled: float


def told_by_later(now: Told, early: Told, seen: float, share: float) -> float:
    """Mean ΔE2000 of a picture, between that of its own halves and that of their pooled noise.

    Pooled noise exaggerates where neighbors differ in noise, and the halves underestimate where light is rare. Earlier
    samples, a ``share`` of those now, tell which: their error ``seen`` by later ones is that of their halves where
    light is common.
    """
    after = lambda ratio: 1 + (min(max(ratio, 1.0), MOST_RARITY) - 1) * share**RARITY_POWER  # noqa: E731
    more = after(seen / max(early.own, 1e-9))
    most = now.pooled * after(seen / max(early.pooled, 1e-9))
    rare = min(max((more - COMMON) / (RARE - COMMON), 0.0), 1.0)
    # common noise may fall faster than that of rare light: so counts where between the two the early error was, too
    place = (seen - early.own) / max(early.pooled - early.own, 1e-9)
    rare = max(rare, min(max((place - UNEVEN) / (MISSED - UNEVEN), 0.0), 1.0))
    return min(most, max(now.own * more, now.own + rare * (most - now.own)))


def repetition(early: Array, late: Array, counts: tuple[float, float], pools: Numbers, blocks: Numbers) -> Any:
    """Correlations (2,) of the errors of early samples and of those after them: of pixels within pools, of pools within
    blocks. ``early``, ``late``: (2, n, 3) means of the halves after ``counts`` samples; each pool is in one block.
    """
    first, last = counts
    rest = (late * last - early * first) / (last - first)
    errors = np.stack([pixel_errors(*early), pixel_errors(*rest)])
    means = np.stack([block_means(each, pools) for each in errors])
    of_pool = np.zeros(means.shape[1], np.int64)
    of_pool[pools] = blocks
    return np.array([_correlation(errors, pools), _correlation(means, of_pool)])


def _correlation(pair: Array, groups: Numbers) -> float:
    """Correlation of two rows of numbers (2, n) about the means of their groups (n,)."""
    one, other = (each - block_means(each, groups)[groups] for each in pair)
    return float(2 * (one @ other) / max(float(one @ one + other @ other), 1e-30))


def with_missed(own: Array, pooled: Array, blocks: Numbers) -> Array:
    """Errors (n,) of pixels' own halves and, where those of the pooled noise of their blocks are larger, the rest."""
    missed = np.maximum(block_means(pooled, blocks) - block_means(own, blocks), 0.0)[blocks]
    # blocks of common noise differ by chance, and the larger of two numbers is no estimate of either
    in_all = max(0.0, float(pooled.mean() - own.mean()))
    return np.asarray(own + missed * min(1.0, in_all / max(float(missed.mean()), 1e-12)))


def block_means(values: Array, blocks: Numbers) -> Array:
    """Mean of each block; 0 for a number without pixels."""
    return np.asarray(np.bincount(blocks, values) / np.maximum(np.bincount(blocks), 1))


def estimated(errors: Array, halves: Array, blocks: Numbers, *, of_half: bool = False) -> Estimate:
    """The mean of pixels' ``errors``; its spread from means of blocks, because neighbors share their causes of noise.

    ``halves``: (2, n, 3), for the relative error; ``blocks``: (n,) number of each pixel's block, from 0.
    """
    means = block_means(errors, blocks)[np.bincount(blocks) > 0]
    spread = float(means.std(ddof=1) / np.sqrt(len(means))) if len(means) > 1 else 0.0
    # the few brightest outliers carry no information on the rest, and would outweigh it
    first, second = halves
    relative = np.sort(relative_errors(first, second, of_half=of_half))
    kept = relative[: max(1, int(0.999 * len(relative)))]
    return Estimate(float(errors.mean()), spread, float(kept.mean()))


def seen_later(
    early: Array, late: Array, early_counts: Array, late_counts: Array, *, of_half: bool = False
) -> tuple[NDArray[np.bool_], float]:
    """Error of an early picture by samples that were traced later: the pixels that have enough of these, mean ΔE2000.

    ``early``, ``late``: (2, n, 3) means of the halves; counts (n,) of their samples; a late half begins with the
    samples of the early one. ``of_half``: of one half as a picture, else of both.
    """
    some = late_counts >= 2 * early_counts
    if np.count_nonzero(some) < LEAST_SHARE * len(some):
        return np.zeros_like(some), 0.0
    early, late, first, last = early[:, some], late[:, some], early_counts[some], late_counts[some]
    if not of_half:
        return some, float(np.mean(seen_apart(early, late, first, last)))
    seen = [seen_apart(early[[k]], late[[1 - k]], first, last, contained=False) for k in (0, 1)]
    return some, float(np.mean(seen))


def seen_apart(early: Array, late: Array, early_counts: Array, late_counts: Array, *, contained: bool = True) -> Array:
    """ΔE2000 (n,) of the pixels of a picture by another of more samples, less the noise of that; parameters as of
    ``seen_later``. ``contained``: its samples begin with those of the picture, and only the others are compared.
    """
    early, late, others = early.mean(axis=0), late.mean(axis=0), late_counts
    if contained:
        others = late_counts - early_counts
        late = (late * late_counts[:, None] - early * early_counts[:, None]) / others[:, None]
    return np.asarray(delta_e_2000(_lab(early), _lab(late))) / np.sqrt(1 + early_counts / others)


def rarity(
    early: Array, late: Array, early_counts: Array, late_counts: Array, errors: Array, *, of_half: bool = False
) -> float:
    """Ratio of the true error of an early picture to its estimated ``errors`` (n,), at most ``MOST_RARITY``.

    Light may be so rare that whole pools have met none of it: both halves are too dark by the same amount, and their
    difference underestimates the error. Comparing the early picture with samples that were traced later reveals this,
    and also noise that only looks like rare light, as at the edges of objects. Parameters as of ``seen_later``.
    """
    some, seen = seen_later(early, late, early_counts, late_counts, of_half=of_half)
    if not some.any():
        return 1.0
    compared = seen / max(float(np.mean(errors[some])), 1e-9)
    surely = 1 - UNMET * float(np.mean(early_counts[some] / late_counts[some]))
    if compared < surely:
        return max(compared / surely, LEAST_RARITY)
    return min(max(compared, 1.0), MOST_RARITY)


def rarity_after(factor: float, early: float, late: float) -> float:
    """The same factor after more samples: paths that were rare become common slowly."""
    return 1 + (factor - 1) * min(1.0, max(early, 1e-9) / max(late, 1e-9)) ** RARITY_POWER


def bias(first: Array, second: Array, run: int = 16) -> float:
    """Mean ΔE2000 between the limits of two pictures (halves, n, 3) traced with equal random numbers.

    Means over ``run`` pixels are compared; the contribution of noise, estimated from the halves, is subtracted.
    """
    blocks = lambda pixels: pixels[: len(pixels) // run * run].reshape(-1, run, 3).mean(axis=1)  # noqa: E731
    one, other = first.mean(axis=0), second.mean(axis=0)
    seen = delta_e_2000(_lab(blocks(one)), _lab(blocks(other)))
    change = (first[0] - second[0] - first[1] + second[1]) / 2
    noise = delta_e_2000(_lab(blocks(one + change)), _lab(blocks(one)))
    return float(np.sqrt(max(0.0, float(np.mean(seen**2)) - float(np.mean(noise**2)))))


def _lab(pixels: Array) -> Array:
    return lab_from_linear_rgb(np.maximum(pixels, 0.0))
