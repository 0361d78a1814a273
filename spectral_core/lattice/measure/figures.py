# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of merit of any lattice: packing, covering, density, thickness, kissing number, second moment, theta list.

Every function takes a basis as columns, (n, n), n to 16, and needs no structure of the lattice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_whole
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.lattice.measure.voronoi import (
    MAX_RELEVANT_DIMENSIONS,
    MAX_VERTEX_DIMENSIONS,
    checked_basis,
    relevant_vectors,
    volume_of,
    voronoi_cell,
)
from spectral_core.lattice.optimization import cell_samples
from spectral_core.lattice.reduction import closest_vectors, magnitude, shortest_vectors

Matrix = NDArray[np.float64]

MAX_EXACT_MOMENT_DIMENSIONS = 4
_REPLICATES = 8


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error; 0 means exact up to rounding."""

    value: float
    standard_error: float = 0.0


@dataclass(frozen=True)
class Bounds:
    """A number known to lie between two bounds; equal bounds mean exact."""

    lower: float
    upper: float

    @property
    def exact(self) -> bool:
        """True if lower and upper bound agree."""
        return self.lower == self.upper


@dataclass(frozen=True)
class FiguresOfMerit:
    """Figures of merit of a lattice; lengths in the units of the basis."""

    dimensions: int
    determinant: float
    """|det G|, the volume per point; 0 or infinite where no double holds it."""
    packing_radius: float
    """ρ: half the least distance of two points."""
    kissing_number: int
    """Points at the least distance from one point."""
    density: float
    """Δ: share of space in balls of radius ρ."""
    center_density: float
    """δ = Δ / volume of the unit ball."""
    covering_radius: Bounds
    """R: largest distance of a position to its nearest point; exact to n = 6."""
    thickness: Bounds
    """Θ: mean number of balls of radius R over a position."""
    second_moment: Estimate
    """Normalized second moment per dimension (Z: 1/12); exact to n = 4."""
    relevant_vectors: int | None
    """Facets of the Voronoi cell; None above n = 12."""
    face_counts: tuple[int, ...] | None
    """Faces of the cell by dimension, vertices first; None above n = 6."""


def figures_of_merit(basis: ArrayLike, *, samples: int = 65536, seed: int = 0) -> FiguresOfMerit:
    """All figures of the lattice with these basis vectors (columns); ``samples`` and ``seed`` serve n above 4."""
    given = checked_basis(basis)
    length = magnitude(given)  # figures without a unit must not depend on that of the basis
    reduced = given / length
    n = len(reduced)
    determinant = float(abs(np.linalg.det(reduced)))
    radius, kissing = packing(reduced)
    covering = covering_radius(reduced, seed=seed)
    ball = unit_ball_volume(n)
    return FiguresOfMerit(
        dimensions=n,
        determinant=volume_of(given),
        packing_radius=radius * length,
        kissing_number=kissing,
        density=ball * radius**n / determinant,
        center_density=radius**n / determinant,
        covering_radius=Bounds(covering.lower * length, covering.upper * length),
        thickness=Bounds(ball * covering.lower**n / determinant, ball * covering.upper**n / determinant),
        second_moment=second_moment(reduced, samples=samples, seed=seed),
        relevant_vectors=len(relevant_vectors(reduced)) if n <= MAX_RELEVANT_DIMENSIONS else None,
        face_counts=voronoi_cell(reduced).face_counts if n <= MAX_VERTEX_DIMENSIONS else None,
    )


def unit_ball_volume(dimensions: int) -> float:
    """Volume of the ball of radius 1 (thesis 2.2)."""
    return float(math.pi ** (dimensions / 2) / math.gamma(dimensions / 2 + 1))


def packing(basis: ArrayLike) -> tuple[float, int]:
    """Packing radius and kissing number, exact."""
    reduced = checked_basis(basis)
    length = magnitude(reduced)
    vectors = shortest_vectors(reduced / length)[1]
    return float(0.5 * np.sqrt(np.einsum("ij,ij->i", vectors, vectors).min()) * length), len(vectors)


def covering_radius(basis: ArrayLike, *, seed: int = 0, starts: int = 24) -> Bounds:
    """Covering radius: exact to n = 6; above, climbs from ``starts`` positions give a lower bound that is nearly tight.

    Bounded work: at most 20 linear programs per climb to n = 12, only sampled distances beyond. The upper bound is
    that of the nearest-plane rectangle, ½ (Σ r_ii²)^½.
    """
    starts = require_whole("starts", starts, 0, 1 << 20)
    given = checked_basis(basis)
    length = magnitude(given)  # the linear programs have absolute tolerances
    reduced = given / length
    n = len(reduced)
    if n <= MAX_VERTEX_DIMENSIONS:
        exact = voronoi_cell(given).covering_radius
        return Bounds(exact, exact)
    targets = cell_samples(n, 4096, seed) @ reduced.T
    nearest, squared = closest_vectors(reduced, targets)
    lower = float(np.sqrt(squared.max()))
    if n <= MAX_RELEVANT_DIMENSIONS:
        errors = targets - nearest @ reduced.T
        farthest = errors[np.argsort(-squared)[:starts]]
        lower = max(lower, _climb_to_vertices(relevant_vectors(reduced), farthest))
    upper = 0.5 * float(np.sqrt((np.diag(np.linalg.qr(reduced, mode="r")) ** 2).sum()))
    return Bounds(lower * length, max(upper, lower) * length)


def _climb_to_vertices(relevant: Matrix, positions: Matrix) -> float:
    """Largest vertex distance met when each position moves to the vertex farthest in its own direction, repeatedly."""
    from scipy.optimize import linprog

    halfway = 0.5 * np.einsum("ij,ij->i", relevant, relevant)
    best = 0.0
    for position in positions:
        for _ in range(20):
            answer = linprog(-position, A_ub=relevant, b_ub=halfway, bounds=(None, None), method="highs")
            if answer.status != 0:
                raise SolveError(f"a linear program over the Voronoi cell failed: {answer.message}")
            if answer.x @ answer.x <= position @ position * (1.0 + 1e-9):
                break
            position = answer.x
        best = max(best, float(np.sqrt(position @ position)))
    return best


def second_moment(basis: ArrayLike, *, samples: int = 65536, seed: int = 0) -> Estimate:
    """Normalized second moment of the Voronoi cell: exact to n = 4, beyond from Sobol points with a standard error.

    ``samples`` (a power of two) are split into 8 independently scrambled sets, whose spread gives the error.
    """
    samples = require_whole("samples", samples, 0, 1 << 30)
    if samples < 64 or samples & (samples - 1):
        raise InvalidInputError(f"samples is {samples}; expected a power of two of at least 64")
    seed = require_whole("seed", seed, 0, 1 << 59)
    given = checked_basis(basis)
    reduced = given / magnitude(given)
    n = len(reduced)
    if n <= MAX_EXACT_MOMENT_DIMENSIONS:
        return Estimate(voronoi_cell(reduced).second_moment)
    means = []
    for replicate in range(_REPLICATES):
        points = cell_samples(n, samples // _REPLICATES, seed * _REPLICATES + replicate)
        means.append(closest_vectors(reduced, points @ reduced.T)[1].mean())
    scaled = np.array(means) / (n * abs(np.linalg.det(reduced)) ** (2.0 / n))
    return Estimate(float(scaled.mean()), float(scaled.std(ddof=1) / math.sqrt(_REPLICATES)))


def best_known(dimensions: int) -> Matrix | None:
    """Generator (columns, unit density) of a lattice of the densest known packing in its dimension, n 2 to 8 and 10.

    A2, D3, D4, D5, E6, E7, E8 and, for 10, D10+ (a good quantizer). None elsewhere.
    """
    if dimensions == 2:
        rows = np.array([[1.0, 0.0], [0.5, math.sqrt(3.0) / 2.0]])
    elif dimensions in (3, 4, 5):
        rows = _checkerboard(dimensions)
    elif dimensions in (6, 7, 8):
        rows = _exceptional(dimensions)
    elif dimensions == 10:
        rows = _checkerboard(10)
        rows[0] = 0.5
    else:
        return None
    unit: Matrix = rows.T / abs(np.linalg.det(rows)) ** (1.0 / dimensions)
    return unit


def _checkerboard(n: int) -> Matrix:
    """Rows spanning D_n: integer vectors of even sum."""
    rows = np.eye(n) - np.eye(n, k=1)
    rows[-1] = 0.0
    rows[-1, -2:] = 1.0
    return rows


def _exceptional(n: int) -> Matrix:
    """Rows spanning E_n in n coordinates, from the Cartan matrix of the root system."""
    cartan = 2.0 * np.eye(n)
    for i, j in [(i, i + 1) for i in range(n - 2)] + [(n - 1, 2)]:
        cartan[i, j] = cartan[j, i] = -1.0
    lower: Matrix = np.linalg.cholesky(cartan)
    return lower
