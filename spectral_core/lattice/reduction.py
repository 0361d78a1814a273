# SPDX-License-Identifier: GPL-3.0-or-later
"""LLL reduction, and all lattice vectors within a distance of many targets at once (Fincke and Pohst, in NumPy).

The search processes all targets together, level by level, so that the inner loop is in NumPy. Its work is the number of
nodes, which is limited.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, require_range
from spectral_core.errors import InvalidInputError, SolveError

Matrix = NDArray[np.float64]
Integers = NDArray[np.int64]

LOVASZ = 0.99
MAX_NODES = 200_000_000
"""Nodes of one search before it stops with an error: some minutes of work."""
FARTHEST = 2.0**50
"""Distance of a target from the origin, in lengths of the basis, above which doubles no longer tell vectors apart."""


def magnitude(basis: Matrix) -> float:
    """The power of two near the largest number of ``basis``: a division by it causes no rounding, 1 for zeros.

    Squares of lengths near 1e-200 or 1e200 are no doubles, and linear programs have absolute tolerances. So searches
    take a basis in units of its magnitude.
    """
    return float(2.0 ** (int(np.frexp(np.abs(basis).max(initial=0.0))[1]) - 1)) if np.any(basis) else 1.0


def lll(basis: Matrix) -> Integers:
    """Unimodular T, (n, n), such that the columns of ``basis @ T`` are LLL-reduced with factor 0.99.

    Passes in floating point repeat from the exact product basis·T until nothing changes, so that rounding in an
    ill-conditioned start does not last. Raises InvalidInputError for a singular basis, SolveError without convergence.
    """
    basis = _regular(basis)
    n = basis.shape[1]
    total = np.eye(n, dtype=np.int64)
    size = np.inf
    for _ in range(40):
        step = _lll_pass(basis @ total)
        reduced = basis @ (total @ step)
        # Ties make a pass swap equal vectors forever, so progress is measured on lengths, not on the matrix.
        now = float(np.log(np.einsum("ij,ij->j", reduced, reduced)).sum())
        if not now < size - 1e-9:
            return total
        total, size = total @ step, now
    raise SolveError("lattice reduction did not settle in 40 passes; the basis is too ill-conditioned")


def _lll_pass(basis: Matrix) -> Integers:
    """One textbook LLL run with Gram-Schmidt coefficients updated in place (Cohen, Algorithm 2.6.3)."""
    n = basis.shape[1]
    mu = np.eye(n)
    r = np.linalg.qr(basis, mode="r")
    norms: Matrix = np.square(np.diag(r))
    mu = (r / np.diag(r)[:, None]).T.copy()
    change = np.eye(n, dtype=np.int64)
    k, swaps = 1, 0
    while k < n:
        for j in range(k - 1, -1, -1):
            q = round(float(mu[k, j]))
            if q:
                change[:, k] -= q * change[:, j]
                mu[k, : j + 1] -= q * mu[j, : j + 1]
        if norms[k] >= (LOVASZ - mu[k, k - 1] ** 2) * norms[k - 1]:
            k += 1
            continue
        _swap(mu, norms, k)
        change[:, [k - 1, k]] = change[:, [k, k - 1]]
        k = max(k - 1, 1)
        swaps += 1
        if swaps > 20_000:
            break
    return change


def _swap(mu: Matrix, norms: Matrix, k: int) -> None:
    """Exchange basis vectors k-1 and k in the Gram-Schmidt data."""
    n = len(norms)
    m = mu[k, k - 1]
    below = norms[k] + m * m * norms[k - 1]
    mu[k, k - 1] = m * norms[k - 1] / below
    norms[k] *= norms[k - 1] / below
    norms[k - 1] = below
    mu[[k - 1, k], : k - 1] = mu[[k, k - 1], : k - 1]
    for i in range(k + 1, n):
        t = mu[i, k]
        mu[i, k] = mu[i, k - 1] - m * t
        mu[i, k - 1] = t + mu[k, k - 1] * mu[i, k]


@dataclass(frozen=True)
class Found:
    """Lattice vectors near targets, sorted by target."""

    target: Integers
    """Index of the target, (N,)."""
    coefficients: Integers
    """Integer coordinates in the basis searched, (N, n)."""
    squared: Matrix
    """Squared distances, (N,)."""


def vectors_within(basis: Matrix, targets: Matrix, squared_radii: Matrix) -> Found:
    """All lattice vectors B k with |B k - t|² <= r² for each target t; ``basis`` should be reduced.

    ``targets`` (N, n) and ``squared_radii`` (N,). Work is bounded by ``MAX_NODES`` nodes (SolveError above it).
    """
    frame, r = np.linalg.qr(basis)
    rotated = targets @ frame
    parts = []
    for start in range(0, max(len(targets), 1), 8192):
        chunk = slice(start, start + 8192)
        parts.append(_search(r, rotated[chunk], squared_radii[chunk], start))
    return Found(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("target", "coefficients", "squared")))


def _search(r: Matrix, targets: Matrix, squared_radii: Matrix, first: int) -> Found:
    n = len(r)
    owner = np.arange(len(targets))
    residual = targets.copy()  # t - R k over the coordinates chosen so far; only rows <= level are still needed
    spent = np.zeros(len(targets))
    chosen = np.zeros((len(targets), 0), dtype=np.int64)
    nodes = 0
    for level in range(n - 1, -1, -1):
        step = r[level, level]
        center = residual[:, level] / step
        half = np.sqrt(np.maximum(squared_radii[owner] - spent, 0.0)) / abs(step)
        low = np.ceil(center - half).astype(np.int64)
        counts = np.maximum(np.floor(center + half).astype(np.int64) - low + 1, 0)
        parent = np.repeat(np.arange(len(owner)), counts)
        nodes += len(parent)
        if nodes > MAX_NODES:
            raise SolveError(f"the search for lattice vectors passed {MAX_NODES} nodes; use a smaller radius")
        k = low[parent] + np.arange(len(parent)) - np.repeat(np.cumsum(counts) - counts, counts)
        miss = residual[parent, level] - step * k
        spent = spent[parent] + miss * miss
        residual = residual[parent, :level] - np.outer(k, r[:level, level])
        chosen = np.concatenate([k[:, None], chosen[parent]], axis=1)
        owner = owner[parent]
    return Found(owner + first, chosen, spent)


def closest_vectors(basis: Matrix, targets: Matrix) -> tuple[Integers, Matrix]:
    """Coefficients (N, n) and squared distances (N,) of the lattice vector nearest to each target; exact.

    Raises InvalidInputError for targets so far from the origin that doubles do not tell lattice vectors apart there.
    """
    unit = magnitude(_square(basis))
    frame, r = np.linalg.qr(_regular(basis))
    given = frozen_array("targets", targets, (None, len(frame)))
    if not len(given):
        return np.zeros((0, len(frame)), dtype=np.int64), np.zeros(0)
    with np.errstate(over="ignore"):
        rotated = (given / unit) @ frame
        farthest = np.abs(rotated / np.abs(np.diag(r)).min()).max()
    if not farthest < FARTHEST:
        raise InvalidInputError(
            f"a target is {farthest:.2g} lengths of the basis from the origin; expected below {FARTHEST:.2g}, beyond "
            "which double precision does not tell lattice vectors apart. Subtract a lattice vector near the targets"
        )
    # The rounding of far coordinates must not exclude the vector that the bound is from.
    rounding = 16.0 * len(frame) * np.finfo(np.float64).eps * (1.0 + np.abs(rotated).max(axis=1))
    bound = np.square(np.sqrt(_nearest_plane(r, rotated)) * (1.0 + 1e-9) + rounding)
    found = vectors_within(r, rotated, bound)
    starts = np.flatnonzero(np.r_[True, found.target[1:] != found.target[:-1]])
    least = np.minimum.reduceat(found.squared, starts)
    is_least = found.squared == least[found.target]
    first = np.full(len(given), -1, dtype=np.int64)
    hits = np.flatnonzero(is_least)[::-1]
    first[found.target[hits]] = hits
    with np.errstate(over="ignore", under="ignore"):
        return found.coefficients[first], least * unit * unit


def _nearest_plane(r: Matrix, targets: Matrix) -> Matrix:
    """Squared distance of Babai's nearest-plane vector to each target, (N,): an upper bound of the least one."""
    residual = targets.copy()
    for level in range(len(r) - 1, -1, -1):
        k = np.rint(residual[:, level] / r[level, level])
        residual[:, : level + 1] -= k[:, None] * r[: level + 1, level]
    squared: Matrix = np.einsum("ij,ij->i", residual, residual)
    return squared


def shortest_vectors(basis: Matrix, *, tolerance: float = 1e-9) -> tuple[Integers, Matrix]:
    """Coefficients (N, n) of all vectors of least positive length in a reduced basis, and their vectors (N, n)."""
    require_range("tolerance", tolerance, 0.0, 0.1)
    unit = magnitude(_square(basis))
    scaled = _regular(basis)
    squares = np.einsum("ij,ij->j", scaled, scaled)
    coefficients, vectors, squared = vectors_up_to(scaled, float(squares.min()) * (1.0 + tolerance))
    keep = squared <= squared.min() * (1.0 + 2.0 * tolerance)
    return coefficients[keep], vectors[keep] * unit


def _regular(basis: Matrix) -> Matrix:
    """The basis, (n, n), in units of its magnitude. Raises InvalidInputError if it is (nearly) singular."""
    given = _square(basis)
    scaled: Matrix = given / magnitude(given)
    with np.errstate(all="ignore"):
        condition = np.linalg.cond(scaled)
    if not condition < 1e13:
        raise InvalidInputError(
            f"the basis has condition number {condition:.2g}; expected below 1e13. Its vectors are (nearly) linearly "
            "dependent: rescale it, or pass a basis of full rank"
        )
    return scaled


def _square(basis: Matrix) -> Matrix:
    """The basis, (n, n) and finite. Raises InvalidInputError."""
    given = frozen_array("basis", basis, (None, None))
    if given.shape[0] != given.shape[1]:
        raise InvalidInputError(
            f"basis has shape {given.shape}; expected a square matrix whose columns are the vectors"
        )
    return given


def vectors_up_to(basis: Matrix, squared_length: float) -> tuple[Integers, Matrix, Matrix]:
    """All non-zero lattice vectors of squared length at most ``squared_length``: coefficients, vectors, squares."""
    n = basis.shape[1]
    found = vectors_within(basis, np.zeros((1, n)), np.array([squared_length]))
    keep = found.coefficients.any(axis=1)
    coefficients = found.coefficients[keep]
    vectors = coefficients @ basis.T
    return coefficients, vectors, np.einsum("ij,ij->i", vectors, vectors)
