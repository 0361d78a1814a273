# SPDX-License-Identifier: GPL-3.0-or-later
"""One spectrum eliminated: with some samples held at their bounds, everything else is affine in the free colors.

The free samples x_F, the multipliers y of the border rows, and the gradients z of the held samples solve

    [H_FF  E_Fᵀ] [x_F]   [z_F − f + Cᵀg]
    [E_F   −c  ] [y  ] = [e + T g      ]      with z_F = 0 and the held samples at their bounds

(``arrow`` has the letters). A factorization of H_FF answers that for one set F. Where a walk changes F by one sample
at a time, a table of all responses is kept instead, and one exchange of a row with a column, a product of two vectors,
replaces the factorization (principal pivoting; Cottle, Pang and Stone 1992, section 2.3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dger

from spectral_core.palette.qp.arrow import Factors
from spectral_core.palette.qp.squares import Spectrum, with_constant

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_EXCHANGES = 40
"""Most exchanges before a block is factored anew, or the number of its samples if that is larger: each adds some
rounding."""
LEAST_PIVOT = 1e-5
"""Pivot below which an exchange would lose its digits, relative to that of the sample by itself (its curvature)."""


class Elimination:
    """One block with its present bounds held; kept, and changed by exchanges, from one problem to the next."""

    def __init__(self, spectrum: Spectrum, free: Mask, x: Array) -> None:
        self.spectrum = spectrum
        self.free, self.held = free, x
        self.map: Array = np.zeros((0, 0))
        """(n + b + q, 1 + q), q colors of the block: value of a free sample or gradient of a held one, multipliers,
        and Cx + Tᵀy, each as constant and by color."""
        self.borders = len(spectrum.border)
        """Number of border rows."""
        self.exchanges = 0
        """Changes since the last factorization."""
        self._factors: Factors | None = None
        self._table: Array | None = None
        self._solve(free, x)

    @property
    def multipliers(self) -> Array:
        """Those of the border rows, (b, 1 + q), as constant and by color."""
        return self.map[self.free.size : self.free.size + self.borders]

    def multipliers_at(self, full: Array) -> Array:
        """Those of the border rows, (b,), at 1 and all free colors of the palette."""
        return np.asarray(self.multipliers @ full[with_constant(self.spectrum.colors)])

    def follow(self, spectrum: Spectrum, free: Mask, x: Array) -> None:
        """Take other targets and other held bounds, by exchanges where that is cheaper than a factorization.

        Parameters
        ----------
        spectrum
            The block's present terms.
        free
            Which samples are off their bounds, (n,).
        x
            Values of the samples, of which those of held ones are read, (n,).
        """
        before, self.spectrum = self.spectrum, spectrum
        table = self._table
        if table is None or spectrum.hessian is not before.hessian or spectrum.border is not before.border:
            self._solve(free, x)
            return
        flips = np.flatnonzero(free != self.free)
        most = max(MOST_EXCHANGES, free.size)
        if 2 * flips.size > free.size or self.exchanges + flips.size > most:
            self._solve(free, x)
            return
        if spectrum is not before:
            self._retarget(table, before)
        kept = ~(free | self.free)
        moved = kept & (x != self.held)
        if moved.any():
            self.map[:, 0] += table[:, : free.size][:, moved] @ (x - self.held)[moved]
            self.held = np.where(moved, x, self.held)
        for i in flips.tolist():
            if not self.exchange(i, float(x[i])):
                self._solve(free, x)
                return

    def exchange(self, i: int, bound: float) -> bool:
        """Hold sample i at ``bound``, or free it if it is held; False where that would cost digits."""
        table = self._tabulated() if self._table is None else self._table
        pivot, own = float(table[i, i]), float(self.spectrum.hessian[i, i])
        is_free = bool(self.free[i])
        # The pivot is a curvature where the sample is held, and the inverse of one where it is free.
        if not (0.0 < pivot * own < 1 / LEAST_PIVOT if is_free else pivot > LEAST_PIVOT * own):
            return False
        if is_free:
            # The table counts a held sample from its bound.
            self.map[i, 0] -= bound
        row, column = table[i] / pivot, table[:, i].copy()
        dger(-1.0, column, row, a=table, overwrite_a=1)
        table[i] = -row
        column /= pivot
        table[:, i] = column
        table[i, i] = 1.0 / pivot
        if is_free:
            self.held[i] = bound
        else:
            self.map[i, 0] += self.held[i]
            self.held[i] = 0.0
        self.free[i] = not is_free
        self.exchanges += 1
        return True

    def current_factors(self) -> Factors:
        """The factors of H on the samples that are free now."""
        found = self._factors
        if found is None or found.hessian is not self.spectrum.hessian or (found.free != self.free).any():
            found = self._factors = Factors(self.spectrum, self.spectrum.hessian, self.free.copy())
        return found

    # -- by factorization ----------------------------------------------------------------------------------------------

    def _solve(self, free: Mask, x: Array) -> None:
        """Solve for one right-hand side for the constant part, and one for each free color."""
        spectrum, size = self.spectrum, free.size
        borders = self.borders = len(spectrum.border)
        self.free, self.held = free.copy(), np.where(free, 0.0, x)
        factors = self.current_factors()
        at = factors.at
        # Held samples move to the right-hand side, so that the factors are those of the free ones alone.
        pull = spectrum.hessian @ self.held
        pull += spectrum.linear
        # In the order of columns that LAPACK works on.
        right = np.empty((at.size, 1 + len(spectrum.ties)), order="F")
        np.negative(pull[at], out=right[:, 0])
        tied = spectrum.ties.take(at, axis=1)
        right[:, 1:] = tied.T
        found = np.empty((size + borders + len(spectrum.ties), right.shape[1]))
        gradient, by_colors = found[:size], found[size + borders :]
        if borders:
            outside = np.empty((borders, right.shape[1]))
            outside[:, 0] = spectrum.border_target - spectrum.border @ self.held
            outside[:, 1:] = spectrum.border_ties
            values, multipliers = factors.solve_free(right, outside)
            found[size : size + borders] = multipliers
        else:
            values, multipliers = factors.solve_free(right, right)
        np.matmul(factors.rows.T, values, out=gradient)
        gradient[:, 0] += pull
        gradient[:, 1:] -= spectrum.ties.T
        np.matmul(tied, values, out=by_colors)
        by_colors[:, 0] += spectrum.ties @ self.held
        if borders:
            gradient += spectrum.border.T @ multipliers
            by_colors += spectrum.border_ties.T @ multipliers
        found[at] = values
        self.exchanges = 0
        self._table = None
        self.map = found

    # -- by the table --------------------------------------------------------------------------------------------------

    def _tabulated(self) -> Array:
        """The response of every row of ``map`` to a push z at a free sample, a move of a held one, a border row's
        target.

        The columns of ``map`` follow those of the responses, so that one exchange changes both.
        """
        spectrum = self.spectrum
        size, total = self.free.size, self.free.size + len(spectrum.border)
        unit = np.zeros((total, total))
        unit.flat[:: total + 1] = np.concatenate([self.free, np.ones(total - size)])
        values, multipliers = self.current_factors().solve(unit[:, :size], unit[:, size:])
        inverse = np.concatenate([values, multipliers], axis=1)
        system = np.zeros((total, total))
        system[:size, :size] = spectrum.hessian
        system[:size, size:], system[size:, :size] = spectrum.border.T, spectrum.border
        held = np.flatnonzero(~self.free)
        moved = -inverse @ system[:, held]
        ties = np.concatenate([spectrum.ties, spectrum.border_ties.T], axis=1)
        rows = np.zeros((total + len(ties), total + self.map.shape[1]), order="F")
        rows[:total, :total] = inverse
        rows[held, :total] = -moved.T
        rows[:total, held] += moved
        rows[np.ix_(held, held)] = system[np.ix_(held, held)] + system[held] @ moved
        rows[total:, :total] = ties @ inverse
        rows[total:, held] = ties[:, held] + ties @ moved
        rows[:, total:] = self.map
        self._table, self.map = rows, rows[:, total:]
        return rows

    def _retarget(self, table: Array, before: Spectrum) -> None:
        """Move the constants to other targets: only f and e changed."""
        spectrum, size = self.spectrum, self.free.size
        self.exchanges += 1
        fallen = before.linear - spectrum.linear
        pushed = np.where(self.free, fallen, 0.0)
        if self.borders:
            pushed = np.concatenate([pushed, spectrum.border_target - before.border_target])
        self.map[:, 0] += table[:, : pushed.size] @ pushed
        self.map[:size, 0] -= np.where(self.free, 0.0, fallen)
