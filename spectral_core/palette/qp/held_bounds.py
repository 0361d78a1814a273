# SPDX-License-Identifier: GPL-3.0-or-later
"""A side with some unknowns held at their bounds: the solution, its gradient, and the bounds that are then wrong.

Each spectrum is eliminated into an affine function of the free colors (``arrow``), and eliminated again only if its own
bounds or terms change. ``active_set`` chooses the held bounds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow, Factors, symmetric_solve

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SLACK = 1e-12
"""Distance beyond a bound, and gradient off a bound, that counts as rounding; relative to the bound and to H."""


_NONE = np.zeros(0)


class HeldBounds:
    """Unknowns of an ``Arrow`` problem, which of them are held at bounds, and each block's elimination."""

    def __init__(self, arrow: Arrow) -> None:
        problem = arrow.problem
        self.arrow = arrow
        self.lower, self.upper = problem.lower, problem.upper
        self.colors = problem.color_lower.size
        self.offsets = problem.offsets
        count = len(arrow.spectra)
        # -1 for the free colors: they belong to no block, so a change of theirs invalidates no block's factors.
        self.block_of = np.repeat(np.arange(-1, count), np.diff([0, *self.offsets]))
        self.x = np.clip(np.zeros(problem.size), self.lower, self.upper)
        self.free = np.ones(problem.size, dtype=bool)
        self.stale = set(range(count))
        self._held_free, self._held = self.free.copy(), self.x.copy()
        """Unknowns that were free, and the values of the others, when their block was last eliminated."""
        # The elimination of a block is kept as an affine map of the free colors. Re-solving after a change elsewhere is
        # then one product.
        self._affine = np.zeros((2, problem.size, self.colors + 1))
        """Value and gradient of each unknown as (constant, by color)."""
        self._borders = [np.zeros((0, 0))] * count
        self._factors: list[Factors | None] = [None] * count
        self._schur = np.zeros((count, self.colors, self.colors + 1))
        self.multipliers: list[Array] = [np.zeros(0)] * count
        """Of the border rows of each block, at the last solution."""
        self.steps = 0
        # Computed once: a solve compares every unknown with them several times.
        self._low_limit = self.lower - SLACK * (1 + np.abs(self.lower))
        self._high_limit = self.upper + SLACK * (1 + np.abs(self.upper))
        self._movable = self.lower < self.upper
        self.goal = self.x
        """The last solution with bounds held, even if it violates other bounds."""

    def begin(self, x: Array, free: Mask) -> None:
        """Set a start: values, and the unknowns that are off their bounds."""
        self.x = np.clip(x, self.lower, self.upper)
        # Values between their bounds are free, whatever the start claims: a held value must be a bound.
        self.free = (free | ((self.x > self.lower) & (self.x < self.upper))) & (self.lower < self.upper)
        # Factors of blocks with unchanged held bounds stay valid.
        moved = (self.free != self._held_free) | (~self.free & (self.x != self._held))
        self.stale.update(set(self.block_of[moved].tolist()) - {-1})

    # -- the solution with the present bounds held -----------------------------------------------------------------

    def _refresh(self) -> None:
        """Eliminate the blocks whose terms or active bounds changed."""
        for k in self.stale:
            begin, end = self.offsets[k], self.offsets[k + 1]
            spectrum, free = self.arrow.spectra[k], self.free[begin:end]
            held = np.where(free, 0.0, self.x[begin:end])
            # Held unknowns move to the right-hand side, so that the factors are those of the free ones alone.
            linear = spectrum.hessian @ held + spectrum.linear
            factors = self._factors[k]
            # The factorization depends on H and on the set of free unknowns, not on targets: a dragged color keeps it.
            if factors is None or factors.hessian is not spectrum.hessian or not np.array_equal(factors.free, free):
                factors = self._factors[k] = Factors(spectrum, spectrum.hessian, free.copy())
            # One right-hand side for the constant part, one for each free color.
            right = np.empty((1 + self.colors, end - begin))
            right[0], right[1:] = -linear, spectrum.ties
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
            # The gradient of a free unknown is 0 by construction; its computed value is rounding.
            gradient *= ~free
            self._held_free[begin:end], self._held[begin:end] = free, self.x[begin:end]
            self._affine[0, begin:end] = values.T
            self._affine[1, begin:end] = gradient.T
            self._borders[k] = multipliers
            if self.colors:
                found = values @ spectrum.ties.T
                # One block's part of the Schur complement in g: constant column first, then the matrix.
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
            # A color at the border of its box is known; its column moves to the right-hand side.
            held = np.where(self.free[:colors], 0.0, self.x[:colors])
            found = held + self._color_solve(system, right - system @ held)
        full = np.concatenate([[1.0], found])
        # Back substitution: all spectra at once, from the colors just found.
        values, gradient = self._affine @ full
        if colors:
            values[:colors] = found
            # A held color has a multiplier too: the remainder of its row of the Schur system.
            gradient[:colors] = np.where(self.free[:colors], 0.0, system @ found - right)
        self.multipliers = [full @ each if each.size else _NONE for each in self._borders]
        return values, gradient

    def slope(self, colors: Array) -> Array:
        """Gradient by the free colors, (q,), at some colors, with all spectra at their solution for the present bounds.

        0 for colors that are held by their boxes.
        """
        self._refresh()
        right = self.arrow.color_system[1] + self._schur[:, :, 0].sum(axis=0)
        return np.where(self.free[: self.colors], self._schur_system() @ colors - right, 0.0)

    def unkept(self, colors: Array) -> list[int]:
        """Set some free colors; returns the blocks whose present bounds are wrong at them."""
        self.x[: self.colors] = colors
        self._refresh()
        values, gradient = self._affine @ np.concatenate([[1.0], colors])
        wrong, _, _ = self._wrong(values, gradient, SLACK * self._scale())
        # The colors were given; only the spectra are tested.
        wrong[: self.colors] = False
        return sorted(set(self.block_of[wrong].tolist()))

    def _wrong(self, values: Array, gradient: Array, slack: Array) -> tuple[Mask, Mask, Mask]:
        """Unknowns whose state (free or held) is wrong, and those of them below and above their bounds."""
        below, above = self.free & (values < self._low_limit), self.free & (values > self._high_limit)
        at_lower = self.x <= self.lower
        # A multiplier of the wrong sign: the objective decreases when the unknown leaves its bound. Unknowns with equal
        # bounds stay.
        inward = np.where(at_lower, gradient < -slack, gradient > slack) & ~self.free & self._movable
        return below | above | inward, below, above

    def _schur_system(self) -> Array:
        """Curvature by the free colors with all spectra eliminated, (q, q)."""
        return np.asarray(self.arrow.color_system[0] - self._schur[:, :, 1:].sum(axis=0))

    def _color_solve(self, system: Array, right: Array) -> Array:
        """Solve for the colors inside their boxes; 0 for the others."""
        free = self.free[: self.colors]
        found = np.zeros(self.colors)
        if free.any():
            inner = system.copy() if free.all() else system[free][:, free]
            # A color without any force has no curvature; the ridge leaves it unchanged.
            own = np.diagonal(self.arrow.color_system[0])
            inner.flat[:: len(inner) + 1] += 1e-15 * max(float(np.abs(own).max()), 1e-300)
            # Rounding leaves the sum of the blocks' parts slightly asymmetric, which Cholesky would ignore, not
            # correct.
            found[free] = symmetric_solve((inner + inner.T) / 2, right[free])
        return found

    def _refined(self, x: Array) -> tuple[Array, Array]:
        """The same solution to full accuracy: Newton steps on residuals that are computed row by row.

        H squares the condition of the rows; a residual from the rows themselves does not, and the factors of H still
        reduce it (iterative refinement of the semi-normal equations, Björck 1987).
        """
        problem, unit = self.arrow.problem, self.arrow.unit
        gradient = np.zeros(x.size)
        for last in (False, False, True):
            forces = self.arrow.row_forces(x, self.multipliers)
            gradient = problem.gradient(x, forces) / unit
            if last:
                break
            # Only free unknowns move; the active set is not decided here.
            held = np.where(self.free, -gradient, 0.0)
            by_colors = held[: self.colors].copy()
            colors, values = x[: self.colors], problem.split(x)[1]
            steps = []
            for k, (spectrum, factors) in enumerate(zip(self.arrow.spectra, self._factors, strict=True)):
                assert factors is not None
                begin, end = self.offsets[k], self.offsets[k + 1]
                # The residual of the border rows belongs to the same Newton system; otherwise the multipliers would
                # keep their rounding.
                left = spectrum.border_target + spectrum.border_ties @ colors - spectrum.border @ values[k]
                left += spectrum.compliance * self.multipliers[k]
                step, multiplier = factors.solve(held[None, begin:end], left[None])
                steps.append((step[0], multiplier[0]))
                by_colors += spectrum.ties @ step[0] + multiplier[0] @ spectrum.border_ties
            # The blocks' steps are for fixed colors; the Schur system gives the step of the colors, which moves the
            # blocks too.
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
        """Size of each unknown's gradient, the reference for rounding."""
        hessian, _ = self.arrow.color_system
        colors = np.maximum(np.abs(hessian.diagonal()), 1e-300)
        sizes = [spectrum.largest for spectrum in self.arrow.spectra]
        return np.concatenate([colors, np.repeat(sizes, np.diff(self.offsets))])

    def _toggle(self, which: Mask) -> None:
        self.free[which] = ~self.free[which]
        self.stale.update(set(self.block_of[which].tolist()) - {-1})

    def _gradient_at(self, x: Array) -> Array:
        """Gradient at any point, with the multipliers of the present bounds."""
        self._refresh()
        colors = x[: self.colors]
        hessian, linear = self.arrow.color_system
        by_colors = hessian @ colors - linear
        parts = []
        full = np.concatenate([[1.0], colors])
        for k, spectrum in enumerate(self.arrow.spectra):
            value = x[self.offsets[k] : self.offsets[k + 1]]
            # Multipliers of exact rows are not in x. Those of the present active set make the start consistent.
            multiplier = full @ self._borders[k]
            by_colors = by_colors - spectrum.ties @ value - multiplier @ spectrum.border_ties
            parts.append(
                spectrum.hessian @ value + spectrum.linear - colors @ spectrum.ties + multiplier @ spectrum.border
            )
        return np.concatenate([by_colors, *parts])
