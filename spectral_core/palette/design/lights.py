# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights designed together with reflectances, by variable projection (Golub and Pereyra 1973).

Given the lights l, the best reflectances r(l) are a convex problem. There remains φ(l) = min over r of F(r, l), whose
gradient is ∂F/∂l at r(l) (the envelope theorem), so that L-BFGS-B within the bounds of the lights takes tens of
milliseconds for a result that needs thousands of rounds by alternation. φ is not convex: if the given lights do not
meet the targets at once, a short race between several starts selects the one to continue.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.requests import Requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.design.fast_lights import PlainPalette
from spectral_core.palette.design.projected import Projected, known
from spectral_core.palette.design.rounds import Budget
from spectral_core.palette.problem import PaletteProblem

Array = NDArray[np.float64]

STARTS = 8
"""Starts of the race, the lights as given among them."""
RACE_SHARE = 0.025
"""Share of the time budget that each start has in each heat of the race."""
GOOD_RMS = 5e-3
"""Root mean square color error, in linear RGB, at which the lights as given need no race."""
MEMORY = 20
"""Pairs of steps and gradients that L-BFGS-B keeps."""
STALLED = 1e-10
"""Relative fall of φ in one iteration below which L-BFGS-B stops."""
MOST_ITERATIONS = 10_000
MOST_HELD = 250
"""Unknowns of designed lights up to which SLSQP keeps their whites; its time grows with the cube of their number."""
HELD_LIMIT = 1e-9
"""Error of the white of a light, relative to its largest value, up to which a descent takes it."""


CHECK_SECONDS, MOST_EVALUATIONS = 8e-3, 20
"""Time between two readings of the processor time, and most evaluations of φ between them: on some machines a reading
takes a tenth of a short evaluation.
"""


class _OutOfTime(Exception):
    """Raised inside L-BFGS-B at the end of the time budget."""


@dataclass(eq=False)
class _Found:
    """The best lights of one descent."""

    state: PaletteState
    objective: float


def outer_side(problem: PaletteProblem, requests: Requests) -> Side | None:
    """The side that L-BFGS-B moves, while the other is solved; None if neither way applies.

    Only bounds, and the white and luminance of lights, may restrict the outer side. Exact cells of measured
    reflectances under designed lights therefore make the lights the inner side, and reflectances the outer one. So do
    lights that must look white, unless exact cells of the reflectances would leave them no choice and the lights have
    few unknowns.
    """
    several = len(problem.observers) > 1 or any(light.variants for light in problem.lights)
    if problem.subspace is not None or (problem.robustness == "worst_case" and several):
        return None
    cells = [cell for row in problem.cells for cell in row]
    if problem.match != "linear" and any(cell.others or cell.box is not None for cell in cells):
        return None  # the metric of free colors moves with them, so that φ has no gradient of this form
    exact = [target.cell for target in requests.targets if target.exact]
    exact += [cell for group in requests.groups for cell, held in zip(group.members, group.exact, strict=True) if held]
    held = any(light.white_xyz is not None or light.luminance is not None for light in problem.lights if light.free)
    unknowns = sum(len(light.primaries) or problem.grid.size for light in problem.lights if light.free)
    moves = not held or (bool(exact) and unknowns <= MOST_HELD)
    if moves and all(problem.reflectances[i].free for i, _ in exact):
        return "lights"
    return "reflectances" if all(problem.lights[j].free for _, j in exact) else None


def held_lights(assembler: Assembler, state: PaletteState) -> tuple[Array, Array] | None:
    """Rows and right sides of the equalities of all designed lights, each row relative to its largest number; None if
    there are none.
    """
    blocks = assembler.assembled("lights", state, perceptual=False).quadratic.blocks
    parts = [block.rows[3 * len(block.keys) :] for block in blocks]
    if not any(len(part) for part in parts):
        return None
    from scipy.linalg import block_diag

    rows = block_diag(*parts)
    right = np.concatenate([block.targets[3 * len(block.keys) :] for block in blocks])
    size = np.maximum(np.abs(rows).max(axis=1), 1e-300)
    return rows / size[:, None], right / size


class LightDescent:
    """L-BFGS-B on φ; SLSQP where lights must look white or keep their luminance."""

    def __init__(self, assembler: Assembler, state: PaletteState, outer: Side) -> None:
        self.assembler = assembler
        self.evaluations = 0
        self._took = 0.0
        """Seconds of the last evaluation that was timed."""
        self._outer = outer
        self._items = assembler.free_items(outer)
        values = [known(getattr(state, outer)[j]) for j in self._items]
        self._ends = np.cumsum([each.size for each in values])[:-1]
        # Lights have any unit; the first step of L-BFGS-B needs numbers near 1.
        self._unit = max(float(np.mean(np.abs(np.concatenate(values)))), 1e-12)
        perceptual = assembler.problem.match == "perceptual"
        plain = PlainPalette.of(assembler, perceptual=perceptual) if outer == "lights" else None
        self._held = held_lights(assembler, state) if outer == "lights" else None
        self._phi: Callable[[PaletteState], tuple[float, Array, PaletteState]]
        self._phi = plain.objective if plain is not None else Projected(assembler, outer).objective
        self.plain = plain is not None
        """True if φ takes a fraction of a millisecond."""

    def raced(self, state: PaletteState, budget: Budget, share: float) -> PaletteState:
        """The best state after a race of several starts; the winner continues until a share of the budget.

        The race has heats: in each, every start descends for a short time, and the better half goes on. There is no
        race if ``state`` soon reaches the colors.
        """
        end = (1.0 - share) * budget.seconds
        heat = RACE_SHARE * budget.seconds
        runners = [self.down(state, budget, heat)]
        if self.assembler.color_rms(runners[0].state) > GOOD_RMS:
            rng = np.random.default_rng(0)
            while len(runners) < STARTS and budget.left > end + self._took:
                runners.append(self.down(self.scattered(state, rng), budget, heat))
        while True:
            runners = sorted(runners, key=lambda each: each.objective)[: max(1, len(runners) // 2)]
            if len(runners) == 1 or budget.left <= end + len(runners) * self._took:
                break
            runners = [self.down(each.state, budget, heat) for each in runners]
        best = runners[0]
        if budget.left > end + self._took:
            best = self.down(best.state, budget, budget.left - end)
        return best.state

    def solved(self, state: PaletteState) -> PaletteState:
        """The state with the best inner side for its outer one."""
        return self._phi(state)[2]

    def down(self, state: PaletteState, budget: Budget, seconds: float) -> _Found:
        """Descend from a state for some seconds of the budget."""
        from scipy.optimize import minimize

        begun = budget.left
        state = self._allowed(state)
        objective, _, found = self._phi(state)
        best = _Found(found, objective)
        # L-BFGS-B compares decreases below 1 with 1: the objective is divided by its present size.
        size = max(objective, 1e-300)
        self._took = took = begun - budget.left
        floor = max(begun - seconds, 0.0) + took
        every = int(np.clip(CHECK_SECONDS / max(took, 1e-9), 1, MOST_EVALUATIONS))

        def phi(scaled: Array) -> tuple[float, Array]:
            if self.evaluations % every == 0 and budget.left <= floor:
                raise _OutOfTime
            self.evaluations += 1
            objective, gradient, found = self._phi(self._with_lights(state, self._unit * scaled))
            if objective < best.objective and self._is_allowed(scaled):
                best.objective, best.state = objective, found
            return objective / size, self._unit / size * gradient

        begin = np.concatenate([known(getattr(state, self._outer)[j]) for j in self._items]) / self._unit
        limits = self._limits(state)
        options = {
            "maxcor": MEMORY,
            "ftol": STALLED,
            "gtol": 0.0,
            "maxiter": MOST_ITERATIONS,
            "maxfun": MOST_ITERATIONS,
        }
        with suppress(_OutOfTime):
            if self._held is None:
                minimize(phi, begin, jac=True, method="L-BFGS-B", bounds=limits, options=options)
            else:
                options = {"ftol": STALLED, "maxiter": MOST_ITERATIONS}
                minimize(
                    phi, begin, jac=True, method="SLSQP", bounds=limits, constraints=self._equality(), options=options
                )
        return best

    def _equality(self) -> dict[str, Any]:
        """The white and luminance of the lights, for scipy."""
        assert self._held is not None
        rows, right = self._held
        return {"type": "eq", "fun": lambda scaled: rows @ scaled - right / self._unit, "jac": lambda _: rows}

    def _is_allowed(self, scaled: Array) -> bool:
        if self._held is None:
            return True
        rows, right = self._held
        miss = np.abs(rows @ scaled - right / self._unit).max(initial=0.0)
        return bool(miss <= HELD_LIMIT * max(float(np.abs(scaled).max()), 1.0))

    def _allowed(self, state: PaletteState) -> PaletteState:
        """The state with the nearest lights of the required white and luminance."""
        from scipy.optimize import minimize

        values = np.concatenate([known(getattr(state, self._outer)[j]) for j in self._items]) / self._unit
        if self._is_allowed(values):
            return state
        found = minimize(
            lambda x: (0.5 * float((x - values) @ (x - values)), x - values),
            values,
            jac=True,
            method="SLSQP",
            bounds=self._limits(state),
            constraints=self._equality(),
        )
        return self._with_lights(state, self._unit * found.x) if self._is_allowed(found.x) else state

    def _ends_of(self, state: PaletteState, item: int) -> tuple[Array, Array]:
        """Least and greatest values of a spectrum of the outer side."""
        problem = self.assembler.problem
        if self._outer == "lights":
            return state.light_limits(item, problem.light_bounds)
        low, high = problem.reflectance_bounds
        return np.full(problem.grid.size, low), np.full(problem.grid.size, high)

    def _limits(self, state: PaletteState) -> list[tuple[float, float]]:
        """Bounds of all unknowns of the outer side, in its unit, for scipy."""
        ends = [self._ends_of(state, item) for item in self._items]
        return [pair for low, high in ends for pair in zip(low / self._unit, high / self._unit, strict=True)]

    def _with_lights(self, state: PaletteState, values: Array) -> PaletteState:
        return state.with_values(self._outer, dict(zip(self._items, np.split(values, self._ends), strict=True)))

    def scattered(self, state: PaletteState, rng: np.random.Generator) -> PaletteState:
        """The outer side drawn at random sample by sample, each spectrum with its previous mean."""
        values = {}
        for j in self._items:
            old = known(getattr(state, self._outer)[j])
            values[j] = np.clip(2.0 * np.mean(np.abs(old)) * rng.uniform(size=old.size), *self._ends_of(state, j))
        return state.with_values(self._outer, values)
