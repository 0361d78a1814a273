# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternative solutions of one palette: all meet the requests as well as the first solution, and differ in other
colors.

If the requests do not determine the reflectances, one solution is one of many. The search finds those that differ most
in color under the lights whose cells are free or ignored; without such cells, under other common lamps. For "distinct"
cells the alternatives are the results of the local searches.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.cell import CellMode
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.distinct.search import distinct_solutions
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.report import state_errors
from spectral_core.palette.solution import PaletteSolution
from spectral_core.palette.solve import solve_palette
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, lab_jacobian_from_linear_rgb
from spectral_core.spectra.observer import linear_rgb_from_product, normalized
from spectral_core.spectra.spectrum import Illuminant, Reflectance

Array = NDArray[np.float64]

TRIED = 20
"""Directions of color in which each material is moved; the solutions farthest from each other are kept."""
ROUGHEST = 0.12
"""Largest second difference of an alternative between knots of 10 nm, unless the solution itself exceeds it."""
ELSEWHERE = ("A", "FL11", "HP1")
"""Lamps under which alternatives differ if every light of the table has requests."""


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """``solution``; ``apart``: largest ΔE2000 of any material to the first answer, under ``seen_under``."""

    solution: PaletteSolution
    apart: float
    seen_under: tuple[str, ...]


def alternatives(
    problem: PaletteProblem,
    *,
    count: int = 4,
    locked: Mapping[int, Reflectance] | None = None,
    solution: PaletteSolution | None = None,
    seed: int = 0,
) -> tuple[Alternative, ...]:
    """Find up to ``count`` different solutions, the plain solution first.

    Parameters
    ----------
    problem : the palette.
    count : answers, 2 to 12.
    locked : reflectances by number that are kept as they are in all answers.
    solution : of ``problem`` with its locked rows, if it is known; None: it is solved here.
    seed : of the random directions.

    Raises
    ------
    InvalidInputError : everything is measured or locked, or the palette has no trustworthy solution.
    """
    wanted = int(require_range("count", count, 2, 12))
    held = dict(locked or {})
    problem = replace(
        problem,
        reflectances=tuple(
            replace(item, spectrum=held[i]) if i in held else item for i, item in enumerate(problem.reflectances)
        ),
    )
    if not any(item.free for item in problem.reflectances):
        raise InvalidInputError("every material is measured or locked, so there is only one solution; unlock one")
    if wants_distinct(problem):
        found = distinct_solutions(problem, starts=max(wanted, 6), seed=seed)
        return _chosen(list(found), wanted, [light.name for light in problem.lights])
    first = solution if solution is not None and not held else solve_palette(problem, explain=False)
    if not first.status.usable:
        raise InvalidInputError(f"the palette has no solution to vary: {first.remedy}")
    rng = np.random.default_rng(seed)
    pushers = {i: _Pusher(first, i) for i, item in enumerate(problem.reflectances) if item.free}
    tried = [first]
    for _ in range(TRIED):
        values = {i: pusher.pushed(rng.normal(size=(len(pusher.rows), 3))) for i, pusher in pushers.items()}
        tried.append(_with_reflectances(first, values))
    names = sorted({name for pusher in pushers.values() for name in pusher.names})
    return _chosen(tried, wanted, names)


class _Pusher:
    """Moves one reflectance along a direction of color under the free lights; requested colors are held."""

    def __init__(self, solution: PaletteSolution, item: int) -> None:
        problem = solution.problem
        self.values = np.asarray(solution.reflectances[item].values, dtype=np.float64)
        lights = [Illuminant(light.name, light.grid, light.values) for light in solution.illuminants]
        # A cell that another one refers to counts as requested in any mode.
        referred = {other for row in problem.cells for cell in row for other in cell.others}
        shown = [
            k
            for k, cell in enumerate(problem.cells[item])
            if cell.mode in (CellMode.IGNORE, CellMode.FREE) and (item, k) not in referred
        ]
        rows = [linear_rgb_from_product(light, problem.grid) for light in lights]
        self.held = np.concatenate(
            [rows[k] for k in range(len(rows)) if k not in shown] or [np.empty((0, self.values.size))]
        )
        seen = [lights[k] for k in shown] or [normalized(illuminant(name)) for name in ELSEWHERE]
        self.names = [light.name for light in seen]
        self.rows = [linear_rgb_from_product(light, problem.grid) for light in seen]
        self.second = np.diff(np.eye(self.values.size), 2, axis=0)
        step = float(np.diff(problem.grid.wavelengths_nm).mean()) / 10.0
        own = np.abs(self.second @ self.values).max(initial=0.0)
        self.limit = max(ROUGHEST * min(step, 1.0) ** 2, float(own))

    def pushed(self, direction: Array) -> Array:
        """Reflectance (n,) moved as far as possible along ``direction`` (lights, 3) in CIELAB; the present one if it
        cannot move.
        """
        import daqp

        size = self.values.size
        linear = np.zeros(size)
        for rows, toward in zip(self.rows, direction, strict=True):
            linear -= toward @ lab_jacobian_from_linear_rgb(np.maximum(rows @ self.values, 1e-3)) @ rows
        linear *= 1e-1 / max(float(np.abs(linear).max()), 1e-12)
        hessian = 1e-3 * (self.second.T @ self.second) + 1e-5 * np.eye(size)
        color = self.held @ self.values
        upper = np.concatenate([np.ones(size), color, np.full(len(self.second), self.limit)])
        lower = np.concatenate([np.zeros(size), color, np.full(len(self.second), -self.limit)])
        sense = np.concatenate([np.zeros(size), np.full(len(color), 5), np.zeros(len(self.second))]).astype(np.int32)
        rows = np.ascontiguousarray(np.concatenate([self.held, self.second]))
        found, _, status, _ = daqp.solve(hessian, linear - 1e-5 * self.values, rows, upper, lower, sense)
        return np.clip(found, 0.0, 1.0) if status in (1, 2) else self.values


def _with_reflectances(solution: PaletteSolution, values: Mapping[int, Array]) -> PaletteSolution:
    """The solution with other reflectances; its colors and errors are recomputed, the requests are still met."""
    problem = solution.problem
    made = list(solution.reflectances)
    actual = np.array(solution.actual_linear_rgb)
    for i, each in values.items():
        made[i] = Reflectance(made[i].name, problem.grid, each)
        for j, light in enumerate(solution.illuminants):
            lamp = Illuminant(light.name, light.grid, light.values)
            actual[i, j] = linear_rgb_from_product(lamp, problem.grid) @ each
    solution = replace(solution, reflectances=tuple(made), actual_linear_rgb=actual)
    if solution.state is None:
        return solution
    # A cell may be the same as a free one, whose color is another now.
    state = solution.state.with_values("reflectances", dict(values))
    errors = state_errors(problem, compiled_requests(problem), state)
    return replace(solution, target_linear_rgb=errors.target_linear_rgb, delta_e_2000=errors.delta_e_2000, state=state)


def _chosen(tried: Sequence[PaletteSolution], count: int, names: Sequence[str]) -> tuple[Alternative, ...]:
    """The first, then repeatedly the one that is farthest from all chosen ones."""
    labs = [_seen(solution, names) for solution in tried]
    differences = np.array([[float(delta_e_2000(a, b).max(initial=0.0)) for b in labs] for a in labs])
    chosen = [0]
    while len(chosen) < min(count, len(tried)):
        nearest = differences[:, chosen].min(axis=1)
        best = int(nearest.argmax())
        if nearest[best] < 0.5:
            break  # the requests leave no further visible difference
        chosen.append(best)
    return tuple(Alternative(tried[k], float(differences[0, k]), tuple(names)) for k in chosen)


def _seen(solution: PaletteSolution, names: Sequence[str]) -> Array:
    """CIELAB (materials, lights, 3) under the named lights of the table, or common lamps."""
    by_name = {light.name: Illuminant(light.name, light.grid, light.values) for light in solution.illuminants}
    lights = [by_name[name] if name in by_name else normalized(illuminant(name)) for name in names]
    colors = [
        [linear_rgb_from_product(light, item.grid) @ item.values for light in lights] for item in solution.reflectances
    ]
    return np.asarray(lab_from_linear_rgb(np.maximum(np.array(colors), 0.0)))
