# SPDX-License-Identifier: GPL-3.0-or-later
"""Mehrotra's predictor-corrector interior point on the block-arrow system, the method for cold starts.

Each iteration factors every block once (H plus the barrier's diagonal) and uses the factors twice (Mehrotra 1992;
Wright 1997, chapter 10). It ends with a guess of the active bounds; the active set then gives full accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.arrow import Arrow, Factors, symmetric_solve
from spectral_core.palette.qp.squares import across

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ITERATIONS = 60
TOLERANCE = 1e-9
"""Scaled residual and complementarity at which the guess of active bounds is good."""
BACKOFF = 0.995
"""Share of the way to the nearest bound that a step may go."""
DIVERGED = 1e12
"""Multiplier, in units of the median weight, at which exact rows count as conflicting."""


@dataclass(slots=True)
class Point:
    """Unknowns x (colors first), multipliers y of the border rows of each block, and z of lower and upper bounds."""

    x: Array
    y: list[Array]
    lower: Array
    upper: Array


def interior_point(arrow: Arrow) -> tuple[Array, Mask, bool]:
    """All unknowns near the optimum, those that seem to be off their bounds, and True if the tolerance was reached."""
    # If exact rows cannot hold together, the iterates grow without limit; the last finite one is returned.
    with np.errstate(all="ignore"):
        return _InteriorPoint(arrow).run()


class _InteriorPoint:
    def __init__(self, arrow: Arrow) -> None:
        problem = arrow.problem
        self._arrow = arrow
        self._colors = problem.color_lower.size
        self._offsets = problem.offsets
        self._low, self._high = problem.lower, problem.upper
        # A given color has equal bounds: it is no unknown, and its row is omitted.
        self._fixed = self._low == self._high
        self._has_low = np.isfinite(self._low) & ~self._fixed
        self._has_high = np.isfinite(self._high) & ~self._fixed

    def run(self) -> tuple[Array, Mask, bool]:
        point = self._start()
        free, arrived = np.ones(point.x.size, dtype=bool), False
        for _ in range(ITERATIONS):
            # The predictor aims at complementarity 0 (no centering). It costs one back substitution and determines the
            # centering of the corrector.
            residual, border = self._residuals(point)
            gap = self._gap(point)
            system = _Barrier(self._arrow, self._diagonal(point), self._fixed)
            affine = system.solve(-residual + self._bound_terms(point, 0.0, None), border)
            moved = self._bound_steps(point, affine[0], 0.0, None)
            # The affine step shows the tendency of each pair; near the optimum it separates active from free bounds
            # well.
            free = self._guess(point, affine[0], *moved)
            # Multipliers set the scale of the gradient: where they are 1e6, a residual of 1e-3 is rounding.
            size = 1.0 + float(np.abs(point.lower).max(initial=0.0)) + float(np.abs(point.upper).max(initial=0.0))
            worst = max(
                float(np.abs(residual).max(initial=0.0)) / size, *(np.abs(b).max(initial=0.0) for b in border), 0
            )
            if worst < TOLERANCE and gap < TOLERANCE:
                arrived = True
                break
            reach = self._reach(point, affine[0], *moved)
            after = self._gap_after(point, affine[0], *moved, reach)
            # Mehrotra's rule: the better the predictor, the less centering.
            centering = (after / gap) ** 3 if gap > 0 else 0.0
            corrections = (affine[0] * moved[0], -affine[0] * moved[1])
            right = -residual + self._bound_terms(point, centering * gap, corrections)
            dx, dy = system.solve(right, border)
            duals = self._bound_steps(point, dx, centering * gap, corrections)
            # One step length for x and multipliers: the problem is quadratic, so different lengths would spoil the
            # gradient's residual.
            part = min(1.0, BACKOFF * self._reach(point, dx, *duals))
            stepped = Point(
                point.x + part * dx,
                [y + part * step for y, step in zip(point.y, dy, strict=True)],
                point.lower + part * duals[0],
                point.upper + part * duals[1],
            )
            # A multiplier that grows without limit certifies that exact rows conflict; the caller then solves the
            # compromise.
            if not (np.all(np.isfinite(stepped.x)) and max(map(_largest, stepped.y), default=0.0) < DIVERGED):
                break
            point = stepped
        return np.clip(point.x, self._low, self._high), free, arrived

    def _start(self) -> Point:
        """The middle of the bounds, or 1 above a single one."""
        low, high = self._low, self._high
        with np.errstate(invalid="ignore"):
            middle = (low + high) / 2
        x = np.where(self._has_low & self._has_high, middle, 0.0)
        x = np.where(self._has_low & ~self._has_high, low + 1.0, x)
        x = np.where(self._has_high & ~self._has_low, high - 1.0, x)
        x = np.where(self._fixed, low, x)
        y = [np.zeros(len(spectrum.border)) for spectrum in self._arrow.spectra]
        return Point(x, y, self._has_low.astype(np.float64), self._has_high.astype(np.float64))

    def _distances(self, point: Point) -> tuple[Array, Array]:
        """Distances to both bounds; 1 without a bound."""
        # 1 without a bound: the multiplier is 0 there, and 0 / 1 needs no special case.
        below = np.where(self._has_low, point.x - np.where(self._has_low, self._low, 0.0), 1.0)
        above = np.where(self._has_high, np.where(self._has_high, self._high, 0.0) - point.x, 1.0)
        return below, above

    def _residuals(self, point: Point) -> tuple[Array, list[Array]]:
        """Gradient of the Lagrangian, and the residuals of the border rows."""
        colors = point.x[: self._colors]
        hessian, linear = self._arrow.color_system
        by_colors = hessian @ colors - linear
        parts, borders = [], []
        for k, spectrum in enumerate(self._arrow.spectra):
            x, y = point.x[self._offsets[k] : self._offsets[k + 1]], point.y[k]
            own = colors[spectrum.colors]
            by_colors[spectrum.colors] -= spectrum.ties @ x
            by_colors[spectrum.colors] -= y @ spectrum.border_ties
            # Row of block k of the conditions of optimality, see ``arrow``; the bounds' multipliers follow below for
            # all.
            parts.append(spectrum.hessian @ x + spectrum.linear - own @ spectrum.ties + y @ spectrum.border)
            borders.append(
                spectrum.border_target + spectrum.border_ties @ own + spectrum.compliance * y - spectrum.border @ x
            )
        residual = np.concatenate([by_colors, *parts]) - point.lower + point.upper
        residual[self._fixed] = 0.0
        return residual, borders

    def _gap(self, point: Point) -> float:
        below, above = self._distances(point)
        count = int(self._has_low.sum() + self._has_high.sum())
        return float(point.lower @ below + point.upper @ above) / max(count, 1)

    def _gap_after(self, point: Point, dx: Array, dl: Array, du: Array, part: float) -> float:
        # y takes no part in the complementarity, so it need not move for this.
        moved = Point(point.x + part * dx, point.y, point.lower + part * dl, point.upper + part * du)
        return self._gap(moved)

    def _diagonal(self, point: Point) -> Array:
        below, above = self._distances(point)
        return np.where(self._has_low, point.lower / below, 0.0) + np.where(self._has_high, point.upper / above, 0.0)

    def _bound_terms(self, point: Point, target: float, corrections: tuple[Array, Array] | None) -> Array:
        """Contribution of the bounds' complementarity to the right-hand side."""
        below, above = self._distances(point)
        low, high = corrections if corrections is not None else (0.0, 0.0)
        # From (z + dz)(s + ds) = target, linearized, with dz eliminated; ``low`` and ``high`` are Mehrotra's second-
        # order terms dz·ds.
        from_low = (target - point.lower * below - low) / below
        from_high = (target - point.upper * above - high) / above
        return np.where(self._has_low, from_low, 0.0) - np.where(self._has_high, from_high, 0.0)

    def _bound_steps(
        self, point: Point, dx: Array, target: float, corrections: tuple[Array, Array] | None
    ) -> tuple[Array, Array]:
        """Steps of the bounds' multipliers for a step of x."""
        below, above = self._distances(point)
        low, high = corrections if corrections is not None else (0.0, 0.0)
        from_low = (target - point.lower * below - low - point.lower * dx) / below
        from_high = (target - point.upper * above - high + point.upper * dx) / above
        return np.where(self._has_low, from_low, 0.0), np.where(self._has_high, from_high, 0.0)

    def _reach(self, point: Point, dx: Array, dl: Array, du: Array) -> float:
        """Longest step at which distances and multipliers stay positive, at most 1 / BACKOFF."""
        below, above = self._distances(point)
        reach = 1.0 / BACKOFF
        pairs = ((below, np.where(self._has_low, dx, 0.0)), (above, np.where(self._has_high, -dx, 0.0)))
        for value, step in (*pairs, (point.lower, dl), (point.upper, du)):
            # Only a decreasing value can reach 0.
            shrinking = step < 0
            if shrinking.any():
                reach = min(reach, float((-value[shrinking] / step[shrinking]).min()))
        return reach

    def _guess(self, point: Point, dx: Array, dl: Array, du: Array) -> Mask:
        """Unknowns off their bounds: a distance that decreases faster than its multiplier belongs to an active
        bound.
        """
        below, above = self._distances(point)
        at_low = self._has_low & (dl * below > dx * point.lower)
        at_high = self._has_high & (du * above > -dx * point.upper)
        # Near both bounds, only the nearer one can be active.
        return ~(at_low | at_high | self._fixed)


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0)) if np.all(np.isfinite(values)) else np.inf


class _Barrier:
    """One iteration's factors: the block-arrow matrix with the barrier's diagonal."""

    def __init__(self, arrow: Arrow, diagonal: Array, fixed: Mask) -> None:
        self._arrow, self._fixed = arrow, fixed
        self._offsets = arrow.problem.offsets
        self._count = arrow.problem.color_lower.size
        hessian, _ = arrow.color_system
        system = hessian.copy()
        system.flat[:: self._count + 1] += diagonal[: self._count]
        self._factors, self._responses = [], []
        for k, spectrum in enumerate(arrow.spectra):
            inner = spectrum.hessian.copy()
            own = diagonal[self._offsets[k] : self._offsets[k + 1]]
            # H plus a diagonal that is nowhere negative: each block stays positive definite, so Cholesky serves.
            inner.flat[:: len(inner) + 1] += own
            factors = Factors(spectrum, inner, np.ones(own.size, dtype=bool))
            self._factors.append(factors)
            # Response of the block to each free color. Predictor and corrector share it.
            response = factors.solve(spectrum.ties, spectrum.border_ties.T) if self._count else None
            self._responses.append(response)
            if response is not None:
                inward = spectrum.ties @ response[0].T + spectrum.border_ties.T @ response[1].T
                system[across(spectrum.colors, spectrum.colors)] -= inward
        self._free = ~fixed[: self._count]
        inner = system[self._free][:, self._free]
        # A color that no row depends on has an empty row; the ridge keeps the factorization regular.
        inner.flat[:: len(inner) + 1] += 1e-15 * max(float(np.abs(np.diagonal(hessian)).max(initial=0.0)), 1e-300)
        self._system = (inner + inner.T) / 2

    def solve(self, right: Array, border: list[Array]) -> tuple[Array, list[Array]]:
        """Step of all unknowns and of the border's multipliers."""
        by_colors = right[: self._count].copy()
        own = []
        for k, (spectrum, factors) in enumerate(zip(self._arrow.spectra, self._factors, strict=True)):
            part = right[self._offsets[k] : self._offsets[k + 1]]
            values, multipliers = factors.solve(part[None], border[k][None])
            own.append((values[0], multipliers[0]))
            by_colors[spectrum.colors] += spectrum.ties @ values[0] + multipliers[0] @ spectrum.border_ties
        colors = np.zeros(self._count)
        if self._free.any():
            colors[self._free] = symmetric_solve(self._system, by_colors[self._free])
        parts, steps = [colors], []
        for (value, multiplier), response, spectrum in zip(own, self._responses, self._arrow.spectra, strict=True):
            if response is None:
                parts.append(value)
                steps.append(multiplier)
            else:
                moved = colors[spectrum.colors]
                parts.append(value + moved @ response[0])
                steps.append(multiplier + moved @ response[1])
        return np.concatenate(parts), steps
