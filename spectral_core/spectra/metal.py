# SPDX-License-Identifier: GPL-3.0-or-later
"""Metals by two colors instead of index and extinction (O. Gulbrandsen 2014, "Artist friendly metallic Fresnel").

The reflectance r at normal incidence and the tint g of the edge determine the complex index n + ik.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

MOST_FACING = 0.999
"""Largest reflectance at normal incidence; that of 1 belongs to an infinite index."""


def index_of_metal(facing: ArrayLike, edge: ArrayLike) -> tuple[Array, Array]:
    """Index of refraction n and extinction k (...) by the reflectance at normal incidence and the edge's tint (...).

    ``facing`` is limited to 0 to MOST_FACING. ``edge``: 0 to 1, up to 2 for metals of little extinction.
    """
    r, g = np.clip(np.asarray(facing, dtype=np.float64), 0.0, MOST_FACING), np.asarray(edge, dtype=np.float64)
    most, least = _ends(r)
    index = g * least + (1 - g) * most
    # rounding, or a tint below 0, gives a square below 0
    squared = (r * (index + 1) ** 2 - (index - 1) ** 2) / (1 - r)
    return index, np.sqrt(np.maximum(squared, 0.0))


def colors_of_metal(index: ArrayLike, extinction: ArrayLike) -> tuple[Array, Array]:
    """Reflectance at normal incidence and tint of the edge (...) by n and k (...); inverse of ``index_of_metal``.

    Negative n and k count as 0. The tint exceeds 1 for metals of little extinction.
    """
    n, squared = np.maximum(index, 0.0), np.square(np.maximum(extinction, 0.0))
    facing = np.clip((np.square(n - 1) + squared) / (np.square(n + 1) + squared), 0.0, MOST_FACING)
    most, least = _ends(facing)
    return facing, np.asarray((most - n) / np.maximum(most - least, 1e-9))  # both ends are 1 where nothing is reflected


def _ends(r: Array) -> tuple[Array, Array]:
    """Largest and least index that a metal of the reflectance r at normal incidence can have."""
    root = np.sqrt(r)
    return (1 + root) / (1 - root), (1 - r) / (1 + r)
