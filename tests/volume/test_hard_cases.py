# SPDX-License-Identifier: GPL-3.0-or-later
"""Every hard case is finite and agrees with the oracle; the benchmark counts the same cases."""

import numpy as np
import pytest

from benchmarks.volume.volume_hard import cases, judge, refused

pytest.importorskip("drjit")


@pytest.mark.parametrize("case", list(cases(7)), ids=lambda case: case.name)
def test_hard_case(case):
    error, away, finite = judge(case)
    assert finite
    assert error <= case.limit
    assert away <= 2e-3


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_invalid_voxels_are_reported_with_name_and_index(bad):
    assert refused(bad)
