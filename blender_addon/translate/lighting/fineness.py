# SPDX-License-Identifier: GPL-3.0-or-later
"""How well a drawn environment shows the pattern that it is drawn from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from spectral_core.scene import Camera

from .backgrounds import direction_at, pixel_of
from .directions import Array, Look

DIRECTIONS = 2000
"""Directions in which a pattern is compared with its environment."""
SHARP_DIFFERENCE = 0.002
"""Mean difference, as a share of the pattern's mean, from which sharp rays see the pattern itself: blurred edges show
from about there on.
"""
MOST_DIFFERENCE = 0.05
"""Mean difference from which a note names a pattern that cannot be seen itself."""
BRIGHTEST = 10.0
"""Multiple of the mean at which values are cut, because a few bright directions are left to chance."""


def everywhere() -> Array:
    """Random unit directions (n, 3), the same at each call."""
    found = np.random.default_rng(1).normal(size=(DIRECTIONS, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def in_frame(camera: Camera | None, look: Look) -> Array | None:
    """Random unit directions (n, 3) in the frame of a perspective camera; None for other cameras."""
    if camera is None or camera.kind != "perspective":
        return None
    width, height, shift_x, shift_y, _ = look.window
    u, v = np.random.default_rng(2).random((2, DIRECTIONS))
    there = np.stack([(u - 0.5 + shift_x) * width, (v - 0.5 + shift_y) * height, np.ones_like(u)], axis=1)
    found = there @ look.camera_from_world[:3, :3]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def difference(exact: Callable[[Array], Array], directions: Array, rows: int) -> float:
    """Mean difference of a pattern and an environment of ``rows`` rows along directions (n, 3), as a share of the
    pattern's mean.

    ``exact``: the pattern's radiance (n, 3) along directions. The environment need not be drawn: of its pixels only
    those around the directions are computed.
    """
    wanted, found = exact(directions), _interpolated(exact, directions, rows)
    mean = float(np.abs(wanted).mean())
    if mean == 0:
        mean = float(np.abs(found).mean())
    if mean == 0:
        return 0.0
    most = BRIGHTEST * mean
    return float(np.abs(np.clip(wanted, -most, most) - np.clip(found, -most, most)).mean() / mean)


def _interpolated(exact: Callable[[Array], Array], directions: Array, rows: int) -> Array:
    """Radiance (n, 3) between the centers of the pixels of an environment."""
    column, row = pixel_of(directions, rows, 2 * rows)
    left, low = np.floor(column), np.floor(row)
    across, up = (column - left)[:, None], (row - low)[:, None]
    there = [
        direction_at(np.asarray(left + right), np.clip(low + above, 0.0, rows - 1.0), rows)
        for above in (0.0, 1.0)
        for right in (0.0, 1.0)
    ]
    parts = exact(np.concatenate(there)).reshape(4, len(directions), 3)
    below, above = (parts[k] * (1 - across) + parts[k + 1] * across for k in (0, 2))
    return np.asarray(below * (1 - up) + above * up)
