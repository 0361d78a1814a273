# SPDX-License-Identifier: GPL-3.0-or-later
"""Sensitivity from an existing sample: Sobol indices by a Gaussian process, with intervals.

Estimators with a separate design (Saltelli, Morris) would need new renders. Here a Gaussian process is fitted to the
existing rows, and the indices are those of its mean, by Saltelli's and Jansen's estimators (Saltelli et al. 2010, Table
2) on Sobol points. Intervals are percentiles over bootstrap samples of these points, widened by the difference of the
indices between processes fitted to different parts of the rows, and by the share of variance that the process does not
predict on omitted rows: whatever it misses may be due to any parameter, to several together, or to noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import qmc

from spectral_core.checks import frozen_array, require_whole
from spectral_core.explore.analysis.process import GaussianProcess

Array = NDArray[np.float64]
BOOTSTRAPS = 200
PARTS = 4
FEWEST_PER_PART = 3
"""Rows of a part; of fewer rows none is omitted, and nothing is known of how much the process predicts."""


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Indices of one parameter, each with its 95 % interval. ``explained``: share of variance that is predicted."""

    name: str
    first: float
    first_interval: tuple[float, float]
    total: float
    total_interval: tuple[float, float]
    explained: float


def sobol_indices(
    points: ArrayLike, values: ArrayLike, names: Sequence[str], *, seed: int = 0, base: int = 2048,
    spread: Callable[[Array], Array] | None = None,
) -> list[Sensitivity]:  # fmt: skip
    """First-order and total Sobol index of every parameter, most influential first.

    Parameters
    ----------
    points : (m, n), coordinates of the sweep's unit cube, any design but a grid.
    values : (m,).
    names : of the parameters.
    seed : draws the Sobol points, the bootstrap samples and the parts.
    base : Sobol points; n + 2 times as many predictions are made.
    spread : coordinates (k, n) of the settings over which the variance is taken, from points (k, n) of the unit cube,
        each axis from its own; the unit cube itself if None.
    """
    x = frozen_array("points", points, (None, len(names)))
    y = frozen_array("values", values, (len(x),))
    require_whole("base", base, 8, 1 << 24)
    rng = np.random.default_rng(seed)
    process = GaussianProcess.fit(x, y, seed=seed)
    first, total, firsts, totals = _indices(process, rng, base, spread)
    shift_first, shift_total = np.zeros(len(names)), np.zeros(len(names))
    order = rng.permutation(len(x))
    missed = np.full(len(x), np.nan)
    if len(x) >= FEWEST_PER_PART * PARTS:
        others = []
        for part in range(PARTS):
            held = order[part::PARTS]
            kept = np.setdiff1d(order, held)
            if y[kept].min() == y[kept].max():  # every row that differs is omitted
                missed[held] = y[kept][0] - y[held]
                continue
            one = GaussianProcess.fit(x[kept], y[kept], seed=seed)
            missed[held] = one.predict(x[held])[0] - y[held]
            others.append(_indices(one, rng, base // 4, spread)[:2])
        if others:
            shift_first = np.max([np.abs(other[0] - first) for other in others], axis=0)
            shift_total = np.max([np.abs(other[1] - total) for other in others], axis=0)
    explained = (
        float(1 - np.nanmean(missed**2) / y.var()) if np.isfinite(missed).any() and y.var() > 0 else float("nan")
    )
    missing = 1.0 if np.isnan(explained) else min(max(1.0 - explained, 0.0), 1.0)
    result = [
        Sensitivity(
            name, float(first[k]), _interval(firsts[:, k], shift_first[k], missing), float(total[k]),
            _interval(totals[:, k], shift_total[k], missing), explained,
        )
        for k, name in enumerate(names)
    ]  # fmt: skip
    return sorted(result, key=lambda one: -one.total)


def _interval(samples: Array, shift: float, missing: float) -> tuple[float, float]:
    """Ends of an interval; ``missing`` is the share of variance that is not predicted.

    With a prediction and a rest that are uncorrelated, an index is (1 - missing) times that of the prediction and
    missing times that of the rest, which lies anywhere in [0, 1].
    """
    low, high = np.quantile(samples, [0.025, 0.975]) + np.array([-shift, shift])
    return float(min(low, (1.0 - missing) * low)), float(max(high, (1.0 - missing) * high + missing))


def _indices(
    process: GaussianProcess, rng: np.random.Generator, base: int, spread: Callable[[Array], Array] | None
) -> tuple[Array, Array, Array, Array]:
    """First and total indices of the process' mean, and their bootstrap samples (BOOTSTRAPS, n)."""
    n = process.points.shape[1]
    both = qmc.Sobol(2 * n, rng=rng).random(base)
    a, b = (half if spread is None else spread(half) for half in (both[:, :n], both[:, n:]))
    at_a, at_b = process.predict(a)[0], process.predict(b)[0]
    crossed = np.empty((n, base))
    for axis in range(n):
        mixed = a.copy()
        mixed[:, axis] = b[:, axis]
        crossed[axis] = process.predict(mixed)[0]

    def estimate(chosen: NDArray[np.int64]) -> tuple[Array, Array]:
        fa, fb, fc = at_a[chosen], at_b[chosen], crossed[:, chosen]
        variance = max(float(np.concatenate([fa, fb]).var()), 1e-300)
        return (fb * (fc - fa)).mean(axis=1) / variance, 0.5 * np.square(fa - fc).mean(axis=1) / variance

    middle = float(np.concatenate([at_a, at_b]).mean())
    at_a, at_b, crossed = at_a - middle, at_b - middle, crossed - middle  # a mean near 0 lowers the variance
    first, total = estimate(np.arange(base))
    samples = [estimate(rng.integers(0, base, base)) for _ in range(BOOTSTRAPS)]
    return first, total, np.array([s[0] for s in samples]), np.array([s[1] for s in samples])
