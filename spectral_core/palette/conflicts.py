# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells that conflict, from the multipliers of the last solve.

With the active bounds fixed, the answer is a linear function of every row. Releasing cell j changes the error of i by

    Δe_i = M_ij (1/ω_j − M_jj)⁻¹ e_j      M = B K⁻¹ Bᵀ

with K the block-arrow matrix of the last solve, B its color rows, and e_j the error of cell j, or its multiplier over
its weight if it is exact. That takes a millisecond; solving again without each neighbor takes a second.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.requests import Requests
from spectral_core.palette.assemble.side import Assembled
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem
from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.arrow import CAP, median_weight, regular_solve
from spectral_core.palette.qp.elastic import softened
from spectral_core.palette.qp.feasibility import smallest_conflict
from spectral_core.palette.qp.threads import on_one_thread
from spectral_core.palette.report import exact_error
from spectral_core.palette.solution import VISIBLE_DELTA_E, Conflict, PaletteSolution, PaletteStatus
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]

CELLS = 3
"""Missed cells that are explained, the worst first."""
HELPS = 0.8
"""A release is reported if it reduces the error to less than this share."""
LEAST_HELP = 1e-3
"""ΔE2000 below which a release makes no difference."""
NEAR = 1e-9
"""Distance to a bound at which a sample counts as fixed there."""


def find_conflicts(solution: PaletteSolution) -> tuple[Conflict, ...]:
    """For each of the worst missed cells, the cells whose release would reduce its error, best first.

    Empty for a solved palette. The errors without a cell are predicted with the active bounds fixed.
    """
    record = _record(solution)
    if solution.status in (PaletteStatus.SOLVED, PaletteStatus.INVISIBLE) or not record:
        return ()
    requests = next(iter(record.values()))[0].view.requests
    missed = _missed(solution, requests)
    relief: dict[CellIndex, dict[CellIndex, float]] = {cell: {} for cell in missed}
    for side, (assembled, answer) in record.items():
        if answer.values and np.all(np.isfinite(np.concatenate(answer.values))):
            responses = Responses.of(assembled, answer)
            for cell in missed:
                for other, error in _relief(solution, requests, side, responses, cell).items():
                    relief[cell][other] = min(error, relief[cell].get(other, np.inf))
    return tuple(_explained(solution, cell, error, relief[cell]) for cell, error in missed.items())


@on_one_thread
def with_conflicts(solution: PaletteSolution) -> PaletteSolution:
    """The solution with its conflicts, and with the first of them in its remedy."""
    conflicts = find_conflicts(solution)
    together = conflicting_cells(solution)
    texts = [conflicts[0].text] if conflicts else []
    if len(together) > 1:
        names = [_name(solution.problem, cell) for cell in together]
        texts.append(f"{', '.join(names[:-1])} and {names[-1]} cannot all be exact.")
    if not texts:
        return solution
    return replace(solution, conflicts=conflicts, remedy=" ".join([*texts, solution.remedy]))


def _record(solution: PaletteSolution) -> dict[Side, tuple[Assembled, Answer]]:
    """The last solve of each side; empty for a solution from a file."""
    return {} if solution.state is None else solution.state.record or {}


def conflicting_cells(solution: PaletteSolution) -> tuple[CellIndex, ...]:
    """A smallest set of exact cells that cannot all hold; empty if they can, or if no cell is involved."""
    if solution.status is not PaletteStatus.EXACT_CONFLICT:
        return ()
    for assembled, answer in _record(solution).values():
        if answer.infeasible:
            keys = smallest_conflict(assembled.quadratic)
            if keys:
                return tuple(dict.fromkeys(cell for _, cell in keys))
    return ()


def _missed(solution: PaletteSolution, requests: Requests) -> dict[CellIndex, float]:
    """The cells with the largest errors, with these errors; missed exact cells come first."""
    broken = set(exact_error(requests, solution.actual_linear_rgb)[1])
    errors = solution.delta_e_2000
    cells = [(int(i), int(j)) for i, j in np.argwhere(np.isfinite(errors))]
    missed = [cell for cell in cells if cell in broken or errors[cell] > VISIBLE_DELTA_E]
    missed.sort(key=lambda cell: (cell not in broken, -errors[cell]))
    return {cell: float(errors[cell]) for cell in missed[:CELLS]}


# -- sensitivities -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Responses:
    """M of the module's docstring, for the cells of the first condition on one side."""

    rows: dict[CellIndex, list[tuple[int, slice]]]
    """Block and rows of each cell: it may have a target and a link."""
    within: tuple[Array, ...]
    """(m, m) per block: response through the block itself."""
    through_colors: tuple[Array, ...]
    """(m, q) per block: gradient of each row by the free colors."""
    color_response: Array
    """(q, q): inverse of the colors' Schur complement."""
    errors: tuple[Array, ...]
    """(m,) per block: error, or multiplier over weight where exact."""
    weights: tuple[Array, ...]
    """(m,) per block."""
    ties: tuple[Array, ...]
    """(m, q) per block."""

    @classmethod
    def of(cls, assembled: Assembled, answer: Answer) -> Responses:
        """Factor every block once more with its active bounds held, exact rows as rows of large weight."""
        unit, _ = median_weight(assembled.quadratic)
        # If exact rows conflict, the answer is that of this problem; else its exact rows move by a negligible amount.
        quadratic = softened(assembled.quadratic, everything=True)
        count = quadratic.color_lower.size
        hessian = (quadratic.known_ties.T * (quadratic.known_weights / unit)) @ quadratic.known_ties
        within, through, errors, weights = [], [], [], []
        rows: dict[CellIndex, list[tuple[int, slice]]] = {}
        for k, (block, value, force) in enumerate(zip(quadratic.blocks, answer.values, answer.forces, strict=True)):
            own = np.minimum(block.weights / unit, CAP)
            free = (value > block.lower + NEAR) & (value < block.upper - NEAR)
            seen, tied = block.rows[:, free], own[:, None] * block.ties
            curvature = (seen.T * own) @ seen + block.gram[free][:, free] / unit
            # One solve for the rows themselves, and for how the free colors act through them.
            solved = regular_solve(curvature, np.concatenate([seen.T, seen.T @ tied], axis=1))
            by_colors = solved[:, len(own) :]
            within.append(seen @ solved[:, : len(own)])
            through.append(seen @ by_colors - block.ties)
            hessian = hessian + tied.T @ block.ties - (tied.T @ seen) @ by_colors
            errors.append(force / unit / np.maximum(own, 1e-300))
            weights.append(own)
            for r, (condition, cell) in enumerate(block.keys):
                if condition == 0:
                    rows.setdefault(cell, []).append((k, slice(3 * r, 3 * r + 3)))
        held = (quadratic.color_lower == quadratic.color_upper).ravel()
        hessian = hessian + np.diag(np.where(held, 1e12, 1e-12 * max(float(np.abs(hessian).max(initial=0.0)), 1e-300)))
        inverse = np.linalg.inv(hessian) if count else np.zeros((0, 0))
        ties = tuple(block.ties for block in quadratic.blocks)
        return cls(rows, tuple(within), tuple(through), inverse, tuple(errors), tuple(weights), ties)

    def between(self, one: tuple[int, slice], other: tuple[int, slice]) -> Array:
        """M of two triples of rows, (3, 3)."""
        (k, rows), (m, columns) = one, other
        found = self.through_colors[k][rows] @ self.color_response @ self.through_colors[m][columns].T
        return found + self.within[k][rows, columns] if k == m else found

    def moved(self, cell: CellIndex, released: Sequence[CellIndex]) -> Array:
        """Change of a cell's color when another cell's request is dropped, (len(released), 3): of each by itself."""
        into = self.rows[cell][0]
        found = np.empty((len(released), 3))
        # Cells of one request, nearly all, are solved together; one with a target and a link has six rows.
        plain = [number for number, other in enumerate(released) if len(self.rows[other]) == 1]
        rows = [self.rows[released[number]] for number in plain]
        if plain:
            found[plain] = self._moved(into, rows)
        for number, other in enumerate(released):
            if len(self.rows[other]) > 1:
                found[number] = self._moved(into, [self.rows[other]])[0]
        return found

    def _moved(self, into: tuple[int, slice], released: Sequence[list[tuple[int, slice]]]) -> Array:
        """The same for requests of equally many rows."""
        systems, errors, weights, towards = [], [], [], []
        for asked in released:
            if len(asked) == 1:  # np.block alone takes longer than the 3×3 system
                ((k, rows),) = asked
                joint, error, weight = self.between(asked[0], asked[0]), self.errors[k][rows], self.weights[k][rows]
                towards.append(self._color_between(into, asked[0]))
            else:
                joint = np.block([[self.between(a, b) for b in asked] for a in asked])
                error = np.concatenate([self.errors[k][rows] for k, rows in asked])
                weight = np.concatenate([self.weights[k][rows] for k, rows in asked])
                towards.append(np.hstack([self._color_between(into, b) for b in asked]))
            systems.append(joint)
            errors.append(error)
            weights.append(weight)
        stacked = -np.array(systems)
        diagonal = np.arange(stacked.shape[1])
        stacked[:, diagonal, diagonal] += 1.0 / np.maximum(np.array(weights), 1e-12)
        # Where the released rows depend on each other, the least force that the equations leave.
        forces = np.matmul(np.linalg.pinv(stacked, rcond=1e-10), np.array(errors)[:, :, None])
        return np.asarray(np.matmul(np.array(towards), forces)[:, :, 0])

    def _color_between(self, one: tuple[int, slice], other: tuple[int, slice]) -> Array:
        """Like ``between``, for the color itself instead of its distance to a free color."""
        (k, rows), (m, columns) = one, other
        own = self.through_colors[k][rows] + self.ties[k][rows]
        found = own @ self.color_response @ self.through_colors[m][columns].T
        return found + self.within[k][rows, columns] if k == m else found


def _relief(
    solution: PaletteSolution, requests: Requests, side: Side, responses: Responses, cell: CellIndex
) -> dict[CellIndex, float]:
    """ΔE2000 of a cell after the release of each other cell of its spectrum or group."""
    if cell not in responses.rows:
        return {}
    problem = solution.problem
    group = next((set(group.members) for group in requests.groups if cell in group.members), set())
    axis = 0 if side == "reflectances" else 1
    others = [other for other in responses.rows if other != cell and (other[axis] == cell[axis] or other in group)]
    if not others:
        return {}
    target = next((each.color for each in requests.targets if each.cell == cell), None)
    pairs, owners = [], []
    shown = solution.actual_linear_rgb[cell] + responses.moved(cell, others)
    moved: dict[CellIndex, Array] = {}
    for number, other in enumerate(others):
        if target is not None:
            pairs.append((shown[number], target))
            owners.append(other)
        for at in _references(problem, cell, group):
            if at == other:
                continue
            if at in responses.rows and at not in moved:
                moved[at] = responses.moved(at, others)
            pairs.append((shown[number], solution.actual_linear_rgb[at] + (moved[at][number] if at in moved else 0.0)))
            owners.append(other)
    found = dict.fromkeys(others, 0.0)
    if pairs:
        stacked = np.array(pairs)
        errors = delta_e_2000(lab_from_linear_rgb(stacked[:, 0]), lab_from_linear_rgb(stacked[:, 1]))
        for other, error in zip(owners, errors.tolist(), strict=True):
            found[other] = max(found[other], error)
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
    name = _name(problem, cell)
    text = f"{name} misses its color by ΔE {error:.1f}."
    if helpful:
        after, best = helpful[0]
        without = f"without {_name(problem, best)} it would be about {after:.1f}"
        text = f"{name} misses its color by ΔE {error:.1f}; {without}."
    elif relief:
        text = (
            f"{name} misses its color by ΔE {error:.1f}, and no single cell is to blame: {_own_remedy(problem, cell)}"
        )
    least = helpful[0][0] if helpful else error
    return Conflict(cell, error, tuple(other for _, other in helpful), least, text)


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
    """A name in quotes, with its number if another item has the same name."""
    return f"“{names[index]}”" + (f" ({index + 1})" if names.count(names[index]) > 1 else "")
