# SPDX-License-Identifier: GPL-3.0-or-later
"""The check that every answer must pass before it is believed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.least_squares import LinkedLeastSquares

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Check:
    """How well an answer satisfies the conditions of optimality. All in the units of x, but ``equality`` (rows)."""

    kkt: float
    bounds: float
    equality: float
    gap: float = 0.0
    """Bound on how much the sum of squares could still fall, by its slope towards the bounds."""

    SHARP = 1e-13
    """Gap at which colors are right to about 1e-7 even where a light shows some of them only faintly."""
    LIMIT = 1e-6
    """Largest scaled KKT residual and equality error of an answer that is believed."""
    GOAL = 1e-7
    """At which no other engine is tried."""
    BOUND_LIMIT = 1e-9
    """Largest distance outside the bounds."""

    @property
    def passed(self) -> bool:
        """Whether the answer may be called right."""
        return self.kkt <= self.LIMIT and self.bounds <= self.BOUND_LIMIT and self.equality <= self.LIMIT

    @property
    def good(self) -> bool:
        """Whether it passed with room to spare."""
        return self.passed and self.worst <= self.GOAL

    @property
    def worst(self) -> float:
        """One number to compare two answers by."""
        return max(self.kkt, self.bounds, self.equality)


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
