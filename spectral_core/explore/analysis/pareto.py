# SPDX-License-Identifier: GPL-3.0-or-later
"""The Pareto front: rows that no other row beats in every objective."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.errors import InvalidInputError


def pareto_front(objectives: ArrayLike) -> NDArray[np.int64]:
    """Indices of rows (m, k) that no other row is below or equal in all objectives and below in one; all are minimized.

    Rows with a missing value are never on the front.
    """
    values = np.asarray(objectives, np.float64)
    if values.ndim != 2:
        raise InvalidInputError(f"objectives have shape {values.shape}; expected (rows, objectives)")
    candidates = np.flatnonzero(np.isfinite(values).all(axis=1))
    # by the first objective upwards, so that a row can only be beaten by one before it
    order = candidates[np.lexsort(values[candidates].T[::-1])]
    front: list[int] = []
    for row in order:
        kept = values[front]
        beaten = (kept <= values[row]).all(axis=1) & (kept < values[row]).any(axis=1) if front else np.zeros(0, bool)
        if not beaten.any():
            front.append(int(row))
    return np.array(sorted(front), np.int64)
