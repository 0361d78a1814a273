# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera as plain numbers: from a point of the picture and a point of the lens to a ray.

The same few numbers drive the just-in-time renderer (``rays``, Dr.Jit arrays) and tests (``rays``, NumPy arrays): the
arithmetic is written once over whichever array type comes in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.scene import Camera, Film


@dataclass(frozen=True, slots=True, eq=False)
class CameraFrame:
    """What a ray needs.

    ``right``, ``up``, ``back``: unit axes (3,) in world space. ``low``, ``high``: (2,) corners of the full frame on
    the plane at distance 1 (perspective) or in world units (orthographic).
    """

    origin: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    back: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    camera: Camera


def camera_frame(camera: Camera, film: Film) -> CameraFrame:
    """Axes and window of Blender's camera on a film; scale and shear of its matrix are left out, as Blender does.

    Raises InvalidInputError for a matrix without directions.
    """
    axes = camera.world_from_camera[:3, :3]
    if abs(np.linalg.det(axes)) < 1e-30:
        raise InvalidInputError("the camera's matrix is singular, so it looks nowhere; give it a scale other than 0")
    back = axes[:, 2] / np.linalg.norm(axes[:, 2])
    up = axes[:, 1] - back * (axes[:, 1] @ back)
    up /= np.linalg.norm(up)
    right = np.cross(up, back)
    right *= np.sign(right @ axes[:, 0])  # a mirrored camera gives a mirrored picture

    width, height = float(film.width), film.height * film.pixel_aspect
    side = {"auto": max(width, height), "width": width, "height": height}[camera.sensor_fit]
    extent = 2 * np.tan(camera.field_of_view_rad / 2) if camera.kind == "perspective" else camera.orthographic_scale
    half = np.array([width, height]) / side * extent / 2
    center = np.asarray(camera.shift) * extent
    return CameraFrame(camera.world_from_camera[:3, 3], right, up, back, center - half, center + half, camera)


def rays(frame: CameraFrame, picture: Any, lens: Any, vector: Any) -> tuple[Any, Any, Any]:
    """Origin, unit direction and length of rays (a ray ends at the far clip, and starts at the near one).

    ``picture``: two arrays in [0, 1], right and up over the full frame; ``lens``: two arrays, a point in the unit
    disk; ``vector``: makes a 3-vector of three arrays (``mi.Vector3f``).
    """
    camera = frame.camera
    x = picture[0] * float(frame.high[0] - frame.low[0]) + float(frame.low[0])
    y = picture[1] * float(frame.high[1] - frame.low[1]) + float(frame.low[1])
    lens_x, lens_y = lens[0] * camera.aperture_radius, lens[1] * camera.aperture_radius
    focus = camera.focus_distance
    if camera.kind == "perspective":
        start_x, start_y = lens_x, lens_y
        toward_x, toward_y = x - lens_x / focus, y - lens_y / focus
    else:
        start_x, start_y = x + lens_x, y + lens_y
        toward_x, toward_y = -lens_x / focus, -lens_y / focus
    per_depth = (1.0 + toward_x * toward_x + toward_y * toward_y) ** 0.5
    direction = _combine(frame, vector, toward_x / per_depth, toward_y / per_depth, -1.0 / per_depth)
    start = _combine(
        frame, vector, start_x + camera.near * toward_x, start_y + camera.near * toward_y, -camera.near + 0 * x
    )
    origin = vector(*(start[i] + float(frame.origin[i]) for i in range(3)))
    return origin, direction, per_depth * (camera.far - camera.near)


def _combine(frame: CameraFrame, vector: Any, x: Any, y: Any, z: Any) -> Any:
    return vector(*(x * float(frame.right[i]) + y * float(frame.up[i]) + z * float(frame.back[i]) for i in range(3)))
