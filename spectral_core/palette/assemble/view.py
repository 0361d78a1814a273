# SPDX-License-Identifier: GPL-3.0-or-later
"""One side of a palette as unknown, the other as known: the color matrices of cells, for either side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.criteria import subspace_errors
from spectral_core.palette.assemble.requests import Condition, Requests
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.problem import CellIndex, PaletteProblem

Array = NDArray[np.float64]
Side = Literal["reflectances", "lights"]


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """Three rows of a block: one cell in one condition."""

    condition: int
    cell: CellIndex
    color: Array | None
    """The target; None if the cell shares the free color ``column``."""
    column: int | None
    weight: float
    """Squared; infinite for an exact row."""
    own_weight: float
    """Squared, for exact rows too."""


class View:
    """One side as unknown, the other as known: matrices of cells, for either side."""

    def __init__(
        self,
        problem: PaletteProblem,
        requests: Requests,
        side: Side,
        state: PaletteState,
        items: tuple[int, ...],
        metric: Array | None,
    ) -> None:
        self.side, self.state, self.metric = side, state, metric
        self.requests = requests
        self._problem, self._conditions = problem, requests.conditions
        self._items = frozenset(items)
        self._axis = 0 if side == "reflectances" else 1
        self._matrices: dict[int | None, Array] = {}
        self._colors: dict[int, Array] = {}
        self._subspace: Array | None = None

    def condition(self, number: int) -> Condition:
        """The observer and variant of a condition."""
        return self._conditions[number]

    def is_unknown(self, cell: CellIndex) -> bool:
        """True if the cell's factor on this side is designed."""
        return cell[self._axis] in self._items

    def cells_of(self, item: int) -> list[CellIndex]:
        """All cells of an item."""
        if self.side == "reflectances":
            return [(item, j) for j in range(len(self._problem.lights))]
        return [(i, item) for i in range(len(self._problem.reflectances))]

    def sees(self, cell: CellIndex, condition: int) -> bool:
        """True if a cell has another color under this condition: for another observer, or a variant of its light."""
        variant = self._conditions[condition].variant
        return variant is None or variant < len(self._problem.lights[cell[1]].variants)

    def has_primaries(self, item: int) -> bool:
        """True if an item consists of amounts of primaries."""
        return self.side == "lights" and self.state.given.primaries[item] is not None

    def size_of(self, item: int) -> int:
        """Number of unknowns of an item."""
        primaries = self.state.given.primaries[item] if self.side == "lights" else None
        return self._problem.grid.size if primaries is None else len(primaries)

    def limits_of(self, item: int) -> tuple[Array, Array]:
        """Least and greatest values of an item, (p,) each."""
        if self.side == "lights":
            return self.state.light_limits(item, self._problem.light_bounds)
        low, high = self._problem.reflectance_bounds
        return np.full(self._problem.grid.size, low), np.full(self._problem.grid.size, high)

    def matrix(self, item: int, row: Row) -> Array:
        """(3, p) with color = matrix @ unknowns of the item."""
        seen = self._conditions[row.condition]
        if self.has_primaries(item):
            return np.asarray(self.state.primary_matrix(row.cell[0], item)[seen.observer])
        return np.asarray(self.known_matrices(seen.variant)[seen.observer, row.cell[1 - self._axis]])

    def known_matrices(self, variant: int | None = None) -> Array:
        """(O, k, 3, n): color matrices of all items of the known side."""
        if self.side == "lights":
            return self.state.reflectance_matrices
        if variant not in self._matrices:
            self._matrices[variant] = self.state.light_matrices(variant)
        return self._matrices[variant]

    def colors(self, condition: int) -> Array:
        """Present colors (R, L, 3)."""
        if condition not in self._colors:
            self._colors[condition] = self.state.colors(self._conditions[condition])
        return self._colors[condition]

    def bare_light(self, item: int) -> Array:
        """Linear RGB (3, p) of a light itself, from its unknowns."""
        own = self.state.given.primary_colors[item]
        return self.state.kernel.bare[0] if own is None else own.T

    def subspace_errors(self) -> Array:
        """F (k, 3, n) for every known factor."""
        if self._subspace is None:
            problem, knots = self._problem, self._problem.grid.wavelengths_nm
            if self.side == "lights":
                surfaces = zip(problem.reflectances, self.state.reflectances, strict=True)
                known = [item.spectrum.at(knots) if item.spectrum is not None else values for item, values in surfaces]
            else:
                known = [self._light_on_grid(j) for j in range(len(problem.lights))]
            stacked = np.stack([each for each in known if each is not None])
            exact = self.known_matrices()[0]
            self._subspace = subspace_errors(problem, stacked, exact, self.state.kernel.bare[0])
        return self._subspace

    def _light_on_grid(self, j: int) -> Array:
        light, values, knots = self._problem.lights[j], self.state.lights[j], self._problem.grid.wavelengths_nm
        if values is None:
            return self.state.light_scale * light.spectrum.at(knots)
        return self._powers_of_primaries(j) @ values if light.primaries else values

    def _powers_of_primaries(self, j: int) -> Array:
        """Samples on the grid of unit amounts of the primaries of a light, (n, p)."""
        knots, units = self._problem.grid.wavelengths_nm, self.state.given.units[j]
        assert units is not None
        return np.stack([each.at(knots) for each in self._problem.lights[j].primaries], axis=1) / units

    def subspace_matrix(self, item: int, cell: CellIndex) -> Array:
        """F of a cell over the unknowns of its item, (3, p)."""
        matrix = self.subspace_errors()[cell[1 - self._axis]]
        if not self.has_primaries(item):
            return np.asarray(matrix)
        return np.asarray(matrix @ self._powers_of_primaries(item))
