# SPDX-License-Identifier: GPL-3.0-or-later
"""The statement of a palette for ``optimality``, written from docs/palette.md alone.

Its own integrals, roughness, caps of weights and smoothness, groups and metric; it shares only data with the product.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from spectral_core.palette import CellMode, PaletteProblem, PaletteSolution
from spectral_core.spectra.catalogue import color_matching_functions
from spectral_core.spectra.color import RGB_FROM_XYZ, lab_from_linear_rgb


def _cmfs(wavelengths: np.ndarray) -> np.ndarray:
    knots, table = color_matching_functions("cie_1931_2deg")
    return np.stack([np.interp(wavelengths, knots, row, left=0, right=0) for row in table])


def color_matrix(grid: Any, spectrum: Any) -> np.ndarray:
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


def colors(problem: PaletteProblem, solution: PaletteSolution) -> np.ndarray:
    """(R, L, 3) of the returned spectra; a designed reflectance is on the grid, a given one is integrated as such."""
    shown = np.empty((len(solution.reflectances), len(solution.illuminants), 3))
    for j, light in enumerate(solution.illuminants):
        matrix = color_matrix(problem.grid, light)
        for i, surface in enumerate(solution.reflectances):
            on_grid = surface.grid.same_as(problem.grid)
            shown[i, j] = matrix @ surface.values if on_grid else solution.actual_linear_rgb[i, j]
    return shown


def roughness(problem: PaletteProblem) -> np.ndarray:
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


def weights(problem: PaletteProblem) -> tuple[dict[tuple[int, int], float], float]:
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


def groups(problem: PaletteProblem, weights: dict) -> list[tuple[dict, dict, tuple[np.ndarray, np.ndarray]]]:
    """Members with weights, which are exact, and the box: cells joined by references, and lone boxed cells.

    No soft request makes exact ones harder: where it would, exact cells and soft ones are joined separately.
    """
    asking = {
        at: cell
        for at in weights
        for cell in [problem.cells[at[0]][at[1]]]
        if cell.mode in (CellMode.SAME, CellMode.CONSTANT) or cell.box is not None
    }
    found = []
    for part in _connected(asking):
        exact = _connected({at: cell for at, cell in part.items() if cell.exact})
        soft = {at: cell for at, cell in part.items() if not cell.exact}
        binds = len(exact) > 1 or (len(exact) == 1 and any(cell.box is not None for cell in soft.values()))
        for own in [*exact, *_connected(soft)] if binds else [part]:
            weight_of: dict = {}
            exact_of: dict = {}
            low, high = np.full(3, -np.inf), np.full(3, np.inf)
            for at, cell in own.items():
                for member in {at, *cell.others}:
                    weight_of[member] = max(weights[at], weight_of.get(member, 0.0))
                    exact_of[member] = cell.exact or exact_of.get(member, False)
                if cell.box is not None:
                    low, high = np.maximum(low, cell.box[0]), np.minimum(high, cell.box[1])
            ordered = sorted(weight_of)
            found.append(({m: weight_of[m] for m in ordered}, {m: exact_of[m] for m in ordered}, (low, high)))
    return found


def _connected(asking: dict) -> list[dict]:
    """Asking cells in parts that share no cell, by spreading from each."""
    left, parts = dict(asking), []
    while left:
        first = next(iter(left))
        part, reached = {first: left.pop(first)}, {first, *asking[first].others}
        while near := [at for at, cell in left.items() if reached & {at, *cell.others}]:
            for at in near:
                part[at] = left.pop(at)
                reached |= {at, *part[at].others}
        parts.append(part)
    return parts


def best_common(members: dict, exact: dict, box: tuple, metric: np.ndarray, shown: np.ndarray) -> np.ndarray:
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


def metrics(problem: PaletteProblem, shown: np.ndarray) -> np.ndarray:
    """(R, L, 3, 3): identity, or the slope of CIELAB / 100 at each target or middle in a box, by differences."""
    if problem.match == "linear":
        return np.broadcast_to(np.eye(3), (*shown.shape[:2], 3, 3))
    at = shown.copy()
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.mode in (CellMode.FIXED, CellMode.BLACK) and (cell.weight > 0 or cell.exact):
                at[i, j] = 0.0 if cell.target is None else cell.target
    for members, _, (low, high) in groups(problem, weights(problem)[0]):
        middle = np.mean([at[cell] for cell in members], axis=0)
        with np.errstate(invalid="ignore"):  # no box is from minus infinity to infinity
            middle = np.where(low > high, (low + high) / 2, np.minimum(np.maximum(middle, low), high))
        for cell in members:
            at[cell] = middle
    slopes = []
    for axis in range(3):
        step = 1e-7 * np.eye(3)[axis]
        slopes.append((lab_from_linear_rgb(at + step) - lab_from_linear_rgb(at - step)) / 2e-7 / 100)
    return np.stack(slopes, axis=-1)
