# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradients of a field at its voxels, for two-dimensional transfer functions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import require_kind
from spectral_core.volume.field import VOLUME_SOURCES, ScalarVolume

_LEAST_SINGLE, _GREATEST_SINGLE = 1e-30, 1e38  # greatest values of data that float32 holds with most of their range
_SLAB = 1 << 18  # voxels whose gradient is computed at a time


def gradient_magnitude(volume: ScalarVolume) -> ScalarVolume:
    """|∇f| by central differences (one-sided at faces), in data units per world unit, on the same grid.

    It is float32, or float64 where float32 does not hold such values. Between voxels it is trilinear, as the field is.
    The second axis of a two-dimensional transfer function reads it. It is computed in slabs, so that its computation
    needs little beside the result: 4 bytes per voxel, or 12 where it is float64.
    """
    require_kind("the volume", volume, ScalarVolume, VOLUME_SOURCES)
    low, high = volume.value_range
    # Powers of two, which cause no rounding: the data may be far beyond the range of float32, and voxels of any size.
    unit = 2.0 ** (math.frexp(max(-low, high))[1] - 1)
    # A gradient is a covector: ∂f/∂world_a = Σ_b ∂f/∂index_b · ∂index_b/∂world_a.
    world_from_index_gradient = volume.index_from_world[:3, :3].T
    steepness = 2.0 ** math.frexp(float(np.abs(world_from_index_gradient).max()))[1]
    magnitude: NDArray[Any] = np.empty(volume.shape, np.float32)
    slabs = _slabs(volume.shape)
    for first, last in slabs:
        magnitude[first:last] = _in_slab(volume, unit, world_from_index_gradient / steepness, first, last)
    greatest = float(magnitude.max()) * unit * steepness
    if greatest == 0.0 or _LEAST_SINGLE <= greatest <= _GREATEST_SINGLE:
        for first, last in slabs:
            magnitude[first:last] = magnitude[first:last].astype(np.float64) * unit * steepness
    else:
        magnitude = magnitude.astype(np.float64)
        magnitude *= unit
        magnitude *= steepness
    magnitude.setflags(write=False)
    return ScalarVolume(f"gradient of {volume.name}", magnitude, volume.world_from_index)


def _slabs(shape: tuple[int, int, int]) -> list[tuple[int, int]]:
    """First and last row along x, the last one excluded, of parts of about ``_SLAB`` voxels."""
    rows = max(1, _SLAB // (shape[1] * shape[2]))
    return [(first, min(first + rows, shape[0])) for first in range(0, shape[0], rows)]


def _in_slab(volume: ScalarVolume, unit: float, matrix: NDArray[np.float64], first: int, last: int) -> NDArray[Any]:
    """The magnitude in the rows from ``first`` to before ``last``, of data in ``unit``, with ``matrix`` (3, 3)."""
    begin, end = max(first - 1, 0), min(last + 1, volume.shape[0])
    data = volume.data[begin:end].astype(np.float32 if volume.data.dtype.itemsize <= 2 else np.float64)
    np.divide(data, unit, out=data)
    inner = slice(first - begin, last - begin)
    per_index = np.zeros((3, last - first, *volume.shape[1:]), np.float32)
    for axis in range(3):
        if volume.shape[axis] > 1:
            per_index[axis] = np.gradient(data, axis=axis)[inner]
    square = np.zeros(per_index.shape[1:], np.float64)
    for row in matrix:
        square += np.tensordot(row, per_index, axes=1) ** 2
    return np.asarray(np.sqrt(square))
