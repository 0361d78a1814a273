# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras: rays of a picture in the index space of a field."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_kind, require_range, require_whole
from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import VOLUME_SOURCES, ScalarVolume

Array = NDArray[np.float64]
LEAST_FOV, GREATEST_FOV = 1e-6, 179.999
"""Degrees: those of every camera of a scene, a narrow part of its picture included."""
GREATEST_SHIFT = 1e12
"""Widths of the picture."""


@read_only_when_copied
@dataclass(frozen=True, eq=False)
class View:
    """A camera and the size of its picture.

    ``world_from_camera`` (4, 4) follows Mitsuba: the camera looks along +z, +y is up, +x points to the left.

    ``fov_deg`` is the angle across the picture's width; None makes it orthographic with ``ortho_width`` world units
    across. Rays of a perspective camera start at the camera, so it may be inside a field; those of an
    orthographic camera come from infinitely far behind it.

    ``shift`` (right, up) moves the picture against the axis of view, in widths of the picture: the lens shift of
    Blender and of view cameras. ``fov_deg`` is that of the picture without it.
    """

    world_from_camera: Array
    width: int = 512
    height: int = 512
    fov_deg: float | None = 30.0
    ortho_width: float = field(default=0.0)
    shift: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "world_from_camera", frozen_array("world_from_camera of a view", self.world_from_camera, (4, 4))
        )
        for name in ("width", "height"):
            require_whole(f"{name} of a view", getattr(self, name), 1, 1 << 20, " pixels")
        if self.fov_deg is None:
            require_range("ortho_width", self.ortho_width, 1e-30, 1e30)
        else:
            _checked_fov(self.fov_deg)
        shift = frozen_array("shift of a view", self.shift, (2,)).tolist()
        for value in shift:
            require_range("shift of a view", value, -GREATEST_SHIFT, GREATEST_SHIFT, " widths")
        object.__setattr__(self, "shift", (shift[0], shift[1]))

    @property
    def key(self) -> tuple[object, ...]:
        """Key of a view under which a plan is cached; equal for equal views."""
        return self.world_from_camera.tobytes(), self.width, self.height, self.fov_deg, self.ortho_width, self.shift

    @classmethod
    def looking(cls, origin: ArrayLike, target: ArrayLike, up: ArrayLike = (0, 0, 1), **rest: Any) -> View:
        """From ``origin`` toward ``target`` (3,), world units; ``up`` must not be parallel to that direction. Rest as
        fields.
        """
        start = frozen_array("origin", origin, (3,))
        ahead = frozen_array("target", target, (3,)) - start
        upward = frozen_array("up", up, (3,))
        side, lengths = np.cross(upward, ahead), np.linalg.norm(upward) * np.linalg.norm(ahead)
        if not lengths or np.linalg.norm(side) < 1e-9 * lengths:
            raise InvalidInputError(
                f"a view from {start.tolist()} along its own up has no horizontal direction; choose another up"
            )
        ahead, side = ahead / np.linalg.norm(ahead), side / np.linalg.norm(side)
        matrix = np.eye(4)
        matrix[:3, :4] = np.stack([side, np.cross(ahead, side), ahead, start], axis=1)
        return cls(matrix, **rest)

    @classmethod
    def around(
        cls,
        volume: ScalarVolume,
        azimuth_deg: float = 35.0,
        elevation_deg: float = 25.0,
        *,
        zoom: float = 1.0,
        **rest: Any,
    ) -> View:
        """Toward the center of ``volume``, far enough to see its whole bounding sphere at ``zoom`` 1."""
        require_kind("the volume", volume, ScalarVolume, VOLUME_SOURCES)
        require_range("zoom", zoom, 1e-6, 1e6)
        for name, angle in (("azimuth_deg", azimuth_deg), ("elevation_deg", elevation_deg)):
            require_range(name, angle, -1e6, 1e6, "°")
        corners = volume.corners_world
        middle = corners.mean(axis=0)
        radius = float(np.linalg.norm(corners - middle, axis=1).max()) / zoom
        azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
        toward = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
        fov = rest.get("fov_deg", 30.0)
        if fov is None:
            rest.setdefault("ortho_width", 2.0 * radius)
            distance = 4.0 * radius
        else:
            distance = radius / np.sin(np.radians(_checked_fov(fov)) / 2)
        # near the poles z is nearly the direction of view; a full turn more shows the same picture
        up = (0.0, 0.0, 1.0) if abs(toward[2]) < np.sin(np.radians(85)) else (0.0, 1.0, 0.0)
        return cls.looking(middle + toward * distance, middle, up, **rest)

    def resized(self, width: int, height: int) -> View:
        """The same camera with another number of pixels."""
        return replace(self, width=width, height=height)

    def rays_world(self) -> tuple[Array, Array]:
        """Start and unit direction of the ray through each pixel's center, both (height, width, 3), world units."""
        x, y = np.meshgrid(*(np.arange(n) + 0.5 for n in (self.width, self.height)))
        start, toward = self._affine(np.eye(4), np.zeros(3))
        o = start[0] + x[..., None] * start[1] + y[..., None] * start[2]
        d = toward[0] + x[..., None] * toward[1] + y[..., None] * toward[2]
        return o, d / np.linalg.norm(d, axis=-1, keepdims=True)

    def index_rays(self, volume: ScalarVolume) -> tuple[Array, float]:
        """Coefficients (3, 3, 3) of the rays in index space, and the distance by which they begin before the point.

        At picture coordinates (x, y) in pixels, point = c[0]·(1, x, y), direction = c[1]·(1, x, y), both in index
        space, and c[2]·(1, x, y) is the direction's world vector; none is normalized. The point lies beside the field's
        center, not at the camera, so that float32 stays exact from any distance. A ray begins at point -
        back·direction; an orthographic one has no beginning (infinite). If the camera is in the field or near it, the
        point is the camera, and back is 0: rays that begin on a face of the field begin exactly there.
        """
        middle = volume.corners_world.mean(axis=0)
        start, toward = self._affine(np.eye(4), middle)
        ahead = self.world_from_camera[:3, 2]
        back = float(ahead @ (middle - self.world_from_camera[:3, 3]))  # directions reach one unit along the axis
        if self.fov_deg is None:
            start = start + np.array([[back], [0], [0]]) * ahead
            back = np.inf
        else:
            start = start + back * toward
        linear = volume.index_from_world[:3, :3]
        points = start @ linear.T
        points[0] += np.array(volume.shape) / 2 - 0.5
        camera = self.origin_index(volume)
        if camera is not None:
            points, back = np.stack([camera, np.zeros(3), np.zeros(3)]), 0.0
        return np.stack([points, toward @ linear.T, toward]), back

    def origin_index(self, volume: ScalarVolume) -> Array | None:
        """The camera (3,) in index space if it is in the field or within its size of it; None elsewhere, and for an
        orthographic camera.
        """
        if self.fov_deg is None:
            return None
        away = self.world_from_camera[:3, 3] - volume.corners_world.mean(axis=0)
        away = volume.index_from_world[:3, :3] @ away
        return away + np.array(volume.shape) / 2 - 0.5 if np.all(np.abs(away) <= volume.shape) else None

    def _affine(self, frame: Array, middle: Array) -> tuple[Array, Array]:
        """Start and direction as rows for (1, x, y), world axes, start relative to ``middle``."""
        side, up, ahead, origin = (self.world_from_camera[:3, c] for c in range(4))
        half = self.ortho_width / 2 if self.fov_deg is None else np.tan(np.radians(self.fov_deg) / 2)
        pixel = 2 * half / self.width
        # +x of the camera points to the left of the picture, as in Mitsuba; rows run downwards.
        left, top = half * (1 - 2 * self.shift[0]), half * (self.height / self.width + 2 * self.shift[1])
        across = np.stack([side * left + up * top, -side * pixel, -up * pixel])
        fixed = np.stack([origin - middle, np.zeros(3), np.zeros(3)])
        along = np.stack([ahead, np.zeros(3), np.zeros(3)])
        return (fixed + across, along) if self.fov_deg is None else (fixed, along + across)

    def mitsuba_sensor(self) -> dict[str, Any]:
        """This camera as a Mitsuba sensor dictionary without film (float64 matrix; needs a variant to be set)."""
        import mitsuba as mi

        matrix = self.world_from_camera.copy()
        if self.fov_deg is not None:
            return {
                "type": "perspective",
                "fov": self.fov_deg,
                "fov_axis": "x",
                "principal_point_offset_x": self.shift[0],
                "principal_point_offset_y": -self.shift[1] * self.width / self.height,
                "to_world": mi.ScalarTransform4f(matrix),
            }
        matrix[:3, 3] += self.ortho_width * (self.shift[1] * matrix[:3, 1] - self.shift[0] * matrix[:3, 0])
        matrix[:3, :2] *= self.ortho_width / 2
        return {"type": "orthographic", "to_world": mi.ScalarTransform4f(matrix)}


def _checked_fov(fov_deg: float) -> float:
    """The angle of view in degrees. Raises InvalidInputError outside ``LEAST_FOV`` to ``GREATEST_FOV``."""
    return require_range("fov_deg", fov_deg, LEAST_FOV, GREATEST_FOV, "°")
