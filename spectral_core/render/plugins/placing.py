# SPDX-License-Identifier: GPL-3.0-or-later
"""Small matrices of placed objects, computed by formulas: a scene of many objects has many, and LAPACK starts threads
for each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REGULAR = 1e-6
"""Least determinant, over the product of the lengths of the columns, of a matrix that is far from singular."""


def crossed(first: Array, second: Array) -> Array:
    """Cross products (n, 3) of the rows of two arrays (n, 3)."""
    result = np.empty_like(first)
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        result[:, k] = first[:, a] * second[:, b] - first[:, b] * second[:, a]
    return result


def cofactors(linear: Array) -> tuple[Array, float]:
    """Cofactors (3, 3) of a matrix (3, 3), finite even if it is singular, and its determinant.

    They turn normals as the matrix turns positions, and they are the transposed inverse times the determinant.
    """
    (a, b, c), (d, e, f), (g, h, i) = linear.tolist()
    rows = (
        (e * i - f * h, f * g - d * i, d * h - e * g),
        (c * h - b * i, a * i - c * g, b * g - a * h),
        (b * f - c * e, c * d - a * f, a * e - b * d),
    )
    return np.array(rows), a * rows[0][0] + b * rows[0][1] + c * rows[0][2]


def is_regular(linear: Array) -> bool:
    """True if a matrix (3, 3) is so far from singular that its rank and inverse need no closer look."""
    (a, b, c), (d, e, f), (g, h, i) = linear.tolist()
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    lengths = (a * a + d * d + g * g) * (b * b + e * e + h * h) * (c * c + f * f + i * i)
    return bool(abs(determinant) > REGULAR * lengths**0.5 > 0)
