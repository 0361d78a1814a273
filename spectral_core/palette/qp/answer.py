# SPDX-License-Identifier: GPL-3.0-or-later
"""The answer of an engine: spectra, free colors and multipliers, with the check that decides whether it is accepted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.optimality import FAILED, Check, checked
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

SHARP = 1e-8
"""KKT residual up to which refinement has nothing to gain after an edit."""
STRAIN, ROUNDING = 1e3, 1e-5
"""An answer is strained if the multiplier of an exact row exceeds STRAIN, and ROUNDING times it the objective: a slack
of 1e-11, which no check can tell from 0, then changes the objective by a millionth."""


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
    # Force times slack is the reduction of the objective by a slack; STRAIN and ROUNDING set the limit from which it
    # counts.
    return hardest * ROUNDING > problem.objective(problem.joined(answer.colors, answer.values))


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
