# SPDX-License-Identifier: GPL-3.0-or-later
"""Test if exact rows can hold within the bounds, by daqp's phase one; and if they can only in black."""

from __future__ import annotations

from collections.abc import Sequence
from operator import is_

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.given import CellIndex
from spectral_core.palette.qp.backends import EQUAL
from spectral_core.palette.qp.quadratic import FAR, Quadratic

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

REACHED = 1e-8
"""Linear RGB within which a row counts as held."""
CONFLICT = -1
"""daqp's flag of an infeasible problem."""
ROOM = 1e-2
"""Distance to its bounds that counts as room for an unknown."""
FORCED = 1e-7
"""Share of it that is rounding: an unknown with no more room is forced onto its bound."""


def can_hold(problem: Quadratic, block: int, *, cells: bool = True) -> bool:
    """True if the exact rows of one block can hold within its bounds, independently of the others.

    ``cells``: True to include its exact cells, False for only the rows that belong to no cell.
    """
    chosen = problem.blocks[block]
    keys = [(block, r) for r in range(len(chosen.keys)) if chosen.exact[3 * r]] if cells else []
    return _possible(problem, [block], keys)


class ImpossibleBlocks:
    """The blocks of the latest problem whose exact rows cannot hold, kept from one edit to the next."""

    def __init__(self) -> None:
        self.numbers: set[int] = set()
        self._tested: dict[int, tuple[tuple[Array, ...], Mask, NDArray[np.intp], Array, bool]] = {}
        """The exact rows of each block when they were last tested, and True if they can hold together."""

    def tested(self, problem: Quadratic, changed: list[int] | None) -> list[int] | None:
        """Find these blocks before any method runs on them; returns the changed blocks, None if all are."""
        before = self.numbers
        asked = range(len(problem.blocks)) if changed is None else changed
        found = {k for k in asked if problem.blocks[k].any_exact and not self._can_hold(problem, k)}
        self.numbers = found if changed is None else (before - set(changed)) | found
        # A block whose rows begin or cease to conflict has other weights, so it changed as well.
        return None if changed is None else sorted(set(changed) | (before ^ self.numbers))

    def _can_hold(self, problem: Quadratic, k: int) -> bool:
        """``can_hold``, tested again only where an exact row of the block changed."""
        block = problem.blocks[k]
        asked = (block.rows, block.ties, block.lower, block.upper, problem.color_lower, problem.color_upper)
        before = self._tested.get(k)
        same = before is not None and all(map(is_, asked, before[0]))
        if before is not None and same:
            # Most edits leave the same rows exact, and often the same array that says so.
            same = block.exact is before[1] or bool((block.exact == before[1]).all())
            same = same and bool((block.targets[before[2]] == before[3]).all())
        if before is None or not same:
            at = block.exact.nonzero()[0]
            before = self._tested[k] = asked, block.exact, at, block.targets[at], can_hold(problem, k)
        return before[4]


def _possible(problem: Quadratic, blocks: Sequence[int], keys: Sequence[tuple[int, int]]) -> bool:
    """True if the exact rows of some cells of some blocks can hold together."""
    import daqp

    colors = problem.color_lower.size
    sizes = [problem.blocks[k].lower.size for k in blocks]
    starts = dict(zip(blocks, np.cumsum([colors, *sizes[:-1]]).tolist(), strict=True))
    total = colors + sum(sizes)
    rows, right = [], []
    for k, block in ((k, problem.blocks[k]) for k in blocks):
        # Rows that are no cells (the white of a light) always count.
        others = np.arange(len(block.weights))[3 * len(block.keys) :]
        own = [np.arange(3 * r, 3 * r + 3) for b, r in keys if b == k]
        own.append(others[block.exact[others]])
        chosen = np.concatenate(own).astype(int)
        matrix = np.zeros((chosen.size, total))
        matrix[:, starts[k] : starts[k] + block.lower.size] = block.rows[chosen]
        matrix[:, :colors] = -block.ties[chosen]
        rows.append(matrix)
        right.append(block.targets[chosen])
    matrix, target = np.concatenate(rows), np.concatenate(right)
    low = np.concatenate([problem.color_lower.ravel(), *(problem.blocks[k].lower for k in blocks)])
    high = np.concatenate([problem.color_upper.ravel(), *(problem.blocks[k].upper for k in blocks)])
    sense = np.concatenate([np.zeros(total), np.full(len(target), EQUAL)]).astype(np.int32)
    x, _, flag, _ = daqp.solve(
        # Any strictly convex objective serves for a feasibility test; the identity is the best conditioned.
        np.eye(total),
        np.zeros(total),
        np.ascontiguousarray(matrix),
        np.concatenate([np.minimum(high, FAR), target]),
        np.concatenate([np.maximum(low, -FAR), target]),
        sense,
        primal_tol=1e-10,
    )
    if flag == CONFLICT:
        return False
    # Any other failure is inconclusive; the engine then decides.
    return bool(flag <= 0 or np.abs(matrix @ x - target).max(initial=0.0) < REACHED)


def forced_black(problem: Quadratic) -> tuple[CellIndex, ...]:
    """The exact cells that can hold together with all others only in black; empty if they cannot hold, or in colors.

    A linear program finds the samples without room between their bounds (facial reduction, Borwein and Wolkowicz 1981).
    """
    from scipy import sparse
    from scipy.optimize import linprog

    matrix, target = problem.equalities()
    low, high, n = problem.lower, problem.upper, problem.size
    unit = sparse.identity(n, format="csr")
    below, above = low > -FAR, high < FAR
    ends = np.stack([np.where(below, low, -np.inf), np.where(above, high, np.inf)], axis=1)
    room = np.minimum(ROOM, (high - low) / 4)
    found = linprog(
        np.concatenate([np.zeros(n), -np.ones(n)]),
        A_ub=sparse.bmat([[-unit[below], unit[below]], [unit[above], unit[above]]]),
        b_ub=np.concatenate([-low[below], high[above]]),
        A_eq=sparse.hstack([matrix, sparse.csr_matrix((len(target), n))]),
        b_eq=target,
        bounds=np.concatenate([ends, np.stack([np.zeros(n), room], axis=1)]),
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if found.status != 0:
        return ()
    _, values = problem.split(found.x[:n])
    _, forced = problem.split(found.x[n:] <= FORCED * room)
    asked = asked_black(problem)
    black: dict[CellIndex, None] = {}
    for block, value, fixed in zip(problem.blocks, values, forced, strict=True):
        for r, (_, cell) in enumerate(block.keys):
            at = slice(3 * r, 3 * r + 3)
            rows, ties = block.rows[at], block.ties[at].any(axis=0)
            is_dark = np.abs(rows @ value).max() < REACHED and rows.any() and not rows[:, ~fixed.astype(bool)].any()
            # A cell that asks for black, or for the color of such a cell, is no surprise.
            is_asked = asked[ties].any() if ties.any() else not block.targets[at].any()
            if block.exact[3 * r] and is_dark and not is_asked:
                black[cell] = None
    return tuple(black)


def asked_black(problem: Quadratic) -> Mask:
    """The free colors, three numbers each, of which an exact member asks for black, or shows it as given."""
    found = np.repeat(np.all((problem.color_lower == 0) & (problem.color_upper == 0), axis=1), 3)
    for block in problem.blocks:
        exact = [(r, key) for r, key in enumerate(block.keys) if block.exact[3 * r]]
        numbers = block.ties.any(axis=1) | (block.targets != 0)
        own = {key for r, key in exact if not numbers[3 * r : 3 * r + 3].any()}
        for r, key in exact:
            if key in own:
                found |= block.ties[3 * r : 3 * r + 3].any(axis=0)
    return found


def wants_color(problem: Quadratic) -> bool:
    """True if black misses the request of any cell, exact or not: its color, box, or measured color."""
    is_colored = any(np.any(block.targets[: 3 * len(block.keys)]) for block in problem.blocks)
    is_boxed = bool(np.any((problem.color_lower > 0) | (problem.color_upper < 0)))
    return is_colored or is_boxed or bool(np.any(problem.known_targets))
