# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells that conflict: the requests whose release would reduce the error of a missed cell.

Their errors are predicted from the multipliers of the last solve (``responses``), which takes about a millisecond. With
the active bounds fixed a prediction may be wrong, so ``with_conflicts`` can check the best ones by new solves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.blas_threads import on_one_thread
from spectral_core.palette.assemble.requests import Requests, compiled_requests
from spectral_core.palette.assemble.side import Assembled
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.explain.exact_sets import smallest_conflict
from spectral_core.palette.explain.releases import Releases, ReleaseSearch
from spectral_core.palette.explain.words import listed, own_remedy, request_of
from spectral_core.palette.given import cell_name
from spectral_core.palette.inaccurate import missed_as_measured
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.report import EXACT_LIMIT, exact_error, without_white
from spectral_core.palette.responses import Responses
from spectral_core.palette.solution import VISIBLE_DELTA_E, Conflict, PaletteSolution, PaletteStatus
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]

CELLS = 3
"""Missed cells that are explained, the worst first."""
HELPS = 0.8
"""A release is reported if it reduces the error to less than this share."""
LEAST_HELP = 1e-3
"""ΔE2000 below which a release makes no difference."""
SHOWN = 0.05
"""ΔE2000 from which a text shows another number than 0.0."""


def find_conflicts(solution: PaletteSolution) -> tuple[Conflict, ...]:
    """For each of the worst missed cells, the cells whose release would reduce its error, best first.

    Empty for a solved palette. The errors without a cell are predicted with the active bounds fixed.
    """
    record, problem = _record(solution), solution.problem
    is_designed = any(each.free for each in problem.reflectances) or any(each.free for each in problem.lights)
    if solution.status in (PaletteStatus.SOLVED, PaletteStatus.INVISIBLE) or (is_designed and not record):
        return ()
    requests = next(iter(record.values()))[0].view.requests if record else compiled_requests(problem)
    missed = _missed(solution, requests)
    relief: dict[CellIndex, dict[CellIndex, float]] = {cell: {} for cell in missed}
    for after in _after_releases(solution, requests, record, tuple(missed)):
        for (cell, other), error in after.items():
            relief[cell][other] = min(error, relief[cell].get(other, np.inf))
    return tuple(_explained(solution, cell, error, relief[cell]) for cell, error in missed.items())


@on_one_thread
def with_conflicts(solution: PaletteSolution, *, check: bool = False) -> PaletteSolution:
    """The solution with its conflicts, and with the first of them in its remedy.

    ``check``: True to solve the spectra of each missed cell again without the cells whose release is predicted to help,
    and without the others if these do not. It takes milliseconds to tenths of a second.
    """
    conflicts = find_conflicts(solution)
    if check:
        conflicts = _solved_again(solution, conflicts)
    seen = tuple(each for each in conflicts if each.delta_e_2000 >= SHOWN)
    conflicts = seen or tuple(each for each in conflicts if each.relieved_by)
    together = conflicting_cells(solution)
    texts = [each.text for each in conflicts[:1] if each.delta_e_2000 >= SHOWN]
    texts += [_exclusion(solution.problem, together)] if together else []
    return replace(solution, conflicts=conflicts, remedy=" ".join([*texts, solution.remedy]))


def _record(solution: PaletteSolution) -> dict[Side, tuple[Assembled, Answer]]:
    """The last solve of each side; empty for a solution from a file."""
    return {} if solution.state is None else solution.state.record or {}


def conflicting_cells(solution: PaletteSolution) -> tuple[CellIndex, ...]:
    """A minimal set of exact cells that cannot all hold: without any of them the others can. Another may be smaller.

    Empty if all can hold, or if no cell is involved.
    """
    if solution.status is not PaletteStatus.EXACT_CONFLICT:
        return ()
    measured = missed_as_measured(solution.problem, solution.actual_linear_rgb, EXACT_LIMIT)
    if measured:
        return measured[:1]
    # A side may have an answer although cells conflict: a color that a measured cell gives can be outside of a box.
    for assembled, _ in sorted(_record(solution).values(), key=lambda side: not side[1].infeasible):
        missed = exact_error(assembled.view.requests, solution.actual_linear_rgb)[1]
        if cells := smallest_conflict(solution.problem, assembled, missed):
            return () if without_white(solution).intersection(column for _, column in cells) else cells
    return ()


def _missed(solution: PaletteSolution, requests: Requests) -> dict[CellIndex, float]:
    """The cells with the largest errors, with these errors; missed exact cells come first."""
    broken = exact_error(requests, solution.actual_linear_rgb)[1]
    errors = solution.delta_e_2000.copy()
    errors[:, sorted(without_white(solution))] = np.nan  # their white is the cause, which the remedy states
    visible = np.where(np.isfinite(errors) & (errors > VISIBLE_DELTA_E), errors, -np.inf)
    # A stable order: of equal errors the first in the table counts.
    order = np.argsort(-visible, axis=None, kind="stable")[: CELLS + len(broken)]
    worst = [(int(i), int(j)) for i, j in zip(*np.unravel_index(order, errors.shape), strict=True)]
    held = sorted({cell for cell in broken if np.isfinite(errors[cell])}, key=lambda cell: (-errors[cell], cell))
    unseen = [cell for cell in held if errors[cell] < SHOWN]  # last: beside cells that only black meets, there are many
    held = [cell for cell in held if errors[cell] >= SHOWN]
    missed = [*held, *(cell for cell in worst if np.isfinite(visible[cell]) and cell not in held), *unseen]
    return {cell: float(errors[cell]) for cell in missed[:CELLS]}


# -- errors after the release of a cell --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Neighbors:
    """A missed cell, the cells of its spectrum or group on one side, and the cells that it is compared with."""

    cell: CellIndex
    others: tuple[CellIndex, ...]
    references: tuple[CellIndex, ...]


def _after_releases(
    solution: PaletteSolution,
    requests: Requests,
    record: dict[Side, tuple[Assembled, Answer]],
    missed: Sequence[CellIndex],
) -> Iterator[dict[tuple[CellIndex, CellIndex], float]]:
    """For each side, ΔE2000 of each missed cell after the release of each of its neighbors: by both cells."""
    for side, (assembled, answer) in record.items():
        if not answer.values or not np.all(np.isfinite(np.concatenate(answer.values))):
            continue
        asked = {cell: None for block in assembled.quadratic.blocks for condition, cell in block.keys if condition == 0}
        around = [_neighbors(solution.problem, requests, side, asked, cell) for cell in missed if cell in asked]
        around = [each for each in around if each.others]
        if around:
            cells = {cell for each in around for cell in (each.cell, *each.others, *each.references)}
            yield _errors(solution, requests, Responses.of(assembled, answer, cells), around)


def _neighbors(
    problem: PaletteProblem, requests: Requests, side: Side, asked: Iterable[CellIndex], cell: CellIndex
) -> _Neighbors:
    group = dict.fromkeys(member for group in requests.groups if cell in group.members for member in group.members)
    axis = 0 if side == "reflectances" else 1
    others = tuple(other for other in asked if other != cell and (other[axis] == cell[axis] or other in group))
    return _Neighbors(cell, others, tuple(_references(problem, cell, group)))


def _errors(
    solution: PaletteSolution, requests: Requests, responses: Responses, around: Sequence[_Neighbors]
) -> dict[tuple[CellIndex, CellIndex], float]:
    """Errors of the missed cells of one side; all their color differences are computed at once."""
    released = list(dict.fromkeys(other for each in around for other in each.others))
    number = {other: k for k, other in enumerate(released)}
    cells = list(dict.fromkeys(cell for each in around for cell in (each.cell, *each.references)))
    moved = responses.moved([cell for cell in cells if cell in responses.rows], released)
    shown = {cell: np.broadcast_to(solution.actual_linear_rgb[cell], (len(released), 3)) for cell in cells}
    for cell, change in zip((cell for cell in cells if cell in responses.rows), moved, strict=True):
        shown[cell] = shown[cell] + change
    targets = {each.cell: each.color for each in requests.targets}
    ones, twos, at = [], [], []
    for each in around:
        columns = np.array([number[other] for other in each.others])
        own = shown[each.cell][columns]
        compared = [np.broadcast_to(targets[each.cell], own.shape)] if each.cell in targets else []
        for reference in each.references:
            # A released reference is no longer compared with: no difference.
            is_released = np.array([other == reference for other in each.others])[:, None]
            compared.append(np.where(is_released, own, shown[reference][columns]))
        if compared:
            ones.append(np.broadcast_to(own, (len(compared), *own.shape)).reshape(-1, 3))
            twos.append(np.array(compared).reshape(-1, 3))
        at.append((len(compared), len(each.others)))
    if not ones:
        return {(each.cell, other): 0.0 for each in around for other in each.others}
    lab = lab_from_linear_rgb(np.concatenate([*ones, *twos])).reshape(2, -1, 3)
    errors = delta_e_2000(lab[0], lab[1])
    found, begin = {}, 0
    for each, (compared_with, count) in zip(around, at, strict=True):
        own_errors = errors[begin : begin + compared_with * count].reshape(compared_with, count)
        begin += compared_with * count
        worst = own_errors.max(axis=0, initial=0.0).tolist()
        found.update({(each.cell, other): error for other, error in zip(each.others, worst, strict=True)})
    return found


def _references(problem: PaletteProblem, cell: CellIndex, group: Iterable[CellIndex]) -> Sequence[CellIndex]:
    """Cells that a cell is compared with."""
    asked = problem.cells[cell[0]][cell[1]]
    if asked.mode in (CellMode.SAME, CellMode.CONSTANT):
        return asked.others
    return [] if asked.mode in (CellMode.FIXED, CellMode.BLACK) else [other for other in group if other != cell]


# -- texts -------------------------------------------------------------------------------------------------------------


def _explained(solution: PaletteSolution, cell: CellIndex, error: float, relief: dict[CellIndex, float]) -> Conflict:
    problem = solution.problem
    helpful = sorted((after, other) for other, after in relief.items() if after < HELPS * max(error, LEAST_HELP))
    text = f"{_missed_by(problem, cell, error)}."
    if helpful:
        text = _relieved_by_one(problem, cell, error, (helpful[0][1], helpful[0][0]))
    elif relief:
        text = _blames_none(problem, cell, error)
    elif not (problem.reflectances[cell[0]].free or problem.lights[cell[1]].free):
        text = f"{text[:-1]}: its material and its light are measured. Let one of them be designed, or ignore the cell."
    least = helpful[0][0] if helpful else error
    return Conflict(cell, error, tuple(other for _, other in helpful), least, text)


def _solved_again(solution: PaletteSolution, conflicts: tuple[Conflict, ...]) -> tuple[Conflict, ...]:
    """Conflicts with the releases that new solves show to help."""
    record = _record(solution)
    if not record:
        return conflicts
    problem, search = solution.problem, ReleaseSearch(solution, next(iter(record.values()))[0].view.requests, HELPS)
    checked = []
    for each in conflicts:
        cell, error = each.cell, each.delta_e_2000
        found = search.confirmed(cell, error, each.relieved_by)
        if found is not None:
            text = _relieved_by_one(problem, cell, error, (found.alone[0], found.delta_e_2000))
            checked.append(Conflict(cell, error, found.alone, found.delta_e_2000, text))
        elif error >= SHOWN or each.relieved_by:
            checked.append(_with_releases(problem, each, search.of(cell, error)))
        else:
            checked.append(each)
    return tuple(checked)


def _relieved_by_one(problem: PaletteProblem, cell: CellIndex, error: float, best: tuple[CellIndex, float]) -> str:
    return f"{_missed_by(problem, cell, error)}; without {cell_name(problem, best[0])} it would be about {best[1]:.1f}."


def _with_releases(problem: PaletteProblem, conflict: Conflict, found: Releases | None) -> Conflict:
    """A conflict without a release that was predicted to help and does, and with those that were found instead."""
    cell, error = conflict.cell, conflict.delta_e_2000
    if found is None:
        several = f"{_missed_by(problem, cell, error)}; several other cells exclude it."
        return Conflict(cell, error, (), error, several) if conflict.relieved_by else conflict
    if not (found.alone or found.together):
        return Conflict(cell, error, (), error, _blames_none(problem, cell, error))
    names = [f"{cell_name(problem, other)} ({request_of(problem, other)})" for other in found.alone or found.together]
    after = f"it would be about {found.delta_e_2000:.1f}"
    if found.together:
        what = f"{listed(names)} exclude it, each of them alone. Without all of them {after}. Ignore them."
    elif len(names) == 1:
        what = f"{names[0]} excludes it. Without this cell {after}. Ignore it."
    else:
        what = f"{listed(names)} together exclude it. Without one of them {after}. Ignore one of them."
    return Conflict(cell, error, found.alone, found.delta_e_2000, f"{_missed_by(problem, cell, error)}. {what}")


def _missed_by(problem: PaletteProblem, cell: CellIndex, error: float) -> str:
    return f"{cell_name(problem, cell)} misses its color by ΔE {error:.1f}"


def _blames_none(problem: PaletteProblem, cell: CellIndex, error: float) -> str:
    return f"{_missed_by(problem, cell, error)}, and no other cell is to blame: {own_remedy(problem, cell)}"


def _exclusion(problem: PaletteProblem, cells: Sequence[CellIndex]) -> str:
    names = [cell_name(problem, cell) for cell in cells]
    text = f"{listed(names)} cannot all be exact" if len(names) > 1 else f"{names[0]} cannot be exact"
    compared = {at for cell in cells for at in (cell, *problem.cells[cell[0]][cell[1]].others)}
    is_designed = any(problem.reflectances[i].free for i, _ in compared)
    # One side was tested, and the other was held as it was found.
    if is_designed and (problem.scale_lights or any(problem.lights[j].free for _, j in compared)):
        text += " with the lights and materials that were found, but may be with others"
    return f"{text}."
