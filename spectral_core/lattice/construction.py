# SPDX-License-Identifier: GPL-3.0-or-later
"""Lattices with rotational dilation, QG = GK with QᵀQ = α²I, in closed form (thesis 3.2, corrected).

With roots θ_j of the characteristic polynomial, the row (1, θ_j, ..., θ_j^(n-1)) is a left eigenvector of the
companion matrix, so its real and imaginary parts are rows of G and no eigensolver is needed. A scale per root (one
for both rows of a pair) is all the freedom there is: r - 1 numbers up to size, where the thesis counts n - 1.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only, read_only_when_copied, require_kind
from spectral_core.errors import InvalidInputError
from spectral_core.lattice.classes import LatticeClass, lattice_classes
from spectral_core.lattice.polynomials import CharacteristicPolynomial
from spectral_core.lattice.reduction import lll

MAX_LOG_SCALE = 12.0
"""Largest |log w|: scales repeat on a compact torus (multiplication by units), so the limit excludes no lattice.

At the limit figures of merit still keep about 10 of 16 digits."""


@read_only_when_copied
@dataclass(frozen=True, eq=False)
class Lattice:
    """A lattice of unit density (|det G| = 1) that contains a rotated copy of itself, α times larger."""

    lattice_class: LatticeClass
    log_scales: NDArray[np.float64]
    """log w, (r,): one number per real root and complex pair in the order of ``roots``, Σ block size · log w = 0.

    w = s² weighs the squared length in the block of a root, so it is the square of the thesis' scale."""
    generator: NDArray[np.float64]
    """G, (n, n): the basis vectors are its columns."""
    rotation: NDArray[np.float64]
    """Q, (n, n): QᵀQ = α²I, block diagonal with one 1×1 or 2×2 block per root."""
    criterion: str = "given scales"
    """Goal for which the scales were chosen."""

    @property
    def polynomial(self) -> CharacteristicPolynomial:
        """Shared characteristic polynomial of K and Q."""
        return self.lattice_class.polynomial

    @property
    def dimensions(self) -> int:
        """n."""
        return self.polynomial.dimensions

    @property
    def rate(self) -> int:
        """β = |det K|."""
        return self.polynomial.rate

    @property
    def dilation_factor(self) -> float:
        """α = β^(1/n)."""
        return self.polynomial.dilation_factor

    @functools.cached_property
    def dilation(self) -> NDArray[np.int64]:
        """K, (n, n) integers: GK = QG generates the next coarser level."""
        return read_only(self.lattice_class.dilation)

    @functools.cached_property
    def basis_change(self) -> NDArray[np.int64]:
        """Unimodular T, (n, n), that makes G T an LLL-reduced basis of the same lattice."""
        return read_only(lll(self.generator))

    @functools.cached_property
    def reduced(self) -> NDArray[np.float64]:
        """LLL-reduced generator G T, (n, n); its dilation is T⁻¹ K T."""
        reduced: NDArray[np.float64] = self.generator @ self.basis_change
        return read_only(reduced)

    def residuals(self) -> tuple[float, float]:
        """max |QG - GK| / max |G| and max |QᵀQ - α²I|; both are rounding errors (below 1e-12)."""
        g, q = self.generator, self.rotation
        similarity = np.abs(q @ g - g @ self.dilation).max() / np.abs(g).max()
        orthogonality = np.abs(q.T @ q - self.dilation_factor**2 * np.eye(self.dimensions)).max()
        return float(similarity), float(orthogonality)

    def __repr__(self) -> str:
        scales = ", ".join(f"{value:.5g}" for value in self.log_scales)
        return (
            f"Lattice(n={self.dimensions}, rate={self.rate}, {self.lattice_class}, log w=[{scales}], {self.criterion})"
        )


def build_lattice(
    lattice_class: LatticeClass, log_scales: ArrayLike | None = None, *, criterion: str | None = None
) -> Lattice:
    """Lattice of a class with log scales (r,), one per root; without them S = I.

    Scales are shifted to Σ block size · log w = 0 (a common factor is only size). Raises InvalidInputError if
    they are not finite, of another number, or above ``MAX_LOG_SCALE`` after the shift.
    """
    require_kind("lattice_class", lattice_class, LatticeClass, "class_of, lattice_classes")
    sizes = lattice_class.polynomial.block_sizes
    given = np.zeros(len(sizes)) if log_scales is None else log_scales
    logs = frozen_array("log_scales", given, (len(sizes),))
    shift = float(sizes @ logs) / float(sizes.sum())
    if abs(shift) > 1e-11:  # stored scales, which were shifted before, must give the same bits again
        logs = logs - shift
    if np.abs(logs).max() > MAX_LOG_SCALE * (1.0 + 1e-12):
        raise InvalidInputError(
            f"log_scales reach {np.abs(logs).max():.3g} in size; expected at most {MAX_LOG_SCALE:g}. Scales repeat "
            "with the units of the number ring, so an equal lattice exists within the limit: search nearer to 0"
        )
    blocks = embedding(lattice_class)
    generator = np.exp(0.5 * np.repeat(logs, sizes))[:, None] * blocks
    generator /= np.exp(np.linalg.slogdet(generator)[1] / len(generator))
    rotation = scaled_rotation(lattice_class.polynomial)
    default = "unit scales" if log_scales is None else "given scales"
    return Lattice(lattice_class, read_only(logs), read_only(generator), read_only(rotation), criterion or default)


def class_of(
    dimensions: int, rate: int, middle: int | None = None, *, index: int = 0, improper: bool = False
) -> LatticeClass:
    """The class with middle coefficient C = ``middle``; None if the dimension allows no choice, else C = 0."""
    return LatticeClass(CharacteristicPolynomial(dimensions, rate, middle or 0, improper), index)


def all_lattices(dimensions: int, rate: int) -> tuple[Lattice, ...]:
    """One lattice with S = I per known class, in the order of ``lattice_classes`` (thesis Algorithm 1)."""
    return tuple(build_lattice(one) for one in lattice_classes(dimensions, rate).classes)


def embedding(lattice_class: LatticeClass) -> NDArray[np.float64]:
    """Rows Re and Im of a left eigenvector of K per root, first component 1, (n, n): G with S = I, not normalized."""
    vectors = left_eigenvectors(lattice_class)
    rows: list[NDArray[np.float64]] = []
    for vector, size in zip(vectors, lattice_class.polynomial.block_sizes, strict=True):
        rows.append(vector.real)
        if size == 2:
            rows.append(vector.imag)
    return np.array(rows)


def left_eigenvectors(lattice_class: LatticeClass) -> NDArray[np.complex128]:
    """Row l(θ) with l K = θ l and first component 1, for every root, (r, n).

    For a companion matrix l = (1, θ, ..., θ^(n-1)). For any other K with polynomial p, l is the unit row times the
    quotient (p(x) - p(θ)) / (x - θ) evaluated at x = K, whose coefficients come from Horner's rule.
    """
    polynomial = lattice_class.polynomial
    n = polynomial.dimensions
    roots = polynomial.roots
    if lattice_class.index == 0:
        return np.asarray(roots[:, None] ** np.arange(n)[None, :])
    powers = [np.eye(n, dtype=np.int64)[0]]
    for _ in range(n - 1):
        powers.append(powers[-1] @ lattice_class.dilation)
    total = np.zeros((len(roots), n), dtype=np.complex128)
    quotient = np.ones(len(roots), dtype=np.complex128)
    for k in range(n - 1, -1, -1):
        total += quotient[:, None] * powers[k]
        quotient = roots * quotient + polynomial.coefficients[k]
    return total / total[:, :1]


def scaled_rotation(polynomial: CharacteristicPolynomial) -> NDArray[np.float64]:
    """Q in closed form, (n, n): α(±1) for a real root, α(cos -sin; sin cos) for a pair, on the rows of G."""
    n = polynomial.dimensions
    rotation = np.zeros((n, n))
    row = 0
    for root, size in zip(polynomial.roots, polynomial.block_sizes, strict=True):
        if size == 1:
            rotation[row, row] = root.real
        else:
            rotation[row : row + 2, row : row + 2] = [[root.real, -root.imag], [root.imag, root.real]]
        row += int(size)
    return rotation
