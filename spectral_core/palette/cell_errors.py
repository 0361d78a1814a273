# SPDX-License-Identifier: GPL-3.0-or-later
"""Color errors of cells as an artist reads them: each cell against its request.

A *fixed* or *black* cell is compared with its color, a *same* or *constant* cell with the cells that it refers to (the
farthest one counts), a cell with a box with the nearest color in it. Cells that hold for several observers or variants
of a light have the largest error over all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.requests import Group, Requests
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CellErrors:
    """Errors of all cells of a table."""

    target_linear_rgb: Array
    """(R, L, 3): the color that the cell is compared with, for the first observer; NaN without a request."""
    delta_e_2000: Array
    """(R, L): largest ΔE2000 over observers and variants; NaN without a request."""
    worst_pair_delta_e_2000: float
    """Largest ΔE2000 between any two cells with equal requested colors; 0 without such cells."""

    @property
    def largest(self) -> float:
        """Largest error of any cell or pair; 0 without requests."""
        return max(float(np.nanmax(self.delta_e_2000, initial=0.0)), self.worst_pair_delta_e_2000)


def cell_errors(problem: PaletteProblem, requests: Requests, shown: Sequence[Array]) -> CellErrors:
    """Compare every cell with its request.

    Parameters
    ----------
    problem
        The palette.
    requests
        Its cells as read by ``compiled_requests``.
    shown
        Linear RGB (R, L, 3) of all cells, one array per condition of ``requests``.
    """
    shape = shown[0].shape[:2]
    comparisons = _comparisons(problem, requests, shown)
    target, error = np.full((*shape, 3), np.nan), np.full(shape, np.nan)
    if comparisons:
        actual = np.array([shown[condition][cell] for cell, condition, _ in comparisons])
        wanted = np.array([color for _, _, color in comparisons])
        differences = delta_e_2000(lab_from_linear_rgb(wanted), lab_from_linear_rgb(actual))
        for (cell, condition, color), difference in zip(comparisons, differences.tolist(), strict=True):
            first = np.isnan(error[cell])
            if condition == 0 and (first or difference >= error[cell]):
                target[cell] = color
            if first or difference > error[cell]:
                error[cell] = difference
    pairs = [_worst_pair(group, colors) for group in requests.groups for colors in shown]
    return CellErrors(target, error, max(pairs, default=0.0))


Comparison = tuple[CellIndex, int, Array]
"""Cell, condition, and the color that it is compared with."""


def _comparisons(problem: PaletteProblem, requests: Requests, shown: Sequence[Array]) -> list[Comparison]:
    """The requests of all cells; comparisons of condition 0 come before the others of the same cell."""
    found: list[Comparison] = [(target.cell, 0, target.color) for target in requests.targets]
    found += [(black.cell, number, black.color) for number in range(1, len(shown)) for black in requests.blacks]
    own = {target.cell for target in requests.targets}
    for group in requests.groups:
        for i, j in group.members:
            if (i, j) in own:
                continue
            cell = problem.cells[i][j]
            # A cell of weight 0 is a member because another one refers to it; its own request does not count.
            asks = cell.weight > 0 or cell.exact
            box = cell.box if asks else None
            if box is not None:
                found.append(((i, j), 0, np.clip(shown[0][i, j], box[0], box[1])))
            refers = asks and cell.mode in (CellMode.SAME, CellMode.CONSTANT)
            others = cell.others if refers else tuple(other for other in group.members if other != (i, j))
            found += [((i, j), number, colors[other]) for number, colors in enumerate(shown) for other in others]
    return found


def _worst_pair(group: Group, colors: Array) -> float:
    """Largest ΔE2000 between two members of a group."""
    lab = lab_from_linear_rgb(np.array([colors[cell] for cell in group.members]))
    if len(lab) < 2:
        return 0.0
    first, second = np.triu_indices(len(lab), 1)
    return float(delta_e_2000(lab[first], lab[second]).max())
