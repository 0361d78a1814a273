# SPDX-License-Identifier: GPL-3.0-or-later
"""Sobol points of a convex region: those of its bounding box that lie in it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.lattice import Region

Matrix = NDArray[np.float64]

MOST_BLIND = 2**20
"""Draws after which a region without a point, or with too few, is given up."""
MOST_DRAWN = 2**24
"""Draws that the wanted points may need at the share of the first ``MOST_BLIND``."""
LARGEST_BATCH = 2**16
EMPTY = "the region is empty: its ranges, constraints and ball exclude each other. Widen or remove one of them"


def bounding_box(region: Region) -> tuple[Matrix, Matrix]:
    """Least and greatest coordinate of a region on each axis, (n,) each.

    Raises InvalidInputError if its limits exclude each other. A ball counts by the half-spaces around it.
    """
    low, high, slanted = _axis_limits(region)
    if (low > high).any():
        raise InvalidInputError(EMPTY)
    rows, bounds = region.rows, region.bounds
    if region.norm_ball is not None:
        outer = region.norm_ball.outer_rows()
        rows, bounds = np.concatenate([rows, outer[0]]), np.concatenate([bounds, outer[1]])
    elif not slanted:
        return low, high
    from scipy.optimize import linprog

    for axis, sign in [(axis, sign) for axis in range(region.dimensions) for sign in (1.0, -1.0)]:
        answer = linprog(sign * np.eye(region.dimensions)[axis], A_ub=rows, b_ub=bounds, bounds=(None, None))
        if answer.status == 2:
            raise InvalidInputError(EMPTY)
        if answer.status == 0 and sign > 0:
            low[axis] = max(low[axis], answer.fun)
        elif answer.status == 0:
            high[axis] = min(high[axis], -answer.fun)
    return low, np.maximum(low, high)


def is_box(region: Region) -> bool:
    """True if only limits that are parallel to the axes bound the region."""
    return region.norm_ball is None and not _axis_limits(region)[2]


def _axis_limits(region: Region) -> tuple[Matrix, Matrix, bool]:
    """Limits by the half-spaces that are parallel to an axis, and whether there are others."""
    n = region.dimensions
    low, high, slanted = np.full(n, -np.inf), np.full(n, np.inf), False
    for row, bound in zip(region.rows, region.bounds, strict=True):
        axes = np.flatnonzero(row)
        if len(axes) != 1:
            slanted = True
            continue
        edge = bound / row[axes[0]]
        if row[axes[0]] > 0:
            high[axes[0]] = min(high[axes[0]], edge)
        else:
            low[axes[0]] = max(low[axes[0]], edge)
    return low, high, slanted


def sobol_batches(region: Region, wanted: int, seed: int) -> Iterator[Matrix]:
    """Sobol points in the region, endlessly; ends where ``wanted`` points would need more than ``MOST_DRAWN`` draws."""
    from scipy.stats import qmc

    low, high = bounding_box(region)
    engine = qmc.Sobol(region.dimensions, scramble=True, rng=np.random.default_rng(seed))
    size = min(2 ** max(4, int(np.ceil(np.log2(wanted)))), LARGEST_BATCH)
    found = 0
    while engine.num_generated < MOST_BLIND or engine.num_generated * wanted <= found * MOST_DRAWN:
        drawn = low + engine.random(size) * (high - low)
        inside = drawn[region.contains(drawn)]
        found += len(inside)
        yield inside
        size = min(2 * size, LARGEST_BATCH) if engine.num_generated > size else size
