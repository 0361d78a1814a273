# SPDX-License-Identifier: GPL-3.0-or-later
"""Places of pilot rays in a picture, and their marches: a sample of the visible part, all of its pixels, or a sample
and single pixels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.image import Stepping
from spectral_core.volume.march.march_input import Limits
from spectral_core.volume.pilot.rounding import Rounded, other_roundings
from spectral_core.volume.transfer import TransferFunction
from spectral_core.volume.view import View

Array = NDArray[np.float64]
Pixels = NDArray[np.int64]

Channels = list[NDArray[Any]]
Compared = Callable[[Array, Array], tuple[Array, Array]]

BAND = 1 << 20
"""Pixels that are marched at a time."""
_NEARLY_ALL = 0.999  # of the differences of those pixels: the smallest ones cost as much as the others
_NEGLIGIBLE = 10.0**-9.5  # of a picture's energy: what all differences that are left out have together at most


class RayTracer(Rounded, Protocol):
    """The methods of a renderer that a pilot calls."""

    def shown_corners(self, transfer: TransferFunction) -> Array:
        """World corners (8, 3) of the part of the field that is visible under ``transfer``."""

    def steepest(self, transfer: TransferFunction) -> float:
        """Most that the data value changes over a voxel, where something is visible under ``transfer``."""

    @property
    def sight(self) -> RayTracer:
        """The tracer of the rays that look at every pixel for what a march misses."""

    @property
    def parts(self) -> int:
        """Number of pictures, of which the channels of ``palette`` have equal shares; each has the wanted quality."""

    def palette(self, transfer: TransferFunction) -> Array:
        """Color (n, channels) of each of the n amounts that ``trace`` returns."""

    def trace(
        self, view: View, transfer: TransferFunction, stepping: Stepping, pixels: tuple[Any, Any], limits: Limits
    ) -> Channels:
        """The amounts, transmittance, samples and iterations of the rays through ``pixels``."""


class RaySet:
    """Rays of a picture on the device. What a march of them found is kept, for pilots that add rays to them.

    Parameters
    ----------
    renderer, view, transfer
        What the rays march through.
    x, y
        (n,) picture coordinates in pixels.
    keeps : bool
        False for many rays, whose marches would take much memory.
    first
        An earlier set of the same picture.
    """

    def __init__(
        self,
        renderer: RayTracer,
        view: View,
        transfer: TransferFunction,
        x: Array,
        y: Array,
        *,
        keeps: bool = True,
        first: RaySet | None = None,
    ) -> None:
        self.count, self._renderer, self._keeps = len(x), renderer, keeps
        self._usual: dict[str, Any] = {"view": view, "transfer": transfer, "pixels": on_device(renderer, x, y)}
        self.roundings: list[tuple[dict[str, Any], float]] = [
            ({}, 0.0),
            *other_roundings(renderer, view, transfer, x, y),
        ]
        """What to change in a march to round otherwise, and the dB of ``other_roundings``; first no change."""
        if first is not None:  # a renderer prepares each function once, and knows it by its object
            self.roundings[2:] = first.roundings[2:]
        self._marched: dict[tuple[Stepping, Limits, int], Channels] = {}

    def march(self, stepping: Stepping, limits: Limits, rounding: int = 0) -> Channels:
        """Amounts per material, transmittance, samples and iterations, rounded by one of ``roundings``."""
        key = (stepping, limits, rounding)
        found = self._marched.get(key)
        if found is None:
            found = self._renderer.trace(stepping=stepping, limits=limits, **self._usual | self.roundings[rounding][0])
            if self._keeps:
                self._marched[key] = found
        return found


def on_device(renderer: RayTracer, x: Array, y: Array) -> tuple[Any, Any]:
    """Picture coordinates as arrays that a renderer marches."""
    return renderer.types.Float64(x), renderer.types.Float64(y)


@dataclass(frozen=True)
class Places:
    """Picture coordinates ``x``, ``y`` (n,) of rays, in pixels: first ``sampled`` rays of a sample, then single ones.

    ``weights`` (n,): how much the squared color of each ray counts; 1 for those of the sample outside of the pixels
    ``single`` (m, 2), and 0 inside. ``pixels``: number of those of the visible part. ``is_whole``: they are all taken,
    and none is a sample.
    """

    x: Array
    y: Array
    weights: Array
    sampled: int
    single: Pixels
    pixels: int
    is_whole: bool


def places_with(view: View, corners: Array, count: int, single: Pixels | None = None) -> Places:
    """About ``count`` places over the rectangle that ``corners`` project to, and the centers of the pixels ``single``.

    A ray of the sample counts as much as its share of the pixels that are not single.
    """
    x, y, is_whole = pilot_places(view, corners, count)
    pixels = np.zeros((0, 2), np.int64) if single is None or is_whole else _first_of_each(single)
    weights, n = np.ones(len(x)), len(x)
    first, last = rectangle(view, corners)[2:]
    visible = max(int(np.prod(np.maximum(last - first, 0))), 1)
    if len(pixels):
        flat = np.floor(x).astype(np.int64) * view.height + np.floor(y).astype(np.int64)
        weights = np.where(np.isin(flat, pixels[:, 0] * view.height + pixels[:, 1]), 0.0, 1.0)
        others = max(visible - len(pixels), 1)
        own = max(float(weights.sum()), 1.0) / others
        weights = np.append(weights, np.full(len(pixels), own))
        x, y = np.append(x, pixels[:, 0] + 0.5), np.append(y, pixels[:, 1] + 0.5)
    return Places(x, y, weights, n, pixels, visible, is_whole)


def _first_of_each(pixels: Pixels) -> Pixels:
    """The (n, 2) pixels without repetitions, in their order: marches of the first ones stay those of the first rays."""
    return pixels[np.sort(np.unique(pixels, axis=0, return_index=True)[1])]


def most_apart(view: View, corners: Array, compared: Compared, most: int) -> tuple[Pixels, Array, float]:
    """(n, 2) columns and rows of at most ``most`` pixels in which two pictures differ most, their (n,) differences, and
    the energy of the picture. Differences without effect are left out.

    ``compared`` takes the centers x and y of pixels and returns (pixels,) differences and energies of their colors. It
    is asked for all pixels of the rectangle that ``corners`` project to, some rows at a time; there are none if it is
    beside the picture.
    """
    first, last = rectangle(view, corners)[2:]
    rows = max(4, BAND // max(int(last[0] - first[0]), 1) // 4 * 4)
    found, at, energy = np.zeros(0), np.zeros((0, 2)), 0.0
    for top in range(int(first[1]), int(last[1]), rows) if first[0] < last[0] else ():
        x, y = _in_tiles((int(first[0]), top), (int(last[0]), min(top + rows, int(last[1]))))
        apart, energies = compared(x, y)
        energy += float(np.sum(energies))
        found, at = np.append(found, apart), np.concatenate([at, np.stack([x, y], axis=-1)])
        largest = np.argsort(-found)[:most]
        found, at = found[largest], at[largest]
    counts = (found > _NEGLIGIBLE * energy / most) & (np.cumsum(found) - found < _NEARLY_ALL * found.sum())
    return np.floor(at[counts]).astype(np.int64), found[counts], energy


def missed_by_sample(places: Places, view: View, pixels: Pixels, apart: Array) -> tuple[float, float]:
    """(sum of the differences ``apart`` of ``pixels``, what of it a sample does not expect), single pixels left out.

    A sample that has its share of these pixels measures their error; one that has none of them knows nothing of it.
    """
    flat = pixels[:, 0] * view.height + pixels[:, 1]
    others = ~np.isin(flat, places.single[:, 0] * view.height + places.single[:, 1])
    sample = np.floor(places.x[: places.sampled]).astype(np.int64) * view.height
    sample += np.floor(places.y[: places.sampled]).astype(np.int64)
    stands_for = places.pixels / places.sampled
    whole = float(apart[others].sum())
    return whole, whole - stands_for * float(apart[others & np.isin(flat, sample)].sum())


def is_in_picture(view: View, corners: Array) -> bool:
    """False if the rectangle that ``corners`` project to has no pixel."""
    first, last = rectangle(view, corners)[2:]
    return bool(np.all(first < last))


def rectangle(view: View, corners: Array) -> tuple[Array, Array, Pixels, Pixels]:
    """Least and greatest picture coordinates that ``corners`` project to, in pixels, and its first and last pixels.

    It is empty if they are beside the picture or behind the camera.
    """
    inverse = np.linalg.inv(view.world_from_camera)
    local = corners @ inverse[:3, :3].T + inverse[:3, 3]
    picture = np.array([[0.0, 0.0], [view.width, view.height]])
    axis = picture[1] / 2 + np.array([-view.shift[0], view.shift[1]]) * view.width  # where it meets the picture
    if view.fov_deg is None:
        scale = view.width / view.ortho_width
        places = axis - local[:, :2] * scale
    elif local[:, 2].min() > 1e-3 * local[:, 2].max():
        scale = view.width / (2 * math.tan(math.radians(view.fov_deg) / 2))
        places = axis - local[:, :2] / local[:, 2:] * scale
    elif local[:, 2].max() < 0.0:
        places = picture[:1]
    else:  # the camera is inside the field, or part of the field is behind it
        places = picture
    low, high = np.clip(places.min(0), picture[0], picture[1]), np.clip(places.max(0), picture[0], picture[1])
    first, last = np.floor(low).astype(int), np.ceil(high).astype(int)
    return low, high, first, last


def _in_tiles(first: tuple[int, int], last: tuple[int, int]) -> tuple[Array, Array]:
    """Centers (x, y) of the pixels from ``first`` to before ``last``, in tiles of 4×4: rays of one packet should be
    neighbors.
    """
    row, column = np.mgrid[first[1] : last[1], first[0] : last[0]]
    order = np.lexsort((column.ravel() % 4, row.ravel() % 4, column.ravel() // 4, row.ravel() // 4))
    return column.ravel()[order] + 0.5, row.ravel()[order] + 0.5


def pilot_places(view: View, corners: Array, count: int) -> tuple[Array, Array, bool]:
    """(x, y, True if they are all pixels) of pilot rays, in pixels, over the rectangle that ``corners`` project to.

    ``corners`` (n, 3) in world space. Where the rectangle has about ``count`` pixels or fewer, their centers are taken.
    """
    low, high, first, last = rectangle(view, corners)
    if 0 < np.prod(last - first) <= 1.3 * count:
        return *_in_tiles((int(first[0]), int(first[1])), (int(last[0]), int(last[1]))), True
    index = np.arange(count)
    # A rank-1 lattice: none of its rows or columns is parallel to those of the voxels.
    across = (index * 0.6180339887498949) % 1.0
    down = (index + 0.5) / count
    tiles = max(1, round(math.sqrt(count / 16)))
    order = np.lexsort((across * tiles // 1, down * tiles // 1))
    across, down = across[order], down[order]
    # At centers of pixels: a ray beside them may meet an object of which the picture shows nothing.
    places = low + np.stack([across, down], axis=-1) * (high - low)
    centers = np.clip(np.floor(places), first, np.maximum(last - 1, first)) + 0.5
    return centers[:, 0], centers[:, 1], False
