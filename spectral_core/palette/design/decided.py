# SPDX-License-Identifier: GPL-3.0-or-later
"""The decision about exact cells that the engine leaves open: can they hold together, and which optimum do they leave?

The engine is fast where exact rows are well-conditioned. Rows of line lamps nearly depend on each other, and a color at
the end of what a lamp can show leaves a spectrum no room: more bounds are active than directions are left, and the
engine's methods lose their digits or go in circles. Its failures, and conflicts that it cannot prove, come here. A
linear program finds a point that meets all exact rows, if there is one. From it, the optimum is sought on the affine
set of the rows, so that these hold throughout. Multipliers that show the optimum come from a linear program as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.design.components import components
from spectral_core.palette.design.darkness import dark
from spectral_core.palette.design.linear_programs import ExactRows, least_miss, multipliers, nearest_point
from spectral_core.palette.design.orthogonal import THOROUGH, UNITS, descended, on_bounds, refined, worst_miss
from spectral_core.palette.qp.answer import Answer, answer_at, better, is_strained
from spectral_core.palette.qp.backends import change_on_rows
from spectral_core.palette.qp.elastic import softened
from spectral_core.palette.qp.engine import Engine
from spectral_core.palette.qp.feasibility import asked_black, forced_black, wants_color
from spectral_core.palette.qp.quadratic import Quadratic

Array = NDArray[np.float64]

HELD = 5e-10
"""Miss of the worst exact row, in linear RGB, up to which exact rows hold together: half of what the check allows."""
LARGEST = 12000
"""Most unknowns of a side for which linear programs decide: they take a second or two at that size."""
BLACK = 30.0
"""Factor for the weights of exact cells that hold in black alone."""
SNAP = 1e-12
"""Distance to a bound that is rounding: a direction of descent must not end there."""
DESCENTS = 12
"""Most directions of descent from linear programs; one or two are usual."""
ALONG = 1e-7
"""Share of a direction by which it may leave the exact rows."""
TRACE = 1e-13
"""Coefficient relative to the largest of its exact row, below which it changes no color that the check can tell."""
NEARLY_BLACK = 1e-4
"""Linear RGB of a shared color from which it is not black. Exact rows that hold within their tolerance leave 1e-6 of
a color that must be black.
"""
FAINT = 1e-10  # distance to a bound that is the tolerance of a linear program
NAME = "linear program"  # engine of these answers, as a solution names it


@dataclass(frozen=True, eq=False)
class Decision:
    """A problem, its answer, and True if a linear program has decided about it."""

    problem: Quadratic
    answer: Answer
    is_new: bool = False
    is_black: bool | None = None
    """True if a linear program has shown that exact cells hold in black alone; None if it was not asked."""


def decided(problem: Quadratic, answer: Answer, before: Decision | None = None) -> Decision:
    """The answer of the engine, or a better one where it failed, or where it calls a conflict that it cannot prove.

    Exact rows that depend on no conflict hold beside it. ``before``: the last decision, which is taken where it holds
    for this problem as well.
    """
    found = _decision(problem, answer, before)
    return replace(found, answer=_with_rows_apart(problem, found.answer)) if found.answer.infeasible else found


def _decision(problem: Quadratic, answer: Answer, before: Decision | None) -> Decision:
    found = Decision(problem, answer)
    if answer.check.passed and not answer.infeasible:
        is_black = _holds_in_black_alone(problem, answer, before)
        colored = _beside_black(problem, answer) if is_black else None
        if colored is not None:
            return Decision(problem, colored, is_black=True)
        # Multipliers without measure ask for zeros that no color shows.
        other = _in_the_dark(problem) if is_strained(problem, answer) else None
        return Decision(problem, better(problem, answer, other), is_black=is_black)
    if not problem.has_equalities or not answer.values or problem.size > LARGEST:
        return found
    if answer.infeasible and answer.check.passed and least_miss(problem, answer) > HELD:
        return found
    again = None if before is None or not before.is_new else _again(problem, answer, before)
    if again is not None and before is not None:
        return Decision(problem, again, is_new=True, is_black=before.is_black)
    return Decision(problem, *_decided(problem, answer))


def _holds_in_black_alone(problem: Quadratic, answer: Answer, before: Decision | None) -> bool | None:
    """True if exact cells share a color that can only be black, which the engine may find as the optimum or not,
    depending on the order of the rows; None where no shared color is black.
    """
    if not answer.colors.size or np.abs(answer.colors).max(axis=1).min() > NEARLY_BLACK or problem.size > LARGEST:
        return None
    if before is not None and before.is_black is not None and _same_rows(problem, before.problem):
        return before.is_black
    is_near = np.repeat(np.abs(answer.colors).max(axis=1) <= NEARLY_BLACK, 3) & ~asked_black(problem)
    exact = [block.ties[block.exact][:, is_near] for block in problem.blocks]
    return bool(any(ties.any() for ties in exact) and forced_black(problem))


def _again(problem: Quadratic, answer: Answer, before: Decision) -> Answer | None:
    """The answer that the last decision leaves, if it is about the same exact rows."""
    old = before.problem
    if not _same_rows(problem, old):
        return None
    if before.answer.infeasible:
        return ((before.is_black and _beside_black(problem, answer)) or answer) if answer.infeasible else None
    x = problem.joined(before.answer.colors, before.answer.values)
    found = answer_at(problem, x, list(before.answer.forces), NAME)
    return found if found.check.passed else None


def _with_rows_apart(problem: Quadratic, answer: Answer) -> Answer:
    """A compromise with exact rows that hold in all parts of a problem that do not conflict themselves.

    The compromise gives weights to all exact rows, so that those of other materials miss their colors as well.
    """
    if not answer.check.passed:
        return answer
    parts = components(problem)
    if len(parts) < 2:
        return answer
    x, forces = problem.joined(answer.colors, answer.values), list(answer.forces)
    check, engines = answer.check, answer.engines
    for part in parts:
        if worst_miss(part.problem, x[part.at]) <= HELD:
            continue
        colors, values = part.problem.split(x[part.at])
        own = Answer(tuple(values), colors, [forces[k] for k in part.blocks], check, engines)
        if least_miss(part.problem, own) > HELD:
            continue
        own = _decision(part.problem, Engine().solve(part.problem), None).answer
        if own.infeasible or not own.check.passed:
            continue
        x[part.at] = part.problem.joined(own.colors, own.values)
        for k, force in zip(part.blocks, own.forces, strict=True):
            forces[k] = force
        check, engines = check | own.check, tuple(dict.fromkeys((*engines, *own.engines)))
    colors, values = problem.split(x)
    return replace(answer, values=tuple(values), colors=colors, forces=forces, check=check, engines=engines)


def _same_rows(problem: Quadratic, other: Quadratic) -> bool:
    if len(other.blocks) != len(problem.blocks) or other.size != problem.size:
        return False
    bounds = zip((problem.lower, problem.upper), (other.lower, other.upper), strict=True)
    return all(np.array_equal(*pair) for pair in bounds) and all(
        np.array_equal(one.exact, two.exact)
        and all(
            np.array_equal(getattr(one, name)[one.exact], getattr(two, name)[two.exact])
            for name in ("rows", "ties", "targets")
        )
        for one, two in zip(problem.blocks, other.blocks, strict=True)
    )


def _without_traces(problem: Quadratic) -> Quadratic:
    """The problem without coefficients of exact rows that are rounding errors of the others.

    A row that asks for black leaves nothing but such samples, whose multipliers would be 1e15 times the others.
    """
    blocks = []
    for block in problem.blocks:
        size = np.abs(block.rows)
        is_trace = block.exact[:, None] & (size < TRACE * size.max(axis=1, keepdims=True, initial=0.0))
        blocks.append(replace(block, rows=np.where(is_trace, 0.0, block.rows)) if is_trace.any() else block)
    return replace(problem, blocks=tuple(blocks))


def _decided(problem: Quadratic, answer: Answer) -> tuple[Answer, bool, bool | None]:
    """The answer that linear programs decide, True, and True if exact cells hold in black alone."""
    in_dark = _in_the_dark(problem)
    if in_dark is not None:
        return in_dark, True, None
    point, miss = nearest_point(problem)
    if miss > HELD:
        return answer if answer.infeasible else _compromise(problem, answer), True, None
    is_black = bool(forced_black(problem))
    # The same compromise, whether the engine has found the black optimum or not; none if no cell wants a color.
    if is_black and (colored := _beside_black(problem, answer)) is not None:
        return colored, True, True
    found = _on_rows_of(problem, answer, point)
    return answer if is_black and not found.check.passed else found, True, is_black or None


def _on_rows_of(problem: Quadratic, answer: Answer, point: Array) -> Answer:
    """The optimum whose exact rows are those of a point that meets them; the answer where it is better."""
    found = _on_the_rows(problem, point)
    if not found.check.passed:
        # Beside exact cells in black, all that is left to a row are rounding errors of it and of the program.
        plain = _without_traces(problem)
        faint = on_bounds(plain, point, FAINT)
        if worst_miss(plain, faint) <= HELD:
            found = min(found, _on_the_rows(plain, faint), key=lambda each: each.check.worst)
    if found.check.passed or answer.infeasible:  # the point shows that they do not conflict
        return found
    return found if found.check.worst < answer.check.worst else answer


def _in_the_dark(problem: Quadratic) -> Answer | None:
    """The optimum with the samples at 0 that exact black cells leave no other value; None if there is no such cell, or
    no answer.
    """
    simpler = dark(problem)
    if simpler is None:
        return None
    found = refined(simpler, _decision(simpler, Engine().solve(simpler), None).answer)
    if found.infeasible or not found.check.passed:
        return None
    return found if worst_miss(problem, problem.joined(found.colors, found.values)) <= HELD else None


def _compromise(problem: Quadratic, answer: Answer, factor: float = 1.0) -> Answer:
    """The nearest compromise, with a factor for the squared weights of exact rows."""
    blocks = tuple(
        block if block.own_weights is None else block.with_weights(block.targets, block.weights, own)
        for block in problem.blocks
        for own in [None if block.own_weights is None else factor * block.own_weights]
    )
    found = replace(Engine().solve(softened(replace(problem, blocks=blocks))), infeasible=True)
    return found if found.check.passed else answer


def _beside_black(problem: Quadratic, answer: Answer) -> Answer | None:
    """The compromise where exact cells hold in black alone, which is reported as a conflict: near black are the colors
    that were wanted, with small errors. None if no cell wants a color, so that it is black as well.
    """
    if not wants_color(problem):  # what a compromise misses is the tolerance of the solver
        return None
    found = _compromise(problem, answer, BLACK)
    is_colored = worst_miss(problem, problem.joined(found.colors, found.values)) > HELD
    return found if is_colored and found.check.passed else None


def _on_the_rows(problem: Quadratic, point: Array) -> Answer:
    """The optimum among the points whose exact rows are as at a given point."""
    held = _held_at(problem, point)
    rows = ExactRows.of(problem, problem.lower < problem.upper)
    x, best = _near(held, point, rows), None
    for _ in range(DESCENTS):
        x, forces = descended(held, x, THOROUGH)
        x = on_bounds(problem, x, SNAP)
        found = answer_at(problem, x, problem.forces(x, forces), NAME)
        direction = None
        if not found.check.passed:
            several, direction = multipliers(problem, rows, x)
            others = [answer_at(problem, x, problem.forces(x, each), NAME) for each in several]
            found = min(found, *others, key=lambda each: each.check.worst) if others else found
        best = found if best is None or found.check.worst < best.check.worst else best
        if direction is None or best.check.passed:
            break
        # Below the tolerance of the program, its direction leaves the rows.
        if np.abs(rows.matrix @ direction).max(initial=0.0) > ALONG * np.abs(direction).max():
            break
        moved = _along(held, x, direction)
        if not held.objective(moved) < held.objective(x):
            break
        x = moved
    assert best is not None
    return best


def _near(problem: Quadratic, point: Array, rows: ExactRows) -> Array:
    """A point near the optimum, by piqp."""
    best, least = point, problem.objective(point)
    for unit in (1.0, *UNITS):
        found = change_on_rows(problem, best, rows.matrix, unit)
        if found is not None and worst_miss(problem, found) <= HELD and problem.objective(found) < least:
            best, least = found, problem.objective(found)
    return best


def _held_at(problem: Quadratic, point: Array) -> Quadratic:
    """The problem with exact rows that ask for what they show at a point, to the last digit."""
    colors, values = problem.split(point)
    blocks = []
    for block, value in zip(problem.blocks, values, strict=True):
        shown = block.rows @ value - block.ties @ colors.ravel()
        blocks.append(block.with_targets(np.where(block.exact, shown, block.targets)))
    return replace(problem, blocks=tuple(blocks))


def _along(problem: Quadratic, x: Array, direction: Array) -> Array:
    """The lowest point from ``x`` along a direction within the bounds."""
    curvature = 2 * (problem.objective(x + direction) - problem.objective(x))
    slope = float(problem.gradient(x, problem.forces(x)) @ direction)
    curvature -= 2 * slope
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(direction > 0, (problem.upper - x) / direction, (problem.lower - x) / direction)
    longest = float(np.min(room[direction != 0], initial=np.inf))
    best = -slope / curvature if curvature > 0 else longest
    length = min(best, longest)
    return np.clip(x + length * direction, problem.lower, problem.upper) if np.isfinite(length) else x
