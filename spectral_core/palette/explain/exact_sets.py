# SPDX-License-Identifier: GPL-3.0-or-later
"""A minimal set of exact cells that cannot all hold, by linear programs: without any of its cells the others can.

Each cell is stated by itself, one that refers to another as the difference of both colors. Rows of a common color would
connect cells that are connected only by a cell that is not in the set.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.side import Assembled
from spectral_core.palette.design.decided import HELD
from spectral_core.palette.design.linear_programs import LARGE, TOLERANCES
from spectral_core.palette.given import CellIndex
from spectral_core.palette.problem import Cell, CellMode, PaletteProblem
from spectral_core.palette.qp.quadratic import FAR, Quadratic

Array = NDArray[np.float64]

SHARE = 1e-9
"""Multiplier of a cell, relative to the largest, from which the cell is part of a conflict."""
LARGEST = 20000
"""Most samples of the spectra that a set of cells connects: the program then takes seconds."""


@dataclass(frozen=True, eq=False)
class _Request:
    """An exact cell as rows over the spectra of one side, three for each color that it is compared with."""

    cell: CellIndex
    compared: frozenset[CellIndex]
    """The cell, and those that it refers to."""
    terms: tuple[tuple[int, int, Array], ...]
    """Number of the comparison, number of the spectrum, matrix (3, n)."""
    ends: tuple[Array, Array]
    """Least and greatest value of each row."""

    @property
    def blocks(self) -> set[int]:
        """The spectra that the cell depends on."""
        return {k for _, k, _ in self.terms}


def smallest_conflict(
    problem: PaletteProblem, assembled: Assembled, missed: Collection[CellIndex] = ()
) -> tuple[CellIndex, ...]:
    """A minimal set of exact cells that cannot all hold; empty if all can.

    Single spectra are tested first, because most conflicts are within one; then those that cells connect.

    Parameters
    ----------
    problem
        The palette.
    assembled
        One side of it.
    missed
        Exact cells that the solution misses; without any, all spectra are tested.
    """
    quadratic, requests = assembled.quadratic, _requests(problem, assembled)
    parts = [[each for each in requests if each.blocks == {k}] for k in range(len(quadratic.blocks))]
    parts += _connected(requests)
    for part in parts:
        samples = sum(quadratic.blocks[k].lower.size for k in _blocks(part))
        if not part or samples > LARGEST or not (not missed or any(each.compared & set(missed) for each in part)):
            continue
        found = _in_conflict(quadratic, part)
        if found:
            return tuple(each.cell for each in _filtered(quadratic, found))
    return ()


def _requests(problem: PaletteProblem, assembled: Assembled) -> list[_Request]:
    """The exact cells that depend on a spectrum of the side."""
    seen: dict[CellIndex, tuple[int, Array]] = {}
    for k, block in enumerate(assembled.quadratic.blocks):
        for r, (condition, at) in enumerate(block.keys):
            if condition == 0 and block.exact[3 * r]:  # rows of errors in CIELAB are of another metric
                seen[at] = k, block.rows[3 * r : 3 * r + 3]
    shown = assembled.view.colors(0)
    found = []
    for i, row in enumerate(problem.cells):
        for j, cell in enumerate(row):
            terms: list[tuple[int, int, Array]] = []
            lows, highs = [], []
            for number, (signs, low, high) in enumerate(comparisons(cell, (i, j)) if cell.exact else ()):
                for at, sign in signs:
                    if at in seen:
                        terms.append((number, seen[at][0], sign * seen[at][1]))
                    else:
                        low, high = low - sign * shown[at], high - sign * shown[at]
                lows.append(low)
                highs.append(high)
            if terms:
                compared = frozenset({(i, j), *cell.others})
                found.append(_Request((i, j), compared, tuple(terms), (np.concatenate(lows), np.concatenate(highs))))
    return found


def comparisons(cell: Cell, at: CellIndex) -> list[tuple[list[tuple[CellIndex, float]], Array, Array]]:
    """The comparisons that an exact cell asks for: signed cells, and the least and the greatest sum of their colors."""
    none = np.zeros(3)
    found: list[tuple[list[tuple[CellIndex, float]], Array, Array]] = []
    if cell.mode in (CellMode.FIXED, CellMode.BLACK):
        color = none if cell.target is None else np.asarray(cell.target)
        found.append(([(at, 1.0)], color, color))
    if cell.mode in (CellMode.SAME, CellMode.CONSTANT):
        found += [([(at, 1.0), (other, -1.0)], none, none) for other in cell.others]
    if cell.box is not None:
        found.append(([(at, 1.0)], *cell.box))
    return found


def _blocks(requests: Sequence[_Request]) -> list[int]:
    return sorted(set().union(*(each.blocks for each in requests)))


def _components(requests: Sequence[_Request]) -> list[list[_Request]]:
    """The requests in sets that share no spectrum."""
    sets: list[tuple[set[int], list[_Request]]] = []
    for request in requests:
        blocks, own = set(request.blocks), [request]
        for other in [each for each in sets if each[0] & blocks]:
            sets.remove(other)
            blocks, own = blocks | other[0], other[1] + own
        sets.append((blocks, own))
    return [own for _, own in sets]


def _connected(requests: Sequence[_Request]) -> list[list[_Request]]:
    """Those components that have several spectra."""
    return [own for own in _components(requests) if len(_blocks(own)) > 1]


def _in_conflict(quadratic: Quadratic, requests: Sequence[_Request]) -> list[_Request]:
    """Those of the requests that have a multiplier in the program of the least miss; empty if all can hold.

    The multipliers prove the miss (Farkas 1902), so that the requests that have none are no part of the conflict.
    """
    from scipy import sparse
    from scipy.optimize import linprog

    blocks = _blocks(requests)
    sizes = [quadratic.blocks[k].lower.size for k in blocks]
    starts = dict(zip(blocks, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
    pieces, lows, highs, owners = [], [], [], []

    def add(terms: Sequence[tuple[int, int, Array]], low: Array, high: Array, owner: int) -> None:
        wide = np.zeros((low.size, sum(sizes)))
        for number, k, matrix in terms:
            wide[3 * number : 3 * number + len(matrix), starts[k] : starts[k] + matrix.shape[1]] += matrix
        pieces.append(sparse.csr_matrix(wide))
        lows.append(low)
        highs.append(high)
        owners.extend([owner] * low.size)

    for number, request in enumerate(requests):
        add(request.terms, *request.ends, number)
    for k in blocks:  # rows that are no cells (the white of a light) always hold
        block = quadratic.blocks[k]
        own = np.flatnonzero(block.exact[3 * len(block.keys) :]) + 3 * len(block.keys)
        if own.size:
            add([(0, k, block.rows[own])], block.targets[own], block.targets[own], -1)
    rows, low, high = sparse.vstack(pieces, format="csr"), np.concatenate(lows), np.concatenate(highs)
    scale = LARGE / max(float(abs(rows).max()), 1e-300)
    worst = sparse.csr_matrix(np.ones((low.size, 1)))
    above, below = np.isfinite(high), np.isfinite(low)
    ends = [
        np.concatenate([getattr(quadratic.blocks[k], end) for k in blocks]) if blocks else np.zeros(0)
        for end in ("lower", "upper")
    ]
    ends = [np.where(np.abs(each) < FAR, each, sign * np.inf) for each, sign in zip(ends, (-1, 1), strict=True)]
    answer = linprog(
        np.append(np.zeros(sum(sizes)), 1.0),
        A_ub=sparse.vstack(
            [
                sparse.hstack([scale * rows, -worst]).tocsr()[above],
                sparse.hstack([-scale * rows, -worst]).tocsr()[below],
            ]
        ),
        b_ub=scale * np.concatenate([high[above], -low[below]]),
        bounds=np.stack([np.append(ends[0], 0.0), np.append(ends[1], np.inf)], axis=1),
        method="highs",
        options=TOLERANCES,
    )
    if answer.x is None or answer.x[-1] / scale <= HELD:
        return []
    forces = -answer.ineqlin.marginals
    owner = np.array(owners)
    owner = np.concatenate([owner[above], owner[below]])
    used = {int(each) for each in owner[forces > SHARE * forces.max()]}
    return [request for number, request in enumerate(requests) if number in used]


class _Tested:
    """Sets of requests that were found to hold. Their subsets hold as well, and need no program."""

    def __init__(self, quadratic: Quadratic) -> None:
        self._quadratic = quadratic
        self._held: list[set[_Request]] = []
        self._found: dict[frozenset[_Request], list[_Request]] = {}

    def in_conflict(self, requests: Sequence[_Request]) -> list[_Request]:
        """As ``_in_conflict``."""
        # Components share no spectrum: one that holds by itself is no part of a conflict.
        unknown = [part for part in _components(requests) if not any(each.issuperset(part) for each in self._held)]
        asked = frozenset(each for part in unknown for each in part)
        if not asked:
            return []
        if asked not in self._found:
            self._found[asked] = _in_conflict(self._quadratic, [each for each in requests if each in asked])
        if not self._found[asked]:
            self._held += [set(part) for part in unknown]
        return self._found[asked]


def _filtered(quadratic: Quadratic, requests: Sequence[_Request]) -> list[_Request]:
    """Deletion filter (Chinneck 2008): drop each cell without which the others still conflict."""
    # The result is minimal but not unique: another order may keep other cells.
    tested, kept = _Tested(quadratic), list(requests)
    # A chain without one of its ends contains all parts of it without the cells between, except those at the other end.
    for end in _ends(kept):
        tested.in_conflict([each for each in kept if each is not end])
    for request in requests:
        if request not in kept:
            continue
        found = tested.in_conflict([each for each in kept if each is not request])
        if found:
            kept = found
    return kept


def _ends(requests: Sequence[_Request]) -> tuple[_Request, _Request]:
    """Two requests that are far from each other: each has the most requests between itself and another one."""
    with_block: dict[int, list[_Request]] = {}
    for request in requests:
        for k in request.blocks:
            with_block.setdefault(k, []).append(request)

    def farthest(start: _Request) -> _Request:
        reached = {start: None}
        queue = [start]
        for each in queue:
            for k in each.blocks:
                new = [other for other in with_block[k] if other not in reached]
                reached.update(dict.fromkeys(new))
                queue += new
        return queue[-1]

    first = farthest(requests[0])
    return first, farthest(first)
