# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms between two instants, as Cycles interpolates them: by the shortest turn, all else along straight lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

Array = NDArray[np.float64]
Key = TypeVar("Key")


def around(keys: Sequence[Key], parts: int, time: float) -> tuple[Key, Key, float]:
    """The evaluated instants before and after a time, and its share of the way; what stands still has the middle."""
    last = len(keys) - 1
    if parts == 0:
        return keys[last // 2], keys[last // 2], 0.0
    number = min(int(time * parts), parts - 1)
    return keys[number * last // parts], keys[(number + 1) * last // parts], time * parts - number


def between(first: Array, last: Array, share: float) -> Array:
    """The transform (4, 4) a ``share`` of the time from the first to the last; rotation, scale and shear apart."""
    if share <= 0.0 or np.array_equal(first, last):
        return first
    turns, stretches = zip(*(_parts(matrix[:3, :3]) for matrix in (first, last)), strict=True)
    turned = np.array(turns[0].slerp(turns[1], share).to_matrix(), dtype=np.float64)
    result = first * (1 - share) + last * share
    result[:3, :3] = turned @ (stretches[0] * (1 - share) + stretches[1] * share)
    return result


def _parts(matrix: Array) -> tuple[Any, Array]:
    """Rotation (a quaternion), and the scale and shear before it (3, 3), upper triangular."""
    axes, stretch = np.linalg.qr(matrix)
    signs = np.where(np.diag(stretch) < 0, -1.0, 1.0)
    axes, stretch = axes * signs, stretch * signs[:, None]
    if np.linalg.det(axes) < 0:
        axes, stretch = -axes, -stretch
    return Matrix(axes.tolist()).to_quaternion(), stretch
