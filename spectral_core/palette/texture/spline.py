# SPDX-License-Identifier: GPL-3.0-or-later
"""The quadratic B-spline over a lattice of colors: its nodes, and the weights of the nodes around a color."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NODES = 13
_KNOTS: Array = np.concatenate([[0.0, 0.0], np.arange(NODES - 1), [NODES - 2.0, NODES - 2.0]])
"""Knots of the quadratic B-spline, in spans; the ends are threefold, so that the spline reaches the cube's faces."""


def axis() -> Array:
    """Positions (13,) of the nodes on one axis: the Greville abscissae of the quadratic B-spline with clamped ends."""
    return (_KNOTS[1 : NODES + 1] + _KNOTS[2 : NODES + 2]) / 2 / (NODES - 2)


def _along(values: Array) -> tuple[NDArray[np.intp], Array]:
    """First node (m,) and the three shares (3, m) of the quadratic B-spline at ``values`` from 0 to 1 (de Boor)."""
    position = values * (NODES - 2)
    first = np.minimum(position.astype(np.intp), NODES - 3)
    before, start, end, after = (_KNOTS[first + k] for k in (1, 2, 3, 4))
    falling = (end - position) / (end - before)
    rising = (position - start) / (after - start)
    return first, np.stack(
        [
            (end - position) * falling,
            (position - before) * falling + (after - position) * rising,
            (position - start) * rising,
        ]
    )


def cell(colors: Array) -> tuple[NDArray[np.intp], Array]:
    """Lattice nodes (m, 27) around colors (m, 3) and their shares (m, 27), which are never negative and sum to 1."""
    firsts, shares = zip(*(_along(colors[:, channel]) for channel in range(3)), strict=True)
    corners, products = [], []
    for i, j, k in np.ndindex(3, 3, 3):
        corners.append(((firsts[0] + i) * NODES + firsts[1] + j) * NODES + firsts[2] + k)
        products.append(shares[0][i] * shares[1][j] * shares[2][k])
    return np.stack(corners, axis=1), np.stack(products, axis=1)
