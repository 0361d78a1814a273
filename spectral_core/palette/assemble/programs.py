# SPDX-License-Identifier: GPL-3.0-or-later
"""Quadratic programs within limits of unknown reflectances: the nearest point to a wanted color."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import SolveError
from spectral_core.palette.assemble.limits import Limits

Array = NDArray[np.float64]

EXACT = 1e-6  # linear RGB distance below which a wanted color counts as reachable
SOLVED = (1, 2)  # of ``daqp``
TIGHT = 1e-12  # of ``piqp``
DEPENDENT = 1e-10
"""Singular value, relative to the largest, below which rows of exact colors depend on each other."""
LARGEST_DENSE = 150
"""Most unknowns for dense programs: the time of these grows with the cube of the number."""


class Programs:
    """Programs within ``limits``. ``own``: number of unknowns of one material; others are further materials."""

    def __init__(self, limits: Limits, own: int) -> None:
        self.limits, self.own = limits, own

    def solved(self, rows: Array, wanted: Array, ridge: float, center: Array) -> tuple[Array, Array]:
        """Reflectance of the least |rows r - wanted|² + ridge |r - center|², and multipliers, as ``_projected``."""
        import daqp

        limits = self.limits
        linear = -rows.T @ wanted - ridge * center
        if limits.size > max(self.own, LARGEST_DENSE) and (answer := self._of_many(rows, linear, ridge)):
            return answer
        hessian = rows.T @ rows + ridge * np.eye(limits.size)
        # The solver writes into the senses, so it gets a copy.
        found, _, status, info = daqp.solve(
            hessian, linear, limits.rows, limits.upper, limits.lower, limits.sense.copy()
        )
        values = np.clip(found, *self.limits.bounds)
        if status not in SOLVED or limits.miss(values) > EXACT:
            return self._from_a_point(hessian, linear)
        return values, np.asarray(info["lam"], dtype=np.float64)[limits.size :]

    def _of_many(self, rows: Array, linear: Array, ridge: float) -> tuple[Array, Array] | None:
        """``solved`` for many materials, each of which has few of the equations, by the sparse form of piqp, from a
        point that has the exact colors; None if it fails.
        """
        import piqp
        from scipy.sparse import csc_matrix, identity

        limits, equal, knots = self.limits, self.limits.is_equal, self.limits.size
        point = self.any_point
        if point is None:
            return None
        size = float(np.sum(rows**2)) + ridge * knots
        hessian = (csc_matrix(rows.T) @ csc_matrix(rows) + ridge * identity(knots)).tocsc() / size
        present = np.append(point, limits.rows @ point)
        low, high = limits.lower - present, limits.upper - present
        ranges = [csc_matrix(limits.rows[~equal]), low[knots:][~equal], high[knots:][~equal]]
        solver = piqp.SparseSolver()
        solver.settings.eps_abs, solver.settings.eps_rel = TIGHT, 0.0
        solver.setup(
            hessian, linear / size + hessian @ point, csc_matrix(limits.rows[equal]), np.zeros(int(equal.sum())),
            *(ranges if (~equal).any() else [None] * 3), low[:knots], high[:knots],
        )  # fmt: skip
        solver.solve()
        values = np.clip(point + np.asarray(solver.result.x), *self.limits.bounds)
        if not np.isfinite(values).all() or limits.miss(values) > EXACT:
            return None
        multipliers = np.zeros(equal.size)
        multipliers[equal] = size * np.asarray(solver.result.y)
        if (~equal).any():
            multipliers[~equal] = size * (np.asarray(solver.result.z_u) - np.asarray(solver.result.z_l))
        return values, multipliers

    @cached_property
    def any_point(self) -> Array | None:
        """A reflectance with the exact colors; None if there is none."""
        found = self.limits.extreme(np.zeros(self.limits.size))
        return None if found is None else np.clip(found, *self.limits.bounds)

    def _from_a_point(self, hessian: Array, linear: Array) -> tuple[Array, Array]:
        """``solved`` where the exact colors are at the end of what their lights can show, or nearly depend on each
        other: as a change from a point that has them, along independent rows, by piqp.
        """
        import piqp

        limits, equal, knots = self.limits, self.limits.is_equal, self.limits.size
        point = self.any_point
        if point is None:
            raise SolveError("the exact colors of this material cannot be met together")
        outer, sizes, inner = np.linalg.svd(limits.rows[equal], full_matrices=False)
        kept = sizes > DEPENDENT * sizes.max(initial=0.0)
        present = np.append(point, limits.rows @ point)
        low, high = limits.lower - present, limits.upper - present
        none = np.zeros(int(kept.sum()))
        ranges = [limits.rows[~equal], low[knots:][~equal], high[knots:][~equal]] if (~equal).any() else [None] * 3
        size = float(np.trace(hessian))
        solver = piqp.DenseSolver()
        solver.settings.eps_abs, solver.settings.eps_rel = TIGHT, 0.0
        gradient = (linear + hessian @ point) / size
        solver.setup(hessian / size, gradient, inner[kept], none, *ranges, low[:knots], high[:knots])
        status = solver.solve()
        values = np.clip(point + np.asarray(solver.result.x), *self.limits.bounds)
        if not np.isfinite(values).all() or limits.miss(values) > EXACT:
            raise SolveError(
                f"the nearest reachable color was not found ({status}): the exact colors of the other cells leave this "
                "material hardly any other reflectance. Make one of them not exact."
            )
        multipliers = np.zeros(equal.size)
        multipliers[equal] = size * (outer[:, kept] / sizes[kept]) @ np.asarray(solver.result.y)
        if (~equal).any():
            multipliers[~equal] = size * (np.asarray(solver.result.z_u) - np.asarray(solver.result.z_l))
        return values, multipliers
