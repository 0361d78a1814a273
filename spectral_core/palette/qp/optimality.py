# SPDX-License-Identifier: GPL-3.0-or-later
"""The KKT check: decides if an answer is optimal. The answer of every engine of this folder must pass it; the steps of
most-distinct palettes, which are stated differently, have their own (``palette.distinct.step``).

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


def checked(
    problem: Quadratic, x: Array, forces: Array | Sequence[Array], misses: Array | Sequence[Array] | None = None
) -> Check:
    """Check an answer by the Karush-Kuhn-Tucker conditions.

    Parameters
    ----------
    problem
        The problem that was solved.
    x
        All unknowns, free colors first.
    forces
        Multiplier of each row of each block, (m,) each: at an optimum ω_r (a_r·x − t_r − τ_r·g); for exact rows, the
        values that make the gradient vanish.
    misses
        ``problem.all_misses(x)``, if it is known.
    """
    if not np.isfinite(x).all():
        return FAILED
    # Divided by the curvature that a visible error has, the gradient is a distance in x, comparable with the bounds.
    gradient = problem.gradient(x, forces)
    gradient /= problem.gradient_scale
    # The projected step: 0 exactly where each gradient component vanishes or pushes into its active bound.
    stepped = np.subtract(x, gradient, out=gradient)
    np.minimum(np.maximum(stepped, problem.lower, out=stepped), problem.upper, out=stepped)
    stepped -= x
    kkt = _largest(stepped)
    if np.isnan(kkt):
        # NaN multipliers fail the check; a later maximum could hide the NaN.
        return FAILED
    equality = 0.0
    misses = problem.all_misses(x) if misses is None else misses
    stack = problem.stack
    # A multiplier must be the error of its row times its weight, or it explains nothing.
    if stack is not None:
        kkt = max(kkt, _largest(stack.soft * misses - stack.softness * np.asarray(forces)))
        if problem.has_equalities:
            equality = _largest(np.asarray(misses)[stack.exact])
    else:
        for block, left, force in zip(problem.blocks, misses, forces, strict=True):
            soft = block.soft_weights > 0
            kkt = max(kkt, _largest(left[soft] - force[soft] / block.soft_weights[soft]))
            if block.any_exact:
                equality = max(equality, _largest(left[block.exact]))
    stepped = np.minimum(np.maximum(x, problem.lower, out=stepped), problem.upper, out=stepped)
    stepped -= x
    return Check(kkt, _largest(stepped), equality)


def _largest(values: Array) -> float:
    """Largest absolute value; 0 of none."""
    return max(float(values.max()), -float(values.min())) if values.size else 0.0
