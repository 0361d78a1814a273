# SPDX-License-Identifier: GPL-3.0-or-later
"""K spectra whose mixtures are the reflectances of a texture: never negative, and of sum 1 at each wavelength.

A texel mixes them with weights between 0 and 1. Its reflectance then lies between 0 and 1 as well, at every texel
and under any filter of the texture, because a filter takes averages of weights.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.optimize import linprog

from spectral_core.checks import require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.palette.texture.reach import corner_colors, reachable_scales

Array = NDArray[np.float64]

MOST_SPECTRA = 8
MOST_ITERATIONS = 40
EASY_FLOOR = 0.05
"""A lower floor is also reached by a climb from here: climbs that begin at a low floor may end at half the contrast."""


@dataclass(frozen=True, slots=True, eq=False)
class TextureBasis:
    """``spectra``: (K, n) on the texture's grid; ``slope`` and ``floor``: the mapping that all display colors allow."""

    spectra: Array
    floor: float
    slope: float
    iterations: int
    seconds: float


def design_basis(
    matrix: ArrayLike, count: int, *, floor: float = 0.05, smoothness: float = 0.25, iterations: int = MOST_ITERATIONS
) -> TextureBasis:
    """Find the K spectra with the largest contrast for the most difficult combination of display colors.

    Parameters
    ----------
    matrix : (3L, n), ``stimulus_matrix`` of the lights on the texture's grid.
    count : K, from 3L to 8.
    floor : linear gray of the darkest color.
    smoothness : largest second difference of a spectrum between neighboring knots, 0.02 to 2.
    iterations : linear programs that each climb may use at most; counted, so that a busy machine finds the
        same.

    Raises
    ------
    InvalidInputError : K is below 3L or above 8.
    """
    started = time.perf_counter()
    stimuli = np.asarray(matrix, dtype=np.float64)
    rows = len(stimuli)
    if not rows <= require_whole("the number of basis spectra", count, -1 << 31, 1 << 31) <= MOST_SPECTRA:
        raise InvalidInputError(
            f"the number of basis spectra is {count}; expected {rows} to {MOST_SPECTRA} for {rows // 3} lights, three "
            "per light or more"
        )
    require_range("smoothness", smoothness, 0.02, 2.0)
    corners = corner_colors(rows // 3)
    best: tuple[float, Array] | None = None
    total = 0
    at_peaks, equal = _bands_at_peaks(stimuli, count), _bands_of_equal_light(stimuli, count)
    for start, floors in (
        (at_peaks, (floor,)),
        (equal, (floor,)),
        *([(at_peaks, (EASY_FLOOR, floor))] if floor < EASY_FLOOR else []),
    ):
        spectra = _smoothed(start, smoothness)
        for stage in floors:
            slope, spectra, used = _climb(stimuli, spectra, corners, (stage, smoothness, iterations))
            total += used
        if best is None or slope > best[0]:
            best = slope, spectra
    assert best is not None
    return TextureBasis(best[1], floor, best[0], total, time.perf_counter() - started)


def _bands_of_equal_light(stimuli: Array, count: int) -> Array:
    """Hats whose peaks divide the total stimulus into equal parts, (K, n)."""
    weight = np.cumsum(np.abs(stimuli).sum(axis=0))
    peaks = np.interp((np.arange(count) + 0.5) / count, weight / weight[-1], np.arange(stimuli.shape[1]))
    return _hats(peaks, stimuli.shape[1])


def _bands_at_peaks(stimuli: Array, count: int) -> Array:
    """Hats at the strongest local peaks of the lights, so that each narrow primary has a spectrum of its own."""
    peaks: list[int] = []
    for light in np.split(np.abs(stimuli), stimuli.shape[0] // 3):
        power = light.sum(axis=0)
        inner = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
        peaks += list(inner[np.argsort(power[inner])[::-1]][:3])
    chosen = sorted(set(peaks))[:count]
    while len(chosen) < count:  # fill the widest gap until there are K peaks
        edges = [0, *chosen, stimuli.shape[1] - 1]
        widest = int(np.argmax(np.diff(edges)))
        between = (edges[widest] + edges[widest + 1]) // 2
        if between in chosen:
            return _bands_of_equal_light(stimuli, count)
        chosen = sorted([*chosen, between])
    return _hats(np.array(chosen, dtype=np.float64), stimuli.shape[1])


def _hats(peaks: Array, knots: int) -> Array:
    """Linear interpolation between peaks: (K, knots), at least 0, with sum 1; the outer ones stay at 1."""
    return np.stack([np.interp(np.arange(knots), peaks, row) for row in np.eye(len(peaks))])


def _smoothed(spectra: Array, smoothness: float) -> Array:
    """Averages of neighboring knots until every second difference is at most ``smoothness``."""
    for _ in range(200):
        if np.abs(np.diff(spectra, 2, axis=1)).max() <= smoothness:
            break
        padded = np.pad(spectra, ((0, 0), (1, 1)), mode="edge")
        spectra = (padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 4
    return spectra


def _climb(
    stimuli: Array, spectra: Array, corners: Array, limits: tuple[float, float, int]
) -> tuple[float, Array, int]:
    """Sequence of linear programs with a trust region: slope, spectra, iterations."""
    floor, smoothness, most = limits
    reach = reachable_scales(stimuli @ spectra.T, corners, floor)
    slope, radius, used = float(reach.scales.min()), 0.2, 0
    constraints = _Constraints(spectra.shape, smoothness)
    while radius > 1e-3 and used < most:
        used += 1
        # ds/dB = outer(M^T y, w - floor): change of the color by a spectrum's knot, times its weight.
        slopes = (reach.multipliers @ stimuli)[:, None, :] * (reach.reflectances - floor)[:, :, None]
        trial = np.clip(spectra + constraints.step(spectra, reach.scales, slopes, radius), 0.0, 1.0)
        trial = trial / trial.sum(axis=0)
        trial_reach = reachable_scales(stimuli @ trial.T, corners, floor)
        gained = float(trial_reach.scales.min()) - slope
        if gained > 1e-6:
            spectra, reach, slope = trial, trial_reach, slope + gained
            radius = min(0.5, radius * 1.5)
        else:
            radius /= 3
    return slope, spectra, used


class _Constraints:
    """Constraints of every step: sum of 1 at each wavelength, non-negative spectra, small second differences."""

    def __init__(self, shape: tuple[int, ...], smoothness: float) -> None:
        count, knots = shape
        self.smoothness = smoothness
        self.sums = sparse.hstack([*[sparse.eye(knots)] * count, sparse.csc_matrix((knots, 1))], format="csc")
        second = sparse.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(knots - 2, knots))
        self.bend = sparse.hstack(
            [sparse.block_diag([second] * count), sparse.csc_matrix((count * (knots - 2), 1))], format="csc"
        )

    def step(self, spectra: Array, scales: Array, slopes: Array, radius: float) -> Array:
        """Change (K, n) that raises the linearized least scale most inside the trust region."""
        size = spectra.size
        costs = np.zeros(size + 1)
        costs[-1] = -1.0
        above = sparse.csc_matrix(np.hstack([-slopes.reshape(len(scales), size), np.ones((len(scales), 1))]))
        now = np.diff(spectra, 2, axis=1).ravel()
        inequalities = sparse.vstack([above, self.bend, -self.bend], format="csc")
        # A start may exceed the limit by rounding; the allowance keeps the program feasible.
        room = np.maximum(self.smoothness, np.abs(now))
        right = np.concatenate([scales, room - now, room + now])
        low = np.maximum(-spectra, -radius).ravel()
        bounds = [*zip(low, np.full(size, radius), strict=True), (None, None)]
        answer = linprog(
            costs, A_ub=inequalities, b_ub=right, A_eq=self.sums, b_eq=np.zeros(self.sums.shape[0]), bounds=bounds,
            method="highs",
        )  # fmt: skip
        return np.zeros_like(spectra) if answer.status != 0 else np.asarray(answer.x[:-1].reshape(spectra.shape))
