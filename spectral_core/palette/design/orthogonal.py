# SPDX-License-Identifier: GPL-3.0-or-later
"""The last digits of an answer, by orthogonal factors of the rows instead of normal equations.

Squared weights of 10⁶ beside a squared roughness of 10⁻⁶ leave normal equations no digits for smoothness. The rows
themselves, times the roots of their weights, have the root of that condition number. An active-set method on them takes
one factorization for each change of a bound, so it is made for an answer whose active bounds are almost right.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.design.factored import FactoredRows, least_squares
from spectral_core.palette.qp.answer import Answer, answer_at
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

LARGEST = 500
"""Most samples of a spectrum: one factorization takes 0.1 s at that size."""
LIVE = 320
"""Most unknowns in all of a side that is solved at interactive speed."""
CHANGES, THOROUGH = 30, 400
"""Most changes of bounds in a round of two sides, which the next one continues; and for an answer that is returned."""
WORK = 4e9
"""Cubes of the samples of a spectrum, times changes of bounds, in one answer: a second or two."""
ROUNDING = 1e-13
"""Share of a gradient's terms that counts as rounding."""
HELD = 1e-13
"""Error of an exact row, in linear RGB, that is rounding."""


def refined(problem: Quadratic, answer: Answer, changes: int = THOROUGH, most: int | None = None) -> Answer:
    """The answer with more digits, or itself where that does not lower the objective.

    Parameters
    ----------
    problem
        What was solved.
    answer
        A checked answer of an engine.
    changes
        The most changes of bounds.
    most
        The most unknowns in all; None: any number.
    """
    samples = max((block.lower.size for block in problem.blocks), default=0)
    is_large = samples > LARGEST or (most is not None and problem.size > most)
    if is_large or not answer.check.passed or answer.infeasible:
        return answer
    x = problem.joined(answer.colors, answer.values)
    changes = min(changes, int(WORK / max(samples, 1) ** 3))
    found, multipliers = (_descended if problem.color_lower.size else _each)(problem, x, changes)
    if not problem.objective(found) < problem.objective(x):
        return answer
    better = answer_at(problem, found, problem.forces(found, multipliers), answer.engines[0])
    # The exact rows of two points miss by different rounding, which may be all that lowered the objective.
    if better.check.equality > max(answer.check.equality, HELD):
        return answer
    return better if better.check.passed else answer


def _each(problem: Quadratic, x: Array, changes: int) -> tuple[Array, list[Array]]:
    """Without free colors, one spectrum after the other."""
    found, multipliers = [], []
    for block, value in zip(problem.blocks, problem.split(x)[1], strict=True):
        own, forces = _descended(Quadratic((block,), problem.color_lower, problem.color_upper), value, changes)
        found.append(own)
        multipliers += forces
    return np.concatenate(found), multipliers


def _descended(problem: Quadratic, x: Array, changes: int) -> tuple[Array, list[Array]]:
    """Primal active-set steps for ½ ||rows · x − right||² within bounds, from a point within them.

    ``exact`` · x = ``wanted`` holds throughout. Also the multipliers of these rows, by block.
    """
    rows = FactoredRows(problem)
    lower, upper = problem.lower, problem.upper
    largest, exact = ROUNDING * _largest(rows.right), rows.equalities()
    x = x.copy()
    free = (x > lower) & (x < upper)
    multipliers = np.zeros(len(exact))
    for _ in range(changes):
        step = rows.step(free, *rows.left(x))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # steps of 1e-320
            room = np.where(step < 0, (lower - x) / step, np.where(step > 0, (upper - x) / step, np.inf))
        first = int(np.argmin(room))
        if room[first] < 1:
            x = np.clip(x + room[first] * step, lower, upper)
            x[first] = lower[first] if step[first] < 0 else upper[first]
            free[first] = False
            continue
        x = np.clip(x + step, lower, upper)
        left = rows.settled(free, x)
        if _largest(left) <= largest:
            break  # all rows are met
        slack = ROUNDING * rows.back(np.abs(left), sizes=True)
        gradient = -rows.back(left)
        if len(exact):
            # The multipliers that cancel the gradient of the free unknowns.
            multipliers = least_squares(exact[:, free].T, -gradient[free])
            gradient = gradient + exact.T @ multipliers
        inward = np.where(x <= lower, -gradient, gradient) - slack
        inward[free | (lower >= upper)] = 0.0
        worst = int(np.argmax(inward))
        if inward[worst] <= 0:
            break
        free[worst] = True
    ends = np.cumsum([int(block.exact.sum()) for block in problem.blocks])[:-1]
    return x, np.split(multipliers, ends)


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))
