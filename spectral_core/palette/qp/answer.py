# SPDX-License-Identifier: GPL-3.0-or-later
"""The answer of an engine: spectra, free colors and multipliers, with the KKT check that decides if it is accepted.

The answer of every engine of this folder must pass the check; the steps of most-distinct palettes, which are stated
differently, have their own (``palette.distinct.step``). It uses the multipliers of the rows, not their weights times
their errors: at a weight of 1000 the error of a row is rounding, and its square carries no information (Nocedal and
Wright 2006, section 12.3, states the conditions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

SHARP = 1e-8
"""KKT residual up to which refinement has nothing to gain after an edit."""
STRAIN, STRAINED = 1e3, 1e-5
"""An answer is strained if the multiplier of an exact row exceeds STRAIN, and STRAINED times it the objective: a slack
of 1e-11, which no check can tell from 0, then changes the objective by a millionth."""
ROUNDING = 64 * float(np.finfo(float).eps)
"""Share of the terms of a gradient that is rounding."""


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
    kkt = _projected(problem, x, gradient)
    if np.isnan(kkt):
        # NaN multipliers fail the check; a later maximum could hide the NaN.
        return FAILED
    if kkt > Check.LIMIT and problem.has_equalities:
        # A spectrum whose color rows are all exact has the scale of its roughness, which may be less than the rounding
        # of the sum of its forces.
        gradient -= np.clip(gradient, *_rounding(problem, x, forces))
        kkt = _projected(problem, x, gradient)
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
    return Check(kkt, _largest(np.minimum(np.maximum(x, problem.lower), problem.upper) - x), equality)


def _projected(problem: Quadratic, x: Array, gradient: Array) -> float:
    """Largest part of the projected step: 0 exactly where each gradient component vanishes or pushes into its active
    bound.
    """
    stepped = gradient / problem.gradient_scale
    np.subtract(x, stepped, out=stepped)
    np.minimum(np.maximum(stepped, problem.lower, out=stepped), problem.upper, out=stepped)
    stepped -= x
    return _largest(stepped)


def _rounding(problem: Quadratic, x: Array, forces: Array | Sequence[Array]) -> tuple[Array, Array]:
    """The rounding that each gradient component may have, below and above: a share of the sum of its terms."""
    colors, values = problem.split(np.abs(x))
    of_colors, parts = np.abs(problem.known_ties).T @ (problem.known_weights * np.abs(problem.known_targets)), []
    of_colors = of_colors.reshape(-1) if of_colors.size else np.zeros(colors.size)
    for block, value, force in zip(problem.blocks, values, forces, strict=True):
        parts.append(np.abs(block.gram) @ value + np.abs(block.rows).T @ np.abs(force))
        of_colors = of_colors + np.abs(block.ties).T @ np.abs(force)
    found = ROUNDING * np.concatenate([of_colors, *parts])
    return -found, found


def _largest(values: Array) -> float:
    """Largest absolute value; 0 of none."""
    return max(float(values.max()), -float(values.min())) if values.size else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """One side solved."""

    values: tuple[Array, ...]
    """Spectra, one per block."""
    colors: Array
    """Free colors, (G, 3)."""
    forces: Sequence[Array] | Array
    """Multiplier of each row of each block, (K, m) if the blocks are of equal shape."""
    check: Check
    engines: tuple[str, ...]
    infeasible: bool = False
    """True if exact rows cannot hold together; they were given large weights instead."""


def is_sharp(answer: Answer, limit: float = SHARP) -> bool:
    """True if refinement cannot improve the answer."""
    return answer.check.passed and answer.check.kkt <= limit


def is_strained(problem: Quadratic, answer: Answer) -> bool:
    """True if multipliers of exact rows are so large that rounding in the rows shows in the objective.

    They are where rows nearly depend on each other.
    """
    if not problem.has_equalities:
        return False
    if isinstance(answer.forces, np.ndarray) and problem.stack is not None:
        hardest = float(np.abs(answer.forces[problem.stack.exact]).max(initial=0.0))
    else:
        exact = zip(problem.blocks, answer.forces, strict=True)
        largest = [float(np.abs(force[block.exact]).max()) for block, force in exact if block.any_exact]
        hardest = max(largest, default=0.0)
    if not hardest > STRAIN:
        return False
    # Force times slack is the reduction of the objective by a slack; STRAIN and STRAINED set the limit from which it
    # counts.
    return hardest * STRAINED > problem.objective(problem.joined(answer.colors, answer.values))


def better(problem: Quadratic, answer: Answer, other: Answer | None) -> Answer:
    """Another answer if it passed its check and its slack, within the tolerances of the check, lowers the objective."""
    if other is None or not other.check.passed:
        return answer
    costs = [problem.objective(problem.joined(each.colors, each.values)) for each in (other, answer)]
    return other if costs[0] < costs[1] else answer


def answer_at(
    problem: Quadratic,
    x: Array,
    forces: Array | list[Array],
    engine: str,
    misses: Array | list[Array] | None = None,
) -> Answer:
    colors, values = problem.split(x.copy())
    return Answer(tuple(values), colors, forces, checked(problem, x, forces, misses), (engine,))


def nothing(problem: Quadratic) -> Answer:
    """The answer if no method gives numbers at all."""
    x = np.clip(np.zeros(problem.size), problem.lower, problem.upper)
    return replace(answer_at(problem, x, problem.forces(x), "none"), check=FAILED)
