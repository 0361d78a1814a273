# SPDX-License-Identifier: GPL-3.0-or-later
"""One side of a palette as unknown, the other as known: color matrices of cells, and rows while they are gathered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import subspace_errors
from spectral_core.palette.assemble.wishes import Condition
from spectral_core.palette.live.state import PaletteState
from spectral_core.palette.problem import CellIndex, PaletteLight, PaletteProblem, PaletteReflectance
from spectral_core.palette.qp.least_squares import Block

Array = NDArray[np.float64]
Side = Literal["reflectances", "lights"]


def free_items(problem: PaletteProblem, side: Side) -> tuple[int, ...]:
    """Indices of what is to be designed on a side."""
    items: Sequence[PaletteLight | PaletteReflectance] = getattr(problem, side)
    return tuple(k for k, item in enumerate(items) if item.free)


class Rows:
    """Rows of one block while they are gathered."""

    def __init__(self) -> None:
        self.matrices: list[Array] = []
        self.pulls: list[float] = []
        self.targets: list[Array] = []
        self.equal_matrices: list[Array] = []
        self.equal_targets: list[Array] = []

    def add(self, matrix: Array, target: Array, pull: float = np.inf) -> None:
        self.matrices.append(matrix)
        self.targets.append(target)
        self.pulls.append(pull)

    def equal(self, matrix: Array, target: Array) -> None:
        self.equal_matrices.append(matrix)
        self.equal_targets.append(target)

    def block(self, size: int, low: float, high: float) -> Block:
        def stack(matrices: list[Array], targets: list[Array]) -> tuple[Array, Array]:
            return (
                (np.concatenate(matrices), np.concatenate(targets)) if matrices else (np.zeros((0, size)), np.zeros(0))
            )

        soft, hard = stack(self.matrices, self.targets), stack(self.equal_matrices, self.equal_targets)
        return Block(*soft, np.full(size, low), np.full(size, high), *hard, tuple(self.pulls))


class View:
    """One side as unknown, the other as known: color matrices of cells, whichever way round."""

    def __init__(
        self, problem: PaletteProblem, conditions: tuple[Condition, ...], side: Side, state: PaletteState
    ) -> None:
        self.side, self.state = side, state
        self.problem, self.conditions = problem, conditions
        self.items = free_items(problem, side)
        self._block = {item: k for k, item in enumerate(self.items)}
        self._axis = 0 if side == "reflectances" else 1
        self._matrices: dict[int | None, Array] = {}
        self._colors: dict[int, Array] = {}

    def block_of(self, cell: CellIndex) -> int | None:
        """Block of the cell's unknown factor, None where it is known."""
        return self._block.get(cell[self._axis])

    def known_of(self, cell: CellIndex) -> int:
        """Index of the cell's known factor."""
        return cell[1 - self._axis]

    def sees(self, cell: CellIndex, condition: int) -> bool:
        """Whether a cell looks different under this condition: another observer's, or a variant that its light has."""
        variant = self.conditions[condition].variant
        return variant is None or variant < len(self.problem.lights[cell[1]].variants)

    def basis_of(self, item: int) -> Array | None:
        """Primaries (m, p) of a light, None for a spectrum on the grid."""
        return self.state.light_bases[item] if self.side == "lights" else None

    def size_of(self, item: int) -> int:
        """Number of unknowns of an item."""
        basis = self.basis_of(item)
        return self.problem.grid.size if basis is None else int(basis.shape[1])

    def color_row(self, cell: CellIndex, condition: int) -> tuple[int | None, Array, Array]:
        """Block, matrix (3, p) and offset (3,) with color = matrix @ block + offset."""
        block = self.block_of(cell)
        if block is None:
            if condition not in self._colors:
                self._colors[condition] = self.state.colors(self.conditions[condition])
            return None, np.zeros((3, 0)), self._colors[condition][cell]
        seen = self.conditions[condition]
        basis = self.basis_of(cell[self._axis])
        if basis is not None:
            known = self._known_at_points(seen.variant)[self.known_of(cell)]
            return block, (self.state.kernel.rgb_cmfs[seen.observer] * known) @ basis, np.zeros(3)
        return block, self._matrices_of(seen)[self.known_of(cell)], np.zeros(3)

    def _known_at_points(self, variant: int | None) -> Array:
        if self.side == "lights":
            return self.state.reflectances_at_points()
        return self.state.lights_at_points(variant)

    def _matrices_of(self, seen: Condition) -> Array:
        variant = seen.variant if self.side == "reflectances" else None
        if variant not in self._matrices:
            self._matrices[variant] = self.state.kernel.matrices(self._known_at_points(variant))
        return self._matrices[variant][seen.observer]

    def subspace_errors(self) -> Array:
        """F (k, 3, n) for every known factor."""
        known = self._known_at_points(None)
        knots = self.problem.grid.wavelengths_nm
        on_grid = np.stack([np.interp(knots, self.state.kernel.points_nm, row) for row in known])
        bare = self.state.kernel.matrices(np.ones((1, known.shape[1])))[0, 0]
        return subspace_errors(self.problem, on_grid, self.state.kernel.matrices(known)[0], bare)

    def on_grid(self, block: int, matrix: Array) -> Array:
        """A matrix over grid values as one over the block's unknowns."""
        basis = self.basis_of(self.items[block])
        if basis is None:
            return matrix
        knots, points = self.problem.grid.wavelengths_nm, self.state.kernel.points_nm
        return matrix @ np.stack([np.interp(knots, points, primary) for primary in basis.T], axis=1)

    def bare_light(self, item: int) -> Array:
        """Linear RGB (3, p) of a light by itself, from its unknowns."""
        basis = self.basis_of(item)
        if basis is not None:
            return self.state.kernel.rgb_cmfs[0] @ basis
        return self.state.kernel.matrices(np.ones((1, self.state.kernel.points_nm.size)))[0, 0]
