# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradient magnitudes: central differences in world space, the same in slabs of any size, and within their memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from spectral_core.volume import gradient as module
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.gradient import gradient_magnitude

SHEARED = np.array([[1.0, 0.4, 0.1], [0.0, -0.7, 0.3], [0.2, 0.0, 1.5]])


def by_loops(data: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """|∇f| voxel by voxel: differences between neighbors, over their distance, solved for the world's slope."""
    found = np.zeros(data.shape)
    for place in np.ndindex(data.shape):
        slopes = np.zeros(3)
        for axis in range(3):
            before, after = list(place), list(place)
            before[axis], after[axis] = max(place[axis] - 1, 0), min(place[axis] + 1, data.shape[axis] - 1)
            if after[axis] > before[axis]:
                rise = float(data[tuple(after)]) - float(data[tuple(before)])
                slopes[axis] = rise / (after[axis] - before[axis])
        # f(index) changes by slopes · d(index), and a step of the world is matrix · d(index)
        found[place] = np.linalg.norm(np.linalg.solve(matrix.T, slopes))
    return found


@pytest.mark.parametrize("slab", [1, 40, 1 << 18])
@pytest.mark.parametrize("shape", [(7, 5, 6), (1, 4, 3), (2, 1, 5), (1, 1, 1)])
@pytest.mark.parametrize(("kind", "scale"), [(np.uint8, 200.0), (np.float32, 1e30), (np.float64, 1e-100)])
def test_magnitudes_are_those_of_differences_in_the_world(monkeypatch, slab, shape, kind, scale):
    monkeypatch.setattr(module, "_SLAB", slab)
    matrix = np.eye(4)
    matrix[:3, :3] = 1e-3 * SHEARED
    data = (scale * np.random.default_rng(3).random(shape)).astype(kind)
    found = gradient_magnitude(ScalarVolume("noise", data, matrix)).data
    expected = by_loops(data, matrix[:3, :3])
    assert found.dtype == (np.float64 if scale < 1 and expected.any() else np.float32)
    assert np.abs(found - expected).max() <= 2e-6 * expected.max()


def test_it_needs_little_memory_beside_the_result():
    """It took 56 bytes per voxel, 8 GB for 512³ voxels; the result has 4."""
    volume = ScalarVolume("noise", np.random.default_rng(0).integers(0, 255, (128, 128, 128)).astype(np.uint8))
    assert volume.value_range[1] > 0
    tracemalloc.start()
    gradient_magnitude(volume)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 12 * volume.data.size
