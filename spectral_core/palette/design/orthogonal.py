# SPDX-License-Identifier: GPL-3.0-or-later
"""The last digits of an answer, by orthogonal factors of the rows instead of normal equations.

Squared weights of 10⁶ beside a squared roughness of 10⁻⁶ leave normal equations no digits for smoothness. The rows
themselves, times the roots of their weights, have the root of that condition number. An active-set method on them takes
one factorization for each change of a bound, so it is made for an answer whose active bounds are almost right.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.design.components import components
from spectral_core.palette.design.factored import FactoredRows, least_squares
from spectral_core.palette.qp.answer import Answer, answer_at
from spectral_core.palette.qp.backends import change_by_piqp
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

LARGEST = 500
"""Most samples of a spectrum: one factorization takes 0.1 s at that size."""
LIVE = 320
"""Most unknowns in all of a side that is solved at interactive speed."""
CHANGES, THOROUGH = 30, 400
"""Most changes of bounds in a round of two sides, which the next one continues; and for an answer that is returned."""
MANY = 100
"""Samples of a spectrum above which piqp finds the active bounds, before the factorizations."""
NEAR = 1e-9
"""Distance to a bound at which an unknown begins on it."""
UNITS = 1e-2, 1e-4, 1e-6
"""Units of the changes that piqp tries, of spectra near 1: an objective near rounding needs small ones."""
WORK = 4e9
"""Most changes of bounds in one answer, times the cube of the samples of a spectrum: a second or two."""
RELEASES, PROGRESS = 30, 1e-9
"""Releases of bounds that together must lower the objective by this share of it. With exact rows a step may end at a
bound at once; where spectra are black to rounding, such steps go on to the limit of changes.
"""
ROUNDING = 1e-13
"""Share of a gradient's terms that counts as rounding."""
HELD = 1e-13
"""Error of an exact row, in linear RGB, that is rounding."""


def refined(
    problem: Quadratic,
    answer: Answer,
    changes: int = THOROUGH,
    most: int | None = None,
    before: Answer | None = None,
) -> Answer:
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
    before
        An earlier answer to such a problem: the start if it is better than ``answer``.
    """
    samples = max((block.lower.size for block in problem.blocks), default=0)
    is_large = samples > LARGEST or (most is not None and problem.size > most)
    if is_large or not answer.check.passed or answer.infeasible:
        return answer
    x = problem.joined(answer.colors, answer.values)
    start = _better_start(problem, x, before)
    start = _nearer(problem, start) if samples > MANY else start
    start = on_bounds(problem, start, NEAR)
    changes = min(changes, int(WORK / max(samples, 1) ** 3))
    found, multipliers = _each(problem, start, changes)
    if not problem.objective(found) < problem.objective(x):
        return answer
    better = answer_at(problem, found, problem.forces(found, multipliers), answer.engines[0])
    # The exact rows of two points miss by different rounding, which may be all that lowered the objective.
    if better.check.equality > max(answer.check.equality, HELD):
        return answer
    return better if better.check.passed else answer


def _better_start(problem: Quadratic, x: Array, before: Answer | None) -> Array:
    """The point of an earlier answer if it is within the bounds, meets the exact rows and is lower; else ``x``."""
    if before is None or sum(each.size for each in before.values) + before.colors.size != problem.size:
        return x
    old = problem.joined(before.colors, before.values)
    fits = bool(((old >= problem.lower) & (old <= problem.upper)).all()) and worst_miss(problem, old) <= HELD
    return old if fits and problem.objective(old) < problem.objective(x) else x


def on_bounds(problem: Quadratic, x: Array, near: float) -> Array:
    """Unknowns that are near a bound, on it: a step would take them there one after the other."""
    x = np.where(x - problem.lower < near, problem.lower, x)
    return np.where(problem.upper - x < near, problem.upper, x)


def _nearer(problem: Quadratic, x: Array) -> Array:
    """A lower point by piqp, whose time grows with the samples and not with their cube; ``x`` if there is none."""
    best, least = x, problem.objective(x)
    allowed = max(worst_miss(problem, x), HELD)
    for unit in UNITS:
        found = change_by_piqp(problem, x, unit)
        if found is not None and problem.objective(found) < least and worst_miss(problem, found) <= allowed:
            best, least = found, problem.objective(found)
    return best


def worst_miss(problem: Quadratic, x: Array) -> float:
    """Largest error of an exact row."""
    misses = zip(problem.blocks, problem.all_misses(x), strict=True)
    return max((float(np.abs(left[block.exact]).max(initial=0.0)) for block, left in misses), default=0.0)


def _each(problem: Quadratic, x: Array, changes: int) -> tuple[Array, list[Array]]:
    """The spectra that share free colors together, and one such set after the other: a step of one of a hundred
    spectra then costs a hundredth.
    """
    parts = components(problem)
    if len(parts) == 1:
        return descended(problem, x, changes)
    found, multipliers = x.copy(), [np.zeros(0)] * len(problem.blocks)
    for part in parts:
        own, forces = descended(part.problem, x[part.at], changes)
        found[part.at] = own
        for k, force in zip(part.blocks, forces, strict=True):
            multipliers[k] = force
    return found, multipliers


def descended(problem: Quadratic, x: Array, changes: int) -> tuple[Array, list[Array]]:
    """Primal active-set steps for ½ ||rows · x − right||² within bounds, from a point within them.

    ``exact`` · x = ``wanted`` holds throughout. Also the multipliers of these rows, by block. Many bounds change at
    once while that lowers the objective, else one at a time.
    """
    rows = FactoredRows(problem)
    lower, upper = problem.lower, problem.upper
    exact = rows.equalities()
    x = x.copy()
    free = (x > lower) & (x < upper)
    multipliers = np.zeros(len(exact))
    before, many = np.inf, True
    found: deque[float] = deque(maxlen=RELEASES)
    for _ in range(changes):
        step = rows.step(free, *rows.left(x))
        moved = np.clip(x + step, lower, upper)
        outside = free & (moved != x + step)
        if outside.any():
            if many and not len(exact) and problem.objective(moved) < problem.objective(x):
                x, free = moved, free & ~outside
            else:
                x = _to_the_first_bound(x, step, lower, upper)
                free &= (x > lower) & (x < upper)
            continue
        x = moved
        left = rows.settled(free, x)
        if (np.abs(left) <= ROUNDING * rows.sizes(x)).all():
            break  # all rows are met
        slack = ROUNDING * rows.back(np.abs(left), sizes=True)
        gradient = -rows.back(left)
        if len(exact):
            # The multipliers that cancel the gradient of the free unknowns.
            multipliers = least_squares(exact[:, free].T, -gradient[free])
            gradient = gradient + exact.T @ multipliers
        inward = np.where(x <= lower, -gradient, gradient) - slack
        inward[free | (lower >= upper)] = 0.0
        if inward.max(initial=0.0) <= 0:
            break
        here = problem.objective(x)
        many = many and here < before
        before = here
        if len(found) == RELEASES and here > (1 - PROGRESS) * found[0]:
            break
        found.append(here)
        free[inward > 0 if many else np.argmax(inward)] = True
    ends = np.cumsum([int(block.exact.sum()) for block in problem.blocks])[:-1]
    return x, np.split(multipliers, ends)


def _to_the_first_bound(x: Array, step: Array, lower: Array, upper: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # steps of 1e-320
        room = np.where(step < 0, (lower - x) / step, np.where(step > 0, (upper - x) / step, np.inf))
    first = int(np.argmin(room))
    x = np.clip(x + room[first] * step, lower, upper)
    x[first] = lower[first] if step[first] < 0 else upper[first]
    return x
