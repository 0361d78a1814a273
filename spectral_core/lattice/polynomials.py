# SPDX-License-Identifier: GPL-3.0-or-later
"""The characteristic polynomials that a rotational dilation may have, and their roots in closed form (thesis 3.2).

A dilation K is similar to a scaled rotation Q with QᵀQ = α²I, α = β^(1/n), so every root lies on the circle of
radius α. For a rate β without square factors integrality leaves only the trinomials of Proposition 3.2:

* n even, proper rotation: xⁿ + C x^(n/2) + β with C² < 4β,
* n even, improper (det Q < 0): xⁿ - β, which the thesis leaves out,
* n odd: xⁿ - β (its mirror xⁿ + β belongs to -K and gives the same lattice).

For a rate with a square factor (4, 8, 9, ...) the trinomials still work, yet further polynomials may exist.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_declared, require_whole
from spectral_core.errors import InvalidInputError

MAX_DIMENSIONS = 16
"""Largest dimension that is built; companion matrices, reduction and short vectors are tested up to here."""
MAX_RATE = 64
"""Largest rate β; a higher one drops more than 98% of the points per level and is better split into factors."""


@dataclass(frozen=True, order=True)
class CharacteristicPolynomial:
    """xⁿ + C x^(n/2) + β, or xⁿ - β for odd n and for improper rotations."""

    dimensions: int
    """n, from 1 to 16."""
    rate: int
    """β = |det K|, the factor between the densities of two levels."""
    middle: int = 0
    """C, the coefficient of x^(n/2); zero unless n is even and the rotation proper."""
    improper: bool = False
    """True for the polynomial xⁿ - β with even n, whose Q contains one reflection."""

    def __post_init__(self) -> None:
        _check_dimensions_and_rate(self.dimensions, self.rate)
        # K holds integers: with any other number the lattice would contain no copy of itself.
        require_whole("the middle coefficient C", self.middle, -MAX_RATE, MAX_RATE)
        require_declared(self)
        if self.dimensions % 2 and (self.middle or self.improper):
            raise InvalidInputError(
                f"dimension {self.dimensions} is odd: its only polynomial is xⁿ - {self.rate}; leave out the middle "
                f"coefficient (given {self.middle}) and improper (given {self.improper})"
            )
        if self.improper and self.middle:
            raise InvalidInputError(f"an improper similarity has middle coefficient 0, given {self.middle}")
        if self.middle**2 >= 4 * self.rate:
            raise InvalidInputError(
                f"the middle coefficient C is {self.middle}; roots on one circle need C² < 4β = {4 * self.rate}"
            )

    @property
    def coefficients(self) -> tuple[int, ...]:
        """c_0 .. c_n, constant first, c_n = 1."""
        n = self.dimensions
        coefficients = [0] * (n + 1)
        coefficients[n] = 1
        coefficients[0] = -self.rate if n % 2 or self.improper else self.rate
        if n % 2 == 0:
            coefficients[n // 2] += self.middle
        return tuple(coefficients)

    @property
    def dilation_factor(self) -> float:
        """α = β^(1/n), the factor between the distances of two levels."""
        return float(self.rate ** (1.0 / self.dimensions))

    @property
    def angles(self) -> NDArray[np.float64]:
        """Angles of the roots in [0, π], (r,): real roots first (0, then π), then one of each pair, ascending."""
        n = self.dimensions
        if n % 2:
            return 2.0 * math.pi * np.arange((n + 1) // 2) / n
        if self.improper:
            return np.concatenate([[0.0, math.pi], 2.0 * math.pi * np.arange(1, n // 2) / n])
        phi = math.atan2(math.sqrt(4 * self.rate - self.middle**2), -self.middle)
        angles = 2.0 * math.pi * np.arange(n // 2)
        both = np.concatenate([angles + phi, angles - phi]) / (n // 2)
        both = np.arctan2(np.sin(both), np.cos(both))
        return np.sort(both[both > 0.0])

    @property
    def block_sizes(self) -> NDArray[np.int64]:
        """Coordinates that each root takes, (r,): 1 for a real root, 2 for a complex pair; they sum to n."""
        real = 1 if self.dimensions % 2 else 2 * int(self.improper)
        return np.array([1] * real + [2] * ((self.dimensions - real) // 2), dtype=np.int64)

    @property
    def roots(self) -> NDArray[np.complex128]:
        """One root per real root and per pair (the one above the real axis), (r,), in the order of ``angles``."""
        roots = self.dilation_factor * np.exp(1j * self.angles)
        roots[self.block_sizes == 1] = roots[self.block_sizes == 1].real
        return roots

    def companion(self) -> NDArray[np.int64]:
        """Companion matrix, (n, n): ones below the diagonal, -c_0 .. -c_(n-1) in the last column (thesis 3.11)."""
        n = self.dimensions
        matrix = np.eye(n, k=-1, dtype=np.int64)
        matrix[:, -1] = [-c for c in self.coefficients[:n]]
        return matrix

    def __str__(self) -> str:
        n, middle = self.dimensions, ""
        if self.middle:
            factor = "" if abs(self.middle) == 1 else f"{abs(self.middle)} "
            power = "x" if n == 2 else f"x^{n // 2}"
            middle = f" {'+' if self.middle > 0 else '-'} {factor}{power}"
        return f"{'x' if n == 1 else f'x^{n}'}{middle} {'-' if self.coefficients[0] < 0 else '+'} {self.rate}"


def characteristic_polynomials(
    dimensions: int, rate: int, *, improper: bool | None = False
) -> tuple[CharacteristicPolynomial, ...]:
    """All admissible polynomials of a dimension and rate; ``improper`` False, True or None for both types.

    Complete for rates without square factors (Proposition 3.2); odd dimensions have one polynomial, which is proper.
    """
    _check_dimensions_and_rate(dimensions, rate)
    if dimensions % 2:
        return () if improper else (CharacteristicPolynomial(dimensions, rate),)
    found: list[CharacteristicPolynomial] = []
    if not improper:
        largest = math.isqrt(4 * rate - 1)
        found += [CharacteristicPolynomial(dimensions, rate, c) for c in range(-largest, largest + 1)]
    if improper is None or improper:
        found.append(CharacteristicPolynomial(dimensions, rate, improper=True))
    return tuple(found)


def has_square_factor(number: int) -> bool:
    """True if a square above 1 divides ``number``."""
    return any(number % (d * d) == 0 for d in range(2, math.isqrt(number) + 1))


def _check_dimensions_and_rate(dimensions: int, rate: int) -> None:
    if not isinstance(dimensions, int | np.integer) or not 1 <= dimensions <= MAX_DIMENSIONS:
        raise InvalidInputError(f"dimensions is {dimensions!r}; expected a whole number from 1 to {MAX_DIMENSIONS}")
    if not isinstance(rate, int | np.integer) or not 2 <= rate <= MAX_RATE:
        raise InvalidInputError(f"rate is {rate!r}; expected a whole number from 2 to {MAX_RATE}")
