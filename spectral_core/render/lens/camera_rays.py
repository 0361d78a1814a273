# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera as plain numbers: from a point of the picture and a point of the lens to a ray.

The same numbers serve the just-in-time renderer (Dr.Jit arrays) and tests (NumPy arrays): the arithmetic is written
once for both types of array.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.errors import InvalidInputError
from spectral_core.render.lens.panorama import NumPyMath, direction_of
from spectral_core.scene import Camera, Film


@dataclass(frozen=True, slots=True, eq=False)
class CameraFrame:
    """Position, axes and window of a camera, the data of its rays.

    ``right``, ``up``, ``back``: unit axes (3,) in world space. ``low``, ``high``: (2,) corners of the full frame on
    the plane at distance 1 (perspective), in world units (orthographic) or of the picture (panoramic).
    """

    origin: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    back: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    camera: Camera


def is_singular(camera: Camera) -> bool:
    """True if the matrix of a camera has no three directions."""
    return abs(float(np.linalg.det(camera.world_from_camera[:3, :3]))) < 1e-30


def camera_frame(camera: Camera, film: Film) -> CameraFrame:
    """Axes and window of Blender's camera on a film; scale and shear of its matrix are left out, as Blender does.

    Raises InvalidInputError for a matrix without directions.
    """
    axes = camera.world_from_camera[:3, :3]
    if is_singular(camera):
        raise InvalidInputError(
            "the camera's matrix is singular, so it has no view direction; give it a scale other than 0"
        )
    back = axes[:, 2] / np.linalg.norm(axes[:, 2])
    up = axes[:, 1] - back * (axes[:, 1] @ back)
    up /= np.linalg.norm(up)
    right = np.cross(up, back)
    right *= np.sign(right @ axes[:, 0])  # a mirrored camera gives a mirrored picture

    if camera.panorama is not None:  # positions in the picture, shifted by shares of its size
        low = np.asarray(camera.shift, dtype=np.float64)
        return CameraFrame(camera.world_from_camera[:3, 3], right, up, back, low, low + 1, camera)
    width, height, across, up_by, _ = camera.window(film)
    half, center = np.array([width, height]) / 2, np.array([across * width, up_by * height])
    return CameraFrame(camera.world_from_camera[:3, 3], right, up, back, center - half, center + half, camera)


def rays(
    frame: CameraFrame, picture: Any, lens: Any, vector: Any, number: Callable[[float], Any] = float, m: Any = NumPyMath
) -> tuple[Any, Any, Any]:
    """Origin, unit direction and length of rays (a ray ends at the far clip, and starts at the near one).

    ``picture``: two arrays in [0, 1], right and up over the full frame; ``lens``: two arrays, a point in the unit
    disk; ``vector``: makes a 3-vector of three arrays (``mi.Vector3f``); ``number``: what a number of the camera
    becomes (an opaque Dr.Jit value, so that a moving camera needs no new kernel); ``m``: see ``panorama``. A ray of
    length 0 looks nowhere.
    """
    camera, near = frame.camera, number(frame.camera.near)
    x = picture[0] * number(frame.high[0] - frame.low[0]) + number(frame.low[0])
    y = picture[1] * number(frame.high[1] - frame.low[1]) + number(frame.low[1])
    if camera.panorama is not None:
        return _panoramic(frame, (x, y), lens, vector, number, m)
    lens_x = lens_y = 0.0 * x
    tilt_x = tilt_y = 0.0
    if camera.aperture_radius > 0:
        radius, focus = number(camera.aperture_radius), number(camera.focus_distance)
        lens_x, lens_y = lens[0] * radius, lens[1] * radius
        tilt_x, tilt_y = lens_x / focus, lens_y / focus
    if camera.kind == "perspective":
        start_x, start_y = lens_x, lens_y
        toward_x, toward_y = x - tilt_x, y - tilt_y
    else:
        start_x, start_y = x + lens_x, y + lens_y
        toward_x, toward_y = 0.0 * x - tilt_x, 0.0 * y - tilt_y
    per_depth = (1.0 + toward_x * toward_x + toward_y * toward_y) ** 0.5

    def in_world(local: tuple[Any, Any, Any]) -> list[Any]:
        return _in_world(frame, local, number)

    direction = vector(*in_world((toward_x / per_depth, toward_y / per_depth, -1.0 / per_depth)))
    start = in_world((start_x + near * toward_x, start_y + near * toward_y, 0.0 * x - near))
    origin = vector(*(part + number(frame.origin[i]) for i, part in enumerate(start)))
    return origin, direction, per_depth * number(camera.far - camera.near)


def _panoramic(
    frame: CameraFrame, picture: Any, lens: Any, vector: Any, number: Callable[[float], Any], m: Any
) -> tuple[Any, Any, Any]:
    """Rays of a panoramic camera; its lens lies across each ray of its own."""
    camera = frame.camera
    assert camera.panorama is not None
    near = number(camera.near)
    toward, is_seen = direction_of(camera.panorama, picture, m, number)
    start: tuple[Any, Any, Any] = (0.0 * toward[0], 0.0 * toward[0], 0.0 * toward[0])
    if camera.aperture_radius > 0:
        radius, focus = number(camera.aperture_radius), number(camera.focus_distance)
        start, toward = across_lens(toward, (radius * lens[0], radius * lens[1]), focus, m)
    begin = tuple(offset + near * part for offset, part in zip(start, toward, strict=True))
    origin = [part + number(frame.origin[i]) for i, part in enumerate(_in_world(frame, begin, number))]
    length = m.where(is_seen, 0.0 * toward[0] + number(camera.far - camera.near), 0.0)
    return vector(*origin), vector(*_in_world(frame, toward, number)), length


def across_lens(toward: Any, lens: Any, focus: Any, m: Any) -> tuple[Any, Any]:
    """Start and direction of a panorama's ray through a point of its lens, which lies across each ray of its own.

    ``toward``: unit direction in the camera's space, three arrays; ``lens``: two arrays, in world units.
    """
    # the two axes across the ray: the vertical axis without its component along the ray, and their cross product
    depth = (toward[2] * toward[0], toward[2] * toward[1], toward[2] * toward[2] - 1.0)
    size = m.maximum(m.sqrt(sum(part * part for part in depth)), 1e-9)
    first = tuple(part / size for part in depth)
    second = _cross(toward, first)
    start = tuple(lens[0] * a + lens[1] * b for a, b in zip(first, second, strict=True))
    aim = tuple(focus * part - offset for part, offset in zip(toward, start, strict=True))
    length = m.sqrt(sum(part * part for part in aim))
    return start, tuple(part / length for part in aim)


def _in_world(frame: CameraFrame, local: Any, number: Callable[[float], Any]) -> list[Any]:
    """World components of a direction in the camera's space."""
    axes = [[number(axis[i]) for axis in (frame.right, frame.up, frame.back)] for i in range(3)]
    return [sum(part * axis for part, axis in zip(local, row, strict=True)) for row in axes]


def _cross(a: Any, b: Any) -> tuple[Any, Any, Any]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
