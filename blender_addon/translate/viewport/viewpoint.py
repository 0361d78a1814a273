# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of a 3D viewport: its own view, orthographic or in perspective, or a camera with the viewport's zoom."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.live.view import Viewpoint

from ..camera import lens_of

Array = NDArray[np.float64]


def viewpoint_of(region_data: Any, space: Any, camera: Any) -> Viewpoint:
    """The viewpoint of a ``RegionView3D`` of a 3D view; ``camera``: its evaluated camera, or None.

    Lens, zoom, offset and shift are all in the view's matrices. Clipping and depth of field are the camera's if the
    view uses one.
    """
    projection = np.array(region_data.window_matrix, dtype=np.float64)
    placed = np.linalg.inv(np.array(region_data.view_matrix, dtype=np.float64))
    low, high = window_of(projection, is_perspective=bool(region_data.is_perspective))
    through_camera = region_data.view_perspective == "CAMERA" and camera is not None and camera.type == "CAMERA"
    clips = camera.data if through_camera else space
    near, far = float(clips.clip_start), float(max(clips.clip_end, clips.clip_start * 2))
    if not region_data.is_perspective and not through_camera:
        near = -far  # an orthographic view without a camera begins behind its center
    radius, focus = lens_of(camera) if through_camera else (0.0, 1.0)
    return Viewpoint(with_unit_axes(placed), low, high, bool(region_data.is_perspective), near, far, radius, focus)


def window_of(projection: Array, *, is_perspective: bool) -> tuple[Array, Array]:
    """Lower left and upper right corner of the picture, on the plane at distance 1 or in world units."""
    if is_perspective:
        middle, scale = projection[:2, 2], np.array([projection[0, 0], projection[1, 1]])
        return (-1 + middle) / scale, (1 + middle) / scale
    middle, scale = projection[:2, 3], np.array([projection[0, 0], projection[1, 1]])
    return (-1 - middle) / scale, (1 - middle) / scale


def with_unit_axes(matrix: Array) -> Array:
    """The same directions and position, with axes of length 1."""
    result = np.eye(4)
    result[:3, :3] = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    result[:3, 3] = matrix[:3, 3]
    return result
