# SPDX-License-Identifier: GPL-3.0-or-later
"""The Voronoi cell of a lattice: relevant vectors, vertices, faces and exact moments (Agrell et al. 2002; thesis 2.3).

Relevant vectors need one nearest-vector search per class of the lattice modulo twice itself, 2ⁿ - 1 in all. Vertices
are an intersection of half-spaces (at most (n+1)! of them), faces the closure of facets under intersection.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array
from spectral_core.errors import InvalidInputError
from spectral_core.lattice.reduction import closest_vectors, lll, magnitude, vectors_within

Matrix = NDArray[np.float64]

MAX_RELEVANT_DIMENSIONS = 12
"""Relevant vectors are found up to here: 4095 searches; each further dimension doubles them."""
MAX_VERTEX_DIMENSIONS = 6
"""Vertices and faces are found up to here: at most 5040 vertices; in 7 dimensions there may be 40320."""
TOLERANCE = 1e-8
"""The one relative tolerance on lengths: vectors that differ by less are equally long, corners that are nearer are one,
and a corner that is nearer to a facet lies on it. Frozen scales are exact far below it."""


def checked_basis(basis: ArrayLike) -> Matrix:
    """LLL-reduced copy of a basis given as columns, (n, n); InvalidInputError if it is not square or singular."""
    given = frozen_array("basis", basis, (None, None))
    n = given.shape[0]
    if given.shape[1] != n or not 1 <= n <= 16:
        raise InvalidInputError(
            f"basis has shape {given.shape}; expected n×n with the basis vectors as columns, n to 16"
        )
    return np.asarray(given @ lll(given))


def relevant_vectors(basis: ArrayLike) -> Matrix:
    """All Voronoi-relevant vectors, (N, n): the facets of the cell lie halfway to them. n to 12, N <= 2 (2ⁿ - 1).

    A shortest vector of its class modulo 2Λ is relevant exactly when it is unique there up to sign.
    """
    given = checked_basis(basis)
    length = magnitude(given)  # the tolerances hold for lengths near 1
    reduced = given / length
    n = len(reduced)
    if n > MAX_RELEVANT_DIMENSIONS:
        raise InvalidInputError(
            f"relevant vectors of dimension {n} need {2**n - 1} searches; the limit is {MAX_RELEVANT_DIMENSIONS} "
            "dimensions. Packing radius, kissing number and second moment do not need them"
        )
    classes = np.array([[(i >> j) & 1 for j in range(n)] for i in range(1, 2**n)], dtype=np.int64)
    halves = 0.5 * classes @ reduced.T
    _, least = closest_vectors(reduced, halves)
    found = vectors_within(reduced, halves, least * (1.0 + 2.0 * TOLERANCE))
    alone = np.bincount(found.target, minlength=len(classes)) == 2
    keep = alone[found.target]
    vectors: Matrix = (2 * found.coefficients[keep] - classes[found.target[keep]]) @ reduced.T
    return vectors[np.argsort(np.einsum("ij,ij->i", vectors, vectors), kind="stable")] * length


@dataclass(frozen=True, eq=False)
class VoronoiCell:
    """The points nearer to the origin than to any other lattice point; n to 6."""

    relevant: Matrix
    """Relevant vectors, (facets, n), shortest first."""
    vertices: Matrix
    """Corners, (V, n)."""
    volume: float
    """|det G|; 0 or infinite where no double holds it."""

    @functools.cached_property
    def _unit(self) -> tuple[Matrix, Matrix]:
        """Relevant vectors and corners in units of their magnitude, whose squares and products are doubles."""
        length = magnitude(self.relevant)
        return self.relevant / length, self.vertices / length

    @functools.cached_property
    def facets(self) -> tuple[frozenset[int], ...]:
        """Indices of the vertices on each facet, in the order of ``relevant``."""
        relevant, vertices = self._unit
        halfway = 0.5 * np.einsum("ij,ij->i", relevant, relevant)
        on = np.abs(relevant @ vertices.T - halfway[:, None]) < 2.0 * TOLERANCE * halfway[:, None]
        return tuple(frozenset(np.flatnonzero(row).tolist()) for row in on)

    @functools.cached_property
    def face_counts(self) -> tuple[int, ...]:
        """Faces of dimension 0 .. n-1: vertices, edges, ..., facets (each is an intersection of facets)."""
        n = self.relevant.shape[1]
        masks = {_mask(facet) for facet in self.facets}
        counts = [len(masks)]
        facet_masks = tuple(masks)
        for _ in range(n - 1):
            smaller: set[int] = set()
            for face in masks:
                smaller |= _maximal({face & other for other in facet_masks} - {face, 0})
            masks = smaller
            counts.append(len(masks))
        return tuple(reversed(counts))

    @functools.cached_property
    def covering_radius(self) -> float:
        """Distance of the farthest vertex, which is a deep hole."""
        vertices = self._unit[1]
        farthest = np.sqrt(np.einsum("ij,ij->i", vertices, vertices).max())
        return float(farthest * magnitude(self.relevant))

    @functools.cached_property
    def second_moment(self) -> float:
        """Normalized second moment ∫|x|² dx / (n V^(1 + 2/n)), exact: a sum over simplices of the hull."""
        n = self.relevant.shape[1]
        if n == 1:
            return 1.0 / 12.0
        vertices = self._unit[1]
        corners = vertices[_hull_simplices(vertices)]  # (F, n, n), the origin is the last corner
        volumes = np.abs(np.linalg.det(corners)) / math.factorial(n)
        squares = np.einsum("fij,fij->f", corners, corners) + np.einsum("fj,fj->f", corners.sum(1), corners.sum(1))
        integral = float(volumes @ squares) / ((n + 1) * (n + 2))
        return integral / (n * float(volumes.sum()) ** (1.0 + 2.0 / n))


def voronoi_cell(basis: ArrayLike) -> VoronoiCell:
    """Voronoi cell of the lattice with basis vectors as columns; InvalidInputError above 6 dimensions."""
    given = checked_basis(basis)
    length = magnitude(given)
    reduced = given / length
    n = len(reduced)
    if n > MAX_VERTEX_DIMENSIONS:
        raise InvalidInputError(
            f"the cell has dimension {n}; vertices and faces are found up to {MAX_VERTEX_DIMENSIONS}. "
            "relevant_vectors and the figures of merit go further"
        )
    relevant = relevant_vectors(reduced)
    volume = volume_of(given)
    if n == 1:
        return VoronoiCell(relevant * length, 0.5 * relevant * length, volume)
    from scipy.spatial import HalfspaceIntersection

    halfway = 0.5 * np.einsum("ij,ij->i", relevant, relevant)
    corners = HalfspaceIntersection(np.column_stack([relevant, -halfway]), np.zeros(n)).intersections
    return VoronoiCell(relevant * length, _distinct(corners) * length, volume)


def volume_of(basis: Matrix) -> float:
    """|det| of a basis, the volume per point; 0 or infinite where no double holds it."""
    length = magnitude(basis)
    with np.errstate(over="ignore", under="ignore"):
        # One factor after the other: length**n may overflow where the product does not.
        volume = float(abs(np.linalg.det(basis / length)))
        for _ in range(len(basis)):
            volume *= length
    return volume


def _distinct(points: Matrix) -> Matrix:
    """Points without those that repeat within rounding (a vertex on more than n facets is found several times)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(points).query_pairs(TOLERANCE * float(np.abs(points).max()), output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    _, label = connected_components(links, directed=False)
    _, first = np.unique(label, return_index=True)
    return points[first]


def _hull_simplices(points: Matrix) -> NDArray[np.int64]:
    """Simplices of the hull, (F, n); where nearly flat corners defeat Qhull's merging, points move by about 1e-11."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(ConvexHull(points).simplices)
    except QhullError:
        return np.asarray(ConvexHull(points, qhull_options="QJ").simplices)


def _mask(indices: frozenset[int]) -> int:
    return sum(1 << i for i in indices)


def _maximal(masks: set[int]) -> set[int]:
    """Sets that no other one contains: the facets of a face among its intersections with facets of the cell."""
    kept: list[int] = []
    for mask in sorted(masks, key=int.bit_count, reverse=True):
        if not any(mask & other == mask for other in kept):
            kept.append(mask)
    return set(kept)
