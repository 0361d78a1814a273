# SPDX-License-Identifier: GPL-3.0-or-later
"""Two gears of the engine that go from one set of active bounds to the next.

*Primal-dual active set* (Hintermüller, Ito and Kunisch 2002): solve with the present bounds held, then hold whatever
left its bounds and release whatever pulls inwards, all at once. After a small edit two or three steps settle it, but it
may cycle.

*Parametric walk* (Best 1996; Ferreau, Bock and Diehl 2008): the last optimum is the optimum of a problem with another
linear term. Move that term to the new one on a straight line; the solution follows piecewise linearly, and one bound
changes at each bend. The walk cannot cycle where no two bounds change at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow, Factors, _symmetric_solve

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SLACK = 1e-12
"""Distance past a bound, and gradient off a bound, that counts as rounding; relative to the bound and to H."""
FINE_SLACK = 1e-15
"""The same for gradients that were refined."""
WALK_STEPS = 400
"""Bends of the walk before it gives up; some tens are usual."""


_NONE = np.zeros(0)


class ActiveSet:
    """Unknowns of an ``Arrow`` problem, which of them are held at bounds, and each block's elimination."""

    def __init__(self, arrow: Arrow) -> None:
        problem = arrow.problem
        self.arrow = arrow
        self.lower, self.upper = problem.lower, problem.upper
        self.colors = problem.color_lower.size
        self.offsets = problem.offsets
        count = len(arrow.spectra)
        self.block_of = np.repeat(np.arange(-1, count), np.diff([0, *self.offsets]))
        self.x = np.clip(np.zeros(problem.size), self.lower, self.upper)
        self.free = np.ones(problem.size, dtype=bool)
        self.stale = set(range(count))
        self._held_free, self._held = self.free.copy(), self.x.copy()
        """Which unknowns were free, and the values of the others, when their block was last eliminated."""
        self._affine = np.zeros((2, problem.size, self.colors + 1))
        """Value and gradient of each unknown as (constant, by color)."""
        self._borders = [np.zeros((0, 0))] * count
        self._factors: list[Factors | None] = [None] * count
        self._schur = np.zeros((count, self.colors, self.colors + 1))
        self.multipliers: list[Array] = [np.zeros(0)] * count
        """Of the border rows of each block, at the last solution."""
        self.steps = 0
        self._low_limit = self.lower - SLACK * (1 + np.abs(self.lower))
        self._high_limit = self.upper + SLACK * (1 + np.abs(self.upper))
        self._movable = self.lower < self.upper
        self.goal = self.x
        """The last solution with bounds held, whether or not it kept them."""

    def begin(self, x: Array, free: Mask) -> None:
        """Take a start: values, and which unknowns are off their bounds."""
        self.x = np.clip(x, self.lower, self.upper)
        # What lies between its bounds is free, whatever is claimed: a held value must be a bound.
        self.free = (free | ((self.x > self.lower) & (self.x < self.upper))) & (self.lower < self.upper)
        # Factors of blocks whose bounds are held as they were then are still right.
        moved = (self.free != self._held_free) | (~self.free & (self.x != self._held))
        self.stale.update(set(self.block_of[moved].tolist()) - {-1})

    # -- the solution with the present bounds held -----------------------------------------------------------------

    def _refresh(self) -> None:
        """Eliminate the blocks whose terms or active bounds changed."""
        for k in self.stale:
            begin, end = self.offsets[k], self.offsets[k + 1]
            spectrum, free = self.arrow.spectra[k], self.free[begin:end]
            held = np.where(free, 0.0, self.x[begin:end])
            pull = spectrum.hessian @ held + spectrum.linear
            factors = self._factors[k]
            if factors is None or factors.hessian is not spectrum.hessian or not np.array_equal(factors.free, free):
                factors = self._factors[k] = Factors(spectrum, spectrum.hessian, free.copy())
            # One right-hand side for the constant part, one for each free color.
            right = np.empty((1 + self.colors, end - begin))
            right[0], right[1:] = -pull, spectrum.ties
            border = spectrum.border
            if len(border):
                border_right = np.concatenate([(spectrum.border_target - border @ held)[None], spectrum.border_ties.T])
                values, multipliers = factors.solve(right, border_right)
                gradient = multipliers @ border
            else:
                values, multipliers = factors.solve(right, right)
                gradient = np.zeros(right.shape)
            values[0] += held
            gradient += values @ spectrum.hessian
            gradient[0] += spectrum.linear
            gradient[1:] -= spectrum.ties
            gradient *= ~free
            self._held_free[begin:end], self._held[begin:end] = free, self.x[begin:end]
            self._affine[0, begin:end] = values.T
            self._affine[1, begin:end] = gradient.T
            self._borders[k] = multipliers
            if self.colors:
                found = values @ spectrum.ties.T
                self._schur[k] = (found + multipliers @ spectrum.border_ties if len(border) else found).T
        self.stale.clear()

    def solved(self) -> tuple[Array, Array]:
        """Values and gradient of all unknowns with the present bounds held."""
        self._refresh()
        colors = self.colors
        found = np.zeros(0)
        if colors:
            system, (_, linear) = self._schur_system(), self.arrow.color_system
            right = linear + self._schur[:, :, 0].sum(axis=0)
            held = np.where(self.free[:colors], 0.0, self.x[:colors])
            found = held + self._color_solve(system, right - system @ held)
        full = np.concatenate([[1.0], found])
        values, gradient = self._affine @ full
        if colors:
            values[:colors] = found
            gradient[:colors] = np.where(self.free[:colors], 0.0, system @ found - right)
        self.multipliers = [full @ each if each.size else _NONE for each in self._borders]
        return values, gradient

    def slope(self, colors: Array) -> Array:
        """Gradient by the free colors, (q,), at some colors, with all spectra at what the present bounds make of them.

        0 for colors that are held by their boxes.
        """
        self._refresh()
        right = self.arrow.color_system[1] + self._schur[:, :, 0].sum(axis=0)
        return np.where(self.free[: self.colors], self._schur_system() @ colors - right, 0.0)

    def unkept(self, colors: Array) -> list[int]:
        """Take some free colors; the blocks whose present bounds are wrong at them."""
        self.x[: self.colors] = colors
        self._refresh()
        values, gradient = self._affine @ np.concatenate([[1.0], colors])
        wrong, _, _ = self._wrong(values, gradient, SLACK * self._scale())
        wrong[: self.colors] = False
        return sorted(set(self.block_of[wrong].tolist()))

    def _wrong(self, values: Array, gradient: Array, slack: Array) -> tuple[Mask, Mask, Mask]:
        """Unknowns on the wrong side of being free, and those of them below and above their bounds."""
        below, above = self.free & (values < self._low_limit), self.free & (values > self._high_limit)
        at_lower = self.x <= self.lower
        inward = np.where(at_lower, gradient < -slack, gradient > slack) & ~self.free & self._movable
        return below | above | inward, below, above

    def _schur_system(self) -> Array:
        """Curvature by the free colors with all spectra eliminated, (q, q)."""
        return np.asarray(self.arrow.color_system[0] - self._schur[:, :, 1:].sum(axis=0))

    def _color_solve(self, system: Array, right: Array) -> Array:
        """Solve for the colors that are off their boxes; 0 for the others."""
        free = self.free[: self.colors]
        found = np.zeros(self.colors)
        if free.any():
            inner = system.copy() if free.all() else system[free][:, free]
            # A color that nothing pulls at has no curvature; the ridge leaves it where it was.
            own = np.diagonal(self.arrow.color_system[0])
            inner.flat[:: len(inner) + 1] += 1e-15 * max(float(np.abs(own).max()), 1e-300)
            found[free] = _symmetric_solve((inner + inner.T) / 2, right[free])
        return found

    def _refined(self, x: Array) -> tuple[Array, Array]:
        """The same solution to the last digits: Newton steps on residuals that are computed row by row.

        H squares the condition of the rows; a residual from the rows themselves does not, and the factors of H, wrong
        in the last digits only, still bring it down (iterative refinement of the semi-normal equations, Björck 1987).
        """
        problem, unit = self.arrow.problem, self.arrow.unit
        gradient = np.zeros(x.size)
        for last in (False, False, True):
            forces = self.arrow.row_forces(x, self.multipliers)
            gradient = problem.gradient(x, forces) / unit
            if last:
                break
            held = np.where(self.free, -gradient, 0.0)
            by_colors = held[: self.colors].copy()
            colors, values = x[: self.colors], problem.split(x)[1]
            steps = []
            for k, (spectrum, factors) in enumerate(zip(self.arrow.spectra, self._factors, strict=True)):
                assert factors is not None
                begin, end = self.offsets[k], self.offsets[k + 1]
                left = spectrum.border_target + spectrum.border_ties @ colors - spectrum.border @ values[k]
                left += spectrum.compliance * self.multipliers[k]
                step, multiplier = factors.solve(held[None, begin:end], left[None])
                steps.append((step[0], multiplier[0]))
                by_colors += spectrum.ties @ step[0] + multiplier[0] @ spectrum.border_ties
            moved = self._color_solve(self._schur_system(), by_colors) if self.colors else np.zeros(0)
            full = np.concatenate([[0.0], moved])
            x = x + self._affine[0] @ full
            x[: self.colors] += moved
            for k, (step, multiplier) in enumerate(steps):
                x[self.offsets[k] : self.offsets[k + 1]] += step
                self.multipliers[k] = self.multipliers[k] + multiplier + full @ self._borders[k]
        gradient[self.free] = 0.0
        return x, gradient

    def _scale(self) -> Array:
        """Size of each unknown's gradient, for what counts as rounding."""
        hessian, _ = self.arrow.color_system
        colors = np.maximum(np.abs(hessian.diagonal()), 1e-300)
        sizes = [spectrum.largest for spectrum in self.arrow.spectra]
        return np.concatenate([colors, np.repeat(sizes, np.diff(self.offsets))])

    def _toggle(self, which: Mask) -> None:
        self.free[which] = ~self.free[which]
        self.stale.update(set(self.block_of[which].tolist()) - {-1})

    # -- first gear ------------------------------------------------------------------------------------------------

    def settle(self, most: int = 4, *, fine: bool = False) -> bool:
        """Primal-dual active-set steps; whether they arrived at an optimum. ``fine``: with refined solutions."""
        slack = (FINE_SLACK if fine else SLACK) * self._scale()
        for _ in range(most):
            self.steps += 1
            values, gradient = self.solved()
            if fine:
                values, gradient = self._refined(values)
            self.goal = values
            wrong, below, above = self._wrong(values, gradient, slack)
            if not wrong.any():
                self.x = np.clip(values, self.lower, self.upper)
                return True
            self.x = np.where(below, self.lower, np.where(above, self.upper, self.x))
            self._toggle(wrong)
        return False

    # -- second gear -----------------------------------------------------------------------------------------------

    def walk(self, begin: Array, free: Mask) -> bool:
        """The parametric walk from an optimum of a like problem; whether it arrived.

        Parameters
        ----------
        begin
            All unknowns there, within bounds.
        free
            Which of them are off their bounds.
        """
        self.begin(begin, free)
        slack = SLACK * self._scale()
        x = self.x
        gradient = self._gradient_at(x)
        at_lower = x <= self.lower
        # With these gradients ``begin`` is optimal; the difference to the true ones is what the walk takes away.
        gradient = np.where(self.free, 0.0, np.where(at_lower, np.maximum(gradient, 0.0), np.minimum(gradient, 0.0)))
        for _ in range(WALK_STEPS):
            self.steps += 1
            goal, goal_gradient = self.solved()
            below = self.free & (goal < self._low_limit)
            above = self.free & (goal > self._high_limit)
            at_lower = ~self.free & (x <= self.lower)
            inward = ~self.free & self._movable & np.where(at_lower, goal_gradient < -slack, goal_gradient > slack)
            if not (below.any() or above.any() or inward.any()):
                self.x = np.clip(goal, self.lower, self.upper)
                return True
            step = np.full(x.size, np.inf)
            with np.errstate(divide="ignore", invalid="ignore"):
                for bound, past in ((self.lower, below), (self.upper, above)):
                    step[past] = (bound[past] - x[past]) / (goal[past] - x[past])
                step[inward] = gradient[inward] / (gradient[inward] - goal_gradient[inward])
            first = int(step.argmin())
            part = float(np.clip(step[first], 0.0, 1.0))
            x = x + part * (goal - x)
            gradient = gradient + part * (goal_gradient - gradient)
            x = np.where(self.free, np.clip(x, self.lower, self.upper), self.x)
            if self.free[first]:
                x[first] = self.lower[first] if below[first] else self.upper[first]
            gradient[first] = 0.0
            self.x = x
            self.free[first] = not self.free[first]
            if self.block_of[first] >= 0:
                self.stale.add(int(self.block_of[first]))
        return False

    def _gradient_at(self, x: Array) -> Array:
        """Gradient at any point, with the multipliers that the present bounds give."""
        self._refresh()
        colors = x[: self.colors]
        hessian, linear = self.arrow.color_system
        by_colors = hessian @ colors - linear
        parts = []
        full = np.concatenate([[1.0], colors])
        for k, spectrum in enumerate(self.arrow.spectra):
            value = x[self.offsets[k] : self.offsets[k + 1]]
            multiplier = full @ self._borders[k]
            by_colors = by_colors - spectrum.ties @ value - multiplier @ spectrum.border_ties
            parts.append(
                spectrum.hessian @ value + spectrum.linear - colors @ spectrum.ties + multiplier @ spectrum.border
            )
        return np.concatenate([by_colors, *parts])
