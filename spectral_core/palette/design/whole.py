# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole palette: rounds first, lights by variable projection, rounds again until the joint check passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.design.rounds import SETTLED, Budget, Rounds, SolveTrace
from spectral_core.palette.design.together import improved
from spectral_core.palette.qp.elastic import softened
from spectral_core.palette.qp.engine import Engine
from spectral_core.palette.solution import PaletteSolution

LEAD = 3
"""Rounds before variable projection, and rounds in linear RGB before CIELAB is linearized."""
PERCEPTUAL_ROUNDS = 60
"""Most rounds of a single side in CIELAB; five to ten are usual."""
PLAIN_ROUNDS, COMBINED_ROUNDS = 4, 20
"""Of these the first ones, each of which begins where the last one ended; and those after which no combination of
rounds helps.
"""
COMBINED, SHARE = 3, 0.3
"""Most rounds that are combined; and the share of a round that the next one takes where that does not help."""
LAST_ROUNDS, MOST_RESERVED = 2.5, 0.5
"""Time after a descent, in rounds: a round and the joint check; the largest share of the budget for them."""
SHARPENINGS = 16
"""Most steps after a palette is settled."""
REPEATS = 4
"""Most further answers of a single side; one is usual."""
SLOW = 0.5
"""Share of its gain that a round leaves, above which both sides descend together before the next one."""
SECONDS = 2.0
"""Time budget of a solve that designs lights and reflectances together."""


def brightened_to_fit(
    assembler: Assembler, state: PaletteState, trace: SolveTrace, warm: PaletteSolution | None = None
) -> PaletteState:
    """Brighten all lights so that a design without upper bound on reflectance fits below the bound (section 5.5).

    The factor is that of this problem: a ``state`` that begins with the brighter lights of another one is darkened. If
    ``warm`` solves this very problem, its search goes on with the factor that it has.
    """
    low, high = assembler.problem.reflectance_bounds
    plain = state.brightened_to(1.0)
    if not np.isfinite(high) or high <= 0:
        return plain
    if warm is not None and warm.problem is assembler.problem:
        factor = state.light_scale
    else:
        open_ended = Assembler(replace(assembler.problem, reflectance_bounds=(low, np.inf)), assembler.requests)
        answer = Engine().solve(softened(open_ended.assembled("reflectances", plain).quadratic))
        factor = max((float(values.max()) for values in answer.values), default=0.0) / high
        state = plain.brightened_to(factor) if factor > 1.0 else plain
    if factor > 1.0:
        trace.notes.append(f"all lights were made {factor:.3g} times brighter so that reflectances fit below {high:g}")
    return state


def designed(rounds: Rounds, state: PaletteState, budget: Budget, *, race: bool) -> PaletteState:
    """Improve a state within the limits of its problem, number of rounds and budget; then check it jointly."""
    problem = rounds.assembler.problem
    perceptual = problem.match == "perceptual"
    both = len(rounds.sides) == 2
    if perceptual and not both and rounds.sides:
        return _settled_in_lab(rounds, rounds.round(state), budget)
    # A single side is one convex problem.
    most = problem.rounds if both else 1
    took, checked = 0.0, False
    for number in range(1, most + 1):
        metric = perceptual and number > LEAD
        if both and number > LEAD and not rounds.ended():
            budget.reserved = min(LAST_ROUNDS * took, MOST_RESERVED * budget.seconds)
            state = improved(rounds, state, budget, perceptual=metric, race=race and number == LEAD + 1)
            budget.reserved = 0.0
        before = budget.left
        state = rounds.round(state, perceptual=metric)
        took = max(before - budget.left, took / 2)
        if both and budget.left <= took:  # the joint check takes as long as a round
            break
        if number > LEAD and rounds.settled(state, perceptual=metric):
            checked = metric == perceptual
            break
        if number > LEAD and budget.left <= LAST_ROUNDS * took:  # a descent would leave no time for its last round
            break
    if not checked:
        rounds.check(state, perceptual=perceptual)
    if both:
        return _sharpened(rounds, state, budget, took, perceptual=perceptual)
    return _repeated(rounds, state, budget, perceptual=perceptual)


def _settled_in_lab(rounds: Rounds, state: PaletteState, budget: Budget) -> PaletteState:
    """A single side in CIELAB: rounds until the metric at a solution leaves that solution as it is.

    The metric of a shared color is that at the color itself. Rounds that begin where the last one ended may come back
    to the same two colors for ever. So later ones begin at the combination of the last ones that would change least if
    the rounds were linear (Anderson 1965), and where that does not settle, at a share of the way of the last one.
    """
    begun: list[PaletteState] = []
    ended: list[PaletteState] = []
    point, side = state, rounds.sides[0]
    for number in range(1, PERCEPTUAL_ROUNDS + 1):
        state = rounds.round(point, perceptual=True)
        if rounds.settled(state, perceptual=True):
            return _repeated(rounds, state, budget, perceptual=True)
        begun, ended = [*begun, point][-COMBINED:], [*ended, state][-COMBINED:]
        if budget.spent:
            break
        if number <= PLAIN_ROUNDS:
            point = state
        elif number <= COMBINED_ROUNDS:
            point = _weighted(side, ended, _least_change(begun, ended))
        else:
            point = _weighted(side, [point, state], [1 - SHARE, SHARE])
    rounds.check(state, perceptual=True)
    return _repeated(rounds, state, budget, perceptual=True)


def _least_change(begun: Sequence[PaletteState], ended: Sequence[PaletteState]) -> list[float]:
    """Factors of rounds, with sum 1, with which the changes of their colors nearly cancel each other."""
    moved = np.array([(after.colors() - before.colors()).ravel() for before, after in zip(begun, ended, strict=True)])
    factors = np.linalg.lstsq((moved[-1] - moved[:-1]).T, moved[-1], rcond=1e-6)[0].tolist()
    return [*factors, 1 - sum(factors)]


def _weighted(side: Side, states: Sequence[PaletteState], factors: Sequence[float]) -> PaletteState:
    """The weighted sum of the designed spectra of a side."""
    columns = zip(*(getattr(each, side) for each in states), strict=True)
    sums = {
        item: sum(factor * each for factor, each in zip(factors, own, strict=True))
        for item, own in enumerate(columns)
        if own[0] is not None
    }
    return states[-1].with_values(side, sums)


def _repeated(rounds: Rounds, state: PaletteState, budget: Budget, *, perceptual: bool) -> PaletteState:
    """The joint check's answer for a single side, where it is better than the solution.

    Exact rows that nearly depend on each other hide a part of the smoothness from the KKT check, and rounding decides
    which answer the engine finds first.
    """
    trace = rounds.trace
    for _ in range(REPEATS):
        if trace.settled or budget.spent:
            break
        kept = replace(trace, answers=dict(trace.answers), sides=dict(trace.sides))
        found = rounds.answered(state)
        rounds.check(found, perceptual=perceptual)
        if not (trace.joint.passed and trace.gain < kept.gain):
            trace.restore(kept)
            break
        state = found
    return state


def _sharpened(rounds: Rounds, state: PaletteState, budget: Budget, took: float, *, perceptual: bool) -> PaletteState:
    """Last steps where a side of an objective that counts as 0 could still lose a visible share of it.

    Targets that are met leave the roughness alone, at 1e-21 or less: no color depends on it, but the shape of the
    spectra does, and each side is a convex problem that can be solved to more digits. The side that could lose the
    larger share takes the answer that the joint check found for it, which may leave the other side as good as it was:
    the roughness of lights is often a million times that of reflectances. Roughness may also move from one side to the
    other along a valley, and each such step along it is short: there both sides descend together, once, before they are
    solved again. What helps neither side is undone.
    """
    trace, descends = rounds.trace, not rounds.ended()
    for _ in range(SHARPENINGS):
        if not trace.settled or not trace.joint.passed or trace.gain <= SETTLED or budget.left <= LAST_ROUNDS * took:
            break
        kept = replace(trace, answers=dict(trace.answers), sides=dict(trace.sides))
        found = rounds.answered(state)
        rounds.check(found, perceptual=perceptual)
        if trace.better_than(kept):
            state = found
            if trace.gain <= SLOW * kept.gain:
                continue
            kept = replace(trace, answers=dict(trace.answers), sides=dict(trace.sides))
        else:
            trace.restore(kept)
        start = state
        if descends:
            budget.reserved, descends = min(LAST_ROUNDS * took, MOST_RESERVED * budget.seconds), False
            start = improved(rounds, state, budget, perceptual=perceptual, race=False)
            budget.reserved = 0.0
        found = rounds.round(start, perceptual=perceptual)
        rounds.check(found, perceptual=perceptual)
        if trace.better_than(kept):
            state = found
            continue
        trace.restore(kept)
        if start is state:
            break
    return state
