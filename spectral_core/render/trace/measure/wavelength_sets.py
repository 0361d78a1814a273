# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets of four wavelengths for a path, and the weights that turn four radiances into a color.

Four wavelengths a quarter apart in probability, a comb, measure even a gray surface with a relative variance of 0.02 to
0.05 under equal weights, and this noise multiplies with that of the paths. The weights here remove most of it: they are
the unbiased linear estimate of least variance for reflectances that are smooth, under the spectra of the scene's
lights. The mean weight of each wavelength equals the response there, which makes the estimate exact in expectation for
any spectrum; the expected covariance of reflectances affects the noise only. A single comb would leave no freedom, as
each wavelength belongs to one set of it: hence the teeth are moved against each other in ``SHIFTS`` ways. ``SAMPLES``
successive samples of a pixel have one shift, so that their wavelengths are spread evenly, and the variance of their
mean is part of what the weights minimize.

The idea of random nodes whose weights integrate chosen functions without error is that of Ermakov and Zolotukhin 1960.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.blas_threads import on_one_thread
from spectral_core.render.trace.measure.least_variance import least_variance
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]

TEETH = 4
STEPS = 128
"""Intervals of equal probability in the range of one tooth. Designed spectra change within a few nm: with half as many,
the steps' own width is most of the noise of their colors in light that one surface has reflected.
"""
SAMPLES = 64
"""Successive samples of a pixel that have one shift of the teeth against each other; in them, one of each two
neighboring steps occurs.
"""
SHIFTS = 16
"""Different shifts of the teeth against each other."""
_BINS = TEETH * STEPS
_FARTHEST = 48
"""Farthest shift of a tooth, in steps. The more different the sets are, the more of them tell narrow peaks of the
scene's reflectances apart.
"""
_POINTS = 4
"""Wavelengths within a bin at which lights and responses are averaged."""
_GRAY, _SMOOTH, _BUMPY = 20.0, 1.0, 0.05
"""Expected variances of the parts of a reflectance: equal at all wavelengths, smooth, and with bumps."""
_UNKNOWN = 1e-4
"""Variance of light of unknown spectrum, of equal energy and unrelated from one bin to the next, over that of the
scene's. It bounds the weights, above all in bins in which the scene's lights have little power.
"""
_UNKNOWN_WITHIN = 1e-6
"""Least part of it in the second moment of each bin. All bins of an even line of 0.1 nm have the same radiance: nothing
tells them apart, and the system for the weights would have no solution, or one that is off by some per cent.
"""
_COLORS = 30.0
"""Second moment of the smooth reflectances of the scene's colors, beside these variances."""
_KNOWN = ((3000.0, 3.0, 0.0), (30.0, 3000.0, 10.0), (3.0, 100.0, 3000.0))
"""Second moments of the reflectances that are given as spectra, of the products of two, and of three: in light that one
surface has reflected, that two have, and that more have. They are known exactly, while a color may be anything that its
texture holds. Four wavelengths tell few spectra apart, hence the three types of light have weights of their own.
"""
_MOST_IN_PRODUCTS = (64, 16, 6)
"""Most reflectances that are counted, alone and in products of two and of three."""
_SMOOTH_NM, _BUMPY_NM = 100.0, 10.0
"""Lengths over which the smooth part and the bumps change."""
_SINGLE, _SINGLE_IF_KNOWN = 1.0, 3.0
"""Share of the variance of one sample in what the weights minimize, against that of ``STEPS`` samples times their
number: the relative variance of a path's brightness. The second is for scenes with reflectances that are given: their
colors have little noise in either, while saturated colors of textures need the mean.
"""
_KEPT = 4
"""Scenes whose sets are kept: a render loads its scene for the pilot, for probes of its cost, and for the picture."""
_MOST_LIGHTS = 64


@dataclass(frozen=True, slots=True, eq=False)
class WavelengthSets:
    """``shifts``: (SHIFTS, 4) steps that each tooth is moved by, cyclically within its quarter of the probability.
    ``corrections``: (3, SHIFTS, STEPS, 4, 3), added to a quarter of the responses x̄ ȳ z̄ at the wavelengths of a set:
    for light that at most one surface has reflected diffusely, that two have, and that more have.
    """

    shifts: NDArray[np.int64]
    corrections: Array


def wavelength_sets(
    edges_nm: Array,
    probability: Array,
    pieces: Array,
    lights: Sequence[tuple[Spectrum, float]],
    reflectances: Sequence[Spectrum] = (),
    colors: Sequence[Spectrum] = (),
) -> WavelengthSets:
    """Give the sets of a density of wavelengths (cells between ``edges_nm``); ``pieces``: the responses, x̄ ȳ z̄ first.

    ``lights``: spectra and their counts; none stands for equal energy. ``reflectances``: those of the scene, which are
    then expected more than others.
    """
    arrays = (edges_nm.tobytes(), probability.tobytes(), pieces[:, :3].tobytes())
    spectra = tuple(map(_content, ([light for light, _ in lights], reflectances, colors)))
    counts = tuple(count for _, count in lights)
    return _kept(_Question((arrays, spectra, counts), (edges_nm, probability, pieces, lights, reflectances, colors)))


@dataclass(frozen=True, slots=True)
class _Question:
    """Arguments of ``wavelength_sets``, compared by their content."""

    content: tuple[Any, ...]
    arguments: tuple[Any, ...] = field(compare=False)


def _content(spectra: Sequence[Spectrum]) -> tuple[bytes, ...]:
    return tuple(each.grid.wavelengths_nm.tobytes() + each.values.tobytes() for each in spectra)


@lru_cache(_KEPT)
@on_one_thread
def _kept(question: _Question) -> WavelengthSets:
    return _solved(*question.arguments)


def _solved(
    edges_nm: Array,
    probability: Array,
    pieces: Array,
    lights: Sequence[tuple[Spectrum, float]],
    reflectances: Sequence[Spectrum],
    colors: Sequence[Spectrum],
) -> WavelengthSets:
    cell, along = _places(probability)
    widths = np.diff(edges_nm)
    at = edges_nm[cell] + along * widths[cell]
    start, _, end = pieces[:, :3]
    response = start[:, cell] * (1 - along) + end[:, cell] * along
    shapes = _shapes(lights, at, probability[cell] / widths[cell])
    sets, plain = _sets(), response.mean(axis=2) / TEETH
    even = (widths[cell] / probability[cell]).mean(axis=1)
    corrections, single = [], _SINGLE_IF_KNOWN if reflectances else _SINGLE
    # One path of four wavelengths serves all: only the weights differ, and each of them is exact in the mean.
    nm = at.mean(axis=1)
    tints = _units([each.at(nm) for each in colors], nm.size)
    unknown = _unknown(nm) + _COLORS * (tints.T @ tints)
    for known in _KNOWN:
        prior = unknown + _prior(nm, reflectances, known)
        covariance, expected = _moments(shapes, response, prior)
        total = max(float(np.trace(covariance)), 1e-30)
        free = _UNKNOWN * total / _BINS * (even / even.mean()) ** 2
        covariance[np.diag_indices(_BINS)] += np.maximum(free, _UNKNOWN_WITHIN * np.diag(covariance))
        weights = least_variance(covariance, expected, plain, sets, single, STEPS // SAMPLES)
        corrections.append(np.moveaxis(weights - plain[:, sets], 0, -1))
    return WavelengthSets(_shifts(), np.stack(corrections))


def _moments(shapes: Sequence[tuple[Array, float]], response: Array, prior: Array) -> tuple[Array, Array]:
    """Second moments of radiance in the bins, and expected products of the wanted integrals and the radiance."""
    light, share = np.stack([shape for shape, _ in shapes]), np.array([share for _, share in shapes])
    # light varies within a bin, as lines do; the prior of reflectances is that of the bin's mean wavelength
    mean = light.mean(axis=2)
    covariance = (mean.T @ (share[:, None] * mean)) * prior
    covariance[np.diag_indices(_BINS)] += (share @ light.var(axis=2)) * np.diag(prior)
    wanted = np.stack([(response * each).mean(axis=2) for each in light])
    expected = np.einsum("l,lck,lk->ck", share, wanted @ prior, mean) / _BINS
    return covariance, expected


def _places(probability: Array) -> tuple[NDArray[np.int64], Array]:
    """Cells of wavelengths in bins of equal probability, (bins, points), and the positions within these."""
    ends = np.concatenate([[0.0], np.cumsum(probability)])
    place = (np.arange(_BINS * _POINTS) + 0.5).reshape(_BINS, _POINTS) / (_BINS * _POINTS) * ends[-1]
    cell = np.clip(np.searchsorted(ends, place, side="right") - 1, 0, probability.size - 1)
    return cell, np.clip((place - ends[cell]) / np.maximum(probability[cell], 1e-300), 0.0, 1.0)


def _shapes(lights: Sequence[tuple[Spectrum, float]], at: Array, density: Array) -> list[tuple[Array, float]]:
    """Light over density at wavelengths (nm), 1 in the mean, and the share of each light; equal energy without any."""
    found = []
    for light, count in lights[:_MOST_LIGHTS]:
        shape = light.at(at.ravel()).reshape(at.shape) / density
        if shape.mean() > 0.0:
            found.append((shape / shape.mean(), count))
    total = sum(count for _, count in found)
    # equal shares of each light, not of their powers
    return [(shape, count / total) for shape, count in found] or [(1.0 / density / (1.0 / density).mean(), 1.0)]


def _unknown(nm: Array) -> Array:
    """Second moments of any reflectance at wavelengths (nm)."""
    apart = np.abs(nm[:, None] - nm)

    def correlation(length: float) -> Array:  # Matérn's, of functions with one derivative
        result: Array = (1 + apart / length) * np.exp(-apart / length)
        return result

    return np.asarray(_GRAY + _SMOOTH * correlation(_SMOOTH_NM) + _BUMPY * correlation(_BUMPY_NM))


def _prior(nm: Array, reflectances: Sequence[Spectrum], known: Sequence[float]) -> Array:
    """Second moments of the scene's reflectances at wavelengths (nm), by the moments of ``_KNOWN``."""
    # products of reflectances are narrower than each: they need moments of their own
    rows, found = [each.at(nm) for each in reflectances], [np.zeros((0, nm.size))]
    for order, (moment, most) in enumerate(zip(known, _MOST_IN_PRODUCTS, strict=True), 1):
        products = [np.prod(each, axis=0) for each in combinations_with_replacement(rows[:most], order)]
        found.append(np.sqrt(moment) * _units(products, nm.size))
    together = np.concatenate(found)
    return np.asarray(together.T @ together)


def _units(rows: Sequence[Array], size: int) -> Array:
    """Rows (n, size), scaled so that the diagonal of the sum of their outer products is 1 in the mean; no zero rows."""
    found = [row / length for row in rows if (length := np.sqrt(np.mean(row**2)))]
    return np.array(found).reshape(-1, size) / np.sqrt(max(len(found), 1))


@cache
def _shifts() -> NDArray[np.int64]:
    """(SHIFTS, 4) whole steps, spread evenly: radical inverses in four bases (Halton's points)."""

    def inverse(number: int, base: int) -> float:
        result, scale = 0.0, 1.0
        while number:
            scale /= base
            result += scale * (number % base)
            number //= base
        return result

    places = [[inverse(number, base) for base in (2, 3, 5, 7)] for number in range(1, SHIFTS + 1)]
    return np.round((2 * np.array(places) - 1) * _FARTHEST).astype(np.int64)


@cache
def _sets() -> NDArray[np.int64]:
    """(SHIFTS, STEPS, TEETH) the bins of each set: a comb at every position. In a shift each bin occurs once."""
    moved = (np.arange(STEPS)[None, :, None] + _shifts()[:, None]) % STEPS
    return np.asarray(moved + STEPS * np.arange(TEETH))
