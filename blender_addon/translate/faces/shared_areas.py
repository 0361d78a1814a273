# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of boxes that intersect, and the areas that triangles of one plane share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def touching(boxes: NDArray[Any], group: Indices, limit: int) -> tuple[Indices, Indices]:
    """Pairs (one, other) of boxes (n, 2, d) of one group that intersect; some are left out beyond ``limit``."""
    if len(boxes) < 2:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    low, high = boxes[:, 0], boxes[:, 1]
    least = float(low[:, 0].min())
    start = group * (1.01 * (float(high[:, 0].max()) - least) + 1.0) - least
    begins = start + low[:, 0]
    order = np.argsort(begins)
    counts = np.searchsorted(begins[order], (start + high[:, 0])[order], side="right") - np.arange(len(order)) - 1
    counts = np.where(np.cumsum(counts) > limit, 0, np.maximum(counts, 0))
    one = np.repeat(np.arange(len(order)), counts)
    other = np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts) + one + 1
    one, other = order[one], order[other]
    for axis in range(1, boxes.shape[2]):
        meet = (low[one, axis] <= high[other, axis]) & (low[other, axis] <= high[one, axis])
        one, other = one[meet], other[meet]
    return one, other


def shared_areas(first: Array, second: Array, step: float) -> tuple[Array, Array]:
    """Areas (p,) that pairs of triangles (p, 3, 2) share, and the middle (p, 2) of the border of what they share.

    Triangles that reach into each other by less than ``step`` share nothing.
    """
    areas, centers = np.zeros(len(first)), np.zeros((len(first), 2))
    first, second = _counterclockwise(first), _counterclockwise(second)
    deep = np.flatnonzero(_depth(first, second) > step)
    deep = deep[_depth(second[deep], first[deep]) > step]
    if not len(deep):
        return areas, centers
    origin = second[deep, :1]
    first, second = first[deep] - origin, second[deep] - origin
    # Green's theorem over the edges of each that lie in the other; of edges in common, those of the second count
    area, middle, length = _border_within(first, second, -step)
    more = _border_within(second, first, step)
    areas[deep] = np.maximum(area + more[0], 0.0)
    centers[deep] = (middle + more[1]) / np.maximum(length + more[2], 1e-300)[:, None] + origin[:, 0]
    return areas, centers


def _border_within(inner: Array, outer: Array, margin: float) -> tuple[Array, Array, Array]:
    """Twice the area's integral, the first moment and the length of the border (p, 3, 2) inside of another triangle."""
    step_on = np.roll(inner, -1, axis=1) - inner
    low, high = np.zeros(inner.shape[:2]), np.ones(inner.shape[:2])
    for corner in range(3):
        base, side = _edge(outer, corner)
        at, slope = _cross(side, inner - base) + margin, _cross(side, step_on)
        cut = -at / np.where(slope == 0.0, 1.0, slope)
        low = np.where(slope > 0.0, np.maximum(low, cut), low)
        high = np.where(slope < 0.0, np.minimum(high, cut), high)
        high = np.where((slope == 0.0) & (at < 0.0), -1.0, high)
    kept = high > low
    start, end = inner + low[..., None] * step_on, inner + high[..., None] * step_on
    length = np.where(kept, np.linalg.norm(end - start, axis=2), 0.0)
    moment = (length[..., None] * (start + end)).sum(axis=1) / 2
    return np.where(kept, _cross(start, end), 0.0).sum(axis=1) / 2, moment, length.sum(axis=1)


def _depth(first: Array, second: Array) -> Array:
    """How far (p,) second triangles reach across the edge of the first ones that separates the two best."""
    least = np.full(len(first), np.inf)
    for corner in range(3):
        base, side = _edge(first, corner)
        least = np.minimum(least, _cross(side, second - base).max(axis=1))
    return least


def _edge(triangles: Array, corner: int) -> tuple[Array, Array]:
    """A corner (p, 1, 2), and the direction from it to the next one."""
    base = triangles[:, corner, None]
    side = triangles[:, (corner + 1) % 3, None] - base
    return base, side / np.maximum(np.linalg.norm(side, axis=2, keepdims=True), 1e-300)


def _counterclockwise(triangles: Array) -> Array:
    a, b, c = (triangles[:, corner] for corner in range(3))
    return np.where((_cross(b - a, c - a) < 0.0)[:, None, None], triangles[:, ::-1], triangles)


def _cross(one: Array, other: Array) -> Array:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])
