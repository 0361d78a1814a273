# SPDX-License-Identifier: GPL-3.0-or-later
"""The KKT check: the one place that decides whether an answer is optimal. No engine is believed without it.

The check uses the multipliers of the rows, not their weights times their errors: at a weight of 1000 the error of a row
is rounding, and its square says nothing (Nocedal and Wright 2006, section 12.3, states the conditions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.quadratic import Block, Quadratic

Array = NDArray[np.float64]

DIM = 1e-7
"""Sum of absolute values of a color row below which its light shows nothing, so that its error cannot be seen."""


@dataclass(frozen=True, slots=True)
class Check:
    """How well an answer satisfies the conditions of optimality. All in the units of x, but ``equality`` (rows)."""

    kkt: float
    """Largest |x − clip(x − gradient / scale)|: about the largest error of any color, in linear RGB."""
    bounds: float
    """Largest distance outside the bounds."""
    equality: float
    """Largest error of a row that must hold exactly."""

    LIMIT = 1e-6
    """Largest scaled KKT residual of an answer that is believed."""
    EQUALITY_LIMIT = 1e-9
    """Largest error of an equality, in linear RGB; where multipliers are large, a little slack buys a lot."""
    BOUND_LIMIT = 1e-9

    @property
    def passed(self) -> bool:
        """Whether the answer may be called right."""
        return self.kkt <= self.LIMIT and self.bounds <= self.BOUND_LIMIT and self.equality <= self.EQUALITY_LIMIT

    @property
    def worst(self) -> float:
        """One number to compare two answers by."""
        return max(self.kkt, self.bounds, self.equality)

    def __or__(self, other: Check) -> Check:
        """The worse of two checks, number by number."""
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
    gradient = problem.gradient(x, forces) / _scale(problem)
    kkt = float(np.abs(x - np.clip(x - gradient, problem.lower, problem.upper)).max(initial=0.0))
    colors, values = problem.split(x)
    equality = 0.0
    for block, value, force in zip(problem.blocks, values, forces, strict=True):
        misses = block.misses(value, colors.ravel())
        exact = block.exact
        equality = max(equality, float(np.abs(misses[exact]).max(initial=0.0)))
        soft = ~exact & (block.weights > 0)
        # A multiplier must be what its row leaves times its weight, or it explains nothing.
        kkt = max(kkt, float(np.abs(misses[soft] - force[soft] / block.weights[soft]).max(initial=0.0)))
    outside = float(np.maximum(problem.lower - x, x - problem.upper).max(initial=0.0))
    return Check(kkt, outside, equality)


def _scale(problem: Quadratic) -> Array:
    """What each unknown's gradient is compared with.

    By block the gradient that an error of 1 in the color of its *lightest* cell would make, so that nothing heavy hides
    an error of something light; by color the weight of its lightest cell.
    """
    lightest_tie = np.full(problem.color_lower.size, np.inf)
    sizes = []
    for block in problem.blocks:
        pull = _pulls(block)
        curvature = float(np.diagonal(block.gram).max(initial=0.0))
        soft = ~block.exact & (block.weights > 0)
        strongest = max(curvature, float((np.where(soft, block.weights, 0.0) @ block.rows**2).max(initial=0.0)))
        sizes.append(min(strongest, float(pull.min(initial=np.inf))) or 1.0)
        for weight, tie in zip(block.weights[soft], block.ties[soft], strict=True):
            tied = tie != 0
            lightest_tie[tied] = np.minimum(lightest_tie[tied], weight)
    for weight, tie in zip(problem.known_weights, problem.known_ties, strict=True):
        lightest_tie[tie != 0] = np.minimum(lightest_tie[tie != 0], weight)
    lengths = [block.lower.size for block in problem.blocks]
    colors = np.where(np.isfinite(lightest_tie), lightest_tie, 1.0)
    return np.concatenate([colors, np.repeat(sizes, lengths)])


def _pulls(block: Block) -> Array:
    """Gradient of an error of 1 in each soft row; infinite for rows too dim to show a color."""
    strength = np.abs(block.rows).max(axis=1, initial=0.0)
    shown = (np.abs(block.rows).sum(axis=1) >= DIM) & ~block.exact & (block.weights > 0)
    if block.keys:
        # Three rows are one color: the strongest of them says how well it shows.
        colored = 3 * len(block.keys)
        strength[:colored] = np.repeat(strength[:colored].reshape(-1, 3).max(axis=1), 3)
        shown[colored:] = False
    return np.where(shown, np.where(np.isinf(block.weights), 0.0, block.weights) * strength, np.inf)
