# SPDX-License-Identifier: GPL-3.0-or-later
"""Two methods of the engine that change the set of active bounds step by step.

*Primal-dual active set* (Hintermüller, Ito and Kunisch 2002): solve with the present bounds held, then hold all
unknowns that left their bounds and release all whose gradient points inward, at once. After a small edit two or three
steps settle it, but it may cycle.

*Parametric walk* (Best 1996; Ferreau, Bock and Diehl 2008): the last optimum is the optimum of a problem with another
linear term. That term is moved to the new one on a straight line; the solution follows piecewise linearly, and one
bound changes at each breakpoint. The walk cannot cycle unless two bounds change at once.
"""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.held_bounds import SLACK, HeldBounds

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FINE_SLACK = 1e-15
"""Rounding that is accepted in a gradient that was refined; ``SLACK`` otherwise."""
WALK_STEPS = 200
"""Most breakpoints of the walk; some tens are usual. A cold solve of a small palette takes as long as 250."""
STALLED = 3
"""Exchanges of the same unknown, one after another at the same point, that end a walk: it would go on without end."""


class ActiveSet(HeldBounds):
    """Finds the active bounds: ``settle``, the first method, and ``walk``, the second."""

    # -- first method ----------------------------------------------------------------------------------------------

    def settle(self, most: int = 4, *, fine: bool = False) -> bool:
        """Primal-dual active-set steps; True if they reached an optimum. ``fine``: with refined solutions."""
        slack = (FINE_SLACK if fine else SLACK) * self.arrow.sizes
        for _ in range(most):
            self.steps += 1
            values, gradient = self.solved()
            if fine:
                values, gradient = self._refined(values)
            wrong, below, above = self._wrong(values, gradient, slack)
            # Optimal: values are clipped because "kept" allows the slack, and bounds must hold to the last digit.
            if not wrong.any():
                self.x = np.clip(values, self.lower, self.upper)
                return True
            # All changes at once. This is a semismooth Newton step and converges superlinearly near the answer, but it
            # may cycle; hence the limit of steps.
            self.x = np.where(below, self.lower, np.where(above, self.upper, self.x))
            self._toggle(wrong)
        return False

    # -- second method ---------------------------------------------------------------------------------------------

    def walk(self, begin: Array, free: Mask, most: int = WALK_STEPS) -> bool:
        """The parametric walk from an optimum of a similar problem; True if it reached the end.

        Parameters
        ----------
        begin
            All unknowns there, within bounds.
        free
            Which of them are off their bounds.
        most
            Largest number of breakpoints.
        """
        if begin is not self.x or free is not self.free:
            self.begin(begin, free)
        self._refresh()
        low, high = self._kept_between()
        here: Array | None = None
        last, stalled = -1, 0
        for _ in range(most):
            self.steps += 1
            goal, full = self._goal()
            past = ((goal < low) | (goal > high)).nonzero()[0]
            if not past.size:
                self._arrive(goal, full)
                return True
            if here is None:
                here = self._start()
            first, part, end, below = self._first_breakpoint(past, here, goal, low)
            # If exact rows depend on each other at the held bounds, one unknown may be freed and held forever.
            stalled = stalled + 1 if first == last and part == 0.0 else 0
            if stalled == STALLED:
                return False
            last = first
            goal -= here
            goal *= part
            here += goal
            if self.free[first]:
                # Exactly on the bound: "held" means equal to it, also in the next elimination.
                self.x[first] = end
                here[first] = 0.0
                slack = SLACK * self.arrow.sizes[first]
                low[first], high[first] = (-slack, np.inf) if below else (-np.inf, slack)
            else:
                here[first] = self.x[first]
                low[first], high[first] = self._low_limit[first], self._high_limit[first]
            self._exchange(first)
        return False

    def _arrive(self, goal: Array, full: Array) -> None:
        """Take the optimum: values of the free unknowns, and (1, free colors) there."""
        self.x = np.where(self.free, np.minimum(np.maximum(goal, self.lower), self.upper), self.x)
        self._take_multipliers(full)

    def _start(self) -> Array:
        """The start of the walk: the value of each free unknown, and a gradient of each held one."""
        # With these gradients the start is optimal; the walk removes the difference to the true ones.
        gradient = self._gradient_at(self.x[: self.colors])
        inward = np.where(self.x <= self.lower, np.maximum(gradient, 0.0), np.minimum(gradient, 0.0))
        return np.where(self.free, self.x, inward)

    def _first_breakpoint(
        self, past: NDArray[np.intp], here: Array, goal: Array, low: Array
    ) -> tuple[int, float, float, bool]:
        """Ratio test along the line from the present point to the goal.

        The first unknown that meets its bound, or the first multiplier that meets 0, ends the linear piece. Returns its
        number, the part of the line, the bound or 0, and True if the goal is below.
        """
        start, aim = here[past], goal[past]
        below = aim < low[past]
        ends = np.where(self.free[past], np.where(below, self.lower[past], self.upper[past]), 0.0)
        parts = (ends - start) / (aim - start)
        number = int(parts.argmin())
        part = float(parts[number])
        # Ties and rounding give ratios slightly outside [0, 1]; a step beyond them would leave the path.
        part = min(max(part, 0.0), 1.0) if isfinite(part) else 0.0
        return int(past[number]), part, float(ends[number]), bool(below[number])
