# SPDX-License-Identifier: GPL-3.0-or-later
"""The KKT check: the single place that decides if an answer is optimal. Every engine's answer must pass it.

The check uses the multipliers of the rows, not their weights times their errors: at a weight of 1000 the error of a row
is rounding, and its square carries no information (Nocedal and Wright 2006, section 12.3, states the conditions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Check:
    """Residuals of the optimality conditions at an answer. All in the units of x, except ``equality`` (rows)."""

    kkt: float
    """Largest |x − clip(x − gradient / scale)|: about the largest error of any color, in linear RGB."""
    bounds: float
    """Largest distance outside the bounds."""
    equality: float
    """Largest error of an exact row."""

    LIMIT = 1e-6
    """Largest scaled KKT residual of an accepted answer."""
    EQUALITY_LIMIT = 1e-9
    """Largest error of an equality, in linear RGB; with large multipliers, a little slack lowers the objective a
    lot.
    """
    BOUND_LIMIT = 1e-9

    @property
    def passed(self) -> bool:
        """True if the answer is accepted."""
        return self.kkt <= self.LIMIT and self.bounds <= self.BOUND_LIMIT and self.equality <= self.EQUALITY_LIMIT

    @property
    def worst(self) -> float:
        """One number for the comparison of two answers."""
        return max(self.kkt, self.bounds, self.equality)

    def __or__(self, other: Check) -> Check:
        """The worse of two checks, component by component."""
        return Check(max(self.kkt, other.kkt), max(self.bounds, other.bounds), max(self.equality, other.equality))


FAILED = Check(np.inf, np.inf, np.inf)
PERFECT = Check(0.0, 0.0, 0.0)


def checked(problem: Quadratic, x: Array, forces: Sequence[Array]) -> Check:
    """Check an answer by the Karush-Kuhn-Tucker conditions.

    Parameters
    ----------
    problem
        What was solved.
    x
        All unknowns, free colors first.
    forces
        Multiplier of each row of each block, (m,) each: at an optimum ω_r (a_r·x − t_r − τ_r·g), and for exact rows
        whatever makes the gradient vanish.
    """
    if not np.all(np.isfinite(x)):
        return FAILED
    # Divided by the curvature of a visible error, the gradient is a distance in x, comparable with the bounds.
    gradient = problem.gradient(x, forces) / _scale(problem)
    # The projected step: 0 exactly if each gradient component vanishes or points into its active bound.
    kkt = float(np.abs(x - np.clip(x - gradient, problem.lower, problem.upper)).max(initial=0.0))
    equality = 0.0
    if problem.stack is not None:
        soft, exact = problem.stack.soft_weights, problem.stack.exact
        misses = problem.stack.misses(x[problem.offsets[0] :].reshape(len(problem.blocks), -1), x[: problem.offsets[0]])
        kkt = max(kkt, _unexplained(misses, np.asarray(forces), soft))
        equality = float(np.abs(misses[exact]).max(initial=0.0))
    else:
        for block, left, force in zip(problem.blocks, problem.all_misses(x), forces, strict=True):
            kkt = max(kkt, _unexplained(left, force, block.soft_weights))
            equality = max(equality, float(np.abs(left[block.exact]).max(initial=0.0)))
    outside = float(np.maximum(problem.lower - x, x - problem.upper).max(initial=0.0))
    return Check(kkt, outside, equality)


def _unexplained(misses: Array, forces: Array, weights: Array) -> float:
    """A multiplier must equal its row's residual times its weight; otherwise it does not explain the gradient."""
    soft = weights > 0
    return float(np.abs(misses[soft] - forces[soft] / weights[soft]).max(initial=0.0))


def _scale(problem: Quadratic) -> Array:
    """Reference size of each unknown's gradient: ``Block.scale``, and for a color the weight of its lightest cell."""
    lightest = np.full(problem.color_lower.size, np.inf)
    for block in problem.blocks:
        # The least weight that is tied to a color decides; otherwise an error of a light cell would vanish beside heavy
        # ones.
        lightest = np.minimum(lightest, block.lightest_ties)
    if problem.known_weights.size and lightest.size:
        known = np.where(problem.known_ties != 0, problem.known_weights[:, None], np.inf)
        lightest = np.minimum(lightest, known.min(axis=0))
    lengths = [block.lower.size for block in problem.blocks]
    colors = np.where(np.isfinite(lightest), lightest, 1.0)
    return np.concatenate([colors, np.repeat([block.scale for block in problem.blocks], lengths)])
