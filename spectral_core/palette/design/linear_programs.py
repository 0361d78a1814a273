# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear programs that decide about exact rows where the engine does not: the nearest point, a proof, the multipliers.

All are by HiGHS (Huangfu and Hall 2018), whose simplex method answers exactly where bounds and rows are degenerate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.palette.qp.answer import Answer
from spectral_core.palette.qp.quadratic import FAR, Quadratic

Array = NDArray[np.float64]

TOLERANCES = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
LARGE = 1e3
"""Largest coefficient of a row of a program: HiGHS takes coefficients below 1e-9 for 0."""
LEAST_SCALE = 1e-8
"""Least scale of a gradient, relative to the largest: a spectrum with only exact rows has that of its roughness."""
ROUNDING = 1e-13
"""Share of the terms of a sum that may be rounding."""


def nearest_point(problem: Quadratic) -> tuple[Array, float]:
    """A point within the bounds whose worst exact row misses least, and that miss; infinite if there is no answer."""
    from scipy import sparse
    from scipy.optimize import linprog

    rows, right = problem.equalities()
    scale = LARGE / max(float(abs(rows).max()), 1e-300)
    worst = sparse.csr_matrix(np.ones((rows.shape[0], 1)))
    low = np.where(problem.lower > -FAR, problem.lower, -np.inf)
    high = np.where(problem.upper < FAR, problem.upper, np.inf)
    found = linprog(
        np.concatenate([np.zeros(problem.size), [1.0]]),
        A_ub=sparse.bmat([[scale * rows, -worst], [-scale * rows, -worst]], format="csr"),
        b_ub=scale * np.concatenate([right, -right]),
        bounds=np.stack([np.append(low, 0.0), np.append(high, np.inf)], axis=1),
        method="highs",
        options=TOLERANCES,
    )
    if found.x is None:
        return np.clip(np.zeros(problem.size), problem.lower, problem.upper), np.inf
    x = np.clip(found.x[:-1], problem.lower, problem.upper)
    return x, float(np.abs(rows @ x - right).max(initial=0.0))


def least_miss(problem: Quadratic, answer: Answer) -> float:
    """A lower bound of the worst miss of an exact row at any point within the bounds, from a compromise; 0 if unknown.

    Its forces y on the exact rows E x − T g = e are nearly a certificate (Farkas 1902): if the least y·(E x − T g − e)
    within the bounds is above 0, no point meets all rows.
    """
    colors = problem.color_lower.size
    ties = np.concatenate([np.zeros((0, colors)), *(block.ties[block.exact] for block in problem.blocks)])
    forces = np.concatenate([force[b.exact] for b, force in zip(problem.blocks, answer.forces, strict=True)])
    is_open = (problem.lower[:colors] <= -FAR) | (problem.upper[:colors] >= FAR)
    if is_open.any():
        # Nothing bounds these colors, so the forces on them must cancel.
        pull = ties[:, is_open]
        gram = pull.T @ pull
        gram.flat[:: len(gram) + 1] += 1e-300
        forces = forces - pull @ np.linalg.lstsq(gram, pull.T @ forces, rcond=1e-12)[0]
    slope, begin, total, size = [np.where(is_open, 0.0, -forces @ ties)], 0, 0.0, 0.0
    for block in problem.blocks:
        own = forces[begin : begin + int(block.exact.sum())]
        begin += len(own)
        slope.append(own @ block.rows[block.exact])
        total -= float(own @ block.targets[block.exact])
        size += float(np.abs(own) @ np.abs(block.targets[block.exact]))
    slopes = np.concatenate(slope)
    ends = np.where(slopes > 0, problem.lower, problem.upper)
    terms = slopes[slopes != 0] * ends[slopes != 0]
    if not np.isfinite(terms).all():
        return 0.0
    total += float(terms.sum()) - ROUNDING * (size + float(np.abs(terms).sum()))
    return max(total, 0.0) / max(float(np.abs(forces).sum()), 1e-300)


@dataclass(frozen=True, eq=False)
class ExactRows:
    """The exact rows of each spectrum as independent ones: V · (colors, x_k) is constant. Nearly dependent rows get
    lost in the rounding of the large ones; in V they have size 1.
    """

    matrix: Array
    """V of all spectra, (r, size), with orthonormal rows for each spectrum."""
    back: tuple[tuple[int, int, Array], ...]
    """For each spectrum its range of rows of V, and the matrix from their multipliers to those of its own rows."""

    RANK = 1e-10
    """Singular value, relative to the largest, below which rows depend on each other."""

    @classmethod
    def of(cls, problem: Quadratic, movable: NDArray[np.bool_]) -> ExactRows:
        """The rows on the unknowns that are not held."""
        count, found, back, begin = problem.color_lower.size, [np.zeros((0, problem.size))], [], 0
        for block, start, end in zip(problem.blocks, problem.offsets, problem.offsets[1:], strict=False):
            exact = block.exact
            own = np.concatenate([-block.ties[exact] * movable[:count], block.rows[exact] * movable[start:end]], axis=1)
            outer, sizes, inner = np.linalg.svd(own, full_matrices=False)
            rank = int((sizes > cls.RANK * max(float(sizes.max(initial=0.0)), 1e-300)).sum())
            rows = np.zeros((rank, problem.size))
            rows[:, :count], rows[:, start:end] = inner[:rank, :count], inner[:rank, count:]
            found.append(rows)
            back.append((begin, begin + rank, outer[:, :rank] / sizes[:rank]))
            begin += rank
        return cls(np.concatenate(found), tuple(back))

    def forces(self, multipliers: Array) -> list[Array]:
        """Multipliers of the exact rows of each spectrum, from those of V."""
        return [matrix @ multipliers[begin:end] for begin, end, matrix in self.back]


def multipliers(problem: Quadratic, rows: ExactRows, x: Array) -> tuple[list[list[Array]], Array]:
    """Multipliers of the exact rows with the least violation of optimality at ``x``, as the program has them and with
    more digits; and a direction of descent.

    The dual of the program is the direction in which the objective decreases most within the bounds and exact rows:
    it is 0 exactly where the point is optimal, also where more bounds are active than directions are left.
    """
    from scipy import sparse
    from scipy.optimize import linprog

    scale = np.maximum(problem.gradient_scale, LEAST_SCALE * float(problem.gradient_scale.max()))
    gradient = problem.gradient(x, problem.forces(x)) / scale
    # An unknown between equal bounds may be pushed either way.
    rising, falling = x < problem.upper, x > problem.lower
    pushed = sparse.csr_matrix(rows.matrix.T / scale[:, None])
    up, down = np.flatnonzero(rising), np.flatnonzero(falling)
    least = sparse.csr_matrix(np.ones((len(up) + len(down), 1)))
    size = max(float(np.abs(gradient).max(initial=0.0)), 1e-300)
    found = linprog(
        np.append(np.zeros(pushed.shape[1]), 1.0),
        A_ub=sparse.hstack([sparse.vstack([-pushed[up], pushed[down]]), -least], format="csr"),
        b_ub=np.concatenate([gradient[up], -gradient[down]]) / size,
        bounds=[(None, None)] * pushed.shape[1] + [(0.0, None)],
        method="highs",
        options=TOLERANCES,
    )
    direction = np.zeros(problem.size)
    if found.x is None:
        return [], direction
    marginals = -found.ineqlin.marginals
    direction[up] += marginals[: len(up)]
    direction[down] -= marginals[len(up) :]
    first = size * found.x[:-1]
    # The program answers to its tolerance. Where nothing holds an unknown, its gradient must be 0 to rounding.
    free = np.flatnonzero(rising & falling)
    left = gradient[free] * scale[free] + rows.matrix[:, free].T @ first
    sharp = first - np.linalg.lstsq(rows.matrix[:, free].T, left, rcond=ExactRows.RANK)[0]
    return [rows.forces(first), rows.forces(sharp)], direction / scale
