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

from spectral_core.checks import require_kind, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.assemble.limits import OPEN
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState, initial_state
from spectral_core.palette.brightness_unit import brightness_unit, from_unit, in_unit
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.distinct.search import distinct_solutions
from spectral_core.palette.inaccurate import unlit
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.report import bound_violation, criterion_residuals, designed_reflectance, state_errors
from spectral_core.palette.solution import PaletteSolution
from spectral_core.palette.solve import solve_palette
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, lab_jacobian_from_linear_rgb
from spectral_core.spectra.observer import linear_rgb_from_product, normalized, observer
from spectral_core.spectra.spectrum import Illuminant, Reflectance

Array = NDArray[np.float64]

TRIED = 20
"""Directions of color in which each material is moved; the solutions farthest from each other are kept."""
ROUGHEST = 0.12
"""Largest second difference of an alternative between knots of 10 nm, unless the solution itself exceeds it."""
DEPENDENT = 1e-8
"""Size of a combination of held colors, relative to the largest, below which the others hold it."""
ELSEWHERE = ("A", "FL11", "HP1")
"""Lamps under which alternatives differ if every light of the table has requests."""


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """``solution``; ``apart``: largest ΔE2000 of any material to the first answer, under the lights ``seen_under``."""

    solution: PaletteSolution
    apart: float
    seen_under: tuple[Illuminant, ...]


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
    solution : of ``problem`` with its locked rows, if it is known, which saves a solve; one of a palette that is solved
        in a unit of its own is not used.
    seed : of the random directions.

    Raises
    ------
    InvalidInputError : everything is measured or locked, or the palette has no trustworthy solution.
    """
    wanted = require_whole("count", count, 2, 12)
    require_kind("the palette", problem, PaletteProblem)
    if solution is not None:
        require_kind("the solution", solution, PaletteSolution, "from solve_palette")
    held = _locked(problem, locked)
    seed = require_whole("seed", seed, 0, 1 << 62)
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
        return _chosen(list(found), wanted, range(len(problem.lights)))
    if (unit := brightness_unit(problem)) != 1:
        in_own_unit = alternatives(in_unit(problem, unit), count=wanted, seed=seed)
        return tuple(replace(each, solution=from_unit(each.solution, problem, unit)) for each in in_own_unit)
    first = solution if solution is not None and not held else solve_palette(problem, explain=False)
    if not first.status.usable:
        raise InvalidInputError(f"the palette has no solution to vary: {first.remedy}")
    rng = np.random.default_rng(seed)
    builder, state = Assembler(problem, compiled_requests(problem)), _state_of(first)
    pushers = {i: _Pusher(builder, state, i) for i in builder.free_items("reflectances")}
    tried = [first]
    for _ in range(TRIED):
        values = {i: pusher.pushed(rng.normal(size=(len(pusher.rows), 3))) for i, pusher in pushers.items()}
        tried.append(_with_reflectances(first, builder, state.with_values("reflectances", values)))
    return _chosen(tried, wanted, sorted({column for pusher in pushers.values() for column in pusher.shown}))


def _locked(problem: PaletteProblem, locked: Mapping[int, Reflectance] | None) -> dict[int, Reflectance]:
    require_kind("the locked reflectances", {} if locked is None else locked, Mapping, "from numbers to reflectances")
    held = dict(locked or {})
    count = len(problem.reflectances)
    for number, reflectance in held.items():
        if not isinstance(number, int | np.integer) or not 0 <= number < count:
            raise InvalidInputError(f"reflectance {number!r} is locked; expected numbers from 0 to {count - 1}")
        require_kind(f"locked reflectance {number}", reflectance, Reflectance)
    return held


def _state_of(solution: PaletteSolution) -> PaletteState:
    """The spectra of a solution as a solver holds them; a solution from a file has no state of its own."""
    if solution.state is not None:
        return replace(solution.state, record=None)
    problem, state = solution.problem, initial_state(solution.problem)
    lights = {}
    for j, light in enumerate(problem.lights):
        if light.free:
            amounts, units, own = solution.amounts[j], state.given.units[j], solution.illuminants[j].values
            lights[j] = np.asarray(own if amounts is None or units is None else amounts * units)
    surfaces = {i: solution.reflectances[i].values for i, item in enumerate(problem.reflectances) if item.free}
    state = replace(state, light_scale=solution.light_scale).with_values("lights", lights)
    return state.with_values("reflectances", surfaces)


class _Pusher:
    """Moves one reflectance along a direction of color under the lights without requests; requested colors are held,
    for all observers and variants for which they are requested, and those of a range stay in it.
    """

    def __init__(self, builder: Assembler, state: PaletteState, item: int) -> None:
        problem, requests = builder.problem, builder.requests
        found = state.reflectances[item]
        assert found is not None  # of a free reflectance
        self.values = found
        matrices = [state.light_matrices(each.variant)[each.observer] for each in requests.conditions]
        targets = {target.cell[1] for target in requests.targets if target.cell[0] == item}
        everywhere = {target.cell[1] for target in requests.blacks if target.cell[0] == item}
        ranges: dict[int, Array] = {}
        for group in requests.groups:
            columns = {column for row, column in group.members if row == item}
            if len(group.members) > 1:
                everywhere |= columns
            else:  # a free color in a range; its only request is the range, for the first observer
                ranges |= dict.fromkeys(columns - targets, group.box)
        held = [matrices[0][column] for column in sorted(targets | everywhere)]
        held += [rows[column] for rows in matrices[1:] for column in sorted(everywhere)]
        self.held = _independent(np.concatenate([np.empty((0, self.values.size)), *held]))
        in_range = [matrices[0][column] for column in ranges]
        self.ranged = np.concatenate([np.empty((0, self.values.size)), *in_range])
        self.range = np.concatenate([np.empty((2, 0)), *ranges.values()], axis=1)
        self.shown = [column for column in range(len(problem.lights)) if column not in targets | everywhere]
        """Columns without a request, or with a range."""
        kernel = color_kernel(problem.grid, problem.observers)
        lamps = [kernel.matrix_of(lamp)[0] for lamp in ([] if self.shown else _elsewhere())]
        self.rows = [matrices[0][column] for column in self.shown] or lamps
        self.second = np.diff(np.eye(self.values.size), 2, axis=0)
        step = float(np.diff(problem.grid.wavelengths_nm).mean()) / 10.0
        own = np.abs(self.second @ self.values).max(initial=0.0)
        self.limit = max(ROUGHEST * min(step, 1.0) ** 2, float(own))
        # Without bounds a reflectance stays where it is, and otherwise between 0 and 1.
        low, high = problem.reflectance_bounds
        self.least = max(low, min(0.0, float(self.values.min())))
        self.most = min(high, max(1.0, float(self.values.max())))

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
        color, shown = self.held @ self.values, self.ranged @ self.values
        bends = np.full(len(self.second), self.limit)
        # A color that misses its range already may go no farther from it.
        low, high = np.minimum(self.range[0], shown), np.maximum(self.range[1], shown)
        upper = np.concatenate([np.full(size, self.most), color, np.minimum(high, OPEN), bends])
        lower = np.concatenate([np.full(size, self.least), color, np.maximum(low, -OPEN), -bends])
        sense = np.zeros(upper.size, dtype=np.int32)
        sense[size : size + color.size] = 5
        rows = np.ascontiguousarray(np.concatenate([self.held, self.ranged, self.second]))
        found, _, status, _ = daqp.solve(hessian, linear - 1e-5 * self.values, rows, upper, lower, sense)
        return np.clip(found, self.least, self.most) if status in (1, 2) else self.values


def _independent(rows: Array) -> Array:
    """Orthonormal rows with the same null space: rows of several observers are nearly dependent."""
    if not rows.size:
        return rows
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    return np.asarray(directions[sizes > DEPENDENT * sizes[0]])


def _elsewhere() -> list[Illuminant]:
    return [normalized(illuminant(name)) for name in ELSEWHERE]


def _with_reflectances(solution: PaletteSolution, builder: Assembler, state: PaletteState) -> PaletteSolution:
    """The solution with the reflectances of a state; its colors and errors are computed again."""
    problem, requests = builder.problem, builder.requests
    actual, errors = state.colors(), state_errors(problem, requests, state)
    residuals = criterion_residuals(builder, state, errors.target_linear_rgb, actual)
    if requests.groups:
        residuals["worst_pair_delta_e_2000"] = errors.worst_pair_delta_e_2000
    return replace(
        solution,
        reflectances=tuple(designed_reflectance(problem, state, i) for i in range(len(problem.reflectances))),
        actual_linear_rgb=actual,
        target_linear_rgb=errors.target_linear_rgb,
        delta_e_2000=errors.delta_e_2000,
        residuals={**solution.residuals, **residuals},
        bound_violation=bound_violation(problem, state),
        notes=(
            *(note for note in solution.notes if note not in unlit(problem, _state_of(solution))),
            *unlit(problem, state),
        ),
        state=state,
    )


def _chosen(tried: Sequence[PaletteSolution], count: int, columns: Sequence[int]) -> tuple[Alternative, ...]:
    """The first, then repeatedly the one that is farthest from all chosen ones, seen under some lights of the table;
    without these under common lamps.
    """
    lights = tuple(Illuminant(each.name, each.grid, each.values) for each in (tried[0].illuminants[k] for k in columns))
    lights = lights or tuple(_elsewhere())
    labs = [_seen(solution, lights) for solution in tried]
    differences = np.array([[float(delta_e_2000(a, b).max(initial=0.0)) for b in labs] for a in labs])
    chosen = [0]
    while len(chosen) < min(count, len(tried)):
        nearest = differences[:, chosen].min(axis=1)
        best = int(nearest.argmax())
        if nearest[best] < 0.5:
            break  # the requests leave no further visible difference
        chosen.append(best)
    return tuple(Alternative(tried[k], float(differences[0, k]), lights) for k in chosen)


def _seen(solution: PaletteSolution, lights: Sequence[Illuminant]) -> Array:
    """CIELAB (materials, lights, 3)."""
    viewer = observer(solution.problem.observers[0])
    colors = [
        [linear_rgb_from_product(light, item.grid, viewer) @ item.values for light in lights]
        for item in solution.reflectances
    ]
    # Colors outside of the display's gamut differ as well.
    return np.asarray(lab_from_linear_rgb(np.array(colors)))
