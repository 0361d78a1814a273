# SPDX-License-Identifier: GPL-3.0-or-later
"""Both sides of a palette at once, by a primal-dual interior point for nonlinear least squares.

Alternation and variable projection have a kink at each change of an active bound of the other side, and advance slowly
from one to the next. Here all bounds act through a barrier, and both sides move together (Wächter and Biegler 2006).

If colors can be met, the minimum lies along a curved valley: on its floor all colors are met, and smoothness, with a
weight a million times smaller, decreases along it. Three measures make long steps possible there. The second
derivatives use the multipliers of the last step instead of the present errors. A step that leaves the floor is
corrected by Newton steps with the same factors. Damping, if needed, is measured in units of the roughness.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs

from spectral_core.palette.design.joint import Joint, Slopes

Array = NDArray[np.float64]

LARGEST = 700
"""Unknowns up to which dense factors are fast enough."""
ITERATIONS = 400
"""Most iterations; fifty to two hundred are usual."""
INSIDE = 1e-3
"""Initial distance of each unknown from its bounds, relative to its size."""
FIRST_BARRIER, SHRINK, LAST_BARRIER = 0.1, 0.2, 1e-9
"""All barriers together as a share of the objective: at the start, from one barrier to the next, and at the end."""
LEAST_FIRST, LEAST_LAST = 1e-24, 1e-32
"""Least barriers, at the start and at the end. Roughness alone may be 1e-22, and a larger barrier would hide it."""
CLOSE = 0.3
"""Predicted decrease of a step, as a share of all barriers, at which the barrier is reduced."""
BACKOFF = 0.995
"""Share of the distance to the nearest bound that a step may use."""
NEAREST = 1e-3
"""Least distance to a bound, as a share of the distance that follows from its multiplier."""
ARMIJO, HALVINGS, CORRECTIONS = 1e-4, 4, 8
"""Required share of the predicted decrease of a step; numbers of halvings and of corrections."""
CONTRACTION = 0.25
"""Corrections continue while each reduces the squared error to less than this share."""
ROUNDING = 1e-12
"""Relative change of the objective that counts as rounding."""
SHORT = 0.1
"""A step that was halved to less than this share causes damping."""
DAMPING, MOST_DAMPING, LEAST = 1e-2, 1e12, 1e-12
"""First and last damping, in units of the roughness; share of the mean curvature that is added to the roughness."""
EXACT_WEIGHTS = 1e1, 1e5
"""Weight of exact rows, relative to the median: at the start, and at the end."""


def joint_descent(joint: Joint, out_of_time: Callable[[], bool]) -> Array:
    """All unknowns near a local minimum of the whole palette, or at the end of the time budget.

    Parameters
    ----------
    joint
        The palette, and where to begin.
    out_of_time
        Whether to stop.
    """
    return _Descent(joint).run(out_of_time)


@dataclass(slots=True)
class _Step:
    """One Newton step."""

    by_x: Array
    by_lower: Array
    by_upper: Array
    fall: float
    """Decrease of the barrier function, to first order."""
    reach: float
    """Share of the step that stays within bounds."""


class _Descent:
    """Uses scaled unknowns, because lights have any unit."""

    def __init__(self, joint: Joint) -> None:
        self._joint, start = joint, joint.start
        middle = joint.colors + joint.grid_size * len(joint.surfaces)
        unit = max(float(np.mean(np.abs(start[middle:]))), 1e-12)
        self._size = np.ones(start.size)
        self._size[middle:] = unit
        self._low, self._high = joint.lower / self._size, joint.upper / self._size
        self._fixed = self._low >= self._high
        self._has_low, self._has_high = np.isfinite(self._low) & ~self._fixed, np.isfinite(self._high) & ~self._fixed
        self._x = self._inside(start / self._size)
        self._first = max(FIRST_BARRIER * joint.objective(start, EXACT_WEIGHTS[0]) / start.size, LEAST_FIRST)
        self._barrier, self._damping = self._first, 0.0
        below, above = self._distances(self._x)
        self._lower = np.where(self._has_low, self._barrier / below, 0.0)
        self._upper = np.where(self._has_high, self._barrier / above, 0.0)
        # Damping beside the roughness: it determines the directions that no color depends on.
        roughness = [float(np.diagonal(gram).mean()) for gram in joint.grams]
        self._stiffness = np.full(start.size, roughness[0])
        self._stiffness[middle:] = unit**2 * roughness[1]
        self._factor = np.zeros((0, 0))

    def run(self, out_of_time: Callable[[], bool]) -> Array:
        """Newton steps until the barrier is negligible."""
        joint = self._joint
        bending = None
        for _ in range(ITERATIONS):
            if out_of_time():
                break
            self._x = x = self._away(self._x)
            exact = float(np.clip(EXACT_WEIGHTS[0] * (self._first / self._barrier) ** 2, *EXACT_WEIGHTS))
            weights = joint.weighted(exact)[:, None]
            slopes = joint.slopes(x * self._size)
            total, gradient, hessian, left = joint.derivatives(x * self._size, slopes, exact, bending)
            if bending is None:
                bending = weights * left
            step = self._step(gradient * self._size, hessian * np.outer(self._size, self._size))
            done = self._barrier <= max(LAST_BARRIER * total / x.size, LEAST_LAST)
            close = step.fall <= CLOSE * self._barrier * x.size and self._damping == 0.0
            if close and done:
                return np.asarray((x + step.reach * step.by_x) * self._size)
            goal = left + joint.linear(step.by_x * self._size, slopes)
            found = self._along(step, slopes, left, goal, exact)
            if found is not None:
                self._x, reach = found
                self._move_multipliers(step)
                bending = bending + reach * (weights * goal - bending)
                if reach < SHORT * step.reach:
                    self._damping = max(30 * self._damping, DAMPING)
            elif step.fall <= 100 * ROUNDING * abs(total):
                if done:
                    break
                close = True
            else:
                self._damping = max(300 * self._damping, 10 * DAMPING)
                if self._damping > MOST_DAMPING:
                    break
            if close:
                self._barrier = max(SHRINK * self._barrier, 0.1 * LAST_BARRIER * total / x.size, LEAST_LAST)
        return np.asarray(self._x * self._size)

    # -- bounds --------------------------------------------------------------------------------------------------------

    def _inside(self, x: Array) -> Array:
        with np.errstate(invalid="ignore"):
            width = np.where(self._has_low & self._has_high, self._high - self._low, np.inf)
        room = np.minimum(INSIDE * np.maximum(1.0, np.abs(x)), 0.4 * width)
        x = np.where(self._has_low, np.maximum(x, self._low + room), x)
        x = np.where(self._has_high, np.minimum(x, self._high - room), x)
        return np.where(self._fixed, self._low, x)

    def _away(self, x: Array) -> Array:
        """Moved away from bounds that are far nearer than their multipliers say: the barrier's slope would be extreme
        there.
        """
        with np.errstate(divide="ignore"):
            nearest = [
                np.minimum(NEAREST * self._barrier / multipliers, NEAREST) for multipliers in (self._lower, self._upper)
            ]
        x = np.where(self._has_low, np.maximum(x, self._low + nearest[0]), x)
        return np.where(self._has_high, np.minimum(x, self._high - nearest[1]), x)

    def _distances(self, x: Array) -> tuple[Array, Array]:
        """Distances to both bounds; 1 without a bound."""
        below = np.where(self._has_low, x - np.where(self._has_low, self._low, 0.0), 1.0)
        above = np.where(self._has_high, np.where(self._has_high, self._high, 0.0) - x, 1.0)
        return below, above

    def _value(self, x: Array, exact: float) -> float:
        """The barrier function."""
        below, above = self._distances(x)
        logs = float(np.log(below[self._has_low]).sum() + np.log(above[self._has_high]).sum())
        return self._joint.objective(x * self._size, exact) - self._barrier * logs

    # -- one step ------------------------------------------------------------------------------------------------------

    def _step(self, gradient: Array, hessian: Array) -> _Step:
        below, above = self._distances(self._x)
        barrier = self._barrier
        right = (
            np.where(self._has_low, barrier / below, 0.0) - np.where(self._has_high, barrier / above, 0.0) - gradient
        )
        hessian.flat[:: len(hessian) + 1] += self._lower / below + self._upper / above
        self._factorize(hessian)
        by_x = self._solved(right)
        by_lower = np.where(self._has_low, (barrier - self._lower * by_x) / below - self._lower, 0.0)
        by_upper = np.where(self._has_high, (barrier + self._upper * by_x) / above - self._upper, 0.0)
        reach = min(1.0, BACKOFF * _reach(below, by_x), BACKOFF * _reach(above, -by_x))
        return _Step(by_x, by_lower, by_upper, float(right @ by_x), reach)

    def _factorize(self, matrix: Array) -> None:
        """Raise the diagonal until the matrix is positive definite."""
        scale = self._stiffness + LEAST * max(float(np.diagonal(matrix).mean()), 1e-300)
        if self._fixed.any():
            moving = ~self._fixed
            matrix, scale = matrix[np.ix_(moving, moving)], scale[moving]
        damping = 0.0 if self._damping <= DAMPING else self._damping / 10
        while True:
            trial = matrix.copy()
            trial.flat[:: len(trial) + 1] += damping * scale
            self._factor, failed = dpotrf(trial, lower=1, overwrite_a=1)
            if not failed or not np.isfinite(damping):
                break
            damping = max(10 * damping, self._damping / 10, DAMPING)
        self._damping = damping

    def _solved(self, right: Array) -> Array:
        step = np.zeros(right.size)
        step[~self._fixed] = dpotrs(self._factor, right[~self._fixed], lower=1)[0]
        return step

    def _along(self, step: _Step, slopes: Slopes, left: Array, goal: Array, exact: float) -> tuple[Array, float] | None:
        """A point along the step that is low enough, and the share of the step; None if there is none near."""
        here = self._value(self._x, exact)
        reach = step.reach
        for _ in range(HALVINGS):
            trial = self._x + reach * step.by_x
            limit = here - ARMIJO * reach * step.fall + ROUNDING * abs(here)
            if self._value(trial, exact) <= limit:
                return trial, reach
            floor = (1 - reach) * left + reach * goal
            back = self._brought_back(trial, slopes, floor, exact, limit) if reach > SHORT / 2 else None
            if back is not None:
                return back, reach
            reach /= 2
        return None

    def _brought_back(self, trial: Array, slopes: Slopes, floor: Array, exact: float, limit: float) -> Array | None:
        """The trial point after second-order corrections of its rows; None if they do not help."""
        joint, weights = self._joint, self._joint.weighted(exact)[:, None]
        before = np.inf
        for _ in range(CORRECTIONS):
            off = joint.left(trial * self._size) - floor
            size = float(np.vdot(weights * off, off))
            if size > CONTRACTION * before:
                break
            before = size
            # The slopes are those of the factors: others would have parts that only the roughness holds.
            back = self._solved(-joint.gradient_of(weights * off, slopes) * self._size)
            below, above = self._distances(trial)
            back = np.where(self._has_low, np.maximum(back, -0.5 * below), back)
            trial = trial + np.where(self._has_high, np.minimum(back, 0.5 * above), back)
            if self._value(trial, exact) <= limit:
                return trial
        return None

    def _move_multipliers(self, step: _Step) -> None:
        part = min(1.0, BACKOFF * _reach(self._lower, step.by_lower), BACKOFF * _reach(self._upper, step.by_upper))
        below, above = self._distances(self._x)
        # Multipliers that are far from the barrier's are reset to it (Wächter and Biegler, equation 16).
        central = self._barrier / below, self._barrier / above
        lower, upper = self._lower + part * step.by_lower, self._upper + part * step.by_upper
        self._lower = np.where(self._has_low, np.clip(lower, 1e-10 * central[0], 1e10 * central[0]), 0.0)
        self._upper = np.where(self._has_high, np.clip(upper, 1e-10 * central[1], 1e10 * central[1]), 0.0)


def _reach(distance: Array, step: Array) -> float:
    """Largest multiple of a step at which no distance becomes negative."""
    shrinking = step < 0
    return float((-distance[shrinking] / step[shrinking]).min(initial=np.inf))
