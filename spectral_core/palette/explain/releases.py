# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells whose release reduces the error of a missed cell, by solving without them.

A prediction from multipliers holds the active bounds fixed. Where all samples of a spectrum are at a bound, as those of
a material that must be black, it predicts no change at all. Here the spectra that share a request with the missed cell
are solved again, without each of their other cells, and without several of them. The other side is held as solved, and
exact cells that can hold have a large weight: an answer with exact black cells takes ten times as long.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.assembled import Assembled
from spectral_core.palette.assemble.requests import Requests, compiled_requests, weighs
from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState, initial_state
from spectral_core.palette.assemble.view import Side
from spectral_core.palette.design.rounds import Rounds, SolveTrace
from spectral_core.palette.problem import (
    Cell,
    CellIndex,
    CellMode,
    PaletteLight,
    PaletteProblem,
    PaletteReflectance,
)
from spectral_core.palette.qp.elastic import within
from spectral_core.palette.report import state_errors
from spectral_core.palette.solution import PaletteSolution, PaletteStatus
from spectral_core.spectra.spectrum import Illuminant, Reflectance

Array = NDArray[np.float64]

MOST_SAMPLES = 8000
"""Most samples of all spectra in all solves for one cell, which limits them to some tenths of a second."""
MOST_CONFIRMED = 4
"""Most expected releases that are tried before all cells are."""
PERCEPTUAL_ROUNDS = 3
"""Rounds after the linear one if errors count in CIELAB, which is linearized anew in each."""
ENOUGH = 0.5
"""Share of the possible relief from which a release counts."""
EXACT_WEIGHT = 100.0
"""Weight in place of exactness, relative to the largest of the other weights."""


@dataclass(frozen=True, slots=True)
class Releases:
    """``alone``: cells whose release alone relieves the missed cell, best first; ``together``: if there is none, a
    smallest set that relieves it if all of them are released; both empty if no release does. ``delta_e_2000``: the
    error that then remains.
    """

    alone: tuple[CellIndex, ...]
    together: tuple[CellIndex, ...]
    delta_e_2000: float


class ReleaseSearch:
    """The cells whose release relieves missed cells of one solution; cells of the same material share the solves.

    Parameters
    ----------
    solution : of the palette; its lights are held if the material of a cell is designed, else its materials.
    requests : of its problem.
    share : largest part of a cell's error that may remain.
    """

    def __init__(self, solution: PaletteSolution, requests: Requests, share: float) -> None:
        self._solution, self._requests, self._share = solution, requests, share
        self._parts: dict[tuple[int, int], _Part | None] = {}

    def confirmed(self, cell: CellIndex, error: float, expected: Sequence[CellIndex]) -> Releases | None:
        """The expected releases, the first that a solve confirms at the front; None if it confirms none of the first
        few.
        """
        part = self._part(cell)
        for other in expected[:MOST_CONFIRMED]:
            left = np.inf if part is None or other not in part.others else part.error(cell, (other,))
            if left < self._share * error:
                return Releases((other, *(each for each in expected if each != other)), (), left)
        return None

    def of(self, cell: CellIndex, error: float) -> Releases | None:
        """The cells whose release relieves a cell (reflectance, light) with this ΔE2000; None if too many cells are
        in question.
        """
        part = self._part(cell)
        if part is None:
            return None
        found = self._among(part, part.others, cell, error)
        if found is not None and not (found.alone or found.together) and len(part.linked) > len(part.others):
            # A cell of another material moves the color that both share.
            return self._among(part, part.linked, cell, error)
        return found

    def _among(self, part: _Part, cells: Sequence[CellIndex], cell: CellIndex, error: float) -> Releases | None:
        """The cells among some whose release relieves a cell."""
        others = tuple(other for other in cells if other != cell)
        least = part.error(cell, others)
        if not least < self._share * error:
            return Releases((), (), error)
        if len(others) * part.samples > MOST_SAMPLES:
            return None
        enough = min(max(least, error - ENOUGH * (error - least)), self._share * error)
        after = [(part.error(cell, (other,)), other) for other in others]
        alone = sorted(each for each in after if each[0] <= enough)
        if alone:
            return Releases(tuple(other for _, other in alone), (), alone[0][0])
        # Deletion filter: a cell stays released only if the others alone do not relieve the missed one.
        released = list(others)
        for other in others:
            fewer = [each for each in released if each != other]
            if part.error(cell, fewer) <= enough:
                released = fewer
        return Releases((), tuple(released), part.error(cell, released))

    def _part(self, cell: CellIndex) -> _Part | None:
        axis = 0 if self._solution.problem.reflectances[cell[0]].free else 1
        key = (axis, cell[axis])
        if key not in self._parts:
            self._parts[key] = _Part.around(self._solution, self._requests, cell, axis)
        return self._parts[key]


@dataclass(frozen=True, eq=False)
class _Part:
    """The rows (axis 0) or columns (axis 1) of a palette that share a request with one of them; the rest is held."""

    problem: PaletteProblem
    others: tuple[CellIndex, ...]
    """Cells of the row or column, and those that share a color with one of them, by their place in the palette."""
    linked: tuple[CellIndex, ...]
    """All cells of the part with a request."""
    lines: tuple[int, ...]
    """Number of each row or column in the palette."""
    axis: int
    cells_elsewhere: tuple[float, ...]
    """Weights of all other cells: with them, those of the part are capped and scaled as in the whole palette."""
    rows_elsewhere: Array
    """Squared weights of their soft rows, to whose median those of exact cells that cannot hold are relative."""
    _errors: dict[frozenset[CellIndex], Array] = field(default_factory=dict)

    @classmethod
    def around(cls, solution: PaletteSolution, requests: Requests, cell: CellIndex, axis: int) -> _Part | None:
        """The part of the row or column of a cell; None if it is measured, or if held spectra are unphysical."""
        problem, line = solution.problem, cell[axis]
        if axis == 1 and not problem.lights[line].free:
            return None
        held = _held(solution, axis)
        if held is None:
            return None
        lines = _linked(requests, line, axis)
        groups = [group.members for group in requests.groups]
        near = {each for members in groups if any(member[axis] == line for member in members) for each in members}
        asked = [(i, j) for i, row in enumerate(held.cells) for j, each in enumerate(row) if _asks(each)]
        linked = tuple(each for each in asked if each[axis] in lines)
        others = tuple(each for each in linked if each[axis] == line or each in near)
        rest = tuple(
            each.weight
            for i, row in enumerate(problem.cells)
            for j, each in enumerate(row)
            if (i, j)[axis] not in lines and weighs(each)
        )
        record = {} if solution.state is None else solution.state.record or {}
        side = record.get("reflectances" if axis == 0 else "lights")
        rows = np.zeros(0) if side is None else _rows_elsewhere(side[0], lines, axis)
        return cls(_lines_of(held, lines, axis), others, linked, lines, axis, rest, rows)

    @property
    def samples(self) -> int:
        """Samples of all designed spectra."""
        return len(self.lines) * self.problem.grid.size

    @cached_property
    def _start(self) -> PaletteState:
        """The start of every solve, with the color matrices of all lights; no cell changes them."""
        return initial_state(self.problem)

    def error(self, cell: CellIndex, released: Collection[CellIndex]) -> float:
        """ΔE2000 of a cell after a solve without others; 0 if nothing is asked of it any more."""
        key = frozenset(released)
        if key not in self._errors:
            self._errors[key] = self._solved([_placed(each, self.lines, self.axis) for each in released])
        error = float(self._errors[key][_placed(cell, self.lines, self.axis)])
        return 0.0 if np.isnan(error) else error

    def _solved(self, released: Sequence[CellIndex]) -> Array:
        problem = self.problem.with_cells(dict.fromkeys(released, Cell.ignore()))
        requests = compiled_requests(problem, self.cells_elsewhere)
        elsewhere = self.rows_elsewhere / requests.weight_scale**2
        rounds = Rounds(_PartAssembler(problem, requests, elsewhere), SolveTrace(), quick=True)
        state = rounds.round(self._start)
        for _ in range(PERCEPTUAL_ROUNDS if problem.match == "perceptual" else 0):
            state = rounds.round(state, perceptual=True)
        return state_errors(problem, requests, state).delta_e_2000


class _PartAssembler(Assembler):
    """Assembles a part of a palette with the unit of weights that the whole palette would have."""

    def __init__(self, problem: PaletteProblem, requests: Requests, elsewhere: Array) -> None:
        super().__init__(problem, requests)
        self._elsewhere = elsewhere

    def assembled(self, side: Side, state: PaletteState, *, perceptual: bool = False) -> Assembled:
        found = super().assembled(side, state, perceptual=perceptual)
        return replace(found, quadratic=within(found.quadratic, self._elsewhere))


def _rows_elsewhere(whole: Assembled, lines: Collection[int], axis: int) -> Array:
    """Squared weights of a side's soft rows outside of ``lines``, as the artist gave them, not scaled."""
    quadratic, groups, scale = whole.quadratic, whole.view.requests.groups, whole.view.requests.weight_scale
    blocks = zip(whole.items, quadratic.blocks, strict=True)
    own = [block.soft_weights for item, block in blocks if item not in lines]
    is_outside = np.array([groups[number].members[0][axis] not in lines for number, _ in whole.group_conditions], bool)
    is_known = (quadratic.known_ties[:, np.repeat(is_outside, 3)] != 0).any(axis=1)
    return np.concatenate([quadratic.known_weights[is_known], *own]) * scale**2


def _asks(cell: Cell) -> bool:
    """True if a cell has a request that a solve of one side counts."""
    return cell.mode not in (CellMode.IGNORE, CellMode.DISTINCT) and (cell.weight > 0 or cell.exact)


def _held(solution: PaletteSolution, axis: int) -> PaletteProblem | None:
    """The problem with the other side's designed spectra as measured ones; None if they are unphysical."""
    problem = solution.problem
    largest = max((cell.weight for row in problem.cells for cell in row if not cell.exact), default=0.0) or 1.0

    can_hold = solution.status is not PaletteStatus.EXACT_CONFLICT

    def held(cell: Cell) -> Cell:
        if cell.mode is CellMode.DISTINCT:  # searched for seconds, after everything else is met
            return Cell.ignore()
        return replace(cell, exact=False, weight=EXACT_WEIGHT * largest) if cell.exact and can_hold else cell

    cells = tuple(tuple(map(held, row)) for row in problem.cells)
    problem = replace(problem, cells=cells, scale_lights=False)
    if axis == 0:
        lights = []
        for light, found in zip(problem.lights, solution.illuminants, strict=True):
            if not isinstance(found, Illuminant):
                return None
            lights.append(PaletteLight(found, variants=light.variants))
        return replace(problem, lights=tuple(lights))
    surfaces = []
    for item, spectrum in zip(problem.reflectances, solution.reflectances, strict=True):
        if not isinstance(spectrum, Reflectance):
            return None
        surfaces.append(PaletteReflectance(item.name, spectrum))
    return replace(problem, reflectances=tuple(surfaces))


def _linked(requests: Requests, line: int, axis: int) -> tuple[int, ...]:
    """The rows or columns that groups of equal colors link to one, itself included."""
    linked, grows = {line}, True
    while grows:
        lines = [{member[axis] for member in group.members} for group in requests.groups]
        more = linked.union(*(each for each in lines if each & linked))
        linked, grows = more, len(more) > len(linked)
    return tuple(sorted(linked))


def _lines_of(problem: PaletteProblem, lines: Sequence[int], axis: int) -> PaletteProblem:
    """Some rows or columns of a problem; references into the other ones end."""
    number = {line: k for k, line in enumerate(lines)}

    def kept(cell: Cell) -> Cell:
        others = tuple(_placed(other, lines, axis) for other in cell.others if other[axis] in number)
        if len(others) < len(cell.others):  # without weight, so that it links nothing
            return Cell.ignore()
        return replace(cell, others=others)

    if axis == 0:
        cells = tuple(tuple(kept(cell) for cell in problem.cells[line]) for line in lines)
        return replace(problem, reflectances=tuple(problem.reflectances[line] for line in lines), cells=cells)
    cells = tuple(tuple(kept(row[line]) for line in lines) for row in problem.cells)
    return replace(problem, lights=tuple(problem.lights[line] for line in lines), cells=cells)


def _placed(cell: CellIndex, lines: Sequence[int], axis: int) -> CellIndex:
    """The place of a cell of the whole palette in the part."""
    return (lines.index(cell[0]), cell[1]) if axis == 0 else (cell[0], lines.index(cell[1]))
