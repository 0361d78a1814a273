# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether exact cells can hold together: a linear program stated from docs/palette.md, with integrals of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from benchmarks.palette.checks.statement import groups, weights
from spectral_core.palette import CellMode, PaletteProblem, PaletteSolution
from spectral_core.spectra.catalogue import color_matching_functions
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.spectrum import Illuminant

POINTS, SHARES = np.polynomial.legendre.leggauss(4)
SCALE = 1e3
"""The program takes coefficients below 1e-9 for 0."""


def _pieces(*knots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    low, high = max(each[0] for each in knots), min(each[-1] for each in knots)
    edges = np.unique(np.concatenate(knots))
    edges = edges[(edges >= low) & (edges <= high)]
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    return (middle[:, None] + half[:, None] * POINTS).ravel(), (half[:, None] * SHARES).ravel()


def color_matrix(grid: Any, light: Any) -> np.ndarray:
    """(3, n) from a reflectance that is linear between the knots of ``grid`` to linear sRGB."""
    knots, table = color_matching_functions("cie_1931_2deg")
    waves = np.asarray(grid.wavelengths_nm)
    at, width = _pieces(waves, knots, np.asarray(light.grid.wavelengths_nm))
    power = width * np.interp(at, light.grid.wavelengths_nm, light.values)
    seen = np.stack([np.interp(at, knots, row) for row in table]) * power
    left = np.clip(np.searchsorted(waves, at) - 1, 0, waves.size - 2)
    right = (at - waves[left]) / (waves[left + 1] - waves[left])
    found = np.zeros((3, waves.size))
    for row, values in zip(found, seen, strict=True):
        np.add.at(row, left, values * (1 - right))
        np.add.at(row, left + 1, values * right)
    return np.asarray(RGB_FROM_XYZ @ found)


def of_luminance(light: Illuminant, level: float) -> Illuminant:
    """The light with ∫ E ȳ dλ = level."""
    knots, table = color_matching_functions("cie_1931_2deg")
    at, width = _pieces(knots, np.asarray(light.grid.wavelengths_nm))
    total = width @ (np.interp(at, light.grid.wavelengths_nm, light.values) * np.interp(at, knots, table[1]))
    return Illuminant(light.name, light.grid, np.asarray(light.values) * level / total)


def _rows(problem: PaletteProblem) -> tuple[sparse.csr_matrix, np.ndarray, np.ndarray, np.ndarray]:
    """Exact rows over (reflectances, common colors), their right-hand sides, and the bounds of the unknowns."""
    n, count = problem.grid.size, len(problem.reflectances)
    matrices = [color_matrix(problem.grid, light.spectrum) for light in problem.lights]
    joined = groups(problem, weights(problem)[0])
    size = n * count + 3 * len(joined)
    low, high = np.full(size, -np.inf), np.full(size, np.inf)
    low[: n * count], high[: n * count] = problem.reflectance_bounds
    found, right = [sparse.csr_matrix((0, size))], [np.zeros(0)]

    def hold(i: int, j: int, color: np.ndarray, group: int | None) -> None:
        rows = sparse.lil_matrix((3, size))
        rows[:, i * n : (i + 1) * n] = matrices[j]
        for channel in range(3) if group is not None else ():
            rows[channel, n * count + 3 * group + channel] = -1.0
        found.append(rows.tocsr())
        right.append(color)

    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.exact and cell.mode in (CellMode.FIXED, CellMode.BLACK):
                hold(i, j, np.zeros(3) if cell.target is None else np.asarray(cell.target), None)
    for number, (members, exact, box) in enumerate(joined):
        begin = n * count + 3 * number
        low[begin : begin + 3], high[begin : begin + 3] = box
        for i, j in members:
            if exact[i, j]:
                hold(i, j, np.zeros(3), number)
    return sparse.vstack(found, format="csr"), np.concatenate(right), low, high


def least_miss(problem: PaletteProblem) -> float:
    """The least possible error of the worst exact cell of designed materials under measured lights, in linear RGB."""
    rows, right, low, high = _rows(problem)
    if not right.size:
        return 0.0
    worst = sparse.csr_matrix(np.ones((right.size, 1)))
    found = linprog(
        np.append(np.zeros(low.size), 1.0),
        A_ub=sparse.bmat([[SCALE * rows, -worst], [-SCALE * rows, -worst]], format="csr"),
        b_ub=SCALE * np.concatenate([right, -right]),
        bounds=np.stack([np.append(low, 0.0), np.append(high, np.inf)], axis=1),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if found.status != 0:
        return float("nan")
    return float(np.abs(rows @ np.clip(found.x[:-1], low, high) - right).max())


def exact_miss(problem: PaletteProblem, solution: PaletteSolution) -> float:
    """The error of the worst exact cell at the returned reflectances, by the integrals of this module."""
    rows, right, low, _ = _rows(problem)
    if not right.size:
        return 0.0
    values = np.concatenate([np.asarray(surface.values) for surface in solution.reflectances])
    shown = rows[:, : values.size] @ values
    links = rows[:, values.size :]
    # The common color of exact cells is whatever they show: the least-squares one has the least error.
    common = np.linalg.lstsq(links.toarray(), right - shown, rcond=None)[0] if low.size > values.size else np.zeros(0)
    return float(np.abs(shown + links @ common - right).max())
