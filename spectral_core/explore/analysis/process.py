# SPDX-License-Identifier: GPL-3.0-or-later
"""A Gaussian process over the unit cube, with a length scale per parameter: a sweep's prediction between its points.

Kernel: s² exp(-Σ (xᵢ - yᵢ)² / 2lᵢ²) + noise (Rasmussen and Williams 2006, Eqs. 2.25, 2.26, 5.8). The scales maximize
the marginal likelihood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize
from scipy.spatial import KDTree
from scipy.stats import norm, qmc

from spectral_core.checks import frozen_array, read_only_when_copied
from spectral_core.errors import InvalidInputError

Array = NDArray[np.float64]
MAX_FITTED = 600
"""Rows that the scales are fitted to; all rows count in the prediction, up to ``MAX_ROWS``."""
MAX_ROWS = 3000
NEAREST = 0.01
"""Least distance of a proposal to every row, as a share of the ranges: a nearer one would tell nothing new."""
LEAST_GAIN = 1e-9
"""Of a proposal, as a share of the spread of the values; below it the least value seems to be found."""


@read_only_when_copied
@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """A fitted process. ``scales``: length scale per parameter, in units of its range; ``noise``: share of variance."""

    points: Array
    scales: Array
    noise: float
    mean: float
    spread: float
    """s: standard deviation of the process, in the unit of the values. That of the values themselves is smaller where
    the scales are long."""
    _factor: Array
    _weights: Array

    @classmethod
    def fit(cls, points: ArrayLike, values: ArrayLike, *, seed: int = 0) -> GaussianProcess:
        """The process fitted to values (m,) at points (m, n) of the unit cube; ``seed`` draws the starts of the fit."""
        x = np.array(frozen_array("points", points, (None, None)))
        y = np.array(frozen_array("values", values, (len(x),)))
        if not 3 <= len(x) <= MAX_ROWS:
            raise InvalidInputError(f"a Gaussian process needs 3 to {MAX_ROWS} rows; got {len(x)}")
        if y.min() == y.max():
            raise InvalidInputError(
                f"a Gaussian process needs values that differ; all {len(y)} rows have {y[0]:g}. Name another column"
            )
        mean, unit = float(y.mean()), float(y.std())
        z = (y - mean) / unit
        rng = np.random.default_rng(seed)
        part = np.arange(len(x)) if len(x) <= MAX_FITTED else np.sort(rng.choice(len(x), MAX_FITTED, replace=False))
        n = x.shape[1]
        bounds = [(np.log(0.03), np.log(20.0))] * n + [(np.log(1e-8), np.log(1.0))]
        starts = [np.append(np.full(n, np.log(0.4)), np.log(1e-4)), np.append(np.full(n, np.log(1.5)), np.log(1e-6))]
        best = min(
            (minimize(_loss, start, args=(x[part], z[part]), jac=True, bounds=bounds, method="L-BFGS-B",
                      options={"maxiter": 80}) for start in starts),
            key=lambda found: found.fun,
        )  # fmt: skip
        scales, noise = np.exp(best.x[:n]), float(np.exp(best.x[n]))
        factor = cholesky(_kernel(x, x, scales) + (noise + 1e-10) * np.eye(len(x)), lower=True)
        weights = cho_solve((factor, True), z)
        spread = float(np.sqrt(max(z @ weights / len(x), 1e-300)))  # s of the likelihood's maximum, as in ``_loss``
        return cls(x, scales, noise, mean, unit * spread, factor, weights / spread)

    def predict(self, points: ArrayLike) -> tuple[Array, Array]:
        """Mean and standard deviation at points (k, n)."""
        x = frozen_array("points", points, (None, self.points.shape[1]))
        cross = _kernel(x, self.points, self.scales)
        solved = np.linalg.solve(self._factor, cross.T)
        variance = np.maximum(1.0 - np.square(solved).sum(axis=0), 1e-12)
        return self.mean + self.spread * (cross @ self._weights), self.spread * np.sqrt(variance)


def _kernel(x: Array, y: Array, scales: Array) -> Array:
    a, b = x / scales, y / scales
    squares = np.square(a).sum(axis=1)[:, None] + np.square(b).sum(axis=1)[None] - 2 * a @ b.T
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0.0)))


def _loss(logs: Array, x: Array, z: Array) -> tuple[float, Array]:
    """Negative log likelihood with the variance s² at its optimum, and its gradient."""
    n, rows = x.shape[1], len(x)
    scales, noise = np.exp(logs[:n]), np.exp(logs[n])
    plain = _kernel(x, x, scales)
    try:
        factor = cholesky(plain + (noise + 1e-10) * np.eye(rows), lower=True)
    except np.linalg.LinAlgError:
        return 1e12, np.zeros(n + 1)
    weights = cho_solve((factor, True), z)
    power = float(z @ weights) / rows
    if not power > 0:  # the rows of the fit have one value
        return 1e12, np.zeros(n + 1)
    loss = 0.5 * rows * np.log(power) + float(np.log(np.diag(factor)).sum())
    inverse = cho_solve((factor, True), np.eye(rows))
    inner = inverse - np.outer(weights, weights) / power
    gradient = np.empty(n + 1)
    for axis in range(n):
        distance = np.square((x[:, axis, None] - x[None, :, axis]) / scales[axis])
        gradient[axis] = 0.5 * float(np.sum(inner * plain * distance))
    gradient[n] = 0.5 * noise * float(np.trace(inner))
    return float(loss), gradient


def propose(
    points: ArrayLike, values: ArrayLike, *, seed: int = 0, candidates: int | ArrayLike = 2048,
    settled: Callable[[Array], Array] | None = None,
) -> tuple[Array, float]:  # fmt: skip
    """The point with the largest expected improvement below the least value, and that improvement.

    It is not nearer to a row than ``NEAREST``, if there is room. If nothing is to be gained, it is the point farthest
    from all rows, where a narrow minimum may be that no row shows.

    Parameters
    ----------
    points : (m, n), coordinates of the sweep's unit cube.
    values : (m,), to be made small.
    seed : draws the candidates.
    candidates : number of Sobol points of the unit cube that are tried, or such points (k, n) themselves; the best are
        then improved locally.
    settled : those of points (k, n) that can be proposed, moved to the settings that exist; None: all of the unit cube.
    """
    process = GaussianProcess.fit(points, values, seed=seed)
    n = process.points.shape[1]
    least = float(np.min(np.asarray(values)))
    if isinstance(candidates, int):
        tried = qmc.Sobol(n, rng=np.random.default_rng(seed)).random(candidates)
    else:
        tried = np.asarray(candidates, np.float64)
    allowed = settled or _in_unit_cube
    near = process.points[np.argsort(np.asarray(values))[:5]]
    rng = np.random.default_rng([seed, 1])
    drawn = np.concatenate([tried, allowed(np.repeat(near, 60, axis=0) + rng.normal(0, 0.04, (len(near) * 60, n)))])
    if not len(drawn):
        raise InvalidInputError("no setting is left to propose: the sweep has every point of its region")

    def improvement(x: Array) -> Array:
        mean, deviation = process.predict(x)
        reach = (least - mean) / deviation
        return np.asarray((least - mean) * norm.cdf(reach) + deviation * norm.pdf(reach))

    low, high = drawn.min(axis=0), drawn.max(axis=0)
    if settled is None:
        low, high = np.zeros(n), np.ones(n)
    span = np.where(high > low, high - low, 1.0)
    rows = KDTree(process.points / span)
    apart = rows.query(drawn / span)[0]
    nearest = min(NEAREST, float(apart.max()))
    gains = np.where(apart >= nearest, improvement(drawn), -np.inf)
    best, gain = drawn[int(gains.argmax())], float(gains.max())
    for start in drawn[np.argsort(-gains)[:4]]:
        found = minimize(lambda x: -float(improvement(x[None])[0]), start, bounds=list(zip(low, high, strict=True)),
                         method="L-BFGS-B", options={"maxiter": 40})  # fmt: skip
        # the way there as well: the end may lie beyond a constraint
        way = allowed(start + np.linspace(0, 1, 33)[1:, None] * (found.x - start))
        if len(way):
            better = np.where(rows.query(way / span)[0] >= nearest, improvement(way), -np.inf)
            if better.max() > gain:
                best, gain = way[int(better.argmax())], float(better.max())
    if gain < LEAST_GAIN * process.spread:
        best = drawn[int(apart.argmax())]
    return np.asarray(best), gain


def _in_unit_cube(points: Array) -> Array:
    return np.clip(points, 0.0, 1.0)
