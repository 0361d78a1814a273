# SPDX-License-Identifier: GPL-3.0-or-later
"""The march's minimum, maximum, bounds and growth of steps, and tables aligned for packet loads."""

import numpy as np
import pytest

from spectral_core.llvm_library import use_newest_llvm
from spectral_core.volume.march.arithmetic import bounded, larger, smaller, step_growth
from spectral_core.volume.march.device.voxels import aligned

pytest.importorskip("drjit")
use_newest_llvm()


def test_minimum_maximum_and_bounds_equal_those_of_numpy(rng):
    import drjit.llvm as types

    a, b = (rng.normal(size=1000).astype(np.float32) for _ in range(2))
    x, y = types.Float(a), types.Float(b)
    assert np.array_equal(larger(x, y).numpy(), np.maximum(a, b))
    assert np.array_equal(smaller(x, y).numpy(), np.minimum(a, b))
    assert np.array_equal(bounded(x, -0.5, 0.25).numpy(), np.clip(a, np.float32(-0.5), np.float32(0.25)))
    assert (larger(1.0, 2.0), smaller(1.0, 2.0), bounded(3.0, 0.0, 1.0)) == (2.0, 1.0, 1.0)


def test_the_growth_of_steps_is_accurate_enough():
    import drjit.llvm as types

    values = np.logspace(-6, 0, 500).astype(np.float32)
    assert np.allclose(step_growth(types, types.Float(values)).numpy(), values**-0.3125, rtol=0.05)


def test_tables_are_aligned_so_that_one_load_reads_a_record(rng):
    for size in (8, 24, 1000):
        values = rng.random(size).astype(np.float32)
        placed = aligned(values)
        assert placed.ctypes.data % 64 == 0 and np.array_equal(placed, values)
