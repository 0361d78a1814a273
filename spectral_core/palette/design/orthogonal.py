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

LARGEST = 320
"""Most unknowns of one factorization, which takes some milliseconds at that size."""
CHANGES, THOROUGH = 30, 400
"""Most changes of bounds in a round of two sides, which the next one continues; and for an answer that is returned."""
ROUNDING = 1e-13
"""Share of a gradient's terms that counts as rounding."""
RANK = 1e-11
"""Singular value of the exact rows, relative to the largest, below which they depend on each other."""
HELD = 1e-13
"""Error of an exact row, in linear RGB, that is rounding."""


def refined(problem: Quadratic, answer: Answer, changes: int = THOROUGH) -> Answer:
    """The answer with more digits, or itself where that does not lower the objective.

    ``changes`` is the most changes of bounds.
    """
    linked = problem.color_lower.size > 0
    largest = problem.size if linked else max((block.lower.size for block in problem.blocks), default=0)
    if largest > LARGEST or not answer.check.passed or answer.infeasible:
        return answer
    x = problem.joined(answer.colors, answer.values)
    found, multipliers = (_whole if linked else _each)(problem, x, changes)
    if not problem.objective(found) < problem.objective(x):
        return answer
    better = answer_at(problem, found, problem.forces(found, multipliers), answer.engines[0])
    # The exact rows of two points miss by different rounding, which may be all that lowered the objective.
    if better.check.equality > max(answer.check.equality, HELD):
        return answer
    return better if better.check.passed else answer


def _whole(problem: Quadratic, x: Array, changes: int) -> tuple[Array, list[Array]]:
    rows, right = problem.least_squares()
    exact, wanted = problem.equalities()
    bounds = problem.lower, problem.upper
    found, multipliers = _descended(rows.toarray(), right, x, bounds, exact.toarray(), wanted, changes)
    ends = np.cumsum([int(block.exact.sum()) for block in problem.blocks])[:-1]
    return found, np.split(multipliers, ends)


def _each(problem: Quadratic, x: Array, changes: int) -> tuple[Array, list[Array]]:
    """Without free colors, one spectrum after the other."""
    found, multipliers = [], []
    for block, value in zip(problem.blocks, problem.split(x)[1], strict=True):
        soft, exact = ~block.exact, block.exact
        root = np.sqrt(block.weights[soft])
        rows = np.concatenate([root[:, None] * block.rows[soft], block.roughness])
        right = np.concatenate([root * block.targets[soft], np.zeros(len(block.roughness))])
        held = block.rows[exact], block.targets[exact]
        own, forces = _descended(rows, right, value, (block.lower, block.upper), *held, changes)
        found.append(own)
        multipliers.append(forces)
    return np.concatenate(found), multipliers


def _descended(
    rows: Array, right: Array, x: Array, bounds: tuple[Array, Array], exact: Array, wanted: Array, changes: int
) -> tuple[Array, Array]:
    """Primal active-set steps for ½ ||rows · x − right||² within bounds, from a point within them.

    ``exact`` · x = ``wanted`` holds throughout. Also the multipliers of these rows.
    """
    x, (lower, upper) = x.copy(), bounds
    free = (x > lower) & (x < upper)
    size = np.abs(rows)
    multipliers = np.zeros(len(exact))
    for _ in range(changes):
        step = np.zeros(x.size)
        step[free] = _step(rows[:, free], right - rows @ x, exact[:, free], wanted - exact @ x)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # steps of 1e-320
            room = np.where(step < 0, (lower - x) / step, np.where(step > 0, (upper - x) / step, np.inf))
        first = int(np.argmin(room))
        if room[first] < 1:
            x = np.clip(x + room[first] * step, lower, upper)
            x[first] = lower[first] if step[first] < 0 else upper[first]
            free[first] = False
            continue
        x = np.clip(x + step, lower, upper)
        left = rows @ x - right
        if _largest(left) <= ROUNDING * _largest(right):
            break  # all rows are met
        slack = ROUNDING * (size.T @ np.abs(left))
        gradient = rows.T @ left
        if len(exact):
            # The multipliers that cancel the gradient of the free unknowns.
            multipliers = _least_squares(exact[:, free].T, -gradient[free])
            gradient = gradient + exact.T @ multipliers
        inward = np.where(x <= lower, -gradient, gradient) - slack
        inward[free | (lower >= upper)] = 0.0
        worst = int(np.argmax(inward))
        if inward[worst] <= 0:
            break
        free[worst] = True
    return x, multipliers


def _step(rows: Array, left: Array, exact: Array, missing: Array) -> Array:
    """The step s of least ||rows · s − left|| with exact · s = missing, by the null space of the exact rows."""
    if not len(exact):
        return _least_squares(rows, left)
    outer, values, inner = np.linalg.svd(exact, full_matrices=True)
    rank = int((values > RANK * values.max(initial=0.0)).sum())
    own = inner[:rank].T @ ((outer.T @ missing)[:rank] / values[:rank])
    across = inner[rank:].T
    return np.asarray(own + across @ _least_squares(rows @ across, left - rows @ own))


def _least_squares(rows: Array, right: Array) -> Array:
    """By orthogonal factors with pivots, which take a fraction of the time of singular values."""
    from scipy.linalg import lstsq

    if not rows.shape[1]:
        return np.zeros(0)
    cond = np.finfo(float).eps * max(rows.shape)
    return np.asarray(lstsq(rows, right, cond=cond, lapack_driver="gelsy", check_finite=False)[0])


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))
