# SPDX-License-Identifier: GPL-3.0-or-later
"""The structure of every engine here: a block-arrow system, eliminated spectrum by spectrum.

With the bounds that hold an unknown taken as known, the conditions of optimality of one spectrum are

    H x + f − Cᵀ g + Eᵀ y = 0      H = AᵀωA + DᵀD, f = −Aᵀωt, C = τᵀωA
    E x − T g − c y = e            one row for each exact row of the block, or row of very large weight

so that x and y are affine functions of the free colors g. One small system in g remains (the Schur complement).
A row of weight ω above ``cap`` enters H with weight ``cap``, and E with the compliance c = 1 / (ω − cap) for the
rest; an exact row has compliance 0. Thus no weight, however large, enters H and costs digits there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs

from spectral_core.palette.qp.quadratic import Quadratic
from spectral_core.palette.qp.squares import (
    RIDGE,
    Spectrum,
    SumOfBlocks,
    across,
    retargeted,
    squared,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CAP, CAP_OVER_LIGHTEST = 1e4, 1e8
"""Largest weight in H, relative to the median one and to the lightest one."""
BOOSTS = (1e-11, 1e-9, 1e-7)
"""Ridges that are tried one after the other where H is singular to rounding."""
COLOR_RIDGE = 1e-15
"""Added to the curvature of the free colors, relative to the largest."""
STIFFNESS = 1e-13
"""Least compliance of a border row, relative to the largest of its block: rows may depend on each other."""


def median_weight(problem: Quadratic) -> tuple[float, float]:
    """Lower median and least of all finite weights; 1 if there is none."""
    return problem.typical_weights


class Factors:
    """H of one block on its free unknowns, factored, with the border eliminated; solves for any right-hand side."""

    def __init__(self, spectrum: Spectrum, hessian: Array, free: Mask) -> None:
        self.hessian, self.free = hessian, free
        self.at = free.nonzero()[0]
        """Numbers of the free unknowns."""
        # take along both axes is several times faster than np.ix_ at these sizes.
        self.rows = hessian.take(self.at, axis=0)
        """H on the free unknowns against all, (f, n)."""
        inner = self.rows.take(self.at, axis=1)
        # Without smoothness H may be singular to rounding; more ridge then costs digits, not the answer.
        self._factor, failed = dpotrf(inner, lower=1)
        for boost in BOOSTS:
            if not failed:
                break
            self._factor, failed = dpotrf(_ridged(inner, boost), lower=1)
        if failed:
            raise np.linalg.LinAlgError("a spectrum's quadratic form is not positive definite")
        self._borders = len(spectrum.border)
        if self._borders:
            self._border = spectrum.border.take(self.at, axis=1)
            # Schur complement of H in the border rows: its size is the number of border rows, a few.
            self._border_solved = self._solved(self._border.T)
            schur = self._border @ self._border_solved
            least = STIFFNESS * max(float(schur.diagonal().max()), 1e-300)
            # Two exact rows with the same request make the complement singular; the least compliance shares the force
            # between them.
            schur.reshape(-1)[:: len(schur) + 1] += np.maximum(spectrum.compliance, least)
            self._schur = schur
            self._schur_factor, self._schur_failed = dpotrf(schur, lower=1)

    def _solved(self, columns: Array) -> Array:
        """H⁻¹ on the free unknowns for each column of (f, k)."""
        return np.asarray(dpotrs(self._factor, columns, lower=1)[0]) if columns.size else columns

    def solve_free(self, right: Array, border_right: Array) -> tuple[Array, Array]:
        """The free part of x, (f, k), and y, (b, k), column by column; see ``solve``."""
        values = self._solved(right)
        if not self._borders:
            return values, np.zeros((0, right.shape[1]))
        # Block elimination: x without the border first, then the forces that close the rows, then their effect on x.
        outside = self._border @ values
        outside -= border_right
        if self._schur_failed:
            multipliers = symmetric_solve(self._schur, outside)
        else:
            multipliers = np.asarray(dpotrs(self._schur_factor, outside, lower=1)[0])
        values -= self._border_solved @ multipliers
        return values, multipliers

    def solve(self, right: Array, border_right: Array) -> tuple[Array, Array]:
        """x (k, n) and y (k, b) with H x + Eᵀ y = right, E x − c y = border_right, row by row."""
        values, multipliers = self.solve_free(right.take(self.at, axis=1).T, border_right.T)
        found = np.zeros(right.shape)
        found[:, self.at] = values.T
        return found, multipliers.T


def _ridged(matrix: Array, share: float) -> Array:
    ridged = matrix.copy()
    ridged.flat[:: len(ridged) + 1] += share * max(float(matrix.trace()) / max(len(matrix), 1), 1e-12)
    return ridged


def regular_factor(matrix: Array) -> Array:
    """Lower Cholesky factor of a symmetric matrix that has no negative curvature, under the ridge of H."""
    for share in (RIDGE, *BOOSTS):
        # LAPACK copies what is not in its order of columns; the matrix is symmetric.
        factor, failed = dpotrf(_ridged(matrix, share).T, lower=1, overwrite_a=1)
        if not failed:
            return np.asarray(factor)
    raise np.linalg.LinAlgError("a spectrum's quadratic form is not positive definite")


def symmetric_solve(matrix: Array, right: Array) -> Array:
    factor, failed = dpotrf(matrix, lower=1)
    if not failed:
        return np.asarray(dpotrs(factor, right, lower=1)[0])
    if not np.isfinite(matrix).all():  # LAPACK would print a line of its own to the terminal
        raise np.linalg.LinAlgError("a system of equations has grown beyond all numbers")
    # Not positive definite by rounding: the least-squares solution ignores directions without curvature.
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-14)[0])


class Arrow:
    """All blocks of a problem in squares, and the system of the free colors."""

    def __init__(self, problem: Quadratic) -> None:
        self.problem = problem
        self.unit, lightest = median_weight(problem)
        # At most eight decades between the lightest weight and the cap leave the lightest one half of the sixteen
        # digits.
        self.cap = min(CAP, CAP_OVER_LIGHTEST * lightest / self.unit)
        self.spectra = [squared(block, self.unit, self.cap) for block in problem.blocks]
        count = problem.color_lower.size
        weights = problem.known_weights / self.unit
        ties = problem.known_ties if problem.known_ties.size else np.zeros((0, count))
        # Rows of known colors do not change between like problems.
        self._known_hessian = (ties.T * weights) @ ties
        self._known_linear = -(problem.known_targets * weights) @ ties if len(ties) else np.zeros(count)
        self._collect()

    def _collect(self) -> None:
        """The sum of all blocks' contributions to the system of the colors, and the size of each unknown's gradient."""
        curvatures = [(across(each.colors, each.colors), each.color_hessian) for each in self.spectra]
        self._color_hessians = SumOfBlocks(self._known_hessian, curvatures)
        self._color_linears = SumOfBlocks(
            self._known_linear, [((each.colors,), each.color_linear) for each in self.spectra]
        )
        self._weights: Array | None = None
        if self.problem.stack is not None:
            self._weights = np.array([each.weights for each in self.spectra])
            self._in_border = np.array([each.in_border for each in self.spectra])
        lengths = [self.problem.color_lower.size, *(each.linear.size for each in self.spectra)]
        self.sizes = np.repeat([0.0, *(each.largest for each in self.spectra)], lengths)
        """Size of each unknown's gradient, for the rounding that is accepted."""
        self._sum_colors()

    def _sum_colors(self) -> None:
        hessian = self._color_hessians.total()
        self.color_system = hessian, self._color_linears.total()
        """W and w: curvature and linear term of the colors before spectra are eliminated."""
        diagonal = hessian.diagonal()
        self.color_ridge = COLOR_RIDGE * max(float(diagonal.max(initial=0.0)), 1e-300)
        self.sizes[: diagonal.size] = np.maximum(diagonal, 1e-300)

    def replaced(self, problem: Quadratic, changed: list[int]) -> bool:
        """Take a like problem of which only some blocks differ; False where weights differ too much for that."""
        before = self.problem
        if any(problem.blocks[k].weights is not before.blocks[k].weights for k in changed):
            unit, lightest = median_weight(problem)
            cap = min(CAP, CAP_OVER_LIGHTEST * lightest / unit)
            # Unit and cap are kept while they are of the right size: dividing all blocks anew would lose all factors.
            if not (0.1 < unit / self.unit < 10 and 0.1 < cap / self.cap < 10):
                return False
        self.problem = problem
        same_squares = True
        for k in changed:
            old, block = before.blocks[k], problem.blocks[k]
            # An exact row may have become one of large weight: the weights say all.
            same_weights = block.weights is old.weights or np.array_equal(block.weights, old.weights)
            if block.rows is old.rows and block.ties is old.ties and same_weights:
                self.spectra[k] = retargeted(self.spectra[k], block)
            else:
                same_squares = False
                fresh = self.spectra[k] = squared(block, self.unit, self.cap)
                self._color_hessians.put(k, across(fresh.colors, fresh.colors), fresh.color_hessian)
                self.sizes[problem.offsets[k] : problem.offsets[k + 1]] = self.spectra[k].largest
                if self._weights is not None:
                    self._weights[k] = self.spectra[k].weights
                    self._in_border[k] = self.spectra[k].in_border
            self._color_linears.put(k, (self.spectra[k].colors,), self.spectra[k].color_linear)
        if same_squares:
            self.color_system = self.color_system[0], self._color_linears.total()
        else:
            self._sum_colors()
        return True

    def row_forces(self, misses: Array | Sequence[Array], multipliers: Sequence[Array]) -> Array | list[Array]:
        """Multiplier of each row of each block in the units of the problem.

        Parameters
        ----------
        misses
            What each row leaves, as ``Quadratic.all_misses``.
        multipliers
            Those of the border rows of each block, (b,).
        """
        # The part of the force that H carries; the border's multiplier is the rest.
        if self._weights is not None:
            stacked = self._weights * misses
            border = [each for each in multipliers if len(each)]
            if border:
                stacked[self._in_border] += np.concatenate(border)
            stacked *= self.unit
            return stacked
        forces = []
        for left, spectrum, multiplier in zip(misses, self.spectra, multipliers, strict=True):
            force = spectrum.weights * left
            if multiplier.size:
                force[spectrum.in_border] += multiplier
            forces.append(self.unit * force)
        return forces
