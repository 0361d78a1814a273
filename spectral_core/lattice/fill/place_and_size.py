# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a region of half-spaces is, and how large: in that unit, linear programs have all their digits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_core.lattice.fill.regions import Region

Matrix = NDArray[np.float64]

FAR_OFF = 1e-3
"""Width of a region relative to the distances of its half-spaces, below which some of these are far away."""
SHARPEST, SHARP = 1e-6, {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
"""Least width that a linear program tells from 0, relative to the distances of half-spaces, and its tolerances."""
MAX_RESCALINGS = 5
"""Steps to the size of a region; each can make it a million times smaller."""


def place_and_size(region: Region, rows: Matrix, bounds: Matrix) -> tuple[Matrix, float]:
    """A point near a region (n,), and about its largest width.

    ``rows``, ``bounds``: its half-spaces and those around its ball; all rows have length 1. The half-spaces and the
    ball each contain the region, and the smaller of the two is about as large as it is, unless some of their limits are
    so far away that they cut nothing.
    """
    found = []
    if region.norm_ball is not None:
        found.append((region.norm_ball.center, float(region.norm_ball.radii.max())))
    if region.norm_ball is None or is_bounded(region.rows):
        shift = np.linalg.lstsq(region.rows, region.bounds, rcond=None)[0]
        start = shift, float(np.abs(region.bounds - region.rows @ shift).max()) or 1.0
        found.append(_sharpened(region.rows, region.bounds, *start))
    return _sharpened(rows, bounds, *min(found, key=lambda each: each[1]))


def _sharpened(rows: Matrix, bounds: Matrix, shift: Matrix, size: float) -> tuple[Matrix, float]:
    """Point and width of half-spaces, from a point and a distance to which they reach at most."""
    for _ in range(MAX_RESCALINGS):
        distances = (bounds - rows @ shift) / size
        ends = _ends(distances, rows) if np.abs(distances).min() < FAR_OFF else None
        if ends is None:
            break
        width = float((ends[1] - ends[0]).max())
        if width > FAR_OFF:
            break
        shift = shift + 0.5 * size * ends.sum(axis=0)
        size *= max(width, SHARPEST)
    return shift, size


def is_bounded(rows: Matrix) -> bool:
    """Bounded means: the rows span space and some combination of all of them with positive factors vanishes."""
    from scipy.optimize import linprog

    count, n = rows.shape
    if count <= n or np.linalg.matrix_rank(rows) < n:
        return False
    # Farkas: a direction in which no row grows exists exactly if there is no such combination.
    answer = linprog(np.ones(count), A_eq=rows.T, b_eq=np.zeros(n), bounds=(1.0, None), method="highs")
    return bool(answer.status == 0)


def _ends(bounds: Matrix, rows: Matrix) -> Matrix | None:
    """Least and greatest coordinates (2, n) of a region; None if a linear program finds none."""
    from scipy.optimize import linprog

    n = rows.shape[1]
    answers = [
        linprog(sign * axis, A_ub=rows, b_ub=bounds, bounds=(None, None), method="highs", options=SHARP)
        for sign in (1.0, -1.0)
        for axis in np.eye(n)
    ]
    if any(answer.status != 0 for answer in answers):
        return None
    return np.array([answer.x[k % n] for k, answer in enumerate(answers)]).reshape(2, n)
