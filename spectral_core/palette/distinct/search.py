# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors as different as possible: "distinct" cells, by a sequence of convex programs (section 5.5.1).

The least ΔE2000 over pairs of cells is maximized under all requests of the other cells: exact metamers, bounds,
smoothness, and the display's gamut. Distances are not concave, so each step linearizes ΔE2000 of every pair around the
present colors and solves

    maximize  t·κ − ½ ||M x − y||²
    subject to  ΔE_p + ∇ΔE_p · (color(x) − color) ≥ t for every pair p,  0 ≤ linear RGB ≤ 1,
                |J (color(x) − color)| ≤ δ in CIELAB,  and the palette's own equalities and bounds

with M, y the palette's soft rows. A step that does not improve the true objective shrinks δ. The answer is a local
optimum: several starts, each spread in random directions of color, are tried. κ makes one unit of ΔE2000 worth what an
error of one unit (0.01 in linear RGB) costs in a cell.
"""

from __future__ import annotations

from collections import Counter
from copy import copy
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from spectral_core.checks import require_range
from spectral_core.errors import counted
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState, initial_state
from spectral_core.palette.design.rounds import Budget, Rounds, SolveTrace
from spectral_core.palette.design.whole import SECONDS, brightened_to_fit, designed
from spectral_core.palette.distinct.cells import DistinctCells, distinct_cells
from spectral_core.palette.distinct.starts import APART, random_spectra, searches_from_spectra, usual_starts
from spectral_core.palette.distinct.step import Step, StepAnswer, solve_step
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.qp.answer import Answer, Check
from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.palette.report import reported
from spectral_core.palette.solution import REMEDIES, PaletteSolution, PaletteStatus
from spectral_core.palette.worst_case import Shares
from spectral_core.spectra.color import lab_jacobian_from_linear_rgb

Array = NDArray[np.float64]

GAMUTS = ("all colors within the gamut", "common colors out of the gamut", "colors out of the gamut")
"""Gamuts to try in turn if a measured surface or an exact color forces another color out of the display's gamut."""
FIRST_RADIUS, LAST_RADIUS, LARGEST_RADIUS = 20.0, 0.05, 60.0
"""Radii of the trust region δ, in CIELAB."""
SETTLED = 1e-3
"""ΔE2000 by which a step must improve for another to follow."""
RIDGE = 1e-4
"""On every unknown, in ΔE2000: free colors have no other curvature."""
START_SLOPE = 100.0
"""ΔE2000 per unit of linear RGB with which a start is drawn along its directions."""


def solve_distinct(
    problem: PaletteProblem,
    *,
    starts: int | None = None,
    seed: int = 0,
    warm: PaletteSolution | None = None,
    engine: str = "piqp",
) -> PaletteSolution:
    """The palette with its "distinct" cells as different as possible (``residuals["least_delta_e_2000"]``).

    ``starts``: local searches along random directions, the best of which is kept: 6 by default, none if ``warm`` has
    distinct colors already; with ``warm`` one more begins at its spectra. For two distinct cells, 6 starts or more
    have 6 others at random spectra. ``engine``: ``"piqp"``, or ``"cvxpy"``, the same step for a general
    solver. Free lights are designed for the other cells first (from those of ``warm``, if it solves another problem),
    then held. Raises InvalidInputError if no cell with a free reflectance is "distinct".
    """
    return distinct_solutions(problem, starts=starts, seed=seed, warm=warm, engine=engine)[0]


def distinct_solutions(
    problem: PaletteProblem,
    *,
    starts: int | None = None,
    seed: int = 0,
    warm: PaletteSolution | None = None,
    engine: str = "piqp",
) -> tuple[PaletteSolution, ...]:
    """The results of all local searches of ``solve_distinct``, the best first; one solution if nothing was found."""
    started = perf_counter()
    requests = compiled_requests(problem)
    builder = Assembler(problem, requests)
    trace = SolveTrace(notes=list(requests.notes))
    state = initial_state(problem, None if warm is None else warm.state)
    starts = usual_starts(problem, warm) if starts is None else starts
    require_range("starts", starts, 0 if warm is not None else 1, 10_000)
    if problem.scale_lights:
        state = brightened_to_fit(builder, state, trace, warm)
    begun = state
    if warm is None or _asks_anew_of_lights(builder, warm):
        state = _others_first(builder, state, trace)
    if any(answer.infeasible or not answer.check.passed for answer in trace.answers.values()):
        trace.notes.append("the cells beside the distinct ones cannot be met, so no colors were made distinct")
        return (_reported(builder, state, trace, apart=False),)
    if problem.robustness == "worst_case" and len(requests.conditions) > 1:
        # The shares of the design without distinct cells belong to its errors, which are often 0 with any shares.
        builder.shares = Shares()
        trace.notes.append(
            "beside distinct cells, further observers and variants count on average, not by their worst case"
        )
    phase = builder.assembled("reflectances", state, perceptual=problem.match == "perceptual")
    cells = distinct_cells(builder, state, phase)
    given = None if warm is None else np.concatenate([_known(begun.reflectances[item]) for item in phase.items])
    found, gamut = _searched(
        phase.quadratic, cells, engine, (starts, searches_from_spectra(problem, starts), seed, given)
    )
    if not found:
        state = state if warm is None else _others_first(builder, state, trace)
        trace.notes.append("the distinct cells cannot be met together with the others, so no colors were made distinct")
        return (_reported(builder, state, trace, apart=False),)
    if gamut != GAMUTS[0]:
        trace.notes.append(f"{gamut}: the requests of the other cells force a color out of the display's gamut")
    made = []
    for rank, each in enumerate(sorted(found, key=lambda each: -each.merit)):
        own = copy(trace)
        _, blocks = phase.quadratic.split(each.x)
        kept = Answer(tuple(blocks), np.zeros((0, 3)), (), each.check, (engine,) * len(found))
        own.answers, own.joint, own.settled = {"reflectances": kept}, each.check, True
        own.sides, own.gains = {}, {}
        own.engines = Counter(kept.engines)
        which = "the best" if rank == 0 else f"number {rank + 1}"
        own.notes = [
            *trace.notes,
            f"the distinct cells differ by at least ΔE2000 {each.least:.1f}: {which} of "
            f"{counted(len(found), 'local search', 'local searches')}",
        ]
        own.timings = {**trace.timings, "total": perf_counter() - started}
        here = state.with_values("reflectances", dict(zip(phase.items, blocks, strict=True)))
        solution = _reported(builder, here, own, apart=each.least >= APART)
        made.append(replace(solution, residuals={**solution.residuals, "least_delta_e_2000": each.least}))
    return tuple(made)


def _reported(builder: Assembler, state: PaletteState, trace: SolveTrace, *, apart: bool) -> PaletteSolution:
    """The solution; its status is not "solved" if the distinct cells are not visibly different."""
    solution = reported(builder, state, trace)
    if apart or solution.status is not PaletteStatus.SOLVED:
        return solution
    return replace(solution, status=PaletteStatus.COMPROMISE, remedy=REMEDIES[PaletteStatus.COMPROMISE])


def _searched(
    linked: Quadratic, cells: DistinctCells, engine: str, begin: tuple[int, int, int, Array | None]
) -> tuple[list[Found], str]:
    """Local optima from numbers of directions and of random spectra, a seed, and given spectra, in the strictest
    possible gamut.
    """
    starts, elsewhere, seed, given = begin
    for gamut in GAMUTS:
        search = _Search(linked, cells, engine, gamut)
        rng = np.random.default_rng(seed)
        begun = [search.start(rng) for _ in range(starts)]
        begun += [search.nearest(random_spectra(search.samples, rng)) for _ in range(elsewhere)]
        if given is not None:
            begun.append(search.nearest(given))
        found = [search.climbed(start.x, rng) for start in begun if start.feasible]
        if found:
            return found, gamut
    return [], GAMUTS[-1]


def _known(values: Array | None) -> Array:
    assert values is not None  # of a free reflectance
    return values


def _asks_anew_of_lights(builder: Assembler, warm: PaletteSolution) -> bool:
    """True if an earlier solution has lights that were designed for another problem."""
    return bool(builder.free_items("lights")) and warm.problem is not builder.problem


def _others_first(builder: Assembler, state: PaletteState, trace: SolveTrace) -> PaletteState:
    """Requests of the other cells, lights included, and True if they can be met at all."""
    if builder.free_items("lights"):
        state = designed(Rounds(builder, trace), state, Budget(SECONDS), race=False)
        trace.notes.append("the lights were designed for the other cells, then held while colors were made distinct")
    elif builder.free_items("reflectances"):
        state = Rounds(builder, trace).round(state)
    return state


@dataclass(frozen=True, eq=False)
class Found:
    """The result of one local search: ``merit`` is the least ΔE2000 minus the cost of the other criteria, in its
    unit.
    """

    x: Array
    least: float
    merit: float
    check: Check


class _Search:
    """Local searches of one problem. The unknown t is the last entry after x."""

    def __init__(self, linked: Quadratic, cells: DistinctCells, engine: str, gamut: str = GAMUTS[0]) -> None:
        self._linked, self._cells, self._engine, self._gamut = linked, cells, engine, gamut
        rows, target = linked.least_squares()
        # Everything is divided by κ, so that t weighs 1.
        self._hessian = sparse.csc_matrix(rows.T @ rows) / cells.worth
        self._linear = np.asarray(rows.T @ target) / cells.worth
        self._target_cost = 0.5 * float(target @ target) / cells.worth
        self._base = self._own_step()
        self.samples = [block.lower.size for block in linked.blocks]

    def start(self, rng: np.random.Generator) -> StepAnswer:
        """Unknowns that spread the cells along random directions, as far as the other criteria allow."""
        directions = rng.normal(size=(len(self._cells.cells), 3))
        directions -= directions.mean(axis=0)
        linear = START_SLOPE * np.einsum("ck,ckn->n", directions, self._cells.matrices)
        return self._solve(replace(self._base, linear=self._base.linear - linear))

    def nearest(self, values: Array) -> StepAnswer:
        """Feasible unknowns near given spectra, which are behind the free colors in x."""
        wanted = np.concatenate([np.zeros(self._linked.size - values.size), values])
        ridge = 1e3 * sparse.identity(wanted.size, format="csc")
        near = replace(self._base, hessian=self._base.hessian + ridge, linear=self._base.linear - ridge @ wanted)
        return self._solve(near)

    def climbed(self, x: Array, rng: np.random.Generator, iterations: int = 60) -> Found:
        """The local optimum reached from x."""
        merit, radius = self._merit(x), FIRST_RADIUS
        check = Check(np.inf, np.inf, np.inf)
        for _ in range(iterations):
            answer = self._solve(self._linearized(x, radius, rng))
            gain, promised = self._merit(answer.x) - merit, answer.t - self._cost(answer.x) - merit
            if answer.feasible and gain > 1e-3 * max(promised, 0.0):
                x, merit, check = answer.x, merit + gain, answer.check
                radius = min(2 * radius, LARGEST_RADIUS) if gain > 0.7 * promised else radius
                if gain < SETTLED:
                    break
            else:
                check = answer.check if not np.isfinite(check.kkt) else check
                radius /= 3
                if radius < LAST_RADIUS:
                    break
        least = float(self._cells.differences(self._cells.colors(x)).min())
        return Found(x, least, merit, check)

    def _cost(self, x: Array) -> float:
        """½ ||M x − y||² in units of ΔE2000."""
        return float(0.5 * x @ (self._hessian @ x) - self._linear @ x) + self._target_cost

    def _merit(self, x: Array) -> float:
        return float(self._cells.differences(self._cells.colors(x)).min()) - self._cost(x)

    def _solve(self, step: Step) -> StepAnswer:
        return solve_step(step, self._engine)

    def _own_step(self) -> Step:
        """The palette's criteria, and the gamut: of distinct cells, and of free common colors."""
        cells, linked = self._cells, self._linked
        size = linked.size
        own = sparse.csc_matrix(cells.matrices.reshape(-1, size))
        free = np.asarray(np.abs(own).sum(axis=1)).ravel() > 0
        equality, equality_target = linked.equalities()
        common = (np.arange(size) < linked.offsets[0]) & (self._gamut == GAMUTS[0])
        free = free & (self._gamut != GAMUTS[2])
        return Step(
            hessian=self._hessian + RIDGE * sparse.identity(size, format="csc"),
            linear=-self._linear,
            equality=sparse.csc_matrix(equality),
            equality_target=equality_target,
            rows=own[free],
            rows_lower=(cells.lower - cells.offsets).ravel()[free],
            rows_upper=(cells.upper - cells.offsets).ravel()[free],
            lower=np.where(np.isneginf(linked.lower) & common, 0.0, linked.lower),
            upper=np.where(np.isposinf(linked.upper) & common, 1.0, linked.upper),
        )

    def _linearized(self, x: Array, radius: float, rng: np.random.Generator) -> Step:
        cells = self._cells
        colors = cells.colors(x)
        jacobians = lab_jacobian_from_linear_rgb(colors)
        lab_rows = jacobians @ cells.matrices
        slopes = cells.slopes(colors, rng)
        first, second = cells.pairs.T
        pair_rows = np.einsum("pk,pkn->pn", slopes[0], lab_rows[first])
        pair_rows += np.einsum("pk,pkn->pn", slopes[1], lab_rows[second])
        moved = lab_rows.reshape(-1, x.size)
        moves = np.abs(moved).sum(axis=1) > 0
        middle = (moved @ x)[moves]
        return self._base.with_least(
            pair_rows, cells.differences(colors) - pair_rows @ x, sparse.csc_matrix(moved[moves]), middle, radius
        )
