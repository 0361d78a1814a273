# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of a view as plain numbers, the size of its picture, and the number of its samples."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import frozen_array, read_only_when_copied, require_range
from spectral_core.errors import InvalidInputError
from spectral_core.render.lens.camera_rays import camera_frame
from spectral_core.scene import Aperture, Camera, Film, Panorama
from spectral_core.scene.camera import PANORAMAS, space_from_camera

Array = NDArray[np.float64]

PLAIN_NUMBERS = 24
"""Numbers of every view; those of a panorama come after them."""
NUMBERS = PLAIN_NUMBERS + max(PANORAMAS.values())
"""Length of ``Viewpoint.numbers``."""
MOST_PIXELS = 1 << 26
"""Most pixels of a view; larger than any display."""


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """Camera and window of a view.

    ``world_from_view``: (4, 4) with unit axes; the view looks along its -Z, +Y up. ``low``, ``high``: (2,) corners of
    the picture on the plane at distance 1 (perspective), in world units (orthographic) or as shares of the camera's
    picture (with a ``panorama``). ``near``, ``far``: clipping distances; near may be negative for an orthographic
    view. ``lens_radius``: 0 for a pinhole; ``aperture``: its shape.
    """

    world_from_view: Array
    low: Array
    high: Array
    is_perspective: bool
    near: float
    far: float
    lens_radius: float = 0.0
    focus_distance: float = 1.0
    aperture: Aperture = field(default_factory=Aperture)
    panorama: Panorama | None = None

    def __post_init__(self) -> None:
        set_field = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        set_field("world_from_view", frozen_array("world from view", self.world_from_view, (4, 4)))
        for name in ("low", "high"):
            set_field(name, frozen_array(f"view {name}", getattr(self, name), (2,)))
        if not np.all(self.high > self.low):
            raise InvalidInputError(f"the view's window from {self.low} to {self.high} is empty")
        if not (np.isfinite([self.near, self.far]).all() and self.near < self.far):
            raise InvalidInputError(f"the view clips at {self.near:g} and {self.far:g}; expected near < far")
        if self.is_perspective and self.near < 0:
            raise InvalidInputError(
                f"the view begins at {self.near:g}; a perspective view must begin in front of the camera"
            )

    @classmethod
    def of_camera(cls, camera: Camera, film: Film) -> Viewpoint:
        """The view of a render of the whole film. Raises InvalidInputError for a singular camera matrix."""
        frame = camera_frame(camera, film)
        placed = np.eye(4)
        placed[:3] = np.stack([frame.right, frame.up, frame.back, frame.origin], axis=1)
        lens = (camera.aperture_radius, camera.focus_distance)
        shape = (camera.aperture, camera.panorama)
        return cls(placed, frame.low, frame.high, camera.kind == "perspective", camera.near, camera.far, *lens, *shape)

    @property
    def numbers(self) -> NDArray[np.float32]:
        """(NUMBERS,): origin, right, up, back, low, high, perspective (1 or 0), near, length, lens radius, focus
        distance, blades of the lens, their turn, its ratio, then the numbers of the panorama.
        """
        axes = self.world_from_view[:3]
        rest = (float(self.is_perspective), self.near, self.far - self.near, self.lens_radius, self.focus_distance)
        shape = (self.aperture.blades, self.aperture.rotation_rad, self.aperture.ratio)
        numbers = np.zeros(NUMBERS, np.float32)
        known = np.concatenate([axes[:, 3], *axes[:, :3].T, self.low, self.high, rest, shape])
        numbers[:PLAIN_NUMBERS] = known
        if self.panorama is not None:
            numbers[PLAIN_NUMBERS : PLAIN_NUMBERS + len(self.panorama.numbers)] = self.panorama.numbers
        return numbers

    @property
    def kind(self) -> str:
        """Type of the panorama, "" for none: the mapping of its rays."""
        return "" if self.panorama is None else self.panorama.kind

    @property
    def camera_from_world(self) -> Array:
        """(4, 4) to the space that shading programs know as the camera's."""
        return np.asarray(space_from_camera(self.panorama) @ np.linalg.inv(self.world_from_view))

    @property
    def window(self) -> tuple[float, ...]:
        """Width and height of the picture at distance 1, its shift as a share of the size, and 1 for perspective."""
        size, middle = self.high - self.low, (self.high + self.low) / 2
        return (*size, *(middle / size), 1.0 if self.is_perspective else 0.0)

    def moved(self, shift: Array) -> Viewpoint:
        """The view of a scene that was moved by ``-shift`` (3,)."""
        if not shift.any():
            return self
        placed = self.world_from_view.copy()
        placed[:3, 3] -= shift
        return replace(self, world_from_view=placed)

    def scaled(self, factor: float) -> Viewpoint:
        """The view of a scene that is larger by a factor."""
        if factor == 1.0:
            return self
        placed = self.world_from_view.copy()
        placed[:3, 3] *= factor
        window = 1.0 if self.is_perspective or self.panorama is not None else factor
        names = ("near", "far", "lens_radius", "focus_distance")
        lengths = {name: getattr(self, name) * factor for name in names}
        return replace(self, world_from_view=placed, low=self.low * window, high=self.high * window, **lengths)

    @property
    def eye(self) -> Array:
        """(3,) where the ray through the middle of the picture begins; the lens of a panorama."""
        axes, middle = self.world_from_view, (self.low + self.high) / 2
        across = middle * self.near if self.is_perspective else middle
        start = (0.0, 0.0, 0.0) if self.panorama is not None else (*across, -self.near)
        return np.asarray(axes[:3, :3] @ start + axes[:3, 3])

    def same_as(self, other: Viewpoint | None) -> bool:
        """True if another viewpoint gives the same picture."""
        return other is not None and self.kind == other.kind and np.array_equal(self.numbers, other.numbers)


@dataclass(frozen=True, slots=True, eq=False)
class ViewRequest:
    """A requested picture.

    ``stage``: the scene's stage. ``width``, ``height`` in pixels. ``samples``: per pixel, after which the view is
    complete. ``generation``: number of the request, returned with the pictures. ``exposure``: factor on the picture.
    ``border``: left, bottom, width and height in pixels of the part that is traced; None for all. ``denoise``: True to
    denoise full pictures.
    """

    stage: str
    viewpoint: Viewpoint
    width: int
    height: int
    samples: int
    generation: int
    exposure: float = 1.0
    border: tuple[int, int, int, int] | None = None
    denoise: bool = False

    def __post_init__(self) -> None:
        require_range("view width", self.width, 1, 65536, " pixels")
        require_range("view height", self.height, 1, 65536, " pixels")
        require_range("view pixels", self.width * self.height, 1, MOST_PIXELS)
        require_range("view samples", self.samples, 1, 1 << 24)
        require_range("view exposure", self.exposure, 0.0, 1e30)
        low, size = np.array(self.part[:2]), np.array(self.part[2:])
        if low.min() < 0 or size.min() < 1 or np.any(low + size > (self.width, self.height)):
            raise InvalidInputError(
                f"the border {self.border} is outside of a view of {self.width} × {self.height} pixels; "
                "expected left, bottom, width and height within it"
            )

    @property
    def part(self) -> tuple[int, int, int, int]:
        """Left, bottom, width and height in pixels of the part that is traced."""
        return self.border or (0, 0, self.width, self.height)
