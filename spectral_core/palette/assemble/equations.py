# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact cells around one cell, as equations in the reflectances of its material and of those that it depends on.

An exact cell that takes its color from another one requires that both are equal, not that they keep their present
color. So materials whose cells are exactly equal are unknown together. The unknowns of a material are its reflectance
and, if it has fluorescent dyes, their amounts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.kernel import color_kernel
from spectral_core.palette.assemble.requests import compiled_requests
from spectral_core.palette.cell import Cell
from spectral_core.palette.given import CellIndex
from spectral_core.palette.problem import PaletteProblem
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Equation:
    """``ends[0]`` ≤ ``rows`` @ unknowns ≤ ``ends[1]``: an exact color, an equality of two colors, or a range."""

    rows: Array
    """(3, n), to linear RGB."""
    ends: Array
    """(2, 3)."""
    shown: Array
    """(3, n): to the color that the equation concerns."""


def equation_of(rows: Array, color: Array, shown: Array | None = None) -> Equation:
    """The equation of a color (3,), or of a range (2, 3); ``shown``: by default the rows themselves."""
    return Equation(rows, np.broadcast_to(color, (2, 3)), rows if shown is None else shown)


@dataclass(frozen=True, slots=True, eq=False)
class Dyed:
    """The dyes of a material, as unknowns from 0 to 1: shares of the largest amount that each can have alone.

    ``colors``: (L, 3, k), linear RGB of that amount under each light. ``returned``: (n, k), share of the light at each
    sample that it returns at most.
    """

    colors: Array
    returned: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """Exact cells that share one color: ``color`` (3,) where one of them has a given one, else None."""

    members: tuple[CellIndex, ...]
    color: Array | None


class ExactCells:
    """Equations of the exact cells beside cell ``index``, whose own request does not count.

    ``lights``: the spectra of the columns. ``dyed``: the dyes of each material that has some. ``matrix`` (3, n): from
    the unknowns, of which the first are the reflectance of the cell's material, to the color of the cell.
    ``equations``: by the cells whose requests they are, the cells of the same material first. ``energy``: those of
    dyed materials, which return at most all light.
    """

    def __init__(
        self,
        problem: PaletteProblem,
        index: CellIndex,
        lights: Sequence[Illuminant],
        dyed: Mapping[int, Dyed] | None = None,
    ) -> None:
        self._index, self._dyed = index, dyed or {}
        self._problem = problem = problem.with_cell(index, Cell.ignore())
        self._kernel = color_kernel(problem.grid, problem.observers[:1])
        self._seen = [self._kernel.matrix_of(light)[0] for light in lights]
        requests = compiled_requests(problem)
        self._given = {t.cell: t.color for t in requests.targets if t.exact and problem.reflectances[t.cell[0]].free}
        self._shared = []
        for group in requests.groups:
            members = tuple(cell for cell, exact in zip(group.members, group.exact, strict=True) if exact)
            known = [color for cell in members if (color := self._known(cell, lights)) is not None]
            self._shared.append(_Shared(members, known[0] if known else None))
        self._rows = self._unknown_together()
        self.matrix = self._matrix(index)
        found = [*self._of_colors(), *self._of_links()]
        self.equations = sorted(found, key=lambda each: each[0][0] != index[0])
        self.energy = [each for row in self._rows if row in self._dyed for each in self._of_energy(row)]

    def _known(self, cell: CellIndex, lights: Sequence[Illuminant]) -> Array | None:
        surface = self._problem.reflectances[cell[0]].spectrum
        if surface is not None:
            return np.asarray(self._kernel.color_of(lights[cell[1]], surface)[0])
        return self._given.get(cell)

    def _unknown_together(self) -> list[int]:
        """Materials whose reflectances the cell's color depends on, its own first."""
        rows = [self._index[0]]
        links = [shared.members for shared in self._shared if shared.color is None and len(shared.members) > 1]
        while True:
            more = [
                i for members in links for i, j in members if i not in rows and self._matters(members, (i, j), rows)
            ]
            if not more:
                return rows
            rows += dict.fromkeys(more)

    def _matters(self, members: tuple[CellIndex, ...], cell: CellIndex, rows: list[int]) -> bool:
        """True if a material restricts the shared color: not if no more than this is exact about it, and another one
        that is unknown, and has no dyes, shows the color under the same light; then it can have the reflectance of that
        one.
        """
        if not any(i in rows for i, _ in members):
            return False
        about = [at for at in self._given if at[0] == cell[0]]
        about += [at for shared in self._shared for at in shared.members if at[0] == cell[0]]
        return len(about) > 1 or not any(i in rows and j == cell[1] and i not in self._dyed for i, j in members)

    def _begin(self, row: int) -> tuple[int, int]:
        """Number of the first unknown of a material, and the count of all unknowns."""
        sizes = [
            self._problem.grid.size + (self._dyed[each].returned.shape[1] if each in self._dyed else 0)
            for each in self._rows
        ]
        return sum(sizes[: self._rows.index(row)]), sum(sizes)

    def _matrix(self, cell: CellIndex) -> Array:
        begin, size = self._begin(cell[0])
        found = np.zeros((3, size))
        own = self._seen[cell[1]]
        if cell[0] in self._dyed:
            own = np.concatenate([own, self._dyed[cell[0]].colors[cell[1]]], axis=1)
        found[:, begin : begin + own.shape[1]] = own
        return found

    def _of_energy(self, row: int) -> Iterator[Equation]:
        """Reflectance and dyes together return at most all light, at three samples in each equation."""
        begin, size = self._begin(row)
        returned = self._dyed[row].returned
        rows = np.zeros((len(returned), size))
        rows[:, begin : begin + len(returned)] = np.eye(len(returned))
        rows[:, begin + len(returned) : begin + sum(returned.shape)] = returned
        for samples in np.arange(3 * -(-len(rows) // 3)).clip(max=len(rows) - 1).reshape(-1, 3):
            yield Equation(rows[samples], np.array([[-np.inf], [1.0]]) + np.zeros(3), rows[samples])

    def _of_colors(self) -> Iterator[tuple[CellIndex, Equation]]:
        for cell, color in self._given.items():
            if cell[0] in self._rows:
                yield cell, equation_of(self._matrix(cell), color)
        for shared in self._shared:
            for cell in shared.members:
                if shared.color is not None and cell[0] in self._rows and cell not in self._given:
                    yield self._asking(cell, shared), equation_of(self._matrix(cell), shared.color)

    def _of_links(self) -> Iterator[tuple[CellIndex, Equation]]:
        for shared in self._shared:
            here = [cell for cell in shared.members if cell[0] in self._rows]
            if shared.color is not None or not here:
                continue
            # Every other cell is equal to one that only others refer to, such as the cell that is asked about.
            first = min(here, key=lambda cell: (cell != self._index, self._is_exact(cell)))
            color = self._matrix(first)
            for cell in here:
                if cell != first:
                    own = self._matrix(cell)
                    yield self._asking(cell, shared), equation_of(own - color, np.zeros(3), own)
            for cell in shared.members:
                box = self._problem.cells[cell[0]][cell[1]].box
                if box is not None and self._is_exact(cell):
                    yield cell, equation_of(color, np.stack(box))

    def _is_exact(self, cell: CellIndex) -> bool:
        return self._problem.cells[cell[0]][cell[1]].exact

    def _asking(self, cell: CellIndex, shared: _Shared) -> CellIndex:
        """The exact cell whose request makes ``cell`` share a color: itself, or one that refers to it."""
        if self._is_exact(cell):
            return cell
        cells = self._problem.cells
        return next(at for at in shared.members if self._is_exact(at) and cell in cells[at[0]][at[1]].others)
