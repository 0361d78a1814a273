# SPDX-License-Identifier: GPL-3.0-or-later
"""Effect of single precision on a picture: rays a few roundings beside it, and another rounding of camera and data.

A picture and its reference march the same rays, rounded alike, so that their comparison cannot see it. Where a function
is narrow for the field, or a ray grazes an object, a ten-millionth of the field's size changes what the ray collects.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Array = NDArray[np.float64]

_UNIT = 2.0**-24  # relative rounding error of single precision
_WIDE = 1e-5  # of a part between two knots: a rounding of data that has no effect
# Roundings of data by which knots are shifted. They are in single precision, too, so that one rounding may be none, and
# a shift by two may show other voxels of the same number.
_SHIFTS = (1.0, 2.0)
_ASIDE = 8.0  # roundings: how far the other rays are, so that their own rounding hardly counts


class Rounded(Protocol):
    """The parts of a renderer that tell how it rounds."""

    volume: ScalarVolume
    types: Any

    def rounding_at(self, values: Array) -> Array:
        """Largest rounding error, in data units, of places of the field that have the data ``values`` (n,)."""


def other_roundings(
    renderer: Rounded, view: View, transfer: TransferFunction, x: Array, y: Array
) -> list[tuple[dict[str, Any], float]]:
    """What to change in a march of rays to round otherwise, and the dB by which rounding changes colors less.

    The changes are those of the rays' picture coordinates ``pixels``, of the ``view``, and of the function
    ``transfer``.
    """
    near = tuple(renderer.types.Float64(each) for each in beside(view, renderer.volume, x, y))
    # Where the function has no jump, colors change in proportion to the way. Rays pass an edge, or a tip that grows as
    # the root of the way, in proportion to its root.
    power = 10.0 if has_jump(transfer) else 20.0
    changes: list[tuple[dict[str, Any], float]] = [({"pixels": near}, power * math.log10(_ASIDE))]
    camera = beside_camera(view, renderer.volume)
    changes += [] if camera is None else [({"view": camera}, 0.0)]
    for times in _SHIFTS:
        knots = shifted_knots(transfer, renderer.rounding_at, times)
        changes += [] if knots is None else [({"transfer": knots}, 20.0 * math.log10(times))]
    return changes


def has_jump(transfer: TransferFunction) -> bool:
    """True if the extinction or the emission of a material jumps."""
    for material in transfer.materials:
        same = np.diff(material.values) == 0
        for heights in (material.extinction, material.emission):
            if heights is not None and bool(np.any(np.diff(heights)[same])):
                return True
    return False


def shifted_knots(
    transfer: TransferFunction, rounding_at: Callable[[Array], Array], times: float
) -> TransferFunction | None:
    """The function with each knot moved by ``times`` its rounding; None if all parts between two knots are much wider.

    Data of 32 and 64 bits are stored in single precision. Where a function tells apart values that are stored as one,
    the picture is wrong, and its reference reads the same values. The rounding of a value is in proportion to its size:
    of data over many decades, one shift of all knots would be larger than most of them. A value at a jump stays at it
    or above, since knots are rounded as values are, and those just below may be rounded to it: so knots are moved
    down. Knots that are smaller than their rounding are stored as values around them are, and moved up.
    """
    shifts = [times * rounding_at(material.values) for material in transfer.materials]
    is_wide = [
        np.all(np.maximum(by[:-1], by[1:]) <= _WIDE * np.diff(material.values))
        for material, by in zip(transfer.materials, shifts, strict=True)
    ]
    if all(is_wide):
        return None
    moved = [
        replace(material, values=_moved(material.values, by))
        for material, by in zip(transfer.materials, shifts, strict=True)
    ]
    return replace(transfer, materials=tuple(moved))


def _moved(knots: Array, by: Array) -> Array:
    """Knots (n,) moved down by ``by`` (n,), or up where they are smaller than it, in their order."""
    is_lost = (knots != 0.0) & (by >= np.abs(knots))
    moved: Array = np.maximum.accumulate(knots + np.where(is_lost, by, -by))
    return moved


def beside_camera(view: View, volume: ScalarVolume) -> View | None:
    """The view from the number of single precision on the other side of the camera; None if the camera is exact.

    Rays of a camera in the field begin at the rounded camera. Where extinction is high, all that they show is there,
    and rays that should leave the field at once may begin inside it.
    """
    camera = view.origin_index(volume)
    if camera is None:
        return None
    rounded = camera.astype(np.float32)
    # What double precision has lost of a camera on a face is no distance from the face.
    is_exact = np.abs(camera - rounded) <= 1e-12 * max(volume.shape)
    if is_exact.all():
        return None
    other = np.nextafter(rounded, np.where(camera > rounded, np.inf, -np.inf).astype(np.float32))
    moved = np.where(is_exact, 0.0, other.astype(np.float64) - camera)
    matrix = view.world_from_camera.copy()
    matrix[:3, 3] += volume.world_from_index[:3, :3] @ moved
    return replace(view, world_from_camera=matrix)


def beside(view: View, volume: ScalarVolume, x: Array, y: Array) -> tuple[Array, Array]:
    """Picture coordinates (x, y) beside those of rays, in pixels, by ``_ASIDE`` roundings of a point in the field.

    A rounding is as large as the field along each axis of it. Where voxels are far longer along one axis, it moves a
    ray by far more pixels along that axis than along the others.
    """
    camera_from_index = np.linalg.inv(view.world_from_camera[:3, :3]) @ volume.world_from_index[:3, :3]
    signs = 1 - 2 * (np.arange(len(x))[:, None] >> np.arange(3) & 1)
    moved = (signs * (_ASIDE * _UNIT * np.array(volume.shape))) @ camera_from_index.T
    if view.fov_deg is None:
        pixel = np.full(len(x), view.ortho_width / view.width)
        return x - moved[:, 0] / pixel, y - moved[:, 1] / pixel
    # Points of a ray: depth times these slopes, in the camera's space.
    half = np.tan(np.radians(view.fov_deg) / 2)
    left = 1 - 2 * x / view.width - 2 * view.shift[0]
    up = (1 - 2 * y / view.height) * view.height / view.width + 2 * view.shift[1]
    across = left * half, up * half
    pixel = 2 * half / view.width * _depths(view, volume, x, y)
    right, down = ((moved[:, axis] - across[axis] * moved[:, 2]) / pixel for axis in range(2))
    return x - right, y - down


def _depths(view: View, volume: ScalarVolume, x: Array, y: Array) -> Array:
    """Depths in world units, in the far half of the field, of the rays of a perspective camera."""
    (point, along, _), back = view.index_rays(volume)
    pixels = np.stack([np.ones(len(x)), x, y], axis=-1)
    directions = pixels @ along
    lengths = np.linalg.norm(directions, axis=-1)
    ahead = np.sum((np.array(volume.shape) / 2 - 0.5 - pixels @ point) * directions, axis=-1) / lengths
    depths: Array = np.abs(back + ahead / lengths) + 0.5 * max(volume.shape) / lengths
    return depths
