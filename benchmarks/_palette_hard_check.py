# SPDX-License-Identifier: GPL-3.0-or-later
"""A second opinion on optimality, from the cells alone: nothing of the library's assembly or engines is used."""

from __future__ import annotations

import numpy as np

from spectral_core.palette import CellMode, PaletteSolution
from spectral_core.palette.assemble.criteria import REFERENCE_STEP_NM, second_differences
from spectral_core.palette.assemble.wishes import SMOOTHNESS_RANGE, WEIGHT_RATIO
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import xyz_from_product


def independent_kkt(solution: PaletteSolution) -> float:
    """Scaled projected gradient of the side that was solved last, for palettes without groups and exact cells.

    Other palettes give 0: their multipliers and free colors are not part of a solution.
    """
    problem = solution.problem
    plain = {CellMode.FIXED, CellMode.BLACK, CellMode.IGNORE}
    cells = [cell for row in problem.cells for cell in row]
    if problem.match != "linear" or any(cell.mode not in plain or cell.exact or cell.box is not None for cell in cells):
        return 0.0
    lights_last = any(light.free for light in problem.lights)
    unknown = solution.illuminants if lights_last else solution.reflectances
    known = solution.reflectances if lights_last else solution.illuminants
    designed = [light.free for light in problem.lights] if lights_last else [item.free for item in problem.reflectances]
    bounds = problem.light_bounds if lights_last else problem.reflectance_bounds
    weights, scale = _weights(solution)
    smoothness = problem.smoothness / scale
    if smoothness > 0:
        smoothness = float(np.clip(smoothness, *SMOOTHNESS_RANGE)) * (REFERENCE_STEP_NM if lights_last else 1.0)
    rough = smoothness * second_differences(problem.grid, problem.smoothness_operator)
    matrices = [RGB_FROM_XYZ @ xyz_from_product(each, problem.grid) for each in known]
    worst = 0.0
    for k, spectrum in enumerate(unknown):
        if not designed[k]:
            continue
        rows, targets = [rough], [np.zeros(len(rough))]
        lightest = np.inf
        for other, matrix in enumerate(matrices):
            i, j = (other, k) if lights_last else (k, other)
            cell = problem.cells[i][j]
            if cell.mode is not CellMode.IGNORE:
                lightest = min(lightest, _pull(weights[i, j], matrix))
                rows.append(weights[i, j] / np.sqrt(3) * matrix)
                wanted = cell.target if cell.target is not None else np.zeros(3)
                targets.append(weights[i, j] / np.sqrt(3) * wanted)
        worst = max(worst, _residual(np.concatenate(rows), np.concatenate(targets), spectrum.values, bounds, lightest))
    return worst


def _pull(weight: float, matrix: np.ndarray) -> float:
    """Gradient of an error of 1 in a cell's color; infinite for cells that show none."""
    shown = weight > 0 and np.abs(matrix).sum(axis=1).max() >= 1e-7
    return weight**2 / 3 * float(np.abs(matrix).max()) if shown else np.inf


def _weights(solution: PaletteSolution) -> tuple[np.ndarray, float]:
    """Capped weights as the documentation states them: within a ratio of 1e3 below 1e3 times the lower median."""
    cells = solution.problem.cells
    weights = np.array([[0.0 if c.mode is CellMode.IGNORE else c.weight for c in row] for row in cells])
    positive = np.sort(weights[weights > 0])
    if positive.size == 0:
        return weights, 1.0
    if positive[-1] > WEIGHT_RATIO * positive[0]:
        top = min(positive[-1], WEIGHT_RATIO * positive[(positive.size - 1) // 2])
        weights = np.where(weights > 0, np.clip(weights, top / WEIGHT_RATIO, top), 0.0)
    largest = float(weights.max())
    return weights / largest, largest


def _residual(
    matrix: np.ndarray, target: np.ndarray, x: np.ndarray, bounds: tuple[float, float], lightest: float
) -> float:
    gradient = matrix.T @ (matrix @ x - target)
    scale = max(float((matrix**2).sum(axis=0).max()), float(np.abs(matrix.T @ target).max())) or 1.0
    return float(np.abs(x - np.clip(x - gradient / min(scale, lightest), *bounds)).max())
