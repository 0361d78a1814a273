# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells of a palette that should differ: their colors as functions of the unknowns, and ΔE2000 with its slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.palette.assemble.side import Assembled, Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.problem import CellIndex, CellMode, PaletteProblem
from spectral_core.palette.solution import PaletteSolution
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb

Array = NDArray[np.float64]

UNIT_WORTH = 0.5 * 0.01**2 / 3
"""κ: cost of an error of 0.01 in linear RGB in a cell of weight 1 (rows are divided by √3)."""
NUDGE = 1e-4
"""Step of the differences that give the slope of ΔE2000, in CIELAB."""
NOISE = 1e-2
"""ΔE2000 below which two colors count as one; they are then separated in a random direction."""


@dataclass(frozen=True, eq=False)
class DistinctCells:
    """Cells that should differ, and their colors as functions of the unknowns.

    ``matrices``: (C, 3, N) and ``offsets``: (C, 3) with color = matrix @ x + offset; ``pairs``: (P, 2) indices of
    cells; ``lower``, ``upper``: (C, 3) linear RGB bounds of each cell; ``worth``: weight of one unit of the least
    ΔE2000.
    """

    cells: tuple[CellIndex, ...]
    pairs: NDArray[np.intp]
    matrices: Array
    offsets: Array
    lower: Array
    upper: Array
    worth: float

    def colors(self, x: Array) -> Array:
        """Linear RGB (C, 3)."""
        return self.matrices @ x + self.offsets

    def differences(self, colors: Array) -> Array:
        """ΔE2000 of every pair, (P,)."""
        lab = lab_from_linear_rgb(colors)
        return delta_e_2000(lab[self.pairs[:, 0]], lab[self.pairs[:, 1]])

    def slopes(self, colors: Array, rng: np.random.Generator) -> Array:
        """d(ΔE2000)/d(Lab) of every pair to its first and its second color, (2, P, 3): central differences."""
        lab = lab_from_linear_rgb(colors)
        ends = np.stack([lab[self.pairs[:, 0]], lab[self.pairs[:, 1]]])
        # Nudged end (2), axis (3), sign (2): all in one call.
        nudged = np.tile(ends, (2, 3, 2, 1, 1, 1))
        for end in range(2):
            for axis in range(3):
                nudged[end, axis, :, end, :, axis] += np.array([[-NUDGE], [NUDGE]])
        low, high = np.moveaxis(delta_e_2000(nudged[..., 0, :, :], nudged[..., 1, :, :]), 2, 0)
        slopes = np.moveaxis((high - low) / (2 * NUDGE), 1, 2)
        same = delta_e_2000(*ends) < NOISE  # no slope is defined where two colors coincide
        directions = rng.normal(size=(int(same.sum()), 3))
        slopes[0, same] = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        slopes[1, same] = -slopes[0, same]
        return slopes


def wants_distinct(problem: PaletteProblem) -> bool:
    """True if a pair of distinct cells has a reflectance to design."""
    return bool(distinct_pairs(problem))


def distinct_pairs(problem: PaletteProblem) -> list[tuple[CellIndex, CellIndex]]:
    """Pairs of cells that should differ, each once; a cell of weight 0 has no request.

    No design changes a pair of measured materials, and its difference would limit those of all others.
    """
    pairs = set()
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            if cell.mode is CellMode.DISTINCT and cell.weight > 0:
                pairs |= {(min((i, j), other), max((i, j), other)) for other in cell.others}
    return sorted(pair for pair in pairs if any(problem.reflectances[i].free for i, _ in pair))


def least_difference(solution: PaletteSolution) -> float:
    """Least ΔE2000 over the pairs of cells that should differ; inf without such pairs."""
    lab = lab_from_linear_rgb(solution.actual_linear_rgb)
    return min((float(delta_e_2000(lab[a], lab[b])) for a, b in distinct_pairs(solution.problem)), default=np.inf)


def distinct_cells(builder: Assembler, state: PaletteState, assembled: Assembled) -> DistinctCells:
    """The cells of a problem that should differ, as functions of the unknowns of its reflectance phase."""
    problem, linked, items = builder.problem, assembled.quadratic, assembled.items
    pairs = distinct_pairs(problem)
    cells = tuple(sorted({cell for pair in pairs for cell in pair}))
    block_of = {item: k for k, item in enumerate(items)}
    if not any(cell[0] in block_of for cell in cells):
        raise InvalidInputError(
            "no cell with a reflectance to design is 'distinct'; make one distinct, or let its reflectance be designed"
        )
    by_light = state.light_matrices()[0]
    shown = state.colors()
    matrices, offsets = np.zeros((len(cells), 3, linked.size)), np.zeros((len(cells), 3))
    lower, upper = np.full((len(cells), 3), -np.inf), np.full((len(cells), 3), np.inf)
    for index, cell in enumerate(cells):
        if cell[0] not in block_of:
            offsets[index] = shown[cell]
            continue
        begin = int(linked.offsets[block_of[cell[0]]])
        matrices[index][:, begin : begin + problem.grid.size] = by_light[cell[1]]
        white = by_light[cell[1]].sum(axis=1)
        # A lamp itself may be outside the gamut; objects in its light may then be as far outside as its white.
        lower[index], upper[index] = np.minimum(0.0, white), np.maximum(1.0, np.where(white < 0, 1.0, 0.0))
    number = {cell: index for index, cell in enumerate(cells)}
    weights = [problem.cells[i][j].weight for i, j in cells if problem.cells[i][j].mode is CellMode.DISTINCT]
    return DistinctCells(
        cells,
        np.array([(number[a], number[b]) for a, b in pairs]),
        matrices,
        offsets,
        lower,
        upper,
        UNIT_WORTH * max(max(weights), 1e-9) / builder.requests.weight_scale**2,
    )
