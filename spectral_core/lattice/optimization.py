# SPDX-License-Identifier: GPL-3.0-or-later
"""Scales S chosen for packing (exact vertex walk) or for the second moment (exact gradient), per lattice class.

With w = s² the squared length of a lattice vector is linear in w. Packing therefore minimizes the concave function
Σ m_j log w_j over the convex set {w: no vector shorter than 1}: local optima are vertices of that polyhedron, where
at least as many pairs of shortest vectors touch as there are scales (perfect forms). Linear programs with shortest
vectors as cutting planes walk from vertex to vertex, exactly. The second moment is smooth almost everywhere; its
gradient is the energy of the quantization error per block, and it is stationary where the error is white (Zamir and
Feder 1996). Scales live on a compact torus, so many starts make either search global in practice, not in proof.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind, require_whole
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.lattice.classes import LatticeClass
from spectral_core.lattice.construction import MAX_LOG_SCALE, Lattice, build_lattice, embedding
from spectral_core.lattice.reduction import closest_vectors, lll, vectors_up_to

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Search:
    """Outcome of a search over the scales of one class."""

    lattice: Lattice
    value: float
    """Packing radius, normalized second moment or covering radius of ``lattice``, by the search's own estimate."""
    starts: int
    hits: int
    """Number of starts that ended at ``value`` (relative 1e-6); with one hit of many, search longer."""
    residual: float
    """Optimality: largest change of log w in the last step (0 at an exact vertex)."""


class _Weights:
    """Squared block lengths of lattice vectors as rows, so that |v|² = row · w."""

    def __init__(self, lattice_class: LatticeClass) -> None:
        self.sizes = lattice_class.polynomial.block_sizes
        blocks = embedding(lattice_class)
        self.blocks = blocks / np.exp(np.linalg.slogdet(blocks)[1] / len(blocks))
        self.starts = np.cumsum(self.sizes) - self.sizes

    def basis(self, weights: Vector) -> Vector:
        scaled: Vector = np.sqrt(np.repeat(weights, self.sizes))[:, None] * self.blocks
        return scaled

    def block_lengths(self, coefficients: NDArray[np.int64]) -> Vector:
        lengths: Vector = np.add.reduceat((coefficients @ self.blocks.T) ** 2, self.starts, axis=1)
        return lengths

    def normalised_log(self, weights: Vector) -> Vector:
        logs = np.log(weights)
        return np.asarray(logs - self.sizes @ logs / self.sizes.sum())


def optimize_packing(
    lattice_class: LatticeClass, *, starts: int = 30, seed: int = 0, initial: Vector | None = None
) -> Search:
    """Scales of the largest packing radius found from ``starts`` random starts (first ``initial``, where given).

    Every end point is an exact local optimum. Bounded work: 200 linear programs per start. How many starts find the
    global optimum depends on the class: 10 do to n = 6, for n = 9 take 2000.
    """
    _require_positive("starts", starts)
    problem = _Weights(lattice_class)
    rng = np.random.default_rng(seed)
    pool = np.zeros((0, len(problem.sizes)))
    best, values = None, []
    for start in range(starts):
        logs = initial if start == 0 and initial is not None else rng.uniform(-3.0, 3.0, len(problem.sizes))
        weights, pool = _walk_to_vertex(problem, np.exp(logs - logs.mean()), pool)
        logs = problem.normalised_log(weights)
        values.append(float(0.5 * np.exp(-0.5 * (problem.sizes @ np.log(weights)) / problem.sizes.sum())))
        if np.abs(logs).max() <= MAX_LOG_SCALE and (best is None or values[-1] > best[0] + 1e-12):
            best = (values[-1], logs)
    if best is None:
        raise SolveError(f"all {starts} packing searches left the range of scales; try another seed")
    lattice = build_lattice(lattice_class, best[1], criterion="packing")
    return Search(lattice, best[0], starts, int(np.sum(np.array(values) > best[0] * (1 - 1e-6))), 0.0)


def _walk_to_vertex(problem: _Weights, weights: Vector, pool: Vector) -> tuple[Vector, Vector]:
    """Vertex with min |v|² = 1 where linearizing Σ m log w no longer helps, and the enlarged pool of cuts."""
    from scipy.optimize import linprog

    shortest, cuts = _short_rows(problem, weights)
    pool = _merged(pool, cuts)
    weights = weights / shortest
    objective = float(problem.sizes @ np.log(weights))
    slope = problem.sizes / weights
    for _ in range(200):
        answer = linprog(slope / slope.max(), A_ub=-pool, b_ub=-np.ones(len(pool)), bounds=(1e-9, None), method="highs")
        if answer.status != 0:
            raise SolveError(f"linear program of the packing search failed: {answer.message}")
        candidate = _polished(pool, answer.x)
        if candidate.max() > np.exp(2.0 * MAX_LOG_SCALE) * candidate.min():
            return weights, pool  # the walk leaves the range of scales; another start does not
        shortest, cuts = _short_rows(problem, candidate)
        if shortest < 1.0 - 1e-9:
            pool = _merged(pool, cuts)
            continue
        now = float(problem.sizes @ np.log(candidate))
        if now > objective - 1e-10:
            return (candidate if now < objective else weights), pool
        weights, objective, slope = candidate, now, problem.sizes / candidate
    return weights, pool


def _polished(pool: Vector, vertex: Vector) -> Vector:
    """The vertex again from its active rows in full precision (the linear program stops at about 1e-9)."""
    active = pool[np.abs(pool @ vertex - 1.0) < 1e-6]
    if np.linalg.matrix_rank(active, tol=1e-9) < len(vertex):
        return vertex
    exact: Vector = np.linalg.lstsq(active, np.ones(len(active)), rcond=None)[0]
    return exact if (exact > 0).all() and np.abs(exact - vertex).max() < 1e-5 * np.abs(vertex).max() else vertex


def _short_rows(problem: _Weights, weights: Vector) -> tuple[float, Vector]:
    """Least squared length at ``weights`` and block lengths of all vectors up to 1.2 times it (one of each ±v)."""
    basis = problem.basis(weights)
    change = lll(basis)
    reduced = basis @ change
    limit = float(np.einsum("ij,ij->j", reduced, reduced).min())
    coefficients, _, squared = vectors_up_to(reduced, limit * 1.2)
    least = float(squared.min())
    rows = problem.block_lengths(coefficients[squared <= 1.2 * least] @ change.T)
    return least, rows


def _merged(pool: Vector, rows: Vector) -> Vector:
    """Pool and rows without repetition, the newest 400 kept."""
    together = np.concatenate([pool, rows])
    _, index = np.unique(np.round(together, 9), axis=0, return_index=True)
    return together[np.sort(index)][-400:]


def optimize_second_moment(
    lattice_class: LatticeClass, *, starts: int = 10, seed: int = 0, samples: int = 4096, initial: Vector | None = None
) -> Search:
    """Scales of the least normalized second moment found from ``starts`` random starts (first ``initial``).

    The moment is averaged over ``samples`` Sobol points of the lattice cell, the same for every scale, with its exact
    gradient there; 4096 of them choose scales that are about 2e-4 too optimistic, so the value is estimated again on
    other points by ``figures.second_moment``. Bounded work: 120 evaluations per start.
    """
    from scipy.optimize import minimize

    _require_positive("starts", starts)
    problem = _Weights(lattice_class)
    points = cell_samples(len(problem.blocks), samples, seed)
    rng = np.random.default_rng(seed)
    best, values = None, []
    count = len(problem.sizes)
    for start in range(starts if count > 1 else 1):
        logs = initial if start == 0 and initial is not None else rng.uniform(-3.0, 3.0, count)
        answer = minimize(
            lambda x: moment_and_gradient(problem, x, points),
            logs - problem.sizes @ logs / problem.sizes.sum(),
            jac=True,
            method="L-BFGS-B",
            bounds=[(-MAX_LOG_SCALE + 1, MAX_LOG_SCALE - 1)] * count,
            options={"maxfun": 120, "ftol": 1e-13, "gtol": 1e-7},
        )
        values.append(float(answer.fun))
        if best is None or values[-1] < best[0]:
            best = (values[-1], problem.normalised_log(np.exp(answer.x)), float(np.abs(answer.jac).max()))
    assert best is not None
    lattice = build_lattice(lattice_class, best[1], criterion="second moment")
    moment = float(np.exp(best[0]))
    return Search(lattice, moment, starts, int(np.sum(np.array(values) < best[0] + 1e-6)), best[2])


def moment_and_gradient(problem: _Weights, logs: Vector, points: Vector) -> tuple[float, Vector]:
    """log of the normalized second moment over fixed points of the cell, and its exact gradient in log w.

    The gradient needs no derivative of the nearest vector: d E / d log w_j is the error energy of block j.
    """
    logs = logs - problem.sizes @ logs / problem.sizes.sum()
    energies = block_energies(problem.basis(np.exp(logs)), problem.sizes, points)
    total = energies.sum()
    gradient = energies / total - problem.sizes / problem.sizes.sum()
    return float(np.log(total / len(problem.blocks))), gradient


def block_energies(basis: Vector, block_sizes: NDArray[np.int64], points: Vector) -> Vector:
    """Mean squared quantization error per block of coordinates, (r,), over cell points (N, n) in basis coordinates."""
    change = lll(basis)
    reduced = basis @ change
    inverse = np.rint(np.linalg.inv(change.astype(np.float64)))
    coordinates = points @ inverse.T
    targets = (coordinates - np.floor(coordinates)) @ reduced.T
    nearest, _ = closest_vectors(reduced, targets)
    errors = targets - nearest @ reduced.T
    energies: Vector = np.add.reduceat((errors**2).mean(axis=0), np.cumsum(block_sizes) - block_sizes)
    return energies


def cell_samples(dimensions: int, count: int, seed: int) -> Vector:
    """Scrambled Sobol points, (count, n), in the unit cell; ``count`` is a power of two."""
    from scipy.stats import qmc

    count = require_whole("samples", count, 2, 1 << 30)
    if count & (count - 1):
        raise InvalidInputError(f"samples is {count}; expected a power of two of at least 2 (Sobol points)")
    sobol = qmc.Sobol(dimensions, seed=np.random.default_rng(seed))
    points: Vector = sobol.random(count)
    return points


def whiteness(lattice: Lattice, *, samples: int = 65536, seed: int = 1) -> float:
    """Largest relative deviation of a block's error energy per coordinate from the mean; 0 is white error.

    Scales that minimize the second moment are stationary, which is whiteness between blocks (Zamir and Feder).
    """
    require_kind("the lattice", lattice, Lattice, "make_lattice")
    sizes = lattice.polynomial.block_sizes
    points = cell_samples(lattice.dimensions, samples, seed)
    energies = block_energies(lattice.generator, sizes, points) / sizes
    return float(np.abs(energies / (energies @ sizes / sizes.sum()) - 1.0).max())


def _require_positive(name: str, value: int) -> None:
    require_whole(name, value, 1, 1 << 31)
