# SPDX-License-Identifier: GPL-3.0-or-later
"""An independent check of optimality, formulated from the cells and solved by Clarabel, without shared code.

Written from docs/palette.md alone: its own integrals, roughness, caps of weights and smoothness, groups, metric and
equalities. Only data are shared: the CIE tables, the sRGB matrix, CIELAB, and the classes of a problem.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from benchmarks.palette.checks.statement import best_common, color_matrix, colors, groups, metrics, roughness, weights
from spectral_core.palette import CellMode, PaletteProblem, PaletteSolution

EXACT_LIMIT = 1e-6
ROUNDING = 4e-15
"""Error of a color, in linear RGB, by the rounding of its sum (up to 471 terms): an objective of squares of it is 0."""
TOLERANCES = {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-12}
"""For an objective that is 1 at the returned point."""


def side_gains(solution: PaletteSolution) -> dict[str, float]:
    """By side: the share by which its objective falls when that side alone is solved again from the returned point.

    ``"exact"``: the largest error of an exact cell, in linear RGB. Sides on which Clarabel finds no optimum are left
    out. For palettes with one observer, and without variants, subspace and worst case.
    """
    problem = solution.problem
    surfaces = [np.asarray(each.values) for each in solution.reflectances]
    lights = [np.asarray(each.values) for each in solution.illuminants]
    found = {"exact": _exact_miss(problem, solution)}
    for side in ("reflectances", "lights"):
        if any(item.free for item in getattr(problem, side)):
            gain = _gain(problem, solution, side, surfaces if side == "reflectances" else lights)
            if gain is not None:
                found[side] = gain
    return found


def _gain(problem: PaletteProblem, solution: PaletteSolution, side: str, present: list[np.ndarray]) -> float | None:
    """Share of the objective at the returned point by which Clarabel's point is lower; both are sums of squares.

    Clarabel's own value of its objective has an absolute error, which would hide the gains of a palette whose targets
    are nearly met. Its point is put within the bounds instead, and its objective summed as that of the returned point.
    """
    import cvxpy as cp

    free = [item.free for item in getattr(problem, side)]
    known = solution.illuminants if side == "reflectances" else solution.reflectances
    matrices = [color_matrix(problem.grid, each) for each in known]
    bounds = problem.reflectance_bounds if side == "reflectances" else problem.light_bounds
    shown_now = colors(problem, solution)
    squares = _Squares(problem, side, free, shown_now)
    here = squares.of(shown_now, present)
    if here <= squares.rounding_of_colors():
        return 0.0
    unknown = [cp.Variable(problem.grid.size) if each else None for each in free]
    constraints: list[Any] = []
    for x in unknown:
        if x is not None:
            constraints += [x >= bounds[0]] if np.isfinite(bounds[0]) else []
            constraints += [x <= bounds[1]] if np.isfinite(bounds[1]) else []

    def color(cell: tuple[int, int]) -> Any:
        own, other = cell if side == "reflectances" else cell[::-1]
        return shown_now[cell] if unknown[own] is None else matrices[other] @ unknown[own]

    terms, equalities, boxes = _stated(squares, color, [x for x in unknown if x is not None], here)
    statement = cp.Problem(cp.Minimize(cp.sum(cp.hstack(terms)) if terms else 0), constraints + boxes + equalities)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            statement.solve(solver="CLARABEL", **TOLERANCES)
        except cp.error.SolverError:
            return None
    if statement.status not in ("optimal", "optimal_inaccurate"):
        return None
    found = [
        values if x is None else np.clip(np.asarray(x.value), *bounds)
        for x, values in zip(unknown, present, strict=True)
    ]
    shown = shown_now.copy()
    for i, j in np.ndindex(shown.shape[:2]):
        own, other = (i, j) if side == "reflectances" else (j, i)
        if free[own]:
            shown[i, j] = matrices[other] @ found[own]
    # A decrease that results from exact cells that miss their colors does not count, in either point: multiplier times
    # slack (weak duality).
    misses = zip(squares.misses(shown_now), squares.misses(shown), strict=True)
    slack = sum(
        float(np.abs(each.dual_value) @ (ours + theirs))
        for each, (ours, theirs) in zip(equalities, misses, strict=True)
    )
    # Sums are known to their rounding, so that a decrease within it is none: errors e of colors that are known to δ
    # have squares that are known to 2 |e| |δ| + |δ|² (Cauchy and Schwarz).
    own = squares.rounding_of_colors()
    rounding = 2.0 * float(np.sqrt(here * own)) + own
    return max(0.0, (here - squares.of(shown, found) - rounding) / here - slack)


class _Squares:
    """The objective of one side as a sum of squares: of colors (R, L, 3) and of the spectra of the side."""

    def __init__(self, problem: PaletteProblem, side: str, free: list[bool], shown_now: np.ndarray) -> None:
        self.problem, self.side, self.free = problem, side, free
        self.weights, smoothness = weights(problem)
        self.metric = metrics(problem, shown_now)
        self.groups = groups(problem, self.weights)
        self.rough = smoothness * (10.0 if side == "lights" else 1.0) * roughness(problem)

    def targets(self) -> list[tuple[tuple[int, int], np.ndarray, np.ndarray | None]]:
        """Cells with a color of their own: the color and the rows of the error; None for an exact cell."""
        found = []
        for (i, j), weight in self.weights.items():
            cell = self.problem.cells[i][j]
            if cell.mode in (CellMode.FIXED, CellMode.BLACK):
                wanted = np.zeros(3) if cell.target is None else cell.target
                found.append(((i, j), wanted, None if cell.exact else weight / np.sqrt(3) * self.metric[i, j]))
        return found

    def of(self, shown: np.ndarray, spectra: list[np.ndarray]) -> float:
        """The sum of squares at some colors and spectra, with the best common color of each group."""
        total = 0.0
        for cell, wanted, rows in self.targets():
            total += 0.0 if rows is None else float(np.sum((rows @ (shown[cell] - wanted)) ** 2))
        for members, exact, box in self.groups:
            best = best_common(members, exact, box, self.metric, shown)
            for cell, weight in members.items():
                if not exact[cell]:
                    rows = weight / np.sqrt(3) * self.metric[cell]
                    total += float(np.sum((rows @ (shown[cell] - best)) ** 2))
        for is_free, values in zip(self.free, spectra, strict=True):
            total += float(np.sum((self.rough @ values) ** 2)) if is_free else 0.0
        return total

    def rounding_of_colors(self) -> float:
        """The sum of squares that the rounding of all colors makes: at a weight of 10⁴, 10⁸ times that at 1."""
        sizes = [float(np.sum((weight * self.metric[cell]) ** 2)) / 3 for cell, weight in self.weights.items()]
        return ROUNDING**2 * max(sum(sizes), 1.0)

    def is_unknown(self, cell: tuple[int, int]) -> bool:
        """True if the cell's spectrum on this side is designed."""
        return self.free[cell[0] if self.side == "reflectances" else cell[1]]

    def misses(self, shown: np.ndarray) -> list[np.ndarray]:
        """Errors (3,) of the exact cells, in the order of the equalities of ``_stated``."""
        found = [
            np.abs(shown[cell] - wanted)
            for cell, wanted, rows in self.targets()
            if rows is None and self.is_unknown(cell)
        ]
        for members, exact, box in self.groups:
            best = best_common(members, exact, box, self.metric, shown)
            found += [np.abs(shown[cell] - best) for cell in members if exact[cell]]
        return found


def _stated(squares: _Squares, color: Any, unknown: list[Any], here: float) -> tuple[list[Any], list[Any], list[Any]]:
    """The terms of the objective over its value ``here``, the equalities of exact cells, and the boxes, for cvxpy."""
    import cvxpy as cp

    root = np.sqrt(here)
    terms, equalities = [], []
    for cell, wanted, rows in squares.targets():
        if rows is not None:
            terms.append(cp.sum_squares(rows / root @ (color(cell) - wanted)))
        elif squares.is_unknown(cell):
            equalities.append(color(cell) == wanted)
    boxes = []
    for members, exact, box in squares.groups:
        common = cp.Variable(3)
        boxes += [common[c] >= box[0][c] for c in range(3) if np.isfinite(box[0][c])]
        boxes += [common[c] <= box[1][c] for c in range(3) if np.isfinite(box[1][c])]
        for cell, weight in members.items():
            if exact[cell]:
                equalities.append(color(cell) == common)
            else:
                rows = weight / np.sqrt(3) / root * squares.metric[cell]
                terms.append(cp.sum_squares(rows @ (color(cell) - common)))
    terms += [cp.sum_squares(squares.rough / root @ x) for x in unknown]
    return terms, equalities, boxes


def _exact_miss(problem: PaletteProblem, solution: PaletteSolution) -> float:
    shown = colors(problem, solution)
    worst = 0.0
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.exact and cell.mode in (CellMode.FIXED, CellMode.BLACK):
                wanted = np.zeros(3) if cell.target is None else cell.target
                worst = max(worst, float(np.abs(shown[i, j] - wanted).max()))
            if cell.exact and cell.mode in (CellMode.SAME, CellMode.CONSTANT):
                worst = max(worst, *(float(np.abs(shown[i, j] - shown[other]).max()) for other in cell.others))
    return worst
