# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole palette as one sum of squares in all its unknowns: free colors, reflectances and lights together.

A color is bilinear in reflectance and light, so that the second derivatives are known: products of slopes on the
diagonal, and off it, for each cell, its force times the constant map of the kernel. Exact cells are treated as cells of
large weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.assemble.side import Assembler
from spectral_core.palette.assemble.state import PaletteState
from spectral_core.palette.design.joint_rows import Rows, collected, known_colors
from spectral_core.palette.qp.arrow import median_weight

Array = NDArray[np.float64]
Slopes = tuple[Array, Array, Array]
"""Color of each row, and its slopes by reflectance and by light."""


@dataclass(frozen=True, eq=False)
class Joint:
    """Rows of a palette without primaries. Unknowns: free colors, then reflectances, then lights, on the grid."""

    state: PaletteState
    surfaces: tuple[int, ...]
    lights: tuple[int, ...]
    colors: int
    """Free colors times three."""
    lower: Array
    upper: Array
    start: Array
    rows: Rows
    known: tuple[Array, Array, Array]
    """Ties, targets and weights of colors that depend on no designed spectrum."""
    grams: tuple[Array, Array]
    """Squared roughness of a reflectance and of a light."""
    unit: float
    """Median squared weight."""

    @property
    def grid_size(self) -> int:
        """Samples of a spectrum."""
        return len(self.grams[0])

    @classmethod
    def of(cls, assembler: Assembler, state: PaletteState, *, perceptual: bool) -> Joint | None:
        """The rows around a state; None if lights are mixed from primaries or must look white."""
        sides = [assembler.assembled(side, state, perceptual=perceptual) for side in ("reflectances", "lights")]
        problem = assembler.problem
        extra = any(len(block.rows) > 3 * len(block.keys) for side in sides for block in side.quadratic.blocks)
        if extra or any(light.free and light.primaries for light in problem.lights):
            return None
        columns = {key: n for n, key in enumerate(dict.fromkeys(sides[0].group_conditions + sides[1].group_conditions))}
        n, count = problem.grid.size, 3 * len(columns)
        boxes = np.full((2, len(columns), 3), np.inf)
        boxes[0] = -np.inf
        for (number, condition), column in columns.items():
            if condition == 0:
                boxes[:, column] = assembler.requests.groups[number].box
        known = known_colors(assembler, state, columns, boxes)
        colors = np.zeros((len(columns), 3))
        for side in sides[::-1]:
            quadratic = side.quadratic
            values = [getattr(state, side.side)[item] for item in side.items]
            found = quadratic.best_colors(values)
            for key, color in zip(side.group_conditions, found, strict=True):
                colors[columns[key]] = color
        surfaces, lights = sides[0].items, sides[1].items
        ends = [
            np.concatenate([boxes[e].ravel(), np.full(n * len(surfaces), problem.reflectance_bounds[e]),
                            np.full(n * len(lights), problem.light_bounds[e])])
            for e in (0, 1)
        ]  # fmt: skip
        start = np.concatenate(
            [colors.ravel(), *(state.reflectances[i] for i in surfaces), *(state.lights[j] for j in lights)]
        )
        return cls(
            state, surfaces, lights, count, ends[0], ends[1], start, collected(sides[0], sides[1], columns, n), known,
            (assembler.roughness("reflectances")[1], assembler.roughness("lights")[1]),
            median_weight(sides[0].quadratic)[0],
        )  # fmt: skip

    def split(self, x: Array) -> tuple[Array, Array, Array]:
        """Free colors (q,), reflectances (R, n) and lights (L, n)."""
        n, middle = self.grid_size, self.colors + self.grid_size * len(self.surfaces)
        return x[: self.colors], x[self.colors : middle].reshape(-1, n), x[middle:].reshape(-1, n)

    def slopes(self, x: Array) -> Slopes:
        """Color of each row (m, 3), and its slopes by reflectance and by light, (m, 3, n) each, in the metric."""
        kernel = self.state.kernel
        _, surfaces, lights = self.split(x)
        both = (self.rows.surface_of >= 0) & (self.rows.light_of >= 0)
        by_surface, by_light = self.rows.surface_slopes.copy(), self.rows.light_slopes.copy()
        if both.any():
            seen = self.rows.observer_of[both]
            by_surface[both] = kernel.matrices(lights)[seen, self.rows.light_of[both]]
            by_light[both] = kernel.matrices(surfaces)[seen, self.rows.surface_of[both]]
        own = self.rows.surface_of >= 0
        shown = np.zeros((len(self.rows.targets), 3))
        shown[own] = np.matmul(by_surface[own], surfaces[self.rows.surface_of[own]][:, :, None])[:, :, 0]
        shown[~own] = np.matmul(by_light[~own], lights[self.rows.light_of[~own]][:, :, None])[:, :, 0]
        return (
            np.matmul(self.rows.metric, shown[:, :, None])[:, :, 0],
            np.matmul(self.rows.metric, by_surface),
            np.matmul(self.rows.metric, by_light),
        )

    def weighted(self, exact_weight: float) -> Array:
        return np.where(self.rows.exact, exact_weight * self.unit, self.rows.weights)

    def objective(self, x: Array, exact_weight: float) -> float:
        """Half the weighted sum of squares."""
        shown, _, _ = self.slopes(x)
        colors, surfaces, lights = self.split(x)
        left = shown - self.rows.targets - self.rows.ties @ colors
        total = float(self.weighted(exact_weight) @ (left**2).sum(axis=1))
        for values, gram in ((surfaces, self.grams[0]), (lights, self.grams[1])):
            total += float(np.vdot(values @ gram, values))
        ties, targets, weights = self.known
        total += float(weights @ (targets + ties @ colors) ** 2)
        return total / 2

    def left(self, x: Array) -> Array:
        """Residual of each row, unweighted, (m, 3)."""
        return self.slopes(x)[0] - self.rows.targets - self.rows.ties @ x[: self.colors]

    def linear(self, step: Array, slopes: Slopes) -> Array:
        """First-order change of the rows' residuals by a step, (m, 3)."""
        _, by_surface, by_light = slopes
        colors, surfaces, lights = self.split(step)
        found = -(self.rows.ties @ colors)
        for owner, sloped, values in (
            (self.rows.surface_of, by_surface, surfaces),
            (self.rows.light_of, by_light, lights),
        ):
            own = owner >= 0
            found[own] += np.matmul(sloped[own], values[owner[own]][:, :, None])[:, :, 0]
        return found

    def gradient_of(self, forces: Array, slopes: Slopes) -> Array:
        """Gradient (N,) that forces (m, 3) on the rows have at x."""
        _, by_surface, by_light = slopes
        n, q = self.grid_size, self.colors
        found = np.zeros(self.start.size)
        found[:q] = -(forces.ravel() @ self.rows.ties.reshape(forces.size, q))
        middle = q + n * len(self.surfaces)
        for owner, sloped, begin in ((self.rows.surface_of, by_surface, q), (self.rows.light_of, by_light, middle)):
            each = np.matmul(forces[:, None, :], sloped)[:, 0]
            for k in range(owner.max(initial=-1) + 1):
                found[begin + k * n : begin + (k + 1) * n] = each[owner == k].sum(axis=0)
        return found

    def derivatives(
        self, x: Array, slopes: Slopes, exact_weight: float, bending: Array | None = None
    ) -> tuple[float, Array, Array, Array]:
        """Objective, gradient (N,), Hessian (N, N), and the residual of each row, (m, 3).

        Parameters
        ----------
        x
            All unknowns, (N,).
        slopes
            ``slopes`` at x.
        exact_weight
            Weight of exact rows, relative to the median.
        bending
            The forces (m, 3) in the Hessian; None for those of x. Along a valley the multipliers of the last step
            predict the curvature better than the errors of a point beside the valley's floor.
        """
        shown, by_surface, by_light = slopes
        colors, surfaces, lights = self.split(x)
        weights = self.weighted(exact_weight)
        left = shown - self.rows.targets - self.rows.ties @ colors
        forces = weights[:, None] * left
        n, q = self.grid_size, self.colors
        hessian, gradient = np.zeros((x.size, x.size)), np.zeros(x.size)
        total = float(np.vdot(forces, left))
        sides = ((self.rows.surface_of, by_surface, surfaces, self.grams[0], q),
                 (self.rows.light_of, by_light, lights, self.grams[1], q + n * len(surfaces)))  # fmt: skip
        for owner, sloped, values, gram, begin in sides:
            rough = values @ gram
            total += float(np.vdot(rough, values))
            for k in range(len(values)):
                mine, at = np.flatnonzero(owner == k), slice(begin + k * n, begin + (k + 1) * n)
                rows = sloped[mine].reshape(-1, n)
                weighted = np.repeat(weights[mine], 3)[:, None] * rows
                hessian[at, at] = weighted.T @ rows + gram
                gradient[at] = forces[mine].ravel() @ rows + rough[k]
                if q:
                    across = -(weighted.T @ self.rows.ties[mine].reshape(3 * mine.size, q))
                    hessian[at, :q], hessian[:q, at] = across, across.T
        if q:
            ties = self.rows.ties.reshape(forces.size, q)
            hessian[:q, :q] = (ties.T * np.repeat(weights, 3)) @ ties
            gradient[:q] = -(forces.ravel() @ ties)
            more, targets, of_known = self.known
            if len(more):
                rest = targets + more @ colors
                total += float(of_known @ rest**2)
                hessian[:q, :q] += (more.T * of_known) @ more
                gradient[:q] += more.T @ (of_known * rest)
        self._across(hessian, weights, forces if bending is None else bending, by_surface, by_light)
        return total / 2, gradient, hessian, left

    def _across(self, hessian: Array, weights: Array, forces: Array, by_surface: Array, by_light: Array) -> None:
        """Second derivatives by a reflectance and a light, of the cells where both are designed."""
        n, q = self.grid_size, self.colors
        middle = q + n * len(self.surfaces)
        both = np.flatnonzero((self.rows.surface_of >= 0) & (self.rows.light_of >= 0))
        plain = np.matmul(self.rows.metric[both].transpose(0, 2, 1), forces[both][:, :, None])[:, :, 0]
        blocks = np.matmul(by_surface[both].transpose(0, 2, 1) * weights[both, None, None], by_light[both])
        blocks += self.state.kernel.bent(self.rows.observer_of[both], plain)
        for r, block in zip(both, blocks, strict=True):
            row = slice(q + n * self.rows.surface_of[r], q + n * (self.rows.surface_of[r] + 1))
            column = slice(middle + n * self.rows.light_of[r], middle + n * (self.rows.light_of[r] + 1))
            hessian[row, column] += block
        hessian[middle:, q:middle] = hessian[q:middle, middle:].T

    def with_values(self, x: Array) -> PaletteState:
        """The state with these reflectances and lights."""
        _, surfaces, lights = self.split(x)
        state = self.state.with_values("reflectances", dict(zip(self.surfaces, surfaces, strict=True)))
        return state.with_values("lights", dict(zip(self.lights, lights, strict=True)))
