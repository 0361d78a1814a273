# SPDX-License-Identifier: GPL-3.0-or-later
"""Metamers that stay metamers as paint: criterion rows for Kubelka-Munk tints, and the design with them.

A tint's reflectance is no linear function of the paint's, so its color is linearized around the present reflectances
(Gauss-Newton); each step is a palette problem with more rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.requests import Requests, compiled_requests
from spectral_core.palette.assemble.side import COLOR_NORM, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.design.rounds import SolveTrace
from spectral_core.palette.distinct.cells import wants_distinct
from spectral_core.palette.given import sequence_of
from spectral_core.palette.paint.mixtures import base_on, paint_mixture, paint_slope, tint_differences
from spectral_core.palette.problem import CellIndex, PaletteProblem
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.block import Block
from spectral_core.palette.qp.engine import solve
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.palette.report import reported
from spectral_core.palette.solution import PaletteSolution, PaletteStatus
from spectral_core.palette.solve import solve_palette

Array = NDArray[np.float64]

STEP_LIMIT, LAST_STEP = 0.2, 1e-4
"""First and least trust region of a tint design: how far a reflectance may move in one step."""
SETTLED = 1e-6
"""Relative change of the objective below which a tint design stops."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class TintCriterion:
    """Cells that match should also match as tints: mixed as paint, at ``levels``, into ``base``.

    ``base``: reflectance, a number or (n,) on the palette's grid; ``weight``: relative to the cells' own.
    """

    base: Array | float = 0.9
    levels: tuple[float, ...] = (0.75, 0.5, 0.25)
    weight: float = 1.0

    def __post_init__(self) -> None:
        base = frozen_array("the base of tints", np.atleast_1d(self.base), (None,))
        object.__setattr__(self, "base", base)
        base_on(base, max(base.size, 1))
        object.__setattr__(self, "levels", sequence_of("the levels of tints", self.levels))
        if not self.levels:
            raise InvalidInputError("a design with tints needs at least one level, such as 0.5; got none")
        for level in self.levels:
            require_range("a tint level", level, 1e-3, 1.0)
        require_range("the weight of tints", self.weight, 0.0, 1e30)

    def base_on(self, size: int) -> Array:
        """The base at every sample of the grid, (n,)."""
        return base_on(self.base, size)


def with_tints(builder: Assembler, linked: Quadratic, state: PaletteState, criterion: TintCriterion) -> Quadratic:
    """The reflectances' problem with the rows of tints, linearized at the state's reflectances.

    One more free color per group of matching cells and level: the common color of their tints.
    """
    size = builder.problem.grid.size
    base = criterion.base_on(size)
    numbers = {item: k for k, item in enumerate(builder.free_items("reflectances"))}
    by_light = state.light_matrices()[0]
    knots = builder.problem.grid.wavelengths_nm
    rows: dict[int | None, list[tuple[int, Array, Array, float]]] = {k: [] for k in (None, *numbers.values())}
    count = len(linked.color_lower)
    for members in matching_cells(builder.requests):
        if not any(cell[0] in numbers for cell in members):
            continue
        for level in criterion.levels:
            for (i, j), weight in members.items():
                given = builder.problem.reflectances[i].spectrum
                paint = state.reflectances[i] if given is None else given.at(knots)
                assert paint is not None
                tint = paint_mixture([level, 1 - level], np.stack([paint, base]))
                slope = paint_slope(level, paint, base)
                squared = (criterion.weight * weight / COLOR_NORM) ** 2
                held = tint - slope * paint if i in numbers else tint
                rows[numbers.get(i)].append((count, by_light[j] * slope, -by_light[j] @ held, squared))
            count += 1
    added = np.full((count - len(linked.color_lower), 3), np.inf)
    known = [(column, target, weight) for column, _, target, weight in rows[None]]
    return Quadratic(
        tuple(_tinted(block, rows[k], 3 * count) for k, block in enumerate(linked.blocks)),
        np.concatenate([linked.color_lower, -added]),
        np.concatenate([linked.color_upper, added]),
        np.concatenate([_wider(linked.known_ties, 3 * count), *(_tie(column, count) for column, _, _ in known)]),
        np.concatenate([linked.known_targets, *(target for _, target, _ in known)]),
        np.concatenate([linked.known_weights, *(np.full(3, weight) for _, _, weight in known)]),
    )


def _tinted(block: Block, rows: list[tuple[int, Array, Array, float]], colors: int) -> Block:
    """A block with more rows, and columns for more free colors."""
    return replace(
        block,
        rows=np.concatenate([block.rows, *(matrix for _, matrix, _, _ in rows)]),
        targets=np.concatenate([block.targets, *(target for _, _, target, _ in rows)]),
        ties=np.concatenate([_wider(block.ties, colors), *(_tie(column, colors // 3) for column, *_ in rows)]),
        weights=np.concatenate([block.weights, *(np.full(3, weight) for *_, weight in rows)]),
    )


def _wider(ties: Array, colors: int) -> Array:
    return np.pad(ties, ((0, 0), (0, colors - ties.shape[1])))


def _tie(column: int, count: int) -> Array:
    tie = np.zeros((3, 3 * count))
    tie[:, 3 * column : 3 * column + 3] = np.eye(3)
    return tie


def matching_cells(requests: Requests) -> list[dict[CellIndex, float]]:
    """Cells that should look the same, with their weights: those tied, and those of one color under one light."""
    tied = [dict(zip(group.members, group.weights, strict=True)) for group in requests.groups]
    same: dict[tuple[int, bytes], dict[CellIndex, float]] = {}
    for target in requests.targets:
        same.setdefault((target.cell[1], target.color.tobytes()), {})[target.cell] = target.weight
    return [cells for cells in (*tied, *same.values()) if len(cells) > 1]


def solve_with_tints(
    problem: PaletteProblem,
    criterion: TintCriterion | None = None,
    *,
    warm: PaletteSolution | None = None,
    iterations: int = 40,
) -> PaletteSolution:
    """A palette whose matching cells also match as tints (Kubelka-Munk), as nearly as the other requests allow.

    Starts with solve_palette, holds the lights, and takes Gauss-Newton steps within a trust region; each step is a
    palette problem with more rows, and is kept only if the true objective decreases. ``warm``: a solution from which
    solve_palette continues. Raises InvalidInputError if cells are "distinct", or reflectances may leave 0 to 1.
    """
    started = perf_counter()
    require_kind("the palette", problem, PaletteProblem)
    criterion = TintCriterion() if criterion is None else criterion
    require_kind("the criterion of tints", criterion, TintCriterion)
    iterations = require_whole("iterations", iterations, 0, 100_000)
    criterion.base_on(problem.grid.size)
    if wants_distinct(problem):
        raise InvalidInputError("tints are not designed together with 'distinct' cells; make those 'fixed' or 'ignore'")
    if problem.reflectance_bounds[0] < 0 or problem.reflectance_bounds[1] > 1:
        raise InvalidInputError(
            f"tints are mixed from paints, which reflect from 0 to 1, but reflectances are bounded by "
            f"{problem.reflectance_bounds}; bound them by 0 and 1, or design without tints"
        )
    first = solve_palette(problem, warm=warm)
    if not first.status.usable:
        return replace(first, notes=(*first.notes, "tints are not matched, because the other cells cannot be met"))
    builder = Assembler(problem, compiled_requests(problem))
    state: PaletteState = first.state
    trace = SolveTrace(notes=[*first.notes, "tints are matched with the lights held"])
    if len(builder.requests.conditions) > 1:
        trace.notes.append("tints are matched for the first observer, under the lights themselves, not their variants")
    for _, answer in (first.state.record or {}).values():
        trace.joint = trace.joint | answer.check
    quadratic = _without_tints(builder, state)
    objective, reach, settled = _tint_objective(builder, quadratic, state, criterion), STEP_LIMIT, False
    for number in range(1, iterations + 1):
        answer, trial = _tint_step(builder, quadratic, state, criterion, reach)
        found = _tint_objective(builder, quadratic, trial, criterion)
        if not answer.check.passed or found >= objective:
            reach /= 3
            if reach < LAST_STEP:
                break
            continue
        settled = objective - found < SETTLED * objective
        state, objective, reach = trial, found, min(2 * reach, 1.0)
        trace.add("reflectances", answer, 0.0)
        trace.rounds, trace.joint = number, answer.check
        if settled:
            break
        if problem.match == "perceptual":  # CIELAB is linearized anew
            quadratic = _without_tints(builder, state)
            objective = _tint_objective(builder, quadratic, state, criterion)
    if trace.rounds == iterations and not settled:
        trace.notes.append(f"the match of tints may still improve; its design ended after step {iterations}")
    trace.timings["total"] = perf_counter() - started
    solution = reported(builder, state, trace)
    if first.status is PaletteStatus.IMPROVING and solution.status.trusted:  # the lights are as they were
        solution = replace(solution, status=first.status, remedy=first.remedy)
    worst = largest_tint_difference(solution, criterion)
    return replace(solution, residuals={**solution.residuals, "tint_delta_e_2000": worst})


def _without_tints(builder: Assembler, state: PaletteState) -> Quadratic:
    perceptual = builder.problem.match == "perceptual"
    return builder.assembled("reflectances", state, perceptual=perceptual).quadratic


def largest_tint_difference(solution: PaletteSolution, criterion: TintCriterion) -> float:
    """Largest ΔE2000 between tints of cells under one light with equal requested colors; 0 without such cells."""
    worst = 0.0
    for members in matching_cells(compiled_requests(solution.problem)):
        for a, b in combinations(members, 2):
            if a[1] == b[1]:
                found = tint_differences(solution, [(a[0], b[0])], base=criterion.base, levels=criterion.levels)
                worst = max(worst, float(found[:, 0, a[1]].max()))
    return worst


def _tint_step(
    builder: Assembler, quadratic: Quadratic, state: PaletteState, criterion: TintCriterion, reach: float
) -> tuple[Answer, PaletteState]:
    items = builder.free_items("reflectances")
    wider = with_tints(builder, quadratic, state, criterion)
    held = []
    for item, block in zip(items, wider.blocks, strict=True):
        here = state.reflectances[item]
        assert here is not None
        near = np.maximum(block.lower, here - reach), np.minimum(block.upper, here + reach)
        held.append(replace(block, lower=near[0], upper=near[1]))
    answer = solve(replace(wider, blocks=tuple(held)))
    return answer, state.with_values("reflectances", dict(zip(items, answer.values, strict=True)))


def _tint_objective(builder: Assembler, quadratic: Quadratic, state: PaletteState, criterion: TintCriterion) -> float:
    """Half the sum of squares of all soft rows at a state, tints by Kubelka-Munk itself, free colors at their
    optimum. ``quadratic``: of the reflectances, without tints.
    """
    # Linearized at the state itself, the tints' rows are exact there.
    linked = with_tints(builder, quadratic, state, criterion)
    values = [state.reflectances[item] for item in builder.free_items("reflectances")]
    blocks = [each for each in values if each is not None]
    return linked.objective(linked.joined(linked.best_colors(blocks), blocks))
