# SPDX-License-Identifier: GPL-3.0-or-later
"""Which wishes stand in each other's way: every missed cell is solved again with one neighbor released at a time."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.phase import PhaseBuilder
from spectral_core.palette.assemble.wishes import compiled_wishes
from spectral_core.palette.problem import Cell, CellIndex, CellMode, PaletteProblem
from spectral_core.palette.report import EXACT_LIMIT, exact_error, state_errors
from spectral_core.palette.solution import VISIBLE_DELTA_E, Conflict, PaletteSolution, PaletteStatus
from spectral_core.palette.solve import SolveTrace, alternate

Array = NDArray[np.float64]

CELLS = 3
"""Missed cells that are explained, the worst first."""
NEIGHBORS = 10
"""Cells that are released in turn for each of them."""
HELPS = 0.8
"""A release is named where it brings the error to less than this share."""


def find_conflicts(solution: PaletteSolution) -> tuple[Conflict, ...]:
    """For each of the worst missed cells, the cells whose release would help it, in order of help.

    A leave-one-out over cells of the same reflectance, light or group; a few milliseconds for each. Empty for a palette
    that is solved.
    """
    if solution.status in (PaletteStatus.SOLVED, PaletteStatus.INVISIBLE):
        return ()
    return tuple(_explained(solution, cell, error) for cell, error in islice(_missed(solution).items(), CELLS))


def with_conflicts(solution: PaletteSolution) -> PaletteSolution:
    """The solution with its conflicts, and with the first of them in its remedy."""
    conflicts = find_conflicts(solution)
    if not conflicts:
        return solution
    return replace(solution, conflicts=conflicts, remedy=f"{conflicts[0].text} {solution.remedy}")


def _missed(solution: PaletteSolution) -> dict[CellIndex, float]:
    """Cells that miss their wish, worst first, with their error; exact ones that are broken before all others."""
    wishes = compiled_wishes(solution.problem)
    broken = set(exact_error(wishes, solution.actual_linear_rgb)[1])
    errors = solution.delta_e_2000
    cells = [(int(i), int(j)) for i, j in np.argwhere(np.isfinite(errors))]
    missed = [cell for cell in cells if cell in broken or errors[cell] > VISIBLE_DELTA_E]
    missed.sort(key=lambda cell: (cell not in broken, -errors[cell]))
    return {cell: float(errors[cell]) for cell in missed}


def _explained(solution: PaletteSolution, cell: CellIndex, error: float) -> Conflict:
    problem = solution.problem
    relief = {}
    for other in _neighbors(solution, cell)[:NEIGHBORS]:
        relief[other] = _error_without(solution, cell, other)
    helpful = sorted((after, other) for other, after in relief.items() if after < HELPS * max(error, EXACT_LIMIT))
    name = _name(problem, cell)
    text = f"{name} misses its color by ΔE {error:.1f}."
    if helpful:
        after, best = helpful[0]
        text = f"{name} misses its color by ΔE {error:.1f}; without {_name(problem, best)} it would be {after:.1f}."
    elif relief:
        text = (
            f"{name} misses its color by ΔE {error:.1f}, and no single cell is to blame: {_own_remedy(problem, cell)}"
        )
    without = helpful[0][0] if helpful else error
    return Conflict(cell, error, tuple(other for _, other in helpful), without, text)


def _own_remedy(problem: PaletteProblem, cell: CellIndex) -> str:
    light = problem.lights[cell[1]]
    if not light.free:
        return (
            f"the color may be out of reach under {light.name}; brighten or free that light, or choose another color."
        )
    return "the color may be out of reach; choose another one, or lower the smoothness."


def _name(problem: PaletteProblem, cell: CellIndex) -> str:
    rows, columns = [item.name for item in problem.reflectances], [light.name for light in problem.lights]
    return f"{_told_apart(rows, cell[0])} under {_told_apart(columns, cell[1])}"


def _told_apart(names: list[str], index: int) -> str:
    """A name in quotes, with its number where another one is called the same."""
    return f"“{names[index]}”" + (f" ({index + 1})" if names.count(names[index]) > 1 else "")


def _neighbors(solution: PaletteSolution, cell: CellIndex) -> list[CellIndex]:
    """Cells with a wish that share a designed spectrum with ``cell``, the same reflectance's first."""
    problem = solution.problem
    members: set[CellIndex] = set()
    for group in compiled_wishes(problem).groups:
        if cell in group.members:
            members |= set(group.members)
    ranked = []
    for i, row in enumerate(problem.cells):
        for j, other in enumerate(row):
            wish = other.mode not in (CellMode.IGNORE, CellMode.DISTINCT) or (i, j) in members
            if (i, j) == cell or not wish:
                continue
            same_row = i == cell[0] and problem.reflectances[i].free
            same_column = j == cell[1] and problem.lights[j].free
            if same_row or same_column or (i, j) in members:
                ranked.append((not same_row, not same_column, -other.weight, (i, j)))
    return [index for *_, index in sorted(ranked)]


def _error_without(solution: PaletteSolution, cell: CellIndex, released: CellIndex) -> float:
    """ΔE2000 of ``cell`` when another cell's wish is dropped, a few rounds from the present state."""
    problem = _released(solution.problem, released)
    wishes = compiled_wishes(problem)
    builder = PhaseBuilder(problem, wishes)
    state = alternate(builder, solution.state, SolveTrace(), rounds=min(3, problem.rounds))
    error = float(state_errors(problem, wishes, state).delta_e_2000[cell])
    return error if np.isfinite(error) else 0.0


def _released(problem: PaletteProblem, released: CellIndex) -> PaletteProblem:
    """The problem without one cell's wish; cells that refer to it no longer do."""
    changes: dict[CellIndex, Cell] = {released: Cell.ignore()}
    for i, row in enumerate(problem.cells):
        for j, other in enumerate(row):
            if released in other.others and (i, j) != released:
                kept = tuple(each for each in other.others if each != released)
                changes[(i, j)] = replace(other, others=kept) if kept else Cell.ignore()
    return problem.with_cells(changes)
