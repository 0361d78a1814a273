# SPDX-License-Identifier: GPL-3.0-or-later
"""The unknowns that exact rows leave no room between their bounds: they have one value at every point that meets the
rows.

A color at the end of what a lamp can show, or one color under two lights that are too different, leaves most samples of
a spectrum on a bound. Methods that step from bound to bound then go in circles. With these samples held, the others
have room, and the methods work (facial reduction, Borwein and Wolkowicz 1981). A linear program finds them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from spectral_core.palette.given import CellIndex
from spectral_core.palette.qp.feasibility import REACHED
from spectral_core.palette.qp.quadratic import FAR, Quadratic

Array = NDArray[np.float64]

ROOM = 1e-2
"""Distance to its bounds that counts as room for an unknown."""
FORCED = 1e-7
"""Share of it that is rounding: an unknown with no more room is forced onto its bound."""


@dataclass(frozen=True, eq=False)
class Face:
    """The unknowns without room, and a point that meets the rows and leaves the others as much as it can."""

    point: Array
    """(n,), within the bounds."""
    fixed: NDArray[np.bool_]
    """(n,): True for an unknown without room; ``point`` has its value."""

    @classmethod
    def of(
        cls,
        rows: sparse.csr_matrix,
        right: Array,
        low: Array,
        high: Array,
        ranges: tuple[sparse.csr_matrix, Array, Array] | None = None,
    ) -> Face | None:
        """The face of rows · x = right within bounds (n,); None if the program finds no point that meets them.

        ``ranges``: more rows, with the least and the greatest value of each.
        """
        from scipy.optimize import linprog

        n = low.size
        unit = sparse.identity(n, format="csr")
        below, above = low > -FAR, high < FAR
        ends = np.stack([np.where(below, low, -np.inf), np.where(above, high, np.inf)], axis=1)
        room = np.minimum(ROOM, (high - low) / 4)
        inner = [[-unit[below], unit[below]], [unit[above], unit[above]]]
        limits = [-low[below], high[above]]
        if ranges is not None:
            matrix, least, most = ranges
            none = sparse.csr_matrix((matrix.shape[0], n))
            inner += [[-matrix, none], [matrix, none]]
            limits += [-least, most]
        found = linprog(
            np.concatenate([np.zeros(n), -np.ones(n)]),
            A_ub=sparse.bmat(inner),
            b_ub=np.concatenate(limits),
            A_eq=sparse.hstack([rows, sparse.csr_matrix((right.size, n))]),
            b_eq=right,
            bounds=np.concatenate([ends, np.stack([np.zeros(n), room], axis=1)]),
            method="highs",
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        if found.status != 0:
            return None
        fixed = found.x[n:] <= FORCED * room
        point = np.clip(found.x[:n], low, high)
        nearer = np.where(point - low < high - point, low, high)
        return cls(np.where(fixed, nearer, point), fixed)

    @classmethod
    def of_problem(cls, problem: Quadratic) -> Face | None:
        """The face of the exact rows of a side."""
        return cls.of(*problem.equalities(), problem.lower, problem.upper)

    def held(self, problem: Quadratic) -> Quadratic:
        """The problem with the unknowns without room held: it has the same points that meet the exact rows."""
        low, high = (np.where(self.fixed, self.point, end) for end in (problem.lower, problem.upper))
        (colors, lower), (more, upper) = problem.split(low), problem.split(high)
        blocks = zip(problem.blocks, lower, upper, strict=True)
        blocks_held = tuple(replace(block, lower=least, upper=most) for block, least, most in blocks)
        return replace(problem, blocks=blocks_held, color_lower=colors, color_upper=more)

    def forced_black(self, problem: Quadratic) -> tuple[CellIndex, ...]:
        """The exact cells of a side that hold together with all others only in black, although none asks for it."""
        _, values = problem.split(self.point)
        _, forced = problem.split(self.fixed)
        asked = _asked_black(problem)
        black: dict[CellIndex, None] = {}
        for block, value, fixed in zip(problem.blocks, values, forced, strict=True):
            for r, (_, cell) in enumerate(block.keys):
                at = slice(3 * r, 3 * r + 3)
                rows, ties = block.rows[at], block.ties[at].any(axis=0)
                is_dark = np.abs(rows @ value).max() < REACHED and rows.any() and not rows[:, ~fixed].any()
                is_asked = asked[ties].any() if ties.any() else not block.targets[at].any()
                if block.exact[3 * r] and is_dark and not is_asked:
                    black[cell] = None
        return tuple(black)


def _asked_black(problem: Quadratic) -> NDArray[np.bool_]:
    """The free colors, three numbers each, of which a member is exactly black by its own request, or measured."""
    found = np.repeat(
        np.all((problem.color_lower == 0) & (problem.color_upper == 0), axis=1), 3
    )  # of a measured member
    for block in problem.blocks:
        own = {
            key
            for r, key in enumerate(block.keys)
            if block.exact[3 * r] and not (block.ties[3 * r].any() or block.targets[3 * r : 3 * r + 3].any())
        }
        for r, key in enumerate(block.keys):
            if key in own and block.exact[3 * r]:
                found |= block.ties[3 * r : 3 * r + 3].any(axis=0)
    return found
