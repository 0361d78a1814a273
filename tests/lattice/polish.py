# SPDX-License-Identifier: GPL-3.0-or-later
"""Scales at a symmetric optimum, to the last digit.

A search that compares values finds the position of an optimum to about half of the digits of its value. At a symmetric
optimum, vectors that should be equally long then differ by 1e-8, and the Voronoi cell has facets and edges of that
size. Equal lengths are equations for the scales, and Newton's method solves them to rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.lattice.classes import LatticeClass
from spectral_core.lattice.construction import build_lattice
from spectral_core.lattice.reduction import closest_vectors, lll, vectors_within

Matrix = NDArray[np.float64]

NEAR = 1e-6
"""Relative difference of squared lengths below which two vectors are treated as equally long."""
ITERATIONS = 8


def polished_scales(one: LatticeClass, log_scales: Matrix) -> Matrix:
    """Give log scales (r,) that make all nearly equal vectors of ``log_scales`` equal; unchanged if there are none.

    Only vectors that determine the cell count: the shortest of each class modulo twice the lattice, and the shortest of
    all. If there are more equations than the scales can satisfy, the least-squares solution is used.
    """
    scales = np.array(log_scales, dtype=np.float64)
    pairs = _near_ties(build_lattice(one, scales).generator)
    sizes = one.polynomial.block_sizes
    blocks = np.repeat(np.eye(len(scales)), sizes, axis=1)
    for _ in range(ITERATIONS):
        if not len(pairs):
            break
        generator = build_lattice(one, scales).generator
        # A squared length is a sum over blocks, each proportional to its w: each part is the derivative by log w.
        parts = [(np.square(pair @ generator.T) @ blocks.T) for pair in pairs.transpose(1, 0, 2)]
        slope = parts[0] - parts[1]
        equations = np.concatenate([slope, sizes[None]])
        step = np.linalg.lstsq(equations, np.r_[-slope.sum(axis=1), 0.0], rcond=1e-9)[0]
        if np.abs(step).max() > 1e-4:  # the lengths are near by chance: no small change makes them equal
            return np.array(log_scales, dtype=np.float64)
        scales = scales + step
    return scales


def _near_ties(generator: Matrix) -> NDArray[np.int64]:
    """Pairs (K, 2, n) of integer vectors of nearly equal length."""
    change = lll(generator)
    reduced = generator @ change
    n = len(reduced)
    classes = np.array([[(i >> j) & 1 for j in range(n)] for i in range(1, 2**n)], dtype=np.int64)
    halves = 0.5 * classes @ reduced.T
    _, least = closest_vectors(reduced, halves)
    found = vectors_within(reduced, halves, least * (1.0 + NEAR))
    vectors = 2 * found.coefficients - classes[found.target]
    pairs = []
    for target in range(len(classes)):
        mine = vectors[found.target == target]
        pairs += [(mine[0], other) for other in mine[1:] if not np.array_equal(other, -mine[0])]
    lengths = np.square(vectors @ reduced.T).sum(axis=1)
    shortest = vectors[lengths < lengths.min() * (1.0 + NEAR)]
    pairs += [(shortest[0], other) for other in shortest[1:] if not np.array_equal(other, -shortest[0])]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2, n) @ change.T
