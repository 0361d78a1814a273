# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices that are split where their corners differ, and equal rows of numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def split_corners(corners: Array, attributes: Array, vertex_count: int) -> tuple[Array, Array]:
    """New vertex of each corner, and one corner of each new vertex; equal vertices have equal attributes.

    ``corners``: (c,) vertex of each corner; ``attributes``: (c, k) float32. Vertices keep their order and the
    attributes of their first corner; corners that differ from it follow. A loose vertex takes corner 0.
    """
    first = np.zeros(vertex_count, dtype=np.int64)
    first[corners[::-1]] = np.arange(len(corners))[::-1]
    differs = np.flatnonzero(_rows_differ(attributes, np.take(first, corners)))
    if differs.size == 0:
        return corners.astype(np.int64), first
    representative = same_rows(np.take(corners, differs), np.take(attributes, differs, axis=0))
    vertex_of_corner = corners.astype(np.int64)
    vertex_of_corner[differs] = vertex_count + representative[1]
    return vertex_of_corner, np.concatenate([first, differs[representative[0]]])


def _rows_differ(rows: Array, others: Array) -> Array:
    """True for rows that differ from the row in ``others``; (n,) bool."""
    differs = np.zeros(len(rows), dtype=bool)
    for column in rows.T:  # column by column: no temporary of full size
        differs |= column != np.take(column, others)
    return differs


def same_rows(vertices: Array, attributes: Array) -> tuple[Array, Array]:
    """(index of one row of each group, group of each row); a row is a vertex with its attributes.

    Rows are compared by a 64-bit hash, then checked: if two groups collide, every row becomes a group.
    """
    words = np.ascontiguousarray(attributes, dtype=np.float32).view(np.uint32).astype(np.uint64)
    with np.errstate(over="ignore"):
        digest = vertices.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        for column in words.T:
            digest = (digest ^ column) * np.uint64(0xBF58476D1CE4E5B9)
            digest ^= digest >> np.uint64(29)
    _, one, kind = np.unique(digest, return_index=True, return_inverse=True)
    kind = kind.reshape(-1)
    same = np.take(one, kind)
    if np.any(vertices != np.take(vertices, same)) or np.any(_rows_differ(attributes, same)):
        one = kind = np.arange(len(vertices))
    return one, kind
