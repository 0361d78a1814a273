# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells whose release reduces the error of a missed cell, by solving without them.

A prediction from multipliers holds the active bounds fixed. Where all samples of a spectrum are at a bound, as those of
a material that must be black, it predicts no change at all. Here the spectra that share a request with the missed cell
are solved again, without each of their other cells, and without several of them. The other side is held as solved, and
exact cells that can hold have a large weight: an answer with exact black cells takes ten times as long. What is found
so is solved once more with exact cells.
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
from spectral_core.palette.explain.parts import (
    heavy_weight,
    held_problem,
    lines_of,
    linked_lines,
    placed,
    with_weights,
)
from spectral_core.palette.problem import Cell, CellIndex, CellMode, PaletteProblem
from spectral_core.palette.qp.elastic import within
from spectral_core.palette.report import state_errors
from spectral_core.palette.solution import PaletteSolution, PaletteStatus

Array = NDArray[np.float64]

MOST_SAMPLES = 8000
"""Most samples of all spectra in all solves for one cell, which limits them to some tenths of a second."""
MOST_CONFIRMED = 4
"""Most expected releases that are tried before all cells are."""
PERCEPTUAL_ROUNDS = 3
"""Rounds after the linear one if errors count in CIELAB, which is linearized anew in each."""
FAINTEST = 1e-100
"""Least unit of weights, whose square is above 0."""
ENOUGH = 0.5
"""Share of the possible relief from which a release counts."""


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
            if part is None or other not in part.others:
                continue
            left = part.error(cell, (other,))
            if left < self._share * error and (left := part.exactly(cell, (other,))) < self._share * error:
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
        alone = [other for _, other in sorted(each for each in after if each[0] <= enough)]
        for other in alone[:MOST_CONFIRMED]:
            if (left := part.exactly(cell, (other,))) < self._share * error:
                return Releases((other, *(each for each in alone if each != other)), (), left)
        # Deletion filter: a cell stays released only if the others alone do not relieve the missed one.
        released = list(others)
        for other in others:
            fewer = [each for each in released if each != other]
            if part.error(cell, fewer) <= enough:
                released = fewer
        left = part.exactly(cell, released)
        return Releases((), tuple(released), left) if left < self._share * error else Releases((), (), error)

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
    heavy: float | None
    """Weight in place of exactness; None if exact cells cannot all hold."""
    _errors: dict[tuple[frozenset[CellIndex], float | None], Array] = field(default_factory=dict)

    @classmethod
    def around(cls, solution: PaletteSolution, requests: Requests, cell: CellIndex, axis: int) -> _Part | None:
        """The part of the row or column of a cell; None if it is measured, or if held spectra are unphysical."""
        problem, line = solution.problem, cell[axis]
        if axis == 1 and not problem.lights[line].free:
            return None
        held = held_problem(solution, axis)
        heavy = None if solution.status is PaletteStatus.EXACT_CONFLICT else heavy_weight(problem)
        if held is None:
            return None
        lines = linked_lines(requests, line, axis)
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
        return cls(lines_of(held, lines, axis), others, linked, lines, axis, rest, rows, heavy)

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
        return self._error(cell, released, self.heavy)

    def exactly(self, cell: CellIndex, released: Collection[CellIndex]) -> float:
        """``error`` with exact cells that hold to all digits, which takes longer: where lights hardly show a difference
        by itself, a weight in place of exactness leaves a color that exact cells exclude.
        """
        return self._error(cell, released, None)

    def _error(self, cell: CellIndex, released: Collection[CellIndex], heavy: float | None) -> float:
        held = [at for at in self.linked if at not in released and self._is_exact(at)]
        key = frozenset(released), heavy if held else None
        if key not in self._errors:
            self._errors[key] = self._solved([placed(each, self.lines, self.axis) for each in released], heavy)
        error = float(self._errors[key][placed(cell, self.lines, self.axis)])
        return 0.0 if np.isnan(error) else error

    def _is_exact(self, cell: CellIndex) -> bool:
        i, j = placed(cell, self.lines, self.axis)
        return self.problem.cells[i][j].exact

    def _solved(self, released: Sequence[CellIndex], heavy: float | None) -> Array:
        problem = self.problem.with_cells(dict.fromkeys(released, Cell.ignore()))
        requests = compiled_requests(problem, self.cells_elsewhere)
        if heavy is not None:
            requests = with_weights(requests, heavy / requests.weight_scale)
        elsewhere = self.rows_elsewhere / max(requests.weight_scale, FAINTEST) ** 2
        rounds = Rounds(_PartAssembler(problem, requests, elsewhere), SolveTrace(), quick=heavy is not None)
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
