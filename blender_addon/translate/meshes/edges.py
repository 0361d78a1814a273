# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of edges at the vertices, as Blender gives them to Cycles: means in the attribute's own type."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.spectra.color import display_rgb_from_linear, linear_from_display_rgb

Array = NDArray[Any]

SMALL_SINE = 0.0005
"""Below this sine of half its angle, Blender reads no rotation."""


def at_vertices(source: Any, values: Array, data_type: str) -> Array:
    """Values (v, k) at the vertices of values (e, k) of edges: means, of whole numbers rounded; true where an edge is.

    Bytes are averaged as they are stored, encoded as sRGB, and rounded down; rotations as axes times angles.
    """
    if data_type == "BYTE_COLOR":
        return _linear(np.floor(_means(source, np.rint(255.0 * _encoded(values)))) / 255.0)
    if data_type == "QUATERNION":
        return _quaternions(_means(source, _turns(values.astype(np.float64))))
    means = _means(source, values)
    if data_type == "BOOLEAN":
        return (means > 0).astype(np.float32)
    if data_type in ("INT", "INT8"):
        means = np.copysign(np.floor(np.abs(means) + 0.5), means)  # halves away from zero
    return means.astype(np.float32)


def _means(source: Any, values: Array) -> Array:
    ends = np.empty(2 * len(source.edges), dtype=np.int32)
    source.edges.foreach_get("vertices", ends)
    count, each = len(source.vertices), np.repeat(values, 2, axis=0)
    sums = np.stack([np.bincount(ends, column, minlength=count) for column in each.T], axis=1)
    return sums / np.maximum(np.bincount(ends, minlength=count), 1)[:, None]


def _encoded(color: Array) -> Array:
    """Linear colors (n, 4) as sRGB; alpha stays."""
    return np.concatenate([display_rgb_from_linear(color[:, :3]), color[:, 3:]], axis=1)


def _linear(color: Array) -> Array:
    """Colors (n, 4) in sRGB as linear ones; alpha stays."""
    return np.concatenate([linear_from_display_rgb(color[:, :3]), color[:, 3:]], axis=1).astype(np.float32)


def _turns(rotation: Array) -> Array:
    """Axes (n, 3) times angles of quaternions (n, 4)."""
    sine = np.linalg.norm(rotation[:, 1:], axis=1)
    is_none = sine < SMALL_SINE
    angle = np.where(is_none, 0.0, 2.0 * np.arctan2(sine, rotation[:, 0]))
    return rotation[:, 1:] * (angle / np.where(is_none, 1.0, sine))[:, None]


def _quaternions(turn: Array) -> Array:
    angle = np.linalg.norm(turn, axis=1)
    axis = turn / np.where(angle == 0, 1.0, angle)[:, None]
    half = 0.5 * (np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)
    return np.concatenate([np.cos(half)[:, None], axis * np.sin(half)[:, None]], axis=1).astype(np.float32)
