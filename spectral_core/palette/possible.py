# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that a cell of a palette can show, before a solve: the set, its nearest color, and the conflicting cells.

Exact cells must hold, those that take their color from another cell with its new color: materials that match exactly
change together. Requests that are not exact may be missed, and are ignored.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.palette.assemble.equations import Dyed, ExactCells
from spectral_core.palette.cell import Cell, CellMode
from spectral_core.palette.given import CellIndex, cell_index_of, sequence_of
from spectral_core.palette.paint.fluorescence import dyed_colors
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.reachable import CellReach, NearestColor, even_directions
from spectral_core.spectra.color import WHITE_XYZ, linear_rgb_from_xyz, whitened
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]

DIRECTIONS = 96
"""Number of directions in which the extent of a set with exact colors is computed, for its picture; without exact
colors more, as they cost little.
"""
MORE_DIRECTIONS = 1500
SECTION_LIMIT = 110.0
"""A section shows a* and b* from minus this to plus this."""


@dataclass(frozen=True, slots=True, eq=False)
class PossibleColors:
    """Colors that cell ``index`` can show. ``held``: for each equation of ``reach`` the exact cell that requires it;
    ``open``: cells of the same row that may miss their targets.
    """

    index: CellIndex
    problem: PaletteProblem
    lights: tuple[Illuminant, ...]
    """Spectra of the columns."""
    reach: CellReach
    held: tuple[CellIndex, ...]
    open: tuple[CellIndex, ...]
    dyes: Mapping[int, Sequence[FluorescentDye]] = field(default_factory=dict)
    """Dyes of the materials, by their index."""

    def nearest(self, linear_rgb: ArrayLike) -> NearestColor:
        """The possible color that is nearest to a wanted one, linear sRGB (3,)."""
        return self.reach.nearest(linear_rgb)

    def in_the_way(self, nearest: NearestColor) -> tuple[tuple[CellIndex, float], ...]:
        """Exact cells that exclude the wanted color, the strongest first, with their share of the conflict."""
        total = float(nearest.in_the_way.sum())
        if nearest.reachable or total <= 0:
            return ()
        shares = dict.fromkeys(self.held, 0.0)
        for cell, share in zip(self.held, nearest.in_the_way, strict=True):
            shares[cell] += float(share) / total
        return tuple(sorted((each for each in shares.items() if each[1] > 0.01), key=lambda each: -each[1]))

    def without(self, cell: CellIndex, linear_rgb: ArrayLike) -> float:
        """Remaining ΔE2000 to a wanted color if an exact cell is released; ``cell``: one of ``held``."""
        if cell not in self.held:
            raise InvalidInputError(f"cell {cell} is not among the exact cells that must hold, {list(self.held)}")
        released = self.problem.with_cell(cell, Cell.ignore())
        return self._nearest_of(released, linear_rgb)

    def alone(self, linear_rgb: ArrayLike) -> float:
        """Remaining ΔE2000 to a wanted color if all other cells are released."""
        cells = {(i, j): Cell.ignore() for i, row in enumerate(self.problem.cells) for j in range(len(row))}
        return self._nearest_of(self.problem.with_cells(cells), linear_rgb)

    def _nearest_of(self, problem: PaletteProblem, linear_rgb: ArrayLike) -> float:
        colors = possible_colors(problem, self.index, lights=self.lights, dyes=self.dyes)
        return colors.nearest(linear_rgb).delta_e_2000

    def section(self, lightness: float, size: int = 64) -> NDArray[np.bool_]:
        """Possible colors of one L*, (size, size): b* upward in rows, a* in columns, ±SECTION_LIMIT.

        Bounded from outside by the set's extents in a number of directions, so that a color slightly outside may count
        as inside; ``nearest`` is exact.
        """
        lightness = require_range("the lightness of a section", lightness, 0.0, 1000.0)
        size = require_whole("the size of a section", size, 1, 4096)
        directions, extents = self._extents()
        colors = section_linear_rgb(lightness, size).reshape(-1, 3)
        inside = np.ones(len(colors), dtype=bool)
        for start in range(0, len(directions), 128):
            part = slice(start, start + 128)
            inside &= (colors @ directions[part].T <= extents[part] + 1e-9).all(axis=1)
        return inside.reshape(size, size)

    def _extents(self) -> tuple[Array, Array]:
        count = DIRECTIONS if self.held or self.dyes else MORE_DIRECTIONS
        # Even over the sphere after a transformation that makes the set round: displays have a set that is long along
        # gray, and that of a line lamp has no width at all.
        directions = even_directions(count) @ whitened(self.reach.matrix)
        return directions, np.array([self.reach.extent(direction)[0] for direction in directions])


def section_linear_rgb(lightness: float, size: int) -> Array:
    """Linear sRGB (size, size, 3) of the points of a section, also outside the display's gamut."""
    axis = np.linspace(-SECTION_LIMIT, SECTION_LIMIT, size)
    a, b = np.meshgrid(axis, axis)
    y = (lightness + 16) / 116
    f = np.stack([y + a / 500, np.full_like(a, y), y - b / 200], axis=-1)
    xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * WHITE_XYZ
    return np.asarray(linear_rgb_from_xyz(xyz))


def possible_colors(
    problem: PaletteProblem,
    index: CellIndex,
    *,
    lights: Sequence[Illuminant] | None = None,
    dyes: Mapping[int, Sequence[FluorescentDye]] | None = None,
) -> PossibleColors:
    """The colors that a cell can show.

    Parameters
    ----------
    problem : the palette.
    index : (reflectance, light) of the cell.
    lights : spectra of the lights as they are now, for those that are designed; by default where designs start.
    dyes : fluorescent dyes of each material, by its index; their amounts are designed, too.

    Raises
    ------
    InvalidInputError : the material is measured, the exact cells that it depends on contradict each other, or there are
        dyes although reflectances are not bounded by 0 and 1.
    """
    require_kind("the palette", problem, PaletteProblem)
    row, column = index = cell_index_of(index)
    if not (0 <= row < len(problem.reflectances) and 0 <= column < len(problem.lights)):
        raise InvalidInputError(
            f"cell {index} is outside the table of {len(problem.reflectances)}×{len(problem.lights)} cells"
        )
    if problem.reflectances[row].spectrum is not None:
        raise InvalidInputError(
            f"{problem.reflectances[row].name!r} is measured: it shows the one color that it has; let it be designed"
        )
    spectra = [light.spectrum for light in problem.lights] if lights is None else list(sequence_of("lights", lights))
    if len(spectra) != len(problem.lights):
        raise InvalidInputError(
            f"{counted(len(spectra), 'light')}; expected {len(problem.lights)}, one for each column"
        )
    for each in spectra:
        require_kind("a light", each, Illuminant)
    dyes = {} if dyes is None else {each: tuple(own) for each, own in dyes.items() if own}
    exact = ExactCells(problem, index, spectra, _dyed(problem, spectra, dyes))
    held = [equation for _, equation in exact.equations]
    reach = CellReach.beside(problem.grid, exact.matrix, held, problem.reflectance_bounds, exact.energy)
    open_cells = [(row, other) for other, cell in enumerate(problem.cells[row]) if other != column and _may_miss(cell)]
    owners = tuple(cell for cell, _ in exact.equations)
    return PossibleColors(index, problem, tuple(spectra), reach, owners, tuple(open_cells), dyes)


def _dyed(
    problem: PaletteProblem, lights: Sequence[Illuminant], dyes: Mapping[int, Sequence[FluorescentDye]]
) -> dict[int, Dyed]:
    if dyes and tuple(problem.reflectance_bounds) != (0.0, 1.0):
        raise InvalidInputError(
            f"reflectances are bounded by {problem.reflectance_bounds}; beside dyes they are from 0 to 1"
        )
    viewer = observer(problem.observers[0])
    return {each: dyed_colors(lights, own, problem.grid, viewer) for each, own in dyes.items()}


def _may_miss(cell: Cell) -> bool:
    """True if a cell has a request that is not exact."""
    asks = cell.mode not in (CellMode.IGNORE, CellMode.FREE) or cell.box is not None
    return asks and not cell.exact and cell.weight > 0
