# SPDX-License-Identifier: GPL-3.0-or-later
"""Two methods of the engine that change the set of active bounds step by step.

*Primal-dual active set* (Hintermüller, Ito and Kunisch 2002): solve with the present bounds held, then hold every
unknown that left its bounds and release every one whose multiplier points inward, all at once. After a small edit two
or three steps settle it, but it may cycle.

*Parametric walk* (Best 1996; Ferreau, Bock and Diehl 2008): the last optimum is the optimum of a problem with another
linear term. That term is moved to the new one on a straight line; the solution follows piecewise linearly, and one
bound changes at each breakpoint. The walk cannot cycle unless two bounds change at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.held_bounds import SLACK, HeldBounds

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FINE_SLACK = 1e-15
"""Rounding error of a refined gradient; ``SLACK`` otherwise."""
WALK_STEPS = 400
"""Most breakpoints of the walk; some tens are usual."""


class ActiveSet(HeldBounds):
    """Finds the active bounds: ``settle``, the first method, and ``walk``, the second."""

    # -- first method ----------------------------------------------------------------------------------------------

    def settle(self, most: int = 4, *, fine: bool = False) -> bool:
        """Primal-dual active-set steps; True if they reached an optimum. ``fine``: with refined solutions."""
        slack = (FINE_SLACK if fine else SLACK) * self._scale()
        for _ in range(most):
            self.steps += 1
            values, gradient = self.solved()
            if fine:
                values, gradient = self._refined(values)
            self.goal = values
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

    def walk(self, begin: Array, free: Mask) -> bool:
        """The parametric walk from an optimum of a similar problem; True if it reached the end.

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
        # With these gradients ``begin`` is optimal; the walk removes their difference from the true ones.
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
            # Ratio test along the line from the present point to the goal: the first unknown that meets its bound, or
            # the first multiplier that meets 0, ends the linear piece.
            step = np.full(x.size, np.inf)
            with np.errstate(divide="ignore", invalid="ignore"):
                for bound, past in ((self.lower, below), (self.upper, above)):
                    step[past] = (bound[past] - x[past]) / (goal[past] - x[past])
                step[inward] = gradient[inward] / (gradient[inward] - goal_gradient[inward])
            first = int(step.argmin())
            # Ties and rounding give ratios slightly outside [0, 1]; a step beyond them would leave the path.
            part = float(np.clip(step[first], 0.0, 1.0))
            x = x + part * (goal - x)
            gradient = gradient + part * (goal_gradient - gradient)
            x = np.where(self.free, np.clip(x, self.lower, self.upper), self.x)
            if self.free[first]:
                # Exactly on the bound: "held" means equal to it, also in the next elimination.
                x[first] = self.lower[first] if below[first] else self.upper[first]
            gradient[first] = 0.0
            self.x = x
            self.free[first] = not self.free[first]
            if self.block_of[first] >= 0:
                self.stale.add(int(self.block_of[first]))
        return False
