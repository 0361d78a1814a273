# SPDX-License-Identifier: GPL-3.0-or-later
"""The check that every answer must pass before it is believed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.least_squares import Check, LinkedLeastSquares

Array = NDArray[np.float64]


def checked(problem: LinkedLeastSquares, x: Array, multipliers: Array | None = None) -> Check:
    """Projected-gradient residual ``|x − clip(x − gradient/scale)|``, bounds and equalities of an answer.

    Multipliers of the equalities are taken from the engine, or fitted to the unknowns that are off their bounds,
    whichever explains the answer better.
    """
    if not np.all(np.isfinite(x)):
        return Check(np.inf, np.inf, np.inf)
    gradient = problem.gradient(x)
    outside = float(np.maximum(problem.lower - x, x - problem.upper).max(initial=0.0))
    if not problem.has_equalities:
        return Check(_residual(problem, x, gradient), outside, 0.0, _gap(problem, x, gradient))
    matrix, target = problem.equalities
    error = float(np.abs(matrix @ x - target).max())
    free = (x > problem.lower + 1e-9) & (x < problem.upper - 1e-9)
    scale = problem.scale
    columns = matrix.toarray()[:, free].T / scale[free][:, None]
    fitted, *_ = np.linalg.lstsq(columns, -gradient[free] / scale[free], rcond=1e-13)
    candidates = [fitted] if multipliers is None else [fitted, multipliers]
    gradients = [gradient + matrix.T @ each for each in candidates]
    best = min(gradients, key=lambda each: _residual(problem, x, each))
    return Check(_residual(problem, x, best), outside, error, _gap(problem, x, best))


def _gap(problem: LinkedLeastSquares, x: Array, gradient: Array) -> float:
    """Σ max over the bounds of gradient·(x − z): no feasible z has a sum of squares lower by more."""
    reach = 10.0 * float(np.abs(x).max(initial=0.0)) + 1.0
    low, high = np.maximum(problem.lower, x - reach), np.minimum(problem.upper, x + reach)
    return float(np.maximum(gradient * (x - low), gradient * (x - high)).sum())


def _residual(problem: LinkedLeastSquares, x: Array, gradient: Array) -> float:
    moved = np.clip(x - gradient / problem.scale, problem.lower, problem.upper)
    return float(np.abs(x - moved).max(initial=0.0))
