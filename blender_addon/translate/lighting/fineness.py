# SPDX-License-Identifier: GPL-3.0-or-later
"""How well a drawn environment shows the pattern that it is drawn from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from spectral_core.scene import Camera, ImageTexture

from .backgrounds import looked_up
from .directions import Array, Look

DIRECTIONS = 2000
"""Directions in which a pattern is compared with its environment."""
MOST_DIFFERENCE = 0.05
"""Mean difference, as a share of the pattern's mean, from which a note names it."""
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


def difference(drawn: ImageTexture, directions: Array, exact: Callable[[Array], Array]) -> float:
    """Mean difference of an environment and its pattern along directions (n, 3), as a share of the pattern's mean.

    ``exact``: the pattern's radiance (n, 3) along directions.
    """
    wanted, found = exact(directions), looked_up(drawn, directions)
    mean = float(np.abs(wanted).mean())
    if mean == 0:
        mean = float(np.abs(found).mean())
    if mean == 0:
        return 0.0
    most = BRIGHTEST * mean
    return float(np.abs(np.clip(wanted, -most, most) - np.clip(found, -most, most)).mean() / mean)
