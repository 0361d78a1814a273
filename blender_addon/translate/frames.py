# SPDX-License-Identifier: GPL-3.0-or-later
"""Coordinate frames without scale, for cameras and lamps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NO_LENGTH = 1e-19
"""Length of an axis up to which it has no direction: its square is 0 in single precision."""

SHEARED = 1e-3
"""Cosine of the angle between two axes above which a matrix counts as sheared."""


def rigid(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same position and local z direction as (4, 4) ``matrix`` with orthogonal axes of length 1, right-handed.

    An object of scale 0 keeps the axes of the world.
    """
    result = np.eye(4)
    result[:3, 3] = matrix[:3, 3]
    length = np.linalg.norm(matrix[:3, 2])
    if length <= NO_LENGTH:
        return result
    toward = matrix[:3, 2] / length
    across = matrix[:3, 0] - toward * (toward @ matrix[:3, 0])
    if np.linalg.norm(across) <= NO_LENGTH:
        across = np.cross([0.0, 1.0, 0.0] if abs(toward[1]) < 0.9 else [1.0, 0.0, 0.0], toward)
    across = across / np.linalg.norm(across)
    result[:3, :3] = np.stack([across, np.cross(toward, across), toward], axis=1)
    return result


def is_sheared(matrix: NDArray[np.float64]) -> bool:
    """True if the axes of (4, 4) ``matrix`` are not at right angles, as of a child of an object that is stretched."""
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.all(lengths > NO_LENGTH):
        return False
    axes = matrix[:3, :3] / lengths
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() > SHEARED)
