# SPDX-License-Identifier: GPL-3.0-or-later
"""Statistics of a field per brick, independent of the transfer function: range, slope and second difference.

A brick of edge B contains the cells between voxel centers [bB, (b+1)B] on each axis, so B + 1 voxels per axis determine
it; the outer half voxel of the field belongs to the outermost bricks. ``edge`` 1 with ``centered`` makes one brick per
voxel around its center instead, like the thesis' volume of filtered gradient magnitudes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume

Array = NDArray[Any]
LARGE = 1e37
"""Largest number of a field whose differences and gradients fit into single precision, in which bricks are kept."""


@dataclass(frozen=True, eq=False)
class BrickStatistics:
    """Per brick, arrays of shape (bz, by, bx): x last, as the renderer reads them.

    ``low`` and ``high`` bound the field in the brick, ``slope`` bounds its gradient magnitude in data units per
    voxel, ``second_difference`` is the greatest second difference along an axis, data units per voxel². Single
    precision, but for fields of numbers above ``LARGE``.
    """

    edge: int
    centered: bool
    low: Array
    high: Array
    slope: Array
    second_difference: Array

    @property
    def shape(self) -> tuple[int, int, int]:
        """Bricks along (z, y, x)."""
        bz, by, bx = self.low.shape
        return bz, by, bx


def brick_statistics(volume: ScalarVolume, edge: int) -> BrickStatistics:
    """Statistics of ``volume`` in bricks of ``edge`` voxels; slabs of bricks at a time, so memory stays small."""
    data = volume.data.transpose(2, 1, 0)
    layers = _brick_count(data.shape[0], edge)
    # About 16 million voxels at a time, so that temporaries do not grow with the field.
    per_slab = max(1, (1 << 24) // (edge * data.shape[1] * data.shape[2]))
    slabs = [_slab(data, edge, first, min(first + per_slab, layers)) for first in range(0, layers, per_slab)]
    low, high, slope, second_difference = (np.concatenate(parts) for parts in zip(*slabs, strict=True))
    return BrickStatistics(edge, False, low, high, slope, second_difference)


def voxel_statistics(volume: ScalarVolume, window: int) -> BrickStatistics:
    """One brick per voxel: range of the cells around it, and the greatest central-difference gradient magnitude
    within ``window`` voxels, the thesis' rank filter (section 4.2). ``second_difference`` is zero, because
    the rule does not use it.
    """
    from scipy import ndimage

    data = volume.data.transpose(2, 1, 0)
    data = data.astype(np.float64 if _is_large(data) else np.float32)
    slope = np.zeros_like(data)
    for axis in range(3):
        if data.shape[axis] > 1:
            slope = np.hypot(slope, np.gradient(data, axis=axis))  # their squares may exceed float32
    slope = ndimage.maximum_filter(slope, size=2 * window + 1, mode="nearest")
    low = ndimage.minimum_filter(data, size=3, mode="nearest")
    high = ndimage.maximum_filter(data, size=3, mode="nearest")
    return BrickStatistics(1, True, low, high, slope, np.zeros_like(data))


def _brick_count(voxels: int, edge: int) -> int:
    return max(1, -(-(voxels - 1) // edge))


def _slab(data: NDArray[Any], edge: int, first: int, last: int) -> tuple[Array, Array, Array, Array]:
    """Statistics of the brick layers [first, last) along z."""
    depth = data.shape[0]
    # Cells share their corners, so a brick of B cells reads B + 1 voxels.
    start, stop = first * edge, min(last * edge + 1, depth)
    part = data[start:stop]
    is_large = _is_large(part)
    wide, kept = (np.float64, np.float64) if is_large else (_wide(data.dtype), np.float32)
    # One voxel more on either side, if it exists, for the second differences at the slab's faces.
    before, after = max(start - 1, 0), min(stop + 1, depth)
    padded: NDArray[Any] = data[before:after].astype(wide, copy=False)
    along_axes = [_second_difference(padded, axis)[start - before : stop - before] for axis in range(3)]
    second_difference = _reduce(np.maximum.reduce(along_axes), edge, np.maximum)
    slope = np.zeros(second_difference.shape, kept)
    inner = padded[start - before : stop - before]
    for axis in range(3):
        if inner.shape[axis] > 1:
            rise = np.abs(np.diff(inner, axis=axis))
            # Greatest rise along each axis, combined as if all three occurred at one point: an upper bound of the
            # gradient.
            slope = np.hypot(slope, _reduce(rise, edge, np.maximum, edges_along=axis).astype(kept))
    low, high = _reduce(part, edge, np.minimum), _reduce(part, edge, np.maximum)
    if not is_large:
        low, high = _single(low, -np.inf), _single(high, np.inf)
    return low, high, slope, second_difference.astype(kept)


def _is_large(data: NDArray[Any]) -> bool:
    return data.dtype.kind == "f" and float(max(data.max(), -data.min())) > LARGE


def _single(bound: NDArray[Any], outward: float) -> Array:
    """As float32, rounded outward if float32 cannot represent the value."""
    rounded: Array = bound.astype(np.float32)
    if bound.dtype.itemsize < 4 or bound.dtype == np.float32:
        return rounded
    # A bound must not shrink: 2^24 + 1 rounds to a smaller float32, and a brick would lose its largest value.
    return np.where(rounded.astype(np.float64) == bound, rounded, np.nextafter(rounded, np.float32(outward)))


def _wide(dtype: np.dtype[Any]) -> type:
    """A type for differences of ``dtype`` without overflow."""
    if dtype.kind in "iu":
        return np.int16 if dtype.itemsize == 1 else np.int32 if dtype.itemsize == 2 else np.float64
    return np.float64 if dtype.itemsize == 8 else np.float32


def _second_difference(data: NDArray[Any], axis: int) -> NDArray[Any]:
    """|f[i-1] - 2 f[i] + f[i+1]| along ``axis``; at a face, where the field is level beyond, |f[1] - f[0]|."""
    out = np.zeros_like(data)
    if data.shape[axis] == 1:
        return out
    rise = np.diff(data, axis=axis)
    moved, filled = np.moveaxis(rise, axis, 0), np.moveaxis(out, axis, 0)
    filled[0], filled[-1] = np.abs(moved[0]), np.abs(moved[-1])
    np.abs(moved[1:] - moved[:-1], out=filled[1:-1])
    return out


def _reduce(data: NDArray[Any], edge: int, pick: np.ufunc, edges_along: int | None = None) -> NDArray[Any]:
    """``pick`` over the voxels of each brick, both faces included; along ``edges_along`` data lie on cell edges."""
    for axis in range(3):
        moved = np.moveaxis(data, axis, 0)
        cells = len(moved) if axis == edges_along else len(moved) - 1
        starts = range(0, max(cells, 1), edge)
        width = edge if axis == edges_along else edge + 1
        layers = [pick.reduce(moved[start : start + width], axis=0) for start in starts] if axis < 2 else None
        reduced = np.stack(layers) if layers is not None else _reduce_last(moved, len(starts), edge, width, pick)
        data = np.moveaxis(reduced, 0, axis)
    return data


def _reduce_last(moved: NDArray[Any], bricks: int, edge: int, width: int, pick: np.ufunc) -> NDArray[Any]:
    """The same along the fastest axis: whole strided slices, because a reduction over few neighbors is slow."""
    missing = (bricks - 1) * edge + width - len(moved)
    if missing > 0:
        moved = np.concatenate([moved, np.repeat(moved[-1:], missing, axis=0)])
    reduced = moved[: (bricks - 1) * edge + 1 : edge]
    for offset in range(1, width):
        reduced = pick(reduced, moved[offset : offset + (bricks - 1) * edge + 1 : edge])
    return reduced
