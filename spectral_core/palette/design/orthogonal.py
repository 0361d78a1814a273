# SPDX-License-Identifier: GPL-3.0-or-later
"""The last digits of an answer, by orthogonal factors of the rows instead of normal equations.

Squared weights of 10⁶ beside a squared roughness of 10⁻⁶ leave normal equations no digits for smoothness. The rows
themselves, times the roots of their weights, have the root of that condition number. An active-set method on them takes
one factorization for each change of a bound, so it is made for an answer whose active bounds are almost right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.answer import Answer, answer_at
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

LARGEST = 150
"""Most unknowns of one factorization."""
CHANGES = 30
"""Most changes of bounds."""
ROUNDING = 1e-13
"""Share of a gradient's terms that counts as rounding."""


def refined(problem: Quadratic, answer: Answer) -> Answer:
    """The answer with more digits, or itself where that does not lower the objective."""
    linked = problem.color_lower.size > 0
    largest = problem.size if linked else max((block.lower.size for block in problem.blocks), default=0)
    if problem.has_equalities or largest > LARGEST or not answer.check.passed:
        return answer
    x = problem.joined(answer.colors, answer.values)
    found = _whole(problem, x) if linked else _each(problem, x)
    if not problem.objective(found) < problem.objective(x):
        return answer
    better = answer_at(problem, found, problem.forces(found), answer.engines[0])
    return better if better.check.passed else answer


def _whole(problem: Quadratic, x: Array) -> Array:
    rows, right = problem.least_squares()
    return _descended(rows.toarray(), right, x, problem.lower, problem.upper)


def _each(problem: Quadratic, x: Array) -> Array:
    """Without free colors, one spectrum after the other."""
    found = []
    for block, value in zip(problem.blocks, problem.split(x)[1], strict=True):
        root = np.sqrt(block.weights)
        rows = np.concatenate([root[:, None] * block.rows, block.roughness])
        right = np.concatenate([root * block.targets, np.zeros(len(block.roughness))])
        found.append(_descended(rows, right, value, block.lower, block.upper))
    return np.concatenate(found)


def _descended(rows: Array, right: Array, x: Array, lower: Array, upper: Array) -> Array:
    """Primal active-set steps for ½ ||rows · x − right||² within bounds, from a point within them."""
    x = x.copy()
    free = (x > lower) & (x < upper)
    size = np.abs(rows)
    for _ in range(CHANGES):
        step = np.zeros(x.size)
        step[free] = np.linalg.lstsq(rows[:, free], right - rows @ x, rcond=None)[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(step < 0, (lower - x) / step, np.where(step > 0, (upper - x) / step, np.inf))
        first = int(np.argmin(room))
        if room[first] < 1:
            x = np.clip(x + room[first] * step, lower, upper)
            x[first] = lower[first] if step[first] < 0 else upper[first]
            free[first] = False
            continue
        x = np.clip(x + step, lower, upper)
        left = rows @ x - right
        slack = ROUNDING * (size.T @ np.abs(left))
        inward = np.where(x <= lower, -(rows.T @ left), rows.T @ left) - slack
        inward[free | (lower >= upper)] = 0.0
        worst = int(np.argmax(inward))
        if inward[worst] <= 0:
            break
        free[worst] = True
    return x
