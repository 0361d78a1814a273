# SPDX-License-Identifier: GPL-3.0-or-later
"""The method of an edit: Newton's method in the free colors, with every spectrum at its optimum for them.

The objective, as a function of the free colors alone, is convex and piecewise quadratic. Its pieces are the sets of
active bounds; the optimum of the present piece is the next point. There daqp finds the active bounds of the spectra
that left the piece (``backends``), each by itself, in the time of one step of the walk. Where that does not end in
a few steps, the parametric walk goes on from the point reached (``active_set``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.active_set import WALK_STEPS, ActiveSet
from spectral_core.palette.qp.arrow import Arrow
from spectral_core.palette.qp.backends import KeptSpectrum
from spectral_core.palette.qp.held_bounds import SLACK
from spectral_core.palette.qp.quadratic import Quadratic, least_in_box

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DENSE_LIMIT = 200
"""Samples of a spectrum from which piqp finds the active bounds sooner than dense factors do."""
DENSE_STEPS = 150
"""Most breakpoints of a walk with spectra of that size: it costs as much as a solve by piqp."""
MANY = 8
"""Spectra from which a step is worth its time: with few, the bounds of one change the objective's curvature so much
that most steps are too long."""
OVERSHOT = 0.5
"""Slope of the objective after a step, relative to its slope before, from which the step was too long."""
NEWTON_STEPS = 6
"""Most steps; one or two are usual."""
CONFLICT_STEPS = 100
"""Most breakpoints of a walk beside exact rows: a longer one shows that these conflict."""


class ColorNewton(ActiveSet):
    """Finds the active bounds after an edit."""

    def __init__(self, arrow: Arrow) -> None:
        super().__init__(arrow)
        sizes = np.diff(self.offsets)
        self._kept: list[KeptSpectrum | None] = [None] * sizes.size
        self._worthwhile = sizes.size >= MANY and not self.is_dense

    @property
    def is_dense(self) -> bool:
        """True if piqp is the faster method without a near start."""
        return is_dense(self.arrow.problem)

    @property
    def longest_walk(self) -> int:
        """Most breakpoints of a walk."""
        return DENSE_STEPS if self.is_dense else WALK_STEPS

    def descend(self, begin: Array, free: Mask, changed: list[int] | None, most: int | None = None) -> bool:
        """From the last answer to the new one; True if an optimum was reached.

        Parameters
        ----------
        begin
            All unknowns of the last answer, within bounds.
        free
            Which of them were off their bounds.
        changed
            Blocks that differ from the last problem; None for all.
        most
            Breakpoints of the walk, if fewer than usual.
        """
        if begin is not self.x or free is not self.free:
            self.begin(begin, free)
        colors = self.x[: self.colors].copy()
        # A changed spectrum moves to its optimum at the old colors. Then all spectra are at their optimum, the present
        # piece is that of a point, and a later walk moves the linear term by the colors alone.
        for k in range(len(self._kept)) if changed is None else changed:
            self._place(k, colors)
        self._refresh()
        if self._worthwhile:
            for _ in range(NEWTON_STEPS):
                self.steps += 1
                goal, full = self._goal()
                past = self._past(goal, 0)
                if not past.size:
                    self._arrive(goal, full)
                    return True
                if not self._step(goal, past, colors):
                    break
            values = self._at_colors(colors)
            self.x = np.where(self.free, np.minimum(np.maximum(values, self.lower), self.upper), self.x)
        in_doubt = self.arrow.problem.has_equalities
        longest = CONFLICT_STEPS if in_doubt else self.longest_walk
        return self.walk(self.x, self.free, longest if most is None else min(most, longest))

    def _step(self, goal: Array, past: NDArray[np.intp], colors: Array) -> bool:
        """Move to the optimum of the present piece, or stay where that is too far; False if the walk is to go on.

        Parameters
        ----------
        goal
            Values and gradients at that optimum.
        past
            Those of them that are outside their intervals.
        colors
            The free colors, (q,); they take their new values.
        """
        count = self.colors
        before, x, free = colors.copy(), self.x.copy(), self.free.copy()
        system, right = self._color_system()
        moved = False
        if past[0] < count:
            moved = self._boxed_colors(colors)
            past = self._past(self._at_colors(colors)[count:], count)
        else:
            colors[:] = np.where(free[:count], goal[:count], colors)
        self.x[:count] = colors
        for k in np.unique(self.block_of[past]).tolist():
            moved |= self._place(k, colors)
        self._refresh()
        # No bound changed: what is left is rounding.
        if not moved:
            return False
        way = colors - before
        downhill, uphill = way @ (right - system @ before), way @ self._color_gradient(colors)
        # Bounds that became active on the way make the objective steeper: the step was too long for its piece.
        if uphill <= OVERSHOT * downhill:
            return True
        colors[:] = before
        self.begin(x, free)
        self._refresh()
        return False

    def _at_colors(self, colors: Array) -> Array:
        """Value of each free unknown and gradient of each held one in the present piece; first the colors as given."""
        values = self._map @ np.concatenate([[1.0], colors])
        values[: self.colors] = colors
        return np.asarray(values)

    def _past(self, goal: Array, first: int) -> NDArray[np.intp]:
        """Numbers of the unknowns from ``first`` on whose value or gradient is outside its interval."""
        low, high = self._kept_between()
        past = ((goal < low[first:]) | (goal > high[first:])).nonzero()[0]
        return past + first if first else past

    def _boxed_colors(self, colors: Array) -> bool:
        """Move the colors to the optimum of the present piece within their boxes; True if other ones are held there."""
        low, high = self.lower[: self.colors], self.upper[: self.colors]
        system, right = self._color_system()
        found = least_in_box(self._ridged(system), right, low, high, np.clip(colors, low, high))
        found = np.where(found - low < SLACK, low, np.where(high - found < SLACK, high, found))
        free = (found > low) & (found < high)
        changed = bool((free != self.free[: self.colors]).any())
        colors[:], self.free[: self.colors] = found, free
        return changed

    def _place(self, k: int, colors: Array) -> bool:
        """Move one spectrum to its optimum at given free colors; True if other bounds are active then."""
        at = slice(self.offsets[k], self.offsets[k + 1])
        # daqp factors densely; past the limit the walk itself is the faster way to the bounds.
        if at.stop - at.start >= DENSE_LIMIT:
            return False
        kept, spectrum = self._kept[k], self.arrow.spectra[k]
        if kept is None or not kept.fits(spectrum):
            kept = self._kept[k] = KeptSpectrum(spectrum, self.lower[at], self.upper[at])
        found = kept.at(spectrum, colors, self.x[at])
        if found is None:
            return False
        x, free = found
        free &= self._movable[at]
        same = bool(((free == self.free[at]) & ((x == self.x[at]) | free)).all())
        self.x[at], self.free[at] = x, free
        if not same:
            self.stale.add(k)
        return not same


def is_dense(problem: Quadratic) -> bool:
    """True if a spectrum has so many samples that piqp solves the problem sooner than dense factors do."""
    return max(block.lower.size for block in problem.blocks) >= DENSE_LIMIT
