# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of a 3D viewport: its own view, orthographic or in perspective, or a camera with the viewport's zoom."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.live.view import Viewpoint

from ..camera import aperture_of, lens_of
from ..camera.panorama import panorama_of

Array = NDArray[np.float64]


def viewpoint_of(region_data: Any, space: Any, camera: Any, scene: Any) -> Viewpoint:
    """The viewpoint of a ``RegionView3D`` of a 3D view; ``camera``: its evaluated camera, or None.

    ``scene``: evaluated, whose picture a panorama fills. Lens, zoom, offset and shift are all in the view's matrices.
    Clipping, depth of field, blades and panorama are the camera's if the view uses one.
    """
    projection = np.array(region_data.window_matrix, dtype=np.float64)
    placed = np.linalg.inv(np.array(region_data.view_matrix, dtype=np.float64))
    low, high = window_of(projection, is_perspective=bool(region_data.is_perspective))
    through_camera = region_data.view_perspective == "CAMERA" and camera is not None and camera.type == "CAMERA"
    clips = camera.data if through_camera else space
    near, far = float(clips.clip_start), float(max(clips.clip_end, clips.clip_start * 2))
    if not region_data.is_perspective and not through_camera:
        near = -far  # an orthographic view without a camera begins behind its center
    is_perspective, placed = bool(region_data.is_perspective), with_unit_axes(placed)
    if not through_camera:
        return Viewpoint(placed, low, high, is_perspective, near, far)
    radius, focus = lens_of(camera)
    aperture, panorama = aperture_of(camera.data.dof), None
    if camera.data.type == "PANO":
        panorama, is_perspective = panorama_of(camera.data, scene.render), False
        low, high = shares_of_picture(camera.data, scene, low), shares_of_picture(camera.data, scene, high)
    return Viewpoint(placed, low, high, is_perspective, near, far, radius, focus, aperture, panorama)


def border_of(region_data: Any, space: Any, camera: Any, scene: Any) -> Array | None:
    """(2, 2) low and high corner of the render border (Ctrl-B) as shares of the view; None without one.

    In a camera view it is the border of the scene's renders, in others one of the view's own. ``camera``, ``scene``:
    evaluated.
    """
    through_camera = region_data.view_perspective == "CAMERA" and camera is not None and camera.type == "CAMERA"
    owner = scene.render if through_camera else space
    if not (owner.use_border if through_camera else owner.use_render_border):
        return None
    names = ("border_min", "border_max") if through_camera else ("render_border_min", "render_border_max")
    border = np.array([[getattr(owner, f"{name}_{axis}") for axis in "xy"] for name in names], dtype=np.float64)
    if not through_camera:
        return border
    projection = np.array(region_data.window_matrix, dtype=np.float64)
    low, high = window_of(projection, is_perspective=bool(region_data.is_perspective))
    frame_low, frame_high = frame_of(camera.data, scene, is_perspective=bool(region_data.is_perspective))
    place = frame_low + border * (frame_high - frame_low)
    return (place - low) / (high - low)


def pixels_of(border: Array, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left, bottom, width and height of a border in a view of ``size`` pixels, cut off at its sides; at least one
    pixel.
    """
    low, high = np.clip(np.rint(border * size), 0, size).astype(int)
    low = np.minimum(low, np.array(size) - 1)
    width, height = np.maximum(high - low, 1)
    return int(low[0]), int(low[1]), int(width), int(height)


def frame_of(lens: Any, scene: Any, *, is_perspective: bool) -> tuple[Array, Array]:
    """Lower left and upper right corner of a camera's frame, at distance 1 or in world units; with its shift."""
    corners = np.array(lens.view_frame(scene=scene), dtype=np.float64)
    flat = corners[:, :2] / (-corners[:, 2:] if is_perspective else 1.0)
    return flat.min(axis=0), flat.max(axis=0)


def shares_of_picture(lens: Any, scene: Any, place: Array) -> Array:
    """Where a point of the view at distance 1 is in the picture of the camera whose frame Blender draws.

    Blender draws a panoramic camera's frame as that of a camera in perspective with the same lens and shift.
    """
    low, high = frame_of(lens, scene, is_perspective=True)
    shares: Array = (place - low) / (high - low) + np.array([lens.shift_x, lens.shift_y])
    return shares


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
