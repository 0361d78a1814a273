# SPDX-License-Identifier: GPL-3.0-or-later
"""Many bounded spectra tied by a few free colors, solved by Newton steps on the colors alone.

Given the free colors g, every spectrum is a problem of its own, and its solution is piecewise linear in g. So the least
sum of squares as a function of g is convex, smooth and piecewise quadratic, in 3 numbers per group instead of 31 per
spectrum: a Newton step is exact until a spectrum meets or leaves a bound. After an edit most spectra keep their active
bounds, so one or two steps are enough. Each spectrum is solved by daqp, which keeps its factors between calls.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import SolveError
from spectral_core.palette.qp.least_squares import RIDGE, LinkedLeastSquares

Array = NDArray[np.float64]

SETTLED = 1e-14
"""Scaled gradient of the colors at which they are at their minimum."""
HALVINGS = 30
"""Trials along one Newton step."""
STEPS = 60
"""Newton steps before giving up; two or three are usual."""


@dataclass(eq=False)
class TiedProblem:
    """½ Σ_k x_kᵀ H_k x_k + f_k·x_k − gᵀ C_k x_k, plus ½ gᵀ W g − w·g, within bounds.

    ``hessians`` (K, n, n), ``linear`` (K, n), ``ties`` C (K, q, n), ``color_hessian`` W (q, q), ``color_linear`` w.
    """

    hessians: Array
    linear: Array
    ties: Array
    color_hessian: Array
    color_linear: Array
    bounds: tuple[float, float]
    color_bounds: tuple[Array, Array]
    lightest: Array | None = None
    """(K,): as ``LinkedLeastSquares.scale`` has it, the gradient of an error of 1 in the lightest cell's color."""
    ridge: Array | None = None
    """(K,): what was added to each diagonal; it is no part of what was asked, so the check leaves it out."""

    @cached_property
    def scale(self) -> Array:
        """What each spectrum's gradient is compared with, (K,), as in ``LinkedLeastSquares.scale``."""
        curvature = np.diagonal(self.hessians, axis1=1, axis2=2).max(axis=1)
        size = np.maximum(curvature, np.abs(self.linear).max(axis=1, initial=0.0))
        size = np.where(size > 0, size, 1.0)
        return size if self.lightest is None else np.minimum(size, self.lightest)

    def gradients(self, values: Array, colors: Array) -> tuple[Array, Array]:
        """Gradient by spectra (K, n) and by colors (q,)."""
        by_values = np.matmul(self.hessians, values[:, :, None])[:, :, 0] + self.linear
        if colors.size == 0:
            return by_values, np.zeros(0)
        by_values -= colors @ self.ties
        return by_values, self.color_gradient(values, colors)

    def color_gradient(self, values: Array, colors: Array) -> Array:
        """Gradient by colors (q,)."""
        pulls = np.matmul(self.ties, values[:, :, None]).sum(axis=0)[:, 0]
        return self.color_hessian @ colors - self.color_linear - pulls

    def kkt(self, values: Array, colors: Array) -> float:
        """Scaled projected-gradient residual, as ``least_squares.checked`` has it."""
        by_values, by_colors = self.gradients(values, colors)
        if self.ridge is not None:
            by_values = by_values - self.ridge[:, None] * values
        moved = np.clip(values - by_values / self.scale[:, None], *self.bounds)
        worst = float(np.abs(values - moved).max(initial=0.0))
        if colors.size:
            size = float(np.diagonal(self.color_hessian).min())
            moved_colors = np.clip(colors - by_colors / size, *self.color_bounds)
            worst = max(worst, float(np.abs(colors - moved_colors).max()))
        return worst


class TiedSolver:
    """Keeps solvers, active bounds and sensitivities between solves of problems of one shape."""

    def __init__(self, count: int, size: int) -> None:
        self._models: list[Any] = [None] * count
        self.values = np.zeros((count, size))
        self.colors = np.zeros(0)
        self._sensitivities = np.zeros((count, size, 0))
        self._free = np.zeros((count, size), dtype=bool)

    def begin_at(self, colors: Array) -> None:
        """Start the next solve from these free colors (q,); every spectrum must then be listed as changed."""
        self.colors = colors
        self._sensitivities = np.zeros((*self.values.shape, colors.size))

    def solve(self, problem: TiedProblem, changed: NDArray[np.intp], reshaped: NDArray[np.intp]) -> tuple[Array, Array]:
        """Spectra (K, n) and colors (q,) at the minimum.

        ``changed``: spectra whose terms differ from the last call in any way; ``reshaped``: those whose H differs.
        Raises SolveError where the steps do not settle, or daqp fails.
        """
        groups = problem.color_linear.size
        if self.colors.size != groups:
            self.colors = np.zeros(groups)
            self._sensitivities = np.zeros((*self.values.shape, groups))
            changed = reshaped = np.arange(len(self.values))
        self._solve_some(problem, changed, set(reshaped.tolist()))
        if groups == 0:
            return self.values, self.colors
        stale = np.union1d(reshaped, self._crossed(problem, changed)) if changed.size else changed
        for _ in range(STEPS):
            self._sense(problem, stale)
            settled, stale = self._search(problem, self._color_step(problem))
            if settled:
                self._sense(problem, stale)  # for the next call
                return self.values, self.colors
        raise SolveError("the free colors did not settle")

    def _search(self, problem: TiedProblem, step: Array) -> tuple[bool, NDArray[np.intp]]:
        """Go along a Newton step until the slope is no steeper upwards than half of what it was downwards.

        Returns whether the minimum is reached, and the spectra whose active bounds changed.
        """
        values, colors = self.values.copy(), self.colors
        size = max(float(np.diagonal(problem.color_hessian).max()), float(np.abs(problem.color_linear).max()))
        slope = float(step @ problem.color_gradient(values, colors))
        if slope >= 0:  # no way down is left but rounding
            return True, np.zeros(0, dtype=np.intp)
        steepest = -slope
        low, high, high_slope = 0.0, 1.0, 0.0
        part = 1.0
        for _ in range(HALVINGS):
            self.colors = colors + part * step
            stale = self._advance(problem, values, part * step)
            if stale.size == 0 and part == 1.0:
                return True, stale
            self._solve_some(problem, stale, set())
            gradient = problem.color_gradient(self.values, self.colors)
            inner = np.clip(self.colors - gradient / size, *problem.color_bounds) - self.colors
            if np.abs(inner).max() < SETTLED:
                return True, stale
            here = float(step @ gradient)
            if abs(here) <= 0.5 * steepest or (part == 1.0 and here <= 0):
                return False, stale
            if here > 0:
                high, high_slope = part, here
            else:
                low, slope = part, here
            secant = low - slope * (high - low) / (high_slope - slope)
            part = float(np.clip(secant, low + 0.1 * (high - low), high - 0.1 * (high - low)))
        return False, np.arange(len(values))

    def _solve_some(self, problem: TiedProblem, which: NDArray[np.intp], reshaped: set[int]) -> None:
        """Spectra at the present colors."""
        for k in which.tolist():
            pull = problem.linear[k] - self.colors @ problem.ties[k] if self.colors.size else problem.linear[k]
            self._solve_one(problem, k, pull, k in reshaped)

    def _solve_one(self, problem: TiedProblem, k: int, linear: Array, reshape: bool) -> None:
        import daqp

        model = self._models[k]
        if model is None:
            model = self._models[k] = daqp.Model()
            model.settings = {"primal_tol": 1e-11, "dual_tol": 1e-12, "iter_limit": 10_000}
            size = linear.size
            low, high = np.clip(problem.bounds, -1e30, 1e30)
            empty = np.zeros((0, size))
            sense = np.zeros(size, dtype=np.int32)
            model.setup(problem.hessians[k], linear, empty, np.full(size, high), np.full(size, low), sense)
        elif reshape:
            model.update(H=problem.hessians[k], f=linear)
        else:
            model.update(f=linear)
        x, _, flag, info = model.solve()
        if flag <= 0 or not np.all(np.isfinite(x)):
            self._models[k] = None
            raise SolveError(f"daqp gave up on spectrum {k} (flag {flag})")
        multipliers = info["lam"]
        low, high = problem.bounds
        # Exactly on the bound where a multiplier says so: rounding must not make an active bound look free.
        on_bounds = np.where(multipliers > 0, high, np.where(multipliers < 0, low, x))
        np.clip(on_bounds, low, high, out=self.values[k])

    def _crossed(self, problem: TiedProblem, which: NDArray[np.intp]) -> NDArray[np.intp]:
        """Those spectra whose active bounds are not the ones that their sensitivities were computed with."""
        free = (self.values[which] > problem.bounds[0]) & (self.values[which] < problem.bounds[1])
        return which[(free != self._free[which]).any(axis=1)]

    def _sense(self, problem: TiedProblem, which: NDArray[np.intp]) -> None:
        """d(spectrum)/d(colors) with the active bounds held, for some spectra."""
        if which.size == 0:
            return
        free = (self.values[which] > problem.bounds[0]) & (self.values[which] < problem.bounds[1])
        held = problem.hessians[which] * (free[:, :, None] & free[:, None, :])
        index = np.arange(held.shape[1])
        held[:, index, index] += ~free
        right = np.empty((len(which), held.shape[1], self.colors.size + 1))
        right[:, :, :-1] = (problem.ties[which] * free[:, None, :]).transpose(0, 2, 1)
        fixed = np.where(free, 0.0, self.values[which])
        pulled = self.colors @ problem.ties[which] - problem.linear[which]
        pulled -= np.matmul(problem.hessians[which], fixed[:, :, None])[:, :, 0]
        right[:, :, -1] = np.where(free, pulled, fixed)
        solved = np.linalg.solve(held, right)
        self._sensitivities[which] = solved[:, :, :-1]
        self._free[which] = free
        # daqp leaves bounds by its tolerance; on the same bounds these values are exact to rounding.
        exact = solved[:, :, -1]
        inside = ((exact >= problem.bounds[0]) & (exact <= problem.bounds[1])).all(axis=1)
        self.values[which[inside]] = exact[inside]

    def _color_step(self, problem: TiedProblem) -> Array:
        """Newton step on the colors; a small bounded problem of its own where they are held in boxes."""
        gradient = problem.color_gradient(self.values, self.colors)
        hessian = problem.color_hessian - np.matmul(problem.ties, self._sensitivities).sum(axis=0)
        index = np.diag_indices_from(hessian)
        hessian[index] += 1e-15 * max(float(np.diagonal(problem.color_hessian).max()), 1e-300)
        low, high = problem.color_bounds
        if not (np.isfinite(low).any() or np.isfinite(high).any()):
            return -np.linalg.solve(hessian, gradient)
        import daqp

        limits = np.clip(high - self.colors, -1e30, 1e30), np.clip(low - self.colors, -1e30, 1e30)
        symmetric = (hessian + hessian.T) / 2
        sense = np.zeros(gradient.size, dtype=np.int32)
        none = np.zeros((0, gradient.size))
        step, _, flag, _ = daqp.solve(symmetric, gradient, none, *limits, sense, primal_tol=1e-13, dual_tol=1e-14)
        if flag <= 0:
            raise SolveError("the step of the free colors has no solution")
        return np.asarray(step)

    def _advance(self, problem: TiedProblem, values: Array, step: Array) -> NDArray[np.intp]:
        """Spectra follow a step of the colors linearly; those that leave their active bounds are returned."""
        moved = values + self._sensitivities @ step
        by_values, _ = problem.gradients(moved, self.colors)
        low, high = problem.bounds
        slack = 1e-10 * problem.scale[:, None]
        explained = np.where(values <= low, by_values >= -slack, by_values <= slack)
        inside = (moved >= low) & (moved <= high)
        good = np.where(self._free, inside, explained).all(axis=1)
        self.values[:] = np.where(good[:, None], moved, values)
        return np.flatnonzero(~good)


def can_tie(problem: LinkedLeastSquares) -> bool:
    """Whether ``solve_tied`` takes the problem."""
    if problem.has_equalities or not problem.blocks:
        return False
    bounds = [(block.lower.size, block.lower.min(), block.lower.max()) for block in problem.blocks]
    bounds += [(block.upper.size, block.upper.min(), block.upper.max()) for block in problem.blocks]
    low, high = bounds[0], bounds[-1]
    count = len(problem.blocks)
    return low[1] == low[2] and high[1] == high[2] and bounds == [low] * count + [high] * count


def tied_from_links(problem: LinkedLeastSquares) -> TiedProblem:
    """The same problem in squares."""
    groups = problem.color_lower.size
    hessians = np.stack([block.matrix.T @ block.matrix for block in problem.blocks])
    linear = np.stack([-(block.matrix.T @ block.target) for block in problem.blocks])
    ties = np.zeros((len(problem.blocks), groups, hessians.shape[1]))
    color_hessian, color_linear = np.zeros((groups, groups)), np.zeros(groups)
    for link in problem.links:
        weighing = link.weight * link.metric
        gram, at = weighing.T @ weighing, slice(3 * link.group, 3 * link.group + 3)
        color_hessian[at, at] += gram
        color_linear[at] += gram @ link.offset
        if link.block is not None:
            hessians[link.block] += link.matrix.T @ gram @ link.matrix
            linear[link.block] += link.matrix.T @ gram @ link.offset
            ties[link.block, at] += gram @ link.matrix
    index = np.arange(hessians.shape[1])
    diagonal = hessians[:, index, index]
    hessians[:, index, index] += RIDGE * np.maximum(diagonal.mean(axis=1, keepdims=True), 1e-12)
    bounds = float(problem.blocks[0].lower[0]), float(problem.blocks[0].upper[0])
    boxes = problem.color_lower.ravel(), problem.color_upper.ravel()
    return TiedProblem(hessians, linear, ties, color_hessian, color_linear, bounds, boxes)
