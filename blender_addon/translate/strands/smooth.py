# SPDX-License-Identifier: GPL-3.0-or-later
"""Points between those of a strand: as many as its bends need."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STRAIGHT = 0.125
"""Distance of a strand from its smooth curve, over its radius, above which points are added."""
_TIP = 0.1
"""Least radius that counts, over the largest of the strand: tips need no more points than the rest."""


def alike(
    lengths: NDArray[Any], points: Array, radii: Array, most: int
) -> Iterator[tuple[NDArray[Any], NDArray[Any], int]]:
    """Strands with equal numbers of points and of points to add: their numbers, the rows (count, k) of their points,
    and the points to add in each gap, at most ``most``.
    """
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(int)
    for length in np.unique(lengths[lengths > 1]):
        numbers = np.flatnonzero(lengths == length)
        rows = starts[numbers][:, None] + np.arange(length)
        wanted = _points_to_add(points[rows], radii[rows], most)
        for between in np.unique(wanted):
            yield numbers[wanted == between], rows[wanted == between], int(between)


def _points_to_add(strand: Array, radii: Array, most: int) -> NDArray[np.int64]:
    """Points to add in each gap of strands (count, k, 3), so that they follow their smooth curve, (count,)."""
    if most == 0 or strand.shape[1] < 3:
        return np.zeros(len(strand), np.int64)
    first, last = 2 * strand[:, :1] - strand[:, 1:2], 2 * strand[:, -1:] - strand[:, -2:-1]
    padded = np.concatenate([first, strand, last], axis=1)
    a, b, c, d = (padded[:, k : padded.shape[1] - 3 + k] for k in range(4))
    # distance of the curve from the middle of a gap; it falls with the square of the parts of the gap
    away = np.linalg.norm(b + c - a - d, axis=2) / 16
    allowed = STRAIGHT * np.maximum(np.minimum(radii[:, :-1], radii[:, 1:]), _TIP * radii.max(axis=1, keepdims=True))
    parts = np.sqrt(np.max(away / np.maximum(allowed, 1e-30), axis=1))
    return np.clip(np.ceil(np.nan_to_num(parts, posinf=most + 1.0)) - 1, 0, most).astype(np.int64)


def smooth(values: Array, between: int) -> Array:
    """Catmull and Rom's curve through the points (count, k, …), ``between`` more in each gap."""
    first, last = 2 * values[:, :1] - values[:, 1:2], 2 * values[:, -1:] - values[:, -2:-1]
    padded = np.concatenate([first, values, last], axis=1)
    a, b, c, d = (padded[:, k : padded.shape[1] - 3 + k, None] for k in range(4))
    t = (np.arange(between + 1) / (between + 1))[None, None, :, None]
    curve = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - 3 * c + d - a) * t**3)
    count, gaps = curve.shape[:2]
    return np.concatenate([curve.reshape(count, gaps * (between + 1), -1), values[:, -1:]], axis=1)


def straight(values: Array, between: int) -> Array:
    """Values (count, k, 3) at the points of strands, and in equal steps at ``between`` more in each gap."""
    t = (np.arange(between + 1) / (between + 1))[:, None]
    gaps = values[:, :-1, None] * (1 - t) + values[:, 1:, None] * t
    return np.concatenate([gaps.reshape(len(values), -1, values.shape[2]), values[:, -1:]], axis=1)
