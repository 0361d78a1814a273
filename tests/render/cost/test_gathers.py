# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels use the gathers of the processor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mitsuba")


def test_kernels_gather_with_the_processors_instruction():
    """Where it is missing, kernels compile and run in twice the time, and nothing else tells."""
    from spectral_core.render import gathers
    from spectral_core.render.variant import activate, choose_backend

    mi = activate(choose_backend("rgb"))
    import drjit as dr

    has_gathers = "avx2" in _flags()
    assert gathers.use_gathers() == has_gathers
    numbers = np.random.default_rng(3).permutation(1000).astype(np.uint32)
    table, places = mi.UInt32(numbers), mi.UInt32(numbers[::-1].copy())
    wanted = places % 3 != 0
    dr.eval(table, places)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        found = dr.gather(mi.UInt32, table, places, wanted)
        dr.eval(found)
        kernel = dr.kernel_history()[-1]["ir"].getvalue()
    assert ("+fast-gather" in kernel) == has_gathers
    np.testing.assert_array_equal(np.array(found), np.where(numbers[::-1] % 3, numbers[numbers[::-1]], 0))


def _flags() -> list[str]:
    """What the processor can do; none where Linux does not tell, as for processors by ARM."""
    told = Path("/proc/cpuinfo")
    if not told.exists():
        pytest.skip("the processor's features are read from /proc/cpuinfo")
    lines = [line for line in told.read_text("utf-8").splitlines() if line.startswith("flags")]
    return lines[0].split() if lines else []
