# SPDX-License-Identifier: GPL-3.0-or-later
"""A small ellipsoid around the part of a ball that lies in half-spaces.

A thin cap is flat along the cut and narrow across it, unlike the ball and the box around it. The deep cuts of the
ellipsoid method adapt to it (Grötschel, Lovász and Schrijver 1988, section 3.2): each takes the smallest ellipsoid
around the part of the last one in a half-space.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.lattice.fill.regions import NormBall

Matrix = NDArray[np.float64]

MAX_CUTS = 400
LEAST_GAIN = 1e-3
"""Decrease of the logarithm of the volume below which no further cut is made."""


def cap_ellipsoid(ball: NormBall, rows: Matrix) -> tuple[Matrix, Matrix]:
    """Give W (n, n) and e (n,) with ‖W (v - e)‖ <= 1 for all v in the ball with ``rows`` @ v <= 1."""
    n = len(ball.center)
    scale = ball.radii * ball.outer_radius()
    # In these coordinates the ellipsoid starts as the unit ball.
    normals, limits = rows * scale, 1.0 - rows @ ball.center
    shape, middle = np.eye(n), np.zeros(n)
    for _ in range(MAX_CUTS if n > 1 else 0):
        # Distance of each plane from the middle, in units of the ellipsoid's extent across it.
        across = normals @ shape
        lengths = np.sqrt(np.maximum(np.einsum("ij,ij->i", across, normals), 1e-300))
        depths = (normals @ middle - limits) / lengths
        deepest = int(np.argmax(depths))
        depth = min(float(depths[deepest]), 1.0 - 1e-9)  # at 1 the half-space only touches: rounding, not emptiness
        if depth <= -1.0 / n:  # a plane that far beyond the middle cannot make the ellipsoid smaller
            break
        squeeze = 2.0 * (1.0 + n * depth) / ((n + 1.0) * (1.0 + depth))
        growth = n**2 * (1.0 - depth**2) / (n**2 - 1.0)
        if n * np.log(growth) + np.log1p(-squeeze) > -LEAST_GAIN:
            break
        direction = across[deepest] / lengths[deepest]
        middle = middle - (1.0 + n * depth) / (n + 1.0) * direction
        shape = growth * (shape - squeeze * np.outer(direction, direction))
        shape = 0.5 * (shape + shape.T)
    # Enlarged slightly, because the rounding of many cuts could exclude a part of the region.
    factor = np.linalg.cholesky(shape * (1.0 + 1e-6))
    metric = np.linalg.solve(factor, np.diag(1.0 / scale))
    return metric, ball.center + scale * middle
