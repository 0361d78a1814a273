# SPDX-License-Identifier: GPL-3.0-or-later
"""A side with some unknowns held at their bounds: the solution, its gradient, and the bounds that are then wrong.

Each spectrum is eliminated into an affine function of the free colors (``arrow``), and eliminated again only if its own
bounds or terms change. ``active_set`` chooses the held bounds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow, symmetric_solve
from spectral_core.palette.qp.elimination import Elimination
from spectral_core.palette.qp.squares import ALL, SumOfBlocks, across, with_constant

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SLACK = 1e-12
"""Distance beyond a bound, and gradient off a bound, that counts as rounding; relative to the bound and to H."""
EXACT, NOT_WORST = 1e-11, 1e-3
"""Residuals below which a block is not refined: about a color error in linear RGB; and relative to the largest
residual of all blocks."""

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
        # The elimination of a block is kept as an affine map of the free colors: to solve again is one product.
        self._map = np.zeros((problem.size, self.colors + 1))
        """Value of each free unknown, and gradient of each held one, as (constant, by color)."""
        self._summed = np.zeros((self.colors, self.colors + 1))
        """Gradient of all blocks by the free colors, in the same form."""
        self._by_colors = SumOfBlocks(self._summed.copy(), [None] * count)
        self._eliminated: list[Elimination | None] = [None] * count
        self.multipliers: list[Array] = [_NONE] * count
        """Of the border rows of each block, at the last solution."""
        self.steps = 0
        # Computed once: a solve compares every unknown with them several times.
        self._low_limit = self.lower - SLACK * (1 + np.abs(self.lower))
        self._high_limit = self.upper + SLACK * (1 + np.abs(self.upper))
        self._movable = self.lower < self.upper
        self._always = bool(self._movable.all())
        self._kept_low, self._kept_high = np.empty(problem.size), np.empty(problem.size)
        """The intervals of ``kept_between``; those of the blocks in ``_moved`` are of earlier held bounds."""
        self._moved, self._colors_free = set(range(count)), False

    def begin(self, x: Array, free: Mask) -> None:
        """Set a start: values, and the unknowns that are off their bounds."""
        self.x = np.clip(x, self.lower, self.upper)
        # A value between its bounds is free, whatever the claim: a held value must be at a bound.
        self.free = (free | ((self.x > self.lower) & (self.x < self.upper))) & self._movable
        # Blocks whose bounds are held as at their last elimination stay valid.
        moved = (self.free != self._held_free) | (~self.free & (self.x != self._held))
        self._touch(moved)

    # -- the solution with the present bounds held -----------------------------------------------------------------

    def _refresh(self) -> None:
        """Eliminate the blocks whose terms or active bounds changed."""
        for k in self.stale:
            begin, end = self.offsets[k], self.offsets[k + 1]
            spectrum, free, x = self.arrow.spectra[k], self.free[begin:end], self.x[begin:end]
            found = self._eliminated[k]
            if found is None:
                found = self._eliminated[k] = Elimination(spectrum, free, x)
            else:
                found.follow(spectrum, free, x)
            self._held_free[begin:end], self._held[begin:end] = free, x
            self._take(k, found)
        if self.stale:
            self._summed = self._by_colors.total()
            self._moved |= self.stale
            self.stale.clear()

    def _take(self, k: int, found: Elimination) -> None:
        """Copy a block's elimination into the maps of all blocks."""
        begin, end = self.offsets[k], self.offsets[k + 1]
        colors = found.spectrum.colors
        columns = with_constant(colors)
        if colors is not ALL:
            self._map[begin:end] = 0.0  # the block may have depended on other colors
        self._map[begin:end, columns] = found.map[: end - begin]
        if self.colors:
            new = found.map[end - begin + found.borders :]
            # During a walk only the difference is added; ``_refresh`` sums anew.
            self._by_colors.exchange(k, across(colors, columns), new, self._summed)

    def _elimination(self, k: int) -> Elimination:
        """A block's elimination, which ``_refresh`` has made."""
        found = self._eliminated[k]
        assert found is not None
        return found

    def solved(self) -> tuple[Array, Array]:
        """Values and gradient of all unknowns with the present bounds held."""
        self._refresh()
        goal, full = self._goal()
        self._take_multipliers(full)
        return np.where(self.free, goal, self.x), np.where(self.free, 0.0, goal)

    def _goal(self) -> tuple[Array, Array]:
        """Value of each free unknown and gradient of each held one; and (1, free colors), of which all are affine."""
        colors = self.colors
        full = np.empty(1 + colors)
        full[0] = 1.0
        if not colors:
            return self._map[:, 0].copy(), full
        free = self.free[:colors]
        system, right = self._color_system()
        if free.all():
            full[1:] = symmetric_solve(self._ridged(system), right)
            goal = self._map @ full
            goal[:colors] = full[1:]
            return goal, full
        # A color at the border of its box is known; its column moves to the right-hand side.
        held = np.where(free, 0.0, self.x[:colors])
        full[1:] = held + self._color_solve(system, right - system @ held)
        goal = self._map @ full
        # A held color has a multiplier too: the rest of its row of the Schur system.
        goal[:colors] = np.where(free, full[1:], system @ full[1:] - right)
        return goal, full

    def renew(self) -> bool:
        """Have all blocks factored anew whose elimination was changed by exchanges; True if there are any."""
        exchanged = [k for k, found in enumerate(self._eliminated) if found is not None and found.exchanges]
        for k in exchanged:
            self._eliminated[k] = None
        self.stale.update(exchanged)
        return bool(exchanged)

    def _kept_between(self) -> tuple[Array, Array]:
        """The interval in which the value of a free unknown, or the gradient of a held one, must lie.

        They are kept from one call to the next, except those of colors and of blocks that were eliminated since.
        """
        if 2 * len(self._moved) > len(self.offsets):
            changed = [slice(None)]
        else:
            changed = [slice(self.offsets[k], self.offsets[k + 1]) for k in self._moved]
            if self.colors and not (self._colors_free and self.free[: self.colors].all()):
                changed.append(slice(self.colors))
        if self.colors:
            self._colors_free = bool(self.free[: self.colors].all())
        for at in changed:
            free, at_lower = self.free[at], self.x[at] <= self.lower[at]
            slack = SLACK * self.arrow.sizes[at]
            inward = at_lower if self._always else at_lower & self._movable[at]
            outward = at_lower if self._always else at_lower | ~self._movable[at]
            self._kept_low[at] = np.where(free, self._low_limit[at], np.where(inward, -slack, -np.inf))
            self._kept_high[at] = np.where(free, self._high_limit[at], np.where(outward, np.inf, slack))
        self._moved.clear()
        return self._kept_low, self._kept_high

    def _take_multipliers(self, full: Array) -> None:
        """The multipliers of all border rows at some free colors, from (1, colors)."""
        self.multipliers = [
            found.multipliers_at(full) if found is not None and found.borders else _NONE for found in self._eliminated
        ]

    def _wrong(self, values: Array, gradient: Array, slack: Array) -> tuple[Mask, Mask, Mask]:
        """Unknowns whose state (free or held) is wrong, and those of them below and above their bounds."""
        below, above = self.free & (values < self._low_limit), self.free & (values > self._high_limit)
        at_lower = self.x <= self.lower
        # A multiplier of the wrong sign: the objective decreases when the unknown leaves its bound. Unknowns with equal
        # bounds stay.
        inward = np.where(at_lower, gradient < -slack, gradient > slack) & ~self.free & self._movable
        return below | above | inward, below, above

    def _color_system(self) -> tuple[Array, Array]:
        """Curvature by the free colors with all spectra eliminated, (q, q), and right-hand side (q,)."""
        hessian, linear = self.arrow.color_system
        return hessian - self._summed[:, 1:], linear + self._summed[:, 0]

    def _color_solve(self, system: Array, right: Array) -> Array:
        """Solve for the colors inside their boxes; 0 for the others."""
        free = self.free[: self.colors]
        found = np.zeros(self.colors)
        if free.any():
            found[free] = symmetric_solve(self._ridged(system)[free][:, free], right[free])
        return found

    def _ridged(self, system: Array) -> Array:
        # Rounding leaves the sum of the blocks' parts slightly asymmetric, which Cholesky would hide and not repair.
        inner = system + system.T
        inner *= 0.5
        # A color that no row is tied to has no curvature; the ridge leaves it where it was.
        inner.reshape(-1)[:: len(inner) + 1] += self.arrow.color_ridge
        return inner

    def _refined(self, x: Array) -> tuple[Array, Array]:
        """The same solution to full accuracy: Newton steps on residuals that are computed row by row.

        H squares the condition of the rows; a residual from the rows themselves does not, and the factors of H still
        reduce it (iterative refinement of the semi-normal equations, Björck 1987).
        """
        problem, unit = self.arrow.problem, self.arrow.unit
        gradient = np.zeros(x.size)
        for last in (False, False, True):
            forces = self.arrow.row_forces(problem.all_misses(x), self.multipliers)
            gradient = problem.gradient(x, forces) / unit
            if last:
                break
            # Only free unknowns move; the active set is not decided here.
            held = np.where(self.free, -gradient, 0.0)
            by_colors = held[: self.colors].copy()
            steps = {}
            for k, left in self._inexact(x, held).items():
                spectrum, begin, end = self.arrow.spectra[k], self.offsets[k], self.offsets[k + 1]
                step, multiplier = self._elimination(k).current_factors().solve(held[None, begin:end], left[None])
                steps[k] = step[0], multiplier[0]
                by_colors[spectrum.colors] += spectrum.ties @ step[0] + multiplier[0] @ spectrum.border_ties
            # These steps of the spectra are for fixed colors. The Schur system gives the steps of the colors, and
            # these add to the steps of the spectra.
            moved = self._color_solve(self._color_system()[0], by_colors) if self.colors else np.zeros(0)
            full = np.concatenate([[0.0], moved])
            x = x + np.where(self.free, self._map @ full, 0.0)
            x[: self.colors] += moved
            for k, found in enumerate(self._eliminated):
                if found is not None and found.borders:
                    self.multipliers[k] = self.multipliers[k] + found.multipliers_at(full)
            for k, (step, multiplier) in steps.items():
                x[self.offsets[k] : self.offsets[k + 1]] += step
                self.multipliers[k] = self.multipliers[k] + multiplier
        gradient[self.free] = 0.0
        return x, gradient

    def _inexact(self, x: Array, held: Array) -> dict[int, Array]:
        """Residuals of the border rows of the blocks that a refinement can improve, by block.

        A palette has many blocks, and few whose rounding shows: the others would spend the time of a refinement.
        """
        problem = self.arrow.problem
        colors, values = x[: self.colors], problem.split(x)[1]
        shown = np.abs(held) * (self.arrow.unit / problem.gradient_scale)
        sizes = np.array([own.max(initial=0.0) for own in problem.split(shown)[1]])
        lefts = [_NONE] * sizes.size
        for k, spectrum in enumerate(self.arrow.spectra):
            if len(spectrum.border):
                # These residuals belong to the same Newton system; else the multipliers would keep their rounding.
                left = spectrum.border_target + spectrum.border_ties @ colors[spectrum.colors]
                left -= spectrum.border @ values[k]
                left += spectrum.compliance * self.multipliers[k]
                lefts[k], sizes[k] = left, max(sizes[k], np.abs(left).max())
        least = max(EXACT, NOT_WORST * sizes.max(initial=0.0))
        return {k: lefts[k] for k in (sizes >= least).nonzero()[0].tolist()}

    def _toggle(self, which: Mask) -> None:
        self.free[which] = ~self.free[which]
        self._touch(which)

    def _exchange(self, number: int) -> None:
        """Toggle one unknown at its present value, and the elimination of its block with it."""
        self.free[number] = not self.free[number]
        k = int(self.block_of[number])
        if k < 0:
            return
        found = self._elimination(k)
        if found.exchange(number - self.offsets[k], float(self.x[number])):
            self._held_free[number], self._held[number] = self.free[number], self.x[number]
            self._moved.add(k)
            self._take(k, found)
        else:
            self.stale.add(k)
            self._refresh()

    def _gradient_at(self, colors: Array) -> Array:
        """Gradient of all held unknowns at some free colors, (q,), with every spectrum at its best there."""
        full = np.concatenate([[1.0], colors])
        gradient = self._map @ full
        if colors.size:
            gradient[: colors.size] = self._color_gradient(colors)
        return gradient

    def _color_gradient(self, colors: Array) -> Array:
        """Gradient by the free colors at some values of theirs, (q,), with every spectrum at its best there."""
        system, right = self._color_system()
        return system @ colors - right

    def _touch(self, which: Mask) -> None:
        """Note the blocks of some unknowns as changed."""
        self.stale.update(set(self.block_of[which].tolist()) - {-1})
