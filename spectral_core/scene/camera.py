# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera and film."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import read_only_when_copied, require_declared, require_range, require_whole
from spectral_core.errors import InvalidInputError, UnknownNameError, counted
from spectral_core.scene.geometry import affine

LEAST_VIEW_RAD = 1e-7
"""Least field of view: 24 bits tell the directions of its pixels apart no more below this."""
GREATEST_VIEW_RAD = np.pi - 1e-4
"""Greatest field of view of a flat picture."""
MOST_EXPOSURE = 1e30
"""Greatest factor on the radiance of a picture."""


@dataclass(frozen=True, slots=True)
class Aperture:
    """Shape of the aperture: ``blades`` corners (a circle below 3), rotated, ``ratio`` times as high as wide."""

    blades: int = 0
    rotation_rad: float = 0.0
    ratio: float = 1.0

    def __post_init__(self) -> None:
        require_declared(self)
        require_range("aperture blades", self.blades, 0, 1000)
        require_range("aperture rotation", self.rotation_rad, -1e6, 1e6, " rad")
        require_range("aperture ratio", self.ratio, 1e-3, 1e3)


PANORAMAS = {
    "equirectangular": 4,
    "fisheye_equidistant": 1,
    "fisheye_equisolid": 4,
    "fisheye_polynomial": 8,
    "mirror_ball": 0,
    "cube_face": 0,
    "cylinder": 4,
}
"""Number of parameters of each kind of panorama."""


@dataclass(frozen=True, slots=True)
class Panorama:
    """View direction for each position in the picture, as in Blender's panoramic cameras.

    ``numbers`` by kind, angles in rad, lengths in mm: ``equirectangular``: least and largest longitude, least and
    largest latitude. ``fisheye_equidistant``: field of view. ``fisheye_equisolid``: lens, field of view, width and
    height of the sensor. ``fisheye_polynomial``: coefficients 0 to 4, field of view, width and height of the sensor.
    ``cylinder``: least and largest longitude, least and largest height over the radius.
    """

    kind: str
    numbers: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_declared(self)
        if self.kind not in PANORAMAS:
            raise UnknownNameError.among("kind of panorama", self.kind, PANORAMAS)
        if len(self.numbers) != PANORAMAS[self.kind]:
            raise InvalidInputError(
                f"a panorama of kind {self.kind!r} has {counted(len(self.numbers), 'number')}; expected "
                f"{PANORAMAS[self.kind]}"
            )
        for value in self.numbers:
            require_range("panorama number", value, -1e9, 1e9)

    @property
    def least_side_rad(self) -> float:
        """Smallest angle that a side of the picture covers, at most 1."""
        given = self.numbers
        if self.kind in ("equirectangular", "cylinder"):
            sides: tuple[float, ...] = (given[1] - given[0], given[3] - given[2])
        else:
            of_kind = {"fisheye_equidistant": 0, "fisheye_equisolid": 1, "fisheye_polynomial": 5}
            sides = (given[of_kind[self.kind]],) if self.kind in of_kind else ()
        return min(1.0, *(max(abs(side), 1e-6) for side in sides)) if sides else 1.0


_AXES = {
    "": ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
    "mirror_ball": ((1, 0, 0), (0, 0, 1), (0, 1, 0)),
}
"""Axes of the space Camera of shading programs by kind of panorama, "" for none, in the camera's own axes."""
_OF_PANORAMAS = ((0, 0, -1), (-1, 0, 0), (0, 1, 0))


def space_from_camera(panorama: Panorama | None) -> NDArray[np.float64]:
    """Matrix (4, 4) from a camera's own axes to the space that shading programs know as the camera's, as in Cycles.

    The camera looks along +z there; a panoramic one along +x, with +z up, and a mirror ball along -y.
    """
    turned = np.eye(4)
    turned[:3, :3] = _AXES.get("" if panorama is None else panorama.kind, _OF_PANORAMAS)
    return turned


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Camera:
    """Blender's camera: looks along its local -Z, +Y up.

    ``field_of_view_rad``: full angle over the frame's larger side if ``sensor_fit`` is ``"auto"``, else over its width
    or height. ``orthographic_scale``: extent over that same side, in world units. ``shift``: fraction of that same side
    by which the picture's center moves right and up. ``aperture_radius``: 0 for no depth of field. ``panorama``:
    projection of a panoramic camera; its shift is a fraction of each side, its field of view that of its center.
    """

    world_from_camera: NDArray[np.float64]
    kind: Literal["perspective", "orthographic", "panoramic"] = "perspective"
    field_of_view_rad: float = np.radians(40.0)
    orthographic_scale: float = 6.0
    sensor_fit: Literal["auto", "width", "height"] = "auto"
    shift: tuple[float, float] = (0.0, 0.0)
    aperture_radius: float = 0.0
    focus_distance: float = 10.0
    near: float = 0.1
    far: float = 1000.0
    aperture: Aperture = Aperture()
    panorama: Panorama | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_camera", affine("camera", self.world_from_camera))
        require_declared(self)
        require_range("field_of_view_rad", self.field_of_view_rad, LEAST_VIEW_RAD, GREATEST_VIEW_RAD, " rad")
        require_range("aperture_radius", self.aperture_radius, 0.0, 1e9)
        require_range("focus_distance", self.focus_distance, 1e-9, 1e12)
        require_range("orthographic_scale", self.orthographic_scale, 1e-12, 1e12)
        if len(self.shift) != 2:
            raise InvalidInputError(f"camera shift is {self.shift}; expected two numbers, right and up")
        for value in self.shift:
            require_range("camera shift", value, -1e6, 1e6)
        require_range("camera near", self.near, 1e-30, 1e30)
        require_range("camera far", self.far, 1e-30, 1e30)
        if not 0 < self.near < self.far:
            raise InvalidInputError(f"camera clips at {self.near:g} and {self.far:g}; expected 0 < near < far")
        if (self.kind == "panoramic") != (self.panorama is not None):
            raise InvalidInputError("a camera of kind 'panoramic' needs a panorama, and no other has one")

    @property
    def space_from_world(self) -> NDArray[np.float64]:
        """Matrix (4, 4) from the world to the space Camera of shading programs.

        Any inverse serves for a singular matrix, because making the camera's rays raises an error.
        """
        return np.asarray(space_from_camera(self.panorama) @ np.linalg.pinv(self.world_from_camera))

    def window(self, film: Film) -> tuple[float, ...]:
        """Width and height of the frame, the shift of its center in widths and heights, and 1 for a perspective.

        Lengths are those at distance 1 for a perspective, and at any distance for an orthographic camera.
        """
        width, height = float(film.width), float(film.height) * film.pixel_aspect
        side = {"auto": max(width, height), "width": width, "height": height}[self.sensor_fit]
        perspective = self.kind == "perspective"
        size = 2 * float(np.tan(self.field_of_view_rad / 2)) if perspective else float(self.orthographic_scale)
        share_x, share_y = width / side, height / side
        shift = self.shift[0] / share_x, self.shift[1] / share_y
        return size * share_x, size * share_y, *shift, 1.0 if perspective else 0.0


@dataclass(frozen=True, slots=True)
class Film:
    """Size and sampling of the picture.

    ``crop``: (left, bottom, width, height) in pixels of the full frame, y upward, or None. ``samples`` per pixel.
    ``pixel_aspect``: height of a pixel over its width. ``transparent``: the camera does not see the environment.
    ``transparent_glass``: the same through smooth glass, if the film is transparent.
    ``filter_width``: full width of the pixel filter, in pixels. ``exposure``: factor on the linear picture.
    """

    width: int
    height: int
    samples: int = 64
    seed: int = 0
    crop: tuple[int, int, int, int] | None = None
    pixel_aspect: float = 1.0
    transparent: bool = False
    transparent_glass: bool = False
    filter_width: float = 1.5
    exposure: float = 1.0
    filter_kind: Literal["blackman_harris", "gaussian", "box"] = "blackman_harris"

    def __post_init__(self) -> None:
        require_declared(self)
        for name in ("width", "height"):
            object.__setattr__(self, name, require_whole(f"film {name}", getattr(self, name), 1, 65536, " pixels"))
        object.__setattr__(self, "samples", require_whole("samples per pixel", self.samples, 1, 1 << 24))
        object.__setattr__(self, "seed", require_whole("seed", self.seed, -(1 << 63), (1 << 63) - 1))
        require_range("pixel_aspect", self.pixel_aspect, 1e-6, 1e6)
        require_range("filter_width", self.filter_width, 1e-6, 1e3, " pixels")
        require_range("exposure", self.exposure, 0.0, MOST_EXPOSURE)
        if self.crop is not None:
            sides = tuple(require_whole("a number of the crop", side, 0, 65536, " pixels") for side in self.crop)
            if len(sides) != 4:
                raise InvalidInputError(
                    f"crop {self.crop} has {counted(len(sides), 'number')}; expected left, bottom, width, height"
                )
            left, bottom, width, height = sides
            object.__setattr__(self, "crop", sides)
            if (
                min(left, bottom) < 0
                or min(width, height) < 1
                or left + width > self.width
                or bottom + height > self.height
            ):
                raise InvalidInputError(
                    f"crop {self.crop} (left, bottom, width, height) does not lie inside the film of "
                    f"{self.width}×{self.height} pixels"
                )

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the rendered part: the crop, or the whole frame."""
        return (self.crop[2], self.crop[3]) if self.crop else (self.width, self.height)
