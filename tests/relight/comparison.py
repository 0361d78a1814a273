# SPDX-License-Identifier: GPL-3.0-or-later
"""Difference of two pictures, and what lies between the nodes of a table."""

from __future__ import annotations

from itertools import permutations

import numpy as np


def relative_error(picture: np.ndarray, reference: np.ndarray) -> float:
    return float(np.abs(picture - reference)[..., :3].max() / np.abs(reference[..., :3]).max())


def between_corners(table: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values (rows, 3) of a table (n, n, n, 3) at places (rows, 3), in nodes.

    Of the six tetrahedra around the diagonal of a cell, that in which all four barycentric coordinates are positive.
    """
    found = np.empty((len(places), 3))
    for row, place in enumerate(places):
        node = np.minimum(np.floor(place).astype(int), len(table) - 2)
        for order in permutations(range(3)):
            corners = node + np.concatenate([[[0, 0, 0]], np.cumsum(np.eye(3, dtype=int)[list(order)], axis=0)])
            shares = np.linalg.solve(np.vstack([corners.T, np.ones(4)]), [*place, 1.0])
            if (shares >= -1e-12).all():
                found[row] = shares @ table[tuple(corners.T)]
    return found
