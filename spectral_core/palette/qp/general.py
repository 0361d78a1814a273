# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette stated in cvxpy, directly from its cells: slow, short, and the oracle of the fast engines.

It shares no code with ``assemble`` or the engines, except the second differences. Needs the extra ``general``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import MissingDependencyError, SolveError
from spectral_core.palette.assemble.criteria import second_differences
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem
from spectral_core.spectra.color import RGB_FROM_XYZ
from spectral_core.spectra.observer import xyz_from_product
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]


def cvxpy_module() -> Any:
    """The module cvxpy. Raises MissingDependencyError without it."""
    try:
        import cvxpy
    except ImportError as error:
        raise MissingDependencyError.package("cvxpy", "the general statement of a palette", "general") from error
    return cvxpy


def stated_reflectances(problem: PaletteProblem, lights: list[Spectrum] | None = None) -> tuple[Any, list[Any]]:
    """Best reflectances under given lights as a cvxpy problem, and its variables, one (n,) per reflectance.

    Eqs. 5.14 and 5.16 cell by cell, for linear color match and the first observer. ``lights``: instead of the problem's
    own, on any grids.
    """
    cp = cvxpy_module()
    shown = lights or [light.spectrum for light in problem.lights]
    colors = [RGB_FROM_XYZ @ xyz_from_product(light, problem.grid) for light in shown]
    low, high = problem.reflectance_bounds
    spectra = [cp.Variable(problem.grid.size) for _ in problem.reflectances]
    roughness = problem.smoothness * second_differences(problem.grid, problem.smoothness_operator)
    bounds = [spectrum >= low for spectrum in spectra] if np.isfinite(low) else []
    bounds += [spectrum <= high for spectrum in spectra] if np.isfinite(high) else []
    # Eq. 5.14: roughness of each spectrum, beside the color errors of the cells below.
    terms = [cp.sum_squares(roughness @ spectrum) for spectrum in spectra]
    held = []
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            wanted = cell.target if cell.mode is CellMode.FIXED else np.zeros(3)
            if cell.mode in (CellMode.FIXED, CellMode.BLACK):
                difference = colors[j] @ spectra[i] - wanted
                # A third, because a cell is three rows and its weight is meant for the color as a whole.
                terms += [] if cell.exact else [cell.weight**2 / 3 * cp.sum_squares(difference)]
                held += [difference == 0] if cell.exact else []
    # Eq. 5.16: cells that should look alike share one free color, within the box where a cell has one.
    for members, weights, exact, box in _equal_cells(problem):
        common = cp.Variable(3)
        held += [common >= box[0]] if np.isfinite(box[0]).all() else []
        held += [common <= box[1]] if np.isfinite(box[1]).all() else []
        for (i, j), weight in zip(members, weights, strict=True):
            difference = colors[j] @ spectra[i] - common
            terms += [] if exact else [weight**2 / 3 * cp.sum_squares(difference)]
            held += [difference == 0] if exact else []
    return cp.Problem(cp.Minimize(cp.sum(cp.hstack(terms)) / 2), bounds + held), spectra


def _equal_cells(problem: PaletteProblem) -> list[tuple[list[CellIndex], list[float], bool, Array]]:
    """Groups of cells that "same" and "constant" join, by repeated merging: members, weights, exactness, box."""
    groups: list[set[CellIndex]] = []
    weights: dict[CellIndex, float] = {}
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.mode in (CellMode.SAME, CellMode.CONSTANT) or cell.box is not None:
                merged = {(i, j), *cell.others}
                for member in merged:
                    weights[member] = max(weights.get(member, 0.0), cell.weight)
                # Equality is transitive: groups that share a cell are one group.
                for group in [group for group in groups if group & merged]:
                    groups.remove(group)
                    merged |= group
                groups.append(merged)
    result = []
    for group in groups:
        boxes = [cell.box for cell in (problem.cells[i][j] for i, j in group) if cell.box is not None]
        low = np.max([box[0] for box in boxes], axis=0) if boxes else np.full(3, -np.inf)
        high = np.min([box[1] for box in boxes], axis=0) if boxes else np.full(3, np.inf)
        exact = any(problem.cells[i][j].exact for i, j in group if problem.cells[i][j].others)
        members = sorted(group)
        result.append((members, [weights[member] for member in members], exact, np.stack([low, high])))
    return result


def reflectances_by_cvxpy(
    problem: PaletteProblem, lights: list[Spectrum] | None = None, *, solver: str = "CLARABEL", **options: float
) -> Array:
    """Solve ``stated_reflectances``: (R, n). Raises SolveError if cvxpy finds no optimum."""
    cp = cvxpy_module()
    statement, spectra = stated_reflectances(problem, lights)
    try:
        statement.solve(solver=solver, **options)
    except cp.error.SolverError as error:
        raise SolveError(f"cvxpy with {solver} failed: {error}") from error
    if statement.status not in ("optimal", "optimal_inaccurate"):
        raise SolveError(f"cvxpy with {solver} ended as {statement.status}")
    return np.stack([spectrum.value for spectrum in spectra])
