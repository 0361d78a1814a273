# SPDX-License-Identifier: GPL-3.0-or-later
"""An independent check of optimality, formulated from the cells and solved by Clarabel, without shared code.

Written from docs/palette.md alone: its own integrals, roughness, caps of weights and smoothness, groups, metric and
equalities. Only data are shared: the CIE tables, the sRGB matrix, CIELAB, and the classes of a problem.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from spectral_core.palette import CellMode, PaletteProblem, PaletteSolution
from spectral_core.spectra.catalogue import color_matching_functions
from spectral_core.spectra.color import RGB_FROM_XYZ, lab_from_linear_rgb

EXACT_LIMIT = 1e-6
NOTHING = 1e-10
"""Objective, for a median weight of 1, that is rounding."""


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
    import cvxpy as cp

    free = [item.free for item in getattr(problem, side)]
    known = solution.illuminants if side == "reflectances" else solution.reflectances
    matrices = [_color_matrix(problem.grid, each) for each in known]
    bounds = problem.reflectance_bounds if side == "reflectances" else problem.light_bounds
    unknown = [cp.Variable(problem.grid.size) if each else None for each in free]
    constraints, terms = [], []
    for x in unknown:
        if x is not None:
            constraints += [x >= bounds[0]] if np.isfinite(bounds[0]) else []
            constraints += [x <= bounds[1]] if np.isfinite(bounds[1]) else []
    weights, smoothness = _weights(problem)
    shown_now = _colors(problem, solution)

    def color(cell: tuple[int, int]) -> Any:
        own, other = cell if side == "reflectances" else cell[::-1]
        return shown_now[cell] if unknown[own] is None else matrices[other] @ unknown[own]

    here = 0.0
    metric = _metrics(problem, shown_now)
    for (i, j), weight in weights.items():
        cell = problem.cells[i][j]
        if cell.mode not in (CellMode.FIXED, CellMode.BLACK):
            continue
        wanted = np.zeros(3) if cell.target is None else cell.target
        if cell.exact:
            if unknown[i if side == "reflectances" else j] is not None:
                constraints.append(color((i, j)) == wanted)
            continue
        rows = weight / np.sqrt(3) * metric[i, j]
        terms.append(cp.sum_squares(rows @ (color((i, j)) - wanted)))
        here += float(np.sum((rows @ (shown_now[i, j] - wanted)) ** 2))
    for members, exact, box in _groups(problem, weights):
        common = cp.Variable(3)
        constraints += [common[c] >= box[0][c] for c in range(3) if np.isfinite(box[0][c])]
        constraints += [common[c] <= box[1][c] for c in range(3) if np.isfinite(box[1][c])]
        best = _best_common(members, exact, box, metric, shown_now)
        for cell, weight in members.items():
            if exact[cell]:
                constraints.append(color(cell) == common)
            else:
                rows = weight / np.sqrt(3) * metric[cell]
                terms.append(cp.sum_squares(rows @ (color(cell) - common)))
                here += float(np.sum((rows @ (shown_now[cell] - best)) ** 2))
    rough = smoothness * (10.0 if side == "lights" else 1.0) * _roughness(problem)
    for x, values in zip(unknown, present, strict=True):
        if x is not None:
            terms.append(cp.sum_squares(rough @ x))
            here += float(np.sum((rough @ values) ** 2))
    statement = cp.Problem(cp.Minimize(cp.sum(cp.hstack(terms)) if terms else 0), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            statement.solve(solver="CLARABEL", tol_gap_abs=1e-12, tol_gap_rel=1e-10, tol_feas=1e-11)
        except cp.error.SolverError:
            return None
    if statement.status != "optimal":
        return None
    # A decrease by Clarabel that results from violating an exact cell does not count: multiplier times slack (weak
    # duality).
    slack = [np.vdot(np.abs(each.dual_value), np.abs(each.violation())) for each in constraints if _is_equality(each)]
    return max(0.0, here - float(statement.value) - float(sum(slack)) - NOTHING) / max(here, NOTHING)


def _is_equality(constraint: Any) -> bool:
    from cvxpy.constraints.zero import Equality

    return isinstance(constraint, Equality)


def _exact_miss(problem: PaletteProblem, solution: PaletteSolution) -> float:
    shown = _colors(problem, solution)
    worst = 0.0
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.exact and cell.mode in (CellMode.FIXED, CellMode.BLACK):
                wanted = np.zeros(3) if cell.target is None else cell.target
                worst = max(worst, float(np.abs(shown[i, j] - wanted).max()))
            if cell.exact and cell.mode in (CellMode.SAME, CellMode.CONSTANT):
                worst = max(worst, *(float(np.abs(shown[i, j] - shown[other]).max()) for other in cell.others))
    return worst


def _cmfs(wavelengths: np.ndarray) -> np.ndarray:
    knots, table = color_matching_functions("cie_1931_2deg")
    return np.stack([np.interp(wavelengths, knots, row, left=0, right=0) for row in table])


def _color_matrix(grid: Any, spectrum: Any) -> np.ndarray:
    """(3, n): Simpson's rule on every piece between two knots, which is exact for cubics."""
    knots = grid.wavelengths_nm
    if grid.interpolation == "sampled":
        return RGB_FROM_XYZ @ _cmfs(knots) * spectrum.at(knots) * grid.cell_widths_nm
    tables = [knots, color_matching_functions("cie_1931_2deg")[0], spectrum.grid.wavelengths_nm]
    low, high = max(t[0] for t in tables), min(t[-1] for t in tables)
    edges = np.unique(np.concatenate(tables))
    edges = edges[(edges >= low) & (edges <= high)]
    total = np.zeros((3, knots.size))
    if edges.size < 2:
        return total
    width = np.diff(edges)
    hats = np.eye(knots.size)
    for shift, share in ((0.0, 1 / 6), (0.5, 4 / 6), (1.0, 1 / 6)):
        points = edges[:-1] + shift * width
        basis = np.stack([np.interp(points, knots, hat) for hat in hats], axis=1)
        total += (_cmfs(points) * spectrum.at(points) * width * share) @ basis
    return RGB_FROM_XYZ @ total


def _colors(problem: PaletteProblem, solution: PaletteSolution) -> np.ndarray:
    """(R, L, 3) of the returned spectra; a designed reflectance is on the grid, a given one is integrated as such."""
    shown = np.empty((len(solution.reflectances), len(solution.illuminants), 3))
    for j, light in enumerate(solution.illuminants):
        matrix = _color_matrix(problem.grid, light)
        for i, surface in enumerate(solution.reflectances):
            on_grid = surface.grid.same_as(problem.grid)
            shown[i, j] = matrix @ surface.values if on_grid else solution.actual_linear_rgb[i, j]
    return shown


def _roughness(problem: PaletteProblem) -> np.ndarray:
    waves, n = problem.grid.wavelengths_nm, problem.grid.size
    matrix = np.zeros((n, n))
    if problem.smoothness_operator == "thesis":
        for k in range(n):
            matrix[k, k] = 2
            if k:
                matrix[k, k - 1] = matrix[k - 1, k] = -1
        return matrix / (6 * np.sqrt(n))
    steps = np.diff(waves) / 10
    widths = problem.grid.cell_widths_nm / 10
    for k in range(n):
        if k + 1 < n:
            matrix[k, k + 1] += 1 / steps[k]
            matrix[k, k] -= 1 / steps[k]
        if k:
            matrix[k, k - 1] += 1 / steps[k - 1]
            matrix[k, k] -= 1 / steps[k - 1]
        matrix[k] *= np.sqrt(widths[k] / widths.sum()) / widths[k] / 6
    return matrix


def _weights(problem: PaletteProblem) -> tuple[dict[tuple[int, int], float], float]:
    """Weights of cells with requests, over their median, capped as documented; smoothness too."""
    weights = {}
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            asks = cell.mode not in (CellMode.IGNORE, CellMode.DISTINCT) and (cell.weight > 0 or cell.exact)
            if asks and not (cell.mode is CellMode.FREE and cell.box is None):
                weights[i, j] = cell.weight
    positive = sorted(weight for weight in weights.values() if weight > 0)
    if positive and positive[-1] > 1e4 * positive[0]:
        top = min(positive[-1], 1e4 * positive[(len(positive) - 1) // 2])
        weights = {at: min(max(w, top / 1e4), top) if w > 0 else w for at, w in weights.items()}
    positive = sorted(weight for weight in weights.values() if weight > 0)
    median = positive[(len(positive) - 1) // 2] if positive else 1.0
    smoothness = problem.smoothness / median
    smoothness = min(max(smoothness, 1e-6), 30.0) if smoothness > 0 else 0.0
    return {at: weight / median for at, weight in weights.items()}, smoothness


def _groups(problem: PaletteProblem, weights: dict) -> list[tuple[dict, dict, tuple[np.ndarray, np.ndarray]]]:
    """Members with weights, which are exact, and the box: cells joined by references, and lone boxed cells."""
    sets: list[set] = []
    weight_of: dict = {}
    exact_of: dict = {}
    for (i, j), weight in weights.items():
        cell = problem.cells[i][j]
        if cell.mode in (CellMode.SAME, CellMode.CONSTANT) or cell.box is not None:
            joined = {(i, j), *cell.others}
            for member in joined:
                weight_of[member] = max(weight, weight_of.get(member, 0.0))
                exact_of[member] = cell.exact or exact_of.get(member, False)
            for old in [each for each in sets if each & joined]:
                sets.remove(old)
                joined |= old
            sets.append(joined)
    found = []
    for members in sets:
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        for i, j in members:
            box = problem.cells[i][j].box
            if box is not None and (i, j) in weights:
                low, high = np.maximum(low, box[0]), np.minimum(high, box[1])
        ordered = sorted(members)
        found.append(({m: weight_of[m] for m in ordered}, {m: exact_of[m] for m in ordered}, (low, high)))
    return found


def _best_common(members: dict, exact: dict, box: tuple, metric: np.ndarray, shown: np.ndarray) -> np.ndarray:
    held = [cell for cell in members if exact[cell]]
    if held:
        return shown[held[0]]
    total, right = np.zeros((3, 3)), np.zeros(3)
    for cell, weight in members.items():
        gram = weight**2 * metric[cell].T @ metric[cell]
        total += gram
        right += gram @ shown[cell]
    free = np.linalg.lstsq(total, right, rcond=None)[0]
    if np.all((free >= box[0]) & (free <= box[1])) or np.any(box[0] >= box[1]):
        return np.clip(free, *box)
    # Under a metric the channels depend on each other: the best color of the box is not the clipped one.
    values, vectors = np.linalg.eigh(total)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return lsq_linear(root, root @ free, bounds=box, tol=1e-14, method="bvls").x


def _metrics(problem: PaletteProblem, shown: np.ndarray) -> np.ndarray:
    """(R, L, 3, 3): identity, or the slope of CIELAB / 100 at each target or middle, by differences."""
    if problem.match == "linear":
        return np.broadcast_to(np.eye(3), (*shown.shape[:2], 3, 3))
    at = shown.copy()
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.mode in (CellMode.FIXED, CellMode.BLACK) and (cell.weight > 0 or cell.exact):
                at[i, j] = 0.0 if cell.target is None else cell.target
    for members, _, _ in _groups(problem, _weights(problem)[0]):
        middle = np.mean([at[cell] for cell in members], axis=0)
        for cell in members:
            at[cell] = middle
    slopes = []
    for axis in range(3):
        step = 1e-7 * np.eye(3)[axis]
        slopes.append((lab_from_linear_rgb(at + step) - lab_from_linear_rgb(at - step)) / 2e-7 / 100)
    return np.stack(slopes, axis=-1)
