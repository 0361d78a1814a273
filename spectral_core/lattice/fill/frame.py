# SPDX-License-Identifier: GPL-3.0-or-later
"""A lattice placed in parameter space: rotation, spacing, origin, and the nested levels of its dilation.

Level 0 is the lattice as placed; level j is finer by rateʲ. A point has one address, the coarsest level that holds
it and its integer coordinates there, and its position is computed from that address alone, by one fixed sequence of
multiplications and additions. So the same point has the same bits in every region and at every level.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_kind, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.lattice.classes import LatticeClass
from spectral_core.lattice.construction import Lattice, build_lattice
from spectral_core.lattice.fill.anchoring import anchor
from spectral_core.lattice.fill.enumeration import Window
from spectral_core.lattice.fill.regions import Region
from spectral_core.lattice.polynomials import CharacteristicPolynomial

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_POINTS = 10_000_000
"""Most points of one fill (800 MB of coordinates in 10 dimensions)."""
MAX_LEVEL = 64


@read_only_when_copied
@dataclass(frozen=True, eq=False)
class Frame:
    """Positions of the points of a lattice: x = origin + spacing · U G K^-level k for integer k."""

    lattice: Lattice
    rotation: Matrix
    """U, (n, n), orthonormal."""
    spacing: float
    """Edge of a cube with the volume per point at level 0."""
    origin: Matrix
    """(n,): the point with k = 0."""

    @property
    def dimensions(self) -> int:
        """n."""
        return self.lattice.dimensions

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers that ``from_dict`` builds the same frame from, for a project file."""
        polynomial = self.lattice.polynomial
        return {
            "dimensions": polynomial.dimensions,
            "rate": polynomial.rate,
            "middle": polynomial.middle,
            "improper": polynomial.improper,
            "class": self.lattice.lattice_class.index,
            "log_scales": self.lattice.log_scales.tolist(),
            "criterion": self.lattice.criterion,
            "rotation": self.rotation.tolist(),
            "spacing": self.spacing,
            "origin": self.origin.tolist(),
        }

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Frame:
        """The frame that ``to_dict`` described; InvalidInputError if an entry is missing or wrong."""
        try:
            polynomial = CharacteristicPolynomial(
                plain["dimensions"], plain["rate"], plain["middle"], bool(plain["improper"])
            )
            one = LatticeClass(polynomial, plain["class"])
            scales = frozen_array("log_scales", plain["log_scales"], (None,))  # None would mean unit scales
            lattice = build_lattice(one, scales, criterion=plain["criterion"])
            spacing = float(plain["spacing"])
            rotation = checked_rotation(plain["rotation"], polynomial.dimensions)
            origin = frozen_array("origin", plain["origin"], (polynomial.dimensions,))
        except InvalidInputError:
            raise
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise InvalidInputError(
                f"not a description of a lattice frame: {error!r}; write it with to_dict"
            ) from error
        if not 0.0 < spacing < math.inf:
            raise InvalidInputError(f"spacing is {spacing}; expected a positive number")
        return cls(lattice, rotation, spacing, origin)

    def same_as(self, other: Frame) -> bool:
        """True if both frames give the same points, to the bit."""
        return (
            self.lattice.lattice_class == other.lattice.lattice_class
            and np.array_equal(self.basis(), other.basis())
            and np.array_equal(self.origin, other.origin)
        )

    def basis(self, level: int = 0) -> Matrix:
        """Basis of a level as columns, (n, n): spacing · U Q^-level G; finer for positive levels."""
        alpha = self.lattice.dilation_factor
        rotation = self.lattice.rotation / alpha
        step = rotation if level < 0 else rotation.T  # Q⁻¹ = Qᵀ / α²
        rotated = self.lattice.generator
        for _ in range(abs(level)):
            rotated = _product(step, rotated)
        basis: Matrix = (self.spacing * alpha**-level) * _product(self.rotation, rotated)
        return basis

    def positions(self, coefficients: Integers, level: int = 0) -> Matrix:
        """Positions (N, n) of integer coordinates (N, n) of a level. A point is rounded the same in every call.

        Sums run coordinate by coordinate: a matrix product may round differently from one batch to the next.
        """
        coefficients, own = self.addresses(coefficients, level)
        positions = np.empty(coefficients.shape)
        for each in range(level + 1):
            here = own == each
            if not here.any():
                continue
            basis = self.basis(each)
            # One sum for all points of a level, in a fixed order of additions: equal addresses give equal bits.
            local = np.zeros((int(here.sum()), self.dimensions))
            for j in range(self.dimensions):
                local += coefficients[here, j, None].astype(np.float64) * basis[:, j]
            positions[here] = self.origin + local
        return positions

    def addresses(self, coefficients: Integers, level: int) -> tuple[Integers, NDArray[np.int64]]:
        """Coarsest level from 0 that holds each point, and its coordinates there: (N, n) and (N,)."""
        steps = CosetDigits.of(self.lattice)
        coefficients = coefficients.copy()
        own = np.full(len(coefficients), level)
        # From the finest level down: a point whose digit is 0 is already in the next coarser lattice.
        for each in range(level, 0, -1):
            here = np.flatnonzero(own == each)
            coarser = here[steps.digits(coefficients[here]) == 0]
            coefficients[coarser] = steps.divide(coefficients[coarser])
            own[coarser] = each - 1
        return coefficients, own

    def points_in(self, region: Region, level: int = 0) -> tuple[Matrix, Integers]:
        """All points of a level in a region: positions (N, n), coordinates (N, n), in the order of the search.

        InvalidInputError if the region would hold more than ``MAX_POINTS``.
        """
        level = require_whole("level", level, 0, MAX_LEVEL)
        require_kind("the region", region, Region, "box, ball, halfspaces")
        if region.dimensions != self.dimensions:
            raise InvalidInputError(f"the region has {region.dimensions} dimensions, the lattice {self.dimensions}")
        anchored = anchor(region)
        basis = self.basis(level)
        expected = expected_count(region, anchored.metric, float(np.linalg.slogdet(basis)[1]))
        # Too large an estimate only delays the pruning of the search; too small an estimate would start it needlessly.
        if region.log_volume() is None:
            expected = min(expected, 5000.0)  # from the ellipsoid, which may be far too large; the search counts
        if expected > 1.5 * MAX_POINTS:
            raise InvalidInputError(
                f"level {level} holds about {expected:.3g} points in this region; the limit is {MAX_POINTS}. "
                "Take a coarser level or a smaller region"
            )
        # The nearest lattice point to the center keeps the integers small, wherever the origin is.
        nearest = np.rint(np.linalg.solve(basis, anchored.center - self.origin)).astype(np.int64)
        offset = (self.origin - anchored.center) + basis @ nearest
        window = Window(anchored, basis, offset)
        coefficients = window.points(1.0 + 1e-7, expected, MAX_POINTS) + nearest
        positions = self.positions(coefficients, level)
        inside = region.contains(positions)
        return positions[inside], coefficients[inside]


def _product(left: Matrix, right: Matrix) -> Matrix:
    """A matrix product in a fixed order of additions: that of a library may be rounded differently in each call."""
    total = np.zeros((len(left), right.shape[1]))
    for j in range(left.shape[1]):
        total += left[:, j, None] * right[j]
    return total


def expected_count(region: Region, metric: Matrix, log_cell: float) -> float:
    """About how many cells fit: by the region's volume, else a tenth of that of its ellipsoid; at most 1e300.

    In logarithms, since the volume of a small region in 16 dimensions may be below the smallest double.
    """
    log_volume = region.log_volume()
    if log_volume is None:
        n = len(metric)
        log_ball = 0.5 * n * math.log(math.pi) - math.lgamma(0.5 * n + 1.0)
        log_volume = log_ball - float(np.linalg.slogdet(metric)[1]) - math.log(10.0)
    return math.exp(max(min(log_volume - log_cell, 690.0), -690.0))


@dataclass(frozen=True, eq=False)
class CosetDigits:
    """Cosets of K Zⁿ: the number of an integer vector's coset, and division by K; exact integers throughout.

    Zⁿ / K Zⁿ is cyclic for the dilations built here: ``functional`` mod rate gives the coset and ``step`` leads to
    the next one. For a companion matrix these are the constant coefficient and the first unit vector.
    """

    functional: Integers
    step: Integers
    adjugate: Integers
    determinant: int

    @classmethod
    def of(cls, lattice: Lattice) -> CosetDigits:
        """Digits of a lattice's dilation."""
        dilation, rate, n = lattice.dilation, lattice.rate, lattice.dimensions
        determinant = round(float(np.linalg.det(dilation)))
        # K⁻¹ = adj(K) / det K: integer products and one exact division, no rounding at any size.
        adjugate = np.rint(np.linalg.inv(dilation) * determinant).astype(np.int64)
        # Every row of adj(K) vanishes on K Zⁿ modulo the rate;
        # a row with an entry that is invertible modulo the rate distinguishes all cosets.
        for row in adjugate % rate:
            for axis in range(n):
                inverse = next((k for k in range(1, rate) if k * int(row[axis]) % rate == 1), None)
                if inverse is not None:
                    return cls(row * inverse % rate, np.eye(n, dtype=np.int64)[axis], adjugate, determinant)
        raise InvalidInputError(
            f"the quotient of the lattice by its dilation of rate {rate} is not cyclic, so its levels have no digit "
            "order; use a rate without square factors"
        )

    def digits(self, coefficients: Integers) -> Integers:
        """Coset of each vector (N, n), (N,), from 0 to rate - 1; 0 is K Zⁿ."""
        return np.asarray(coefficients @ self.functional % abs(self.determinant))

    def divide(self, coefficients: Integers, digits: Integers | int = 0) -> Integers:
        """K⁻¹ (k - digit · step), exact, for vectors (N, n) with these digits."""
        shifted = coefficients - np.asarray(digits)[..., None] * self.step
        return np.asarray(shifted @ self.adjugate.T // self.determinant)


def random_rotation(dimensions: int, rng: np.random.Generator) -> Matrix:
    """Rotation or reflection drawn uniformly (QR of a Gaussian matrix with the signs of R made positive)."""
    # Without the signs QR would prefer some rotations (Mezzadri 2007).
    q, r = np.linalg.qr(rng.standard_normal((dimensions, dimensions)))
    return np.asarray(q * np.sign(np.diag(r)))


def checked_rotation(rotation: ArrayLike, dimensions: int) -> Matrix:
    """A given orthonormal matrix (n, n), read-only, or InvalidInputError."""
    matrix = frozen_array("rotation", rotation, (dimensions, dimensions))
    error = float(np.abs(matrix.T @ matrix - np.eye(dimensions)).max())
    if error > 1e-9:
        raise InvalidInputError(f"rotation is off orthonormal by {error:.2g}; expected RᵀR = I to 1e-9")
    return matrix
