# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that a cell of a palette can show, before a solve: the set, its nearest color, and the conflicting cells.

Exact cells must hold, those that take their color from another cell with its new color: materials that match exactly
change together. Requests that are not exact may be missed, and are ignored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError, counted
from spectral_core.palette.assemble.equations import Dyed, ExactCells
from spectral_core.palette.assemble.tangents import tangents_at
from spectral_core.palette.cell import Cell, CellMode
from spectral_core.palette.explain.inward import inward
from spectral_core.palette.given import CellIndex, cell_index_of, sequence_of
from spectral_core.palette.paint.fluorescence import dyed_colors
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.reach.reachable import CellReach, NearestColor
from spectral_core.spectra.color import WHITE_XYZ, XYZ_FROM_RGB, lab_from_linear_rgb, linear_rgb_from_xyz
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.observer import observer
from spectral_core.spectra.spectrum import Illuminant

Array = NDArray[np.float64]

SECTION_LIMIT = 110.0
"""A section shows a* and b* from minus this to plus this."""
SECTION_LIGHTNESS = 5.0, 95.0
"""Least and greatest L* of the section of an answer: darker and lighter ones hold few colors."""


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

        L* is one luminance, and colors of one luminance are a convex set, whose tangents bound them from outside.
        """
        lightness = require_range("the lightness of a section", lightness, 0.0, 1000.0)
        size = require_whole("the size of a section", size, 1, 4096)
        xyz = section_linear_rgb(lightness, size).reshape(-1, 3) @ XYZ_FROM_RGB.T
        reach = self.reach
        tangents = tangents_at(float(xyz[0, 1]), reach.matrix, reach.bounds, reach.equations)
        if tangents is None:
            return np.zeros((size, size), dtype=bool)
        normals, extents = tangents
        return np.asarray((xyz[:, ::2] @ normals.T <= extents + 1e-9).all(axis=1).reshape(size, size))


@dataclass(frozen=True, slots=True, eq=False)
class PossibleAnswer:
    """The answer to whether a cell can show a color.

    ``nearest``: the possible color that is nearest to it; ``taken``: that color, linear sRGB (3,), so far inward that
    it is possible as it is stored; ``conflicts``: the exact cells that exclude it, the strongest first, each with the
    ΔE2000 that remains without it; ``alone``: the ΔE2000 that remains without all other cells; ``open``: cells of the
    same row that may miss their targets; ``inside``: the possible colors of ``lightness``, as
    ``PossibleColors.section``.
    """

    nearest: NearestColor
    taken: Array
    conflicts: tuple[tuple[CellIndex, float], ...]
    alone: float
    open: tuple[CellIndex, ...]
    lightness: float
    inside: NDArray[np.bool_]


def possible_answer(
    problem: PaletteProblem,
    index: CellIndex,
    linear_rgb: ArrayLike,
    *,
    lights: Sequence[Illuminant] | None = None,
    dyes: Mapping[int, Sequence[FluorescentDye]] | None = None,
    size: int = 64,
    most_conflicts: int = 2,
    stored: Callable[[Array], Array] | None = None,
) -> PossibleAnswer:
    """Whether a cell can show a wanted color, linear sRGB (3,), and what is in the way.

    ``size``: of the section at the color's lightness, or at the nearest lightness at which a section shows something.
    ``stored``: a color as it is read back, such as ``in_single_precision``; None if all digits are kept. Other
    parameters and errors: as ``possible_colors``.
    """
    colors = possible_colors(problem, index, lights=lights, dyes=dyes)
    nearest = colors.nearest(linear_rgb)
    excluding = [cell for cell, _ in colors.in_the_way(nearest)[:most_conflicts]]
    conflicts = tuple((cell, colors.without(cell, linear_rgb)) for cell in excluding)
    alone = 0.0 if nearest.reachable else colors.alone(linear_rgb)
    taken = nearest.color
    if stored is not None and not nearest.reachable:
        taken = inward(colors.reach, taken, stored)
    wanted = np.asarray(linear_rgb, dtype=np.float64)
    lightness = float(np.clip(lab_from_linear_rgb(np.clip(wanted, 0, None))[0], *SECTION_LIGHTNESS))
    return PossibleAnswer(nearest, taken, conflicts, alone, colors.open, lightness, colors.section(lightness, size))


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
