# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradients of a field at its voxels, for two-dimensional transfer functions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.volume.field import ScalarVolume

_LEAST_SINGLE, _GREATEST_SINGLE = 1e-30, 1e38  # greatest values of data that float32 holds with most of their range


def gradient_magnitude(volume: ScalarVolume) -> ScalarVolume:
    """|∇f| by central differences (one-sided at faces), in data units per world unit, on the same grid.

    It is float32, or float64 where float32 does not hold such values. Between voxels it is trilinear, as the field is.
    The second axis of a two-dimensional transfer function reads it. It needs some 20 bytes per voxel during its
    computation.
    """
    data = volume.data.astype(np.float32 if volume.data.dtype.itemsize <= 2 else np.float64)
    low, high = volume.value_range
    # A power of two, which causes no rounding: the data may be far beyond the range of float32.
    unit = 2.0 ** (math.frexp(max(-low, high))[1] - 1)
    np.divide(data, unit, out=data)
    per_index = np.zeros((3, *volume.shape), np.float32)
    for axis in range(3):
        if volume.shape[axis] > 1:
            per_index[axis] = np.gradient(data, axis=axis)
    # A gradient is a covector: ∂f/∂world_a = Σ_b ∂f/∂index_b · ∂index_b/∂world_a.
    world_from_index_gradient = volume.index_from_world[:3, :3].T
    square = np.zeros(volume.shape, np.float64)
    for row in world_from_index_gradient:
        square += np.tensordot(row, per_index, axes=1) ** 2
    magnitude: NDArray[Any] = np.sqrt(square) * unit
    greatest = float(magnitude.max())
    if greatest == 0.0 or _LEAST_SINGLE <= greatest <= _GREATEST_SINGLE:
        magnitude = magnitude.astype(np.float32)
    magnitude.setflags(write=False)
    return ScalarVolume(f"gradient of {volume.name}", magnitude, volume.world_from_index)
