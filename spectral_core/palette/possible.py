# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that a cell of a palette can show, before a solve: the set, its nearest color, and the conflicting cells.

Exact cells of the same row must hold, those that take their color from the cell with its new color; requests that are
not exact may be missed, and are ignored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.palette.cell import Cell, CellMode
from spectral_core.palette.given import CellIndex, cell_index_of, cell_name, sequence_of
from spectral_core.palette.problem import PaletteProblem
from spectral_core.palette.reachable import CellReach, NearestColor
from spectral_core.spectra.color import WHITE_XYZ, linear_rgb_from_xyz, whitened
from spectral_core.spectra.observer import Observer, observer
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
    """Colors that cell ``index`` can show. ``held``: exact cells of its row, first those of ``exact``, then those of
    ``follows``, and one of both if it takes its color from the cell and has a range; ``open``: cells that may miss
    their targets.
    """

    index: CellIndex
    reach: CellReach
    held: tuple[CellIndex, ...]
    open: tuple[CellIndex, ...]
    light: Illuminant
    exact: tuple[tuple[Illuminant, Array], ...]
    """Light of each held cell, and its color (3,) or the least and the greatest one (2, 3)."""
    follows: tuple[Illuminant, ...] = ()
    """Lights of the exact cells of the row that take their color from the cell."""
    viewer: Observer | None = None
    """The observer of the palette's targets; None: the standard one."""

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
        """Remaining ΔE2000 to a wanted color if an exact cell of the row is released; ``cell``: one of ``held``."""
        if cell not in self.held:
            raise InvalidInputError(f"cell {cell} is not among the exact cells of the row, {list(self.held)}")
        kept = [pair for place, pair in zip(self.held, self.exact, strict=False) if place != cell]
        followers = zip(self.held[len(self.exact) :], self.follows, strict=True)
        follows = [light for place, light in followers if place != cell]
        reach = CellReach(self.light, self.reach.grid, kept, None, follows, self.reach.bounds, self.viewer)
        return reach.nearest(linear_rgb).delta_e_2000

    def alone(self, linear_rgb: ArrayLike) -> float:
        """Remaining ΔE2000 to a wanted color if all other cells of the row are released."""
        reach = CellReach(self.light, self.reach.grid, scale=None, bounds=self.reach.bounds, viewer=self.viewer)
        return reach.nearest(linear_rgb).delta_e_2000

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
        count = DIRECTIONS if self.held else MORE_DIRECTIONS
        z = 1 - (2 * np.arange(count) + 1) / count
        angle, around = np.pi * (1 + 5**0.5) * np.arange(count), np.sqrt(1 - z**2)
        # Even over the sphere after a transformation that makes the set round: displays have a set that is long along
        # gray, and that of a line lamp has no width at all.
        directions = np.stack([around * np.cos(angle), around * np.sin(angle), z], axis=1) @ whitened(self.reach.matrix)
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
    actual: ArrayLike | None = None,
) -> PossibleColors:
    """The colors that a cell can show.

    Parameters
    ----------
    problem : the palette.
    index : (reflectance, light) of the cell.
    lights : spectra of the lights as they are now, for those that are designed; by default where designs start.
    actual : (R, L, 3), colors of the last solution, which exact cells that refer to others must keep.

    Raises
    ------
    InvalidInputError : the material is measured, the exact cells of its row contradict each other, or one of them
        refers to a cell that was not solved yet.
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
        raise InvalidInputError(f"{len(spectra)} lights; expected {len(problem.lights)}, one for each column")
    shape = (len(problem.reflectances), len(problem.lights), 3)
    colors = None if actual is None else frozen_array("the colors of the last solution", actual, shape)
    following = _following(problem, index)
    held: list[CellIndex] = []
    open_cells, exact = [], []
    for other, cell in enumerate(problem.cells[row]):
        asks = (cell.mode not in (CellMode.IGNORE, CellMode.FREE) or cell.box is not None) and (
            cell.exact or cell.weight > 0
        )
        if other == column or not asks or (other in following and cell.box is None):
            continue
        if not cell.exact:
            open_cells.append((row, other))
            continue
        held.append((row, other))
        if cell.box is not None and (cell.mode is CellMode.FREE or other in following):
            color = np.stack(cell.box)
        else:
            color = _wanted(cell, (row, other), colors, cell_name(problem, (row, other)))
        exact.append((spectra[other], color))
    follows = tuple(spectra[other] for other in following)
    held += [(row, other) for other in following]
    viewer = observer(problem.observers[0])  # the targets are colors for the first observer
    reach = CellReach(spectra[column], problem.grid, exact, None, follows, problem.reflectance_bounds, viewer)
    return PossibleColors(index, reach, tuple(held), tuple(open_cells), spectra[column], tuple(exact), follows, viewer)


def _following(problem: PaletteProblem, index: CellIndex) -> list[int]:
    """Columns of the exact cells of a row that take their color from one of its cells, directly or by each other."""
    row, column = index
    found = [column]
    for _ in problem.cells[row]:
        more = [
            other
            for other, cell in enumerate(problem.cells[row])
            if other not in found and cell.exact and any((row, each) in cell.others for each in found)
        ]
        found += more
    return found[1:]


def _wanted(cell: Cell, place: CellIndex, actual: Array | None, name: str) -> Array:
    """The color that an exact cell requires of its material."""
    if cell.mode is CellMode.BLACK:
        return np.zeros(3)
    if cell.target is not None:
        return np.asarray(cell.target)
    if actual is None:
        raise InvalidInputError(
            f"{name} takes its color from another cell, which is not known before the palette is solved; solve it"
        )
    return np.asarray(actual[cell.others[0]] if cell.others else actual[place])
