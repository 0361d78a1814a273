# SPDX-License-Identifier: GPL-3.0-or-later
"""Decide if two lattices are equal up to rotation (congruent), and up to size (similar).

The thesis compares sorted lists of lengths, a necessary condition only. This module searches for an isometry: images of
the vectors of a reduced basis among vectors of equal length, with equal inner products (Plesken and Souvignier).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import require_range
from spectral_core.errors import InvalidInputError, SolveError
from spectral_core.lattice.measure.voronoi import checked_basis
from spectral_core.lattice.reduction import magnitude, vectors_up_to

Matrix = NDArray[np.float64]

MAX_STEPS = 200_000
"""Partial maps tried before the search gives up with an error."""


def isometry(first: ArrayLike, second: ArrayLike, *, tolerance: float = 1e-7) -> NDArray[np.int64] | None:
    """Unimodular T with (A T)ᵀ(A T) = BᵀB for reduced bases A, B of two lattices, or None when there is none.

    ``tolerance`` is relative to the longest basis vector, squared. Raises SolveError after ``MAX_STEPS`` partial maps.
    """
    require_range("tolerance", tolerance, 0.0, 0.1)
    a, b = checked_basis(first), checked_basis(second)
    if a.shape != b.shape:
        raise InvalidInputError(
            f"lattices of dimension {len(a)} and {len(b)} cannot be compared; give equal dimensions"
        )
    volumes = [float(np.linalg.slogdet(each)[1]) for each in (a, b)]
    if abs(volumes[0] - volumes[1]) > len(a) * tolerance:
        return None
    length = magnitude(b)  # squares of very short and very long vectors are no doubles
    a, b = a / length, b / length
    gram = b.T @ b
    scale = float(gram.diagonal().max())
    coefficients, vectors, squared = vectors_up_to(a, scale * (1.0 + tolerance))
    candidates = [np.flatnonzero(np.abs(squared - gram[i, i]) <= tolerance * scale) for i in range(len(b))]
    chosen: list[int] = []
    positions = [iter(candidates[0])]
    for _ in range(MAX_STEPS):
        index = next(positions[-1], None)
        if index is None:
            positions.pop()
            if not positions:
                return None
            chosen.pop()
            continue
        chosen.append(int(index))
        if len(chosen) == len(b):
            return coefficients[chosen].T.copy()
        level = len(chosen)
        options = candidates[level]
        products = vectors[options] @ vectors[chosen].T
        fits = (np.abs(products - gram[level, :level]) <= tolerance * scale).all(axis=1)
        positions.append(iter(options[fits]))
    raise SolveError(
        f"the congruence test passed {MAX_STEPS} steps without a decision; these lattices are very symmetric"
    )


def are_congruent(first: ArrayLike, second: ArrayLike, *, tolerance: float = 1e-7) -> bool:
    """True if a rotation (or reflection) maps one lattice onto the other."""
    return isometry(first, second, tolerance=tolerance) is not None


def are_similar(first: ArrayLike, second: ArrayLike, *, tolerance: float = 1e-7) -> bool:
    """True if the lattices are congruent after scaling both to unit density."""
    return are_congruent(*(_unit(checked_basis(b)) for b in (first, second)), tolerance=tolerance)


def _unit(basis: Matrix) -> Matrix:
    scaled = basis / magnitude(basis)
    unit: Matrix = scaled / abs(np.linalg.det(scaled)) ** (1.0 / len(basis))
    return unit
