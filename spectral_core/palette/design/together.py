# SPDX-License-Identifier: GPL-3.0-or-later
"""Joint design of lights and reflectances: choice of method, starts and time.

The joint interior point is the usual method. Many plain targets have many local minima: there a race of short descents
by variable projection, whose steps cost a fraction of a millisecond, selects the start. Palettes that are too large for
it, or whose lights are mixed from primaries or must look white, use variable projection.
"""

from __future__ import annotations

import numpy as np

from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.design.interior import LARGEST, joint_descent
from spectral_core.palette.design.joint import Joint
from spectral_core.palette.design.lights import GOOD_RMS, STARTS, LightDescent, outer_side
from spectral_core.palette.design.rounds import Budget, Rounds

FIRST_SHARE = 0.6
"""Share of the time budget of the first start, if others may follow."""
LEAST_SHARE = 0.05
"""Share of the time budget below which no other start is begun."""
EXACT_WEIGHT = 1e5
"""Weight of exact rows, relative to the median, by which two starts are compared."""


def improved(rounds: Rounds, state: PaletteState, budget: Budget, *, perceptual: bool, race: bool) -> PaletteState:
    """Improve both sides together until the objective decreases no further, or the budget ends.

    Parameters
    ----------
    rounds
        The two sides; their assembler holds the requests.
    state
        The start.
    budget
        The limit of time and rounds.
    perceptual
        True if errors are in CIELAB, linearized at ``state``.
    race
        True if other starts than ``state`` may be tried.
    """
    assembler = rounds.assembler
    problem = assembler.problem
    outer = outer_side(problem, assembler.requests)
    descent = None if outer is None else LightDescent(assembler, state, outer)
    if not _fits(assembler) or Joint.of(assembler, state, perceptual=perceptual) is None:
        if descent is not None:
            state = descent.raced(state, budget, 1.0) if race else descent.down(state, budget, np.inf).state
            rounds.trace.rounds += descent.evaluations
        return state
    if race and descent is not None and descent.plain:
        state = descent.raced(state, budget, FIRST_SHARE)
        rounds.trace.rounds += descent.evaluations
        race = False
    best, least = _descended(rounds, state, budget, 0.0, perceptual=perceptual)
    if not race or descent is None or assembler.color_rms(best) <= GOOD_RMS:
        return best
    rng = np.random.default_rng(0)
    for _ in range(STARTS - 1):
        if budget.left <= LEAST_SHARE * budget.seconds:
            break
        begin = descent.solved(descent.scattered(state, rng))
        found, objective = _descended(rounds, begin, budget, LEAST_SHARE * budget.seconds, perceptual=perceptual)
        # Stopped by the budget, the descent would only continue.
        if objective < least and budget.left > LEAST_SHARE * budget.seconds:
            best, least = found, objective
    return best


def _fits(assembler: Assembler) -> bool:
    """True if the joint interior point is fast for a palette of this size."""
    items = len(assembler.free_items("reflectances")) + len(assembler.free_items("lights"))
    several = assembler.problem.robustness == "worst_case" and len(assembler.requests.conditions) > 1
    return items * assembler.problem.grid.size <= LARGEST and not several


def _descended(
    rounds: Rounds, state: PaletteState, budget: Budget, floor: float, *, perceptual: bool
) -> tuple[PaletteState, float]:
    """The state after the joint descent, and its objective; the state itself if there is no joint descent."""
    joint = Joint.of(rounds.assembler, state, perceptual=perceptual)
    if joint is None:
        return state, np.inf
    steps = 0

    def out_of_time() -> bool:
        nonlocal steps
        steps += 1
        return budget.left <= floor

    x = joint_descent(joint, out_of_time)
    rounds.trace.rounds += steps
    start = joint.objective(joint.start, EXACT_WEIGHT)
    objective = joint.objective(x, EXACT_WEIGHT)
    return (joint.with_values(x), objective) if objective < start else (state, start)
