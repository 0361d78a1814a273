# SPDX-License-Identifier: GPL-3.0-or-later
"""Effect of single precision on a picture, measured with rays a few roundings beside those of the picture.

A picture and its reference march the same rays, rounded alike, so that their comparison cannot see it. Where a function
is narrow for the field, or a ray grazes an object, a ten-millionth of the field's size changes what the ray collects.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.view import View

Array = NDArray[np.float64]

_UNIT = 2.0**-24  # relative rounding error of single precision
_ROUNDED = 1.0  # times the unit and the size of the field: how far rounding moves a point of a ray
_ASIDE = 8.0  # times that: how far the other rays are, so that their own rounding hardly counts


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


def beside(view: View, volume: ScalarVolume, x: Array, y: Array) -> tuple[Array, Array, float]:
    """Picture coordinates (x, y) beside those of rays, in pixels, and the dB by which rounding changes colors less."""
    size = float(max(volume.shape))
    (point, along, _), _ = view.index_rays(volume)
    turn = float(np.linalg.norm(along[1]) / np.linalg.norm(along[0]))
    camera = view.origin_index(volume)
    distance = 0.0 if camera is None else float(np.linalg.norm(camera - np.array(volume.shape) / 2 + 0.5))
    voxels_per_pixel = float(np.linalg.norm(point[1])) + (0.5 * size + distance) * turn
    rounded = _ROUNDED * _UNIT * size / voxels_per_pixel
    # Picture coordinates are single precision, too.
    aside = max(_ASIDE * rounded, 4.0 * _UNIT * max(view.width, view.height))
    sign = np.where(np.arange(len(x)) % 2, -1.0, 1.0)
    return x + aside, y + sign * aside, 20.0 * math.log10(aside / rounded)
