# SPDX-License-Identifier: GPL-3.0-or-later
"""Proposals after the least value was found: points that tell something new, not the same one again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from spectral_core.explore.analysis.process import propose
from spectral_core.lattice import progressive_fill, unit_cube


@pytest.mark.parametrize("least", [(0.3, 0.6), (0.0, 0.0)])
def test_a_proposal_is_no_row_of_the_sweep_again(least: tuple[float, float]) -> None:
    """Of a minimum that was found, points within 1e-4 of it were proposed again and again."""
    at = np.array(least)
    points = np.concatenate([progressive_fill(unit_cube(2), 16, seed=1).points, at[None]])
    for _ in range(3):
        values = np.square(points - at).sum(axis=1)
        found, gain = propose(points, values)
        assert gain >= 0 and cdist(found[None], points).min() > 0.0099
        points = np.concatenate([points, found[None]])


def test_where_nothing_is_to_be_gained_the_farthest_point_is_proposed() -> None:
    """On a slope, whose least value is in a corner, 17 of 20 proposals were that corner."""
    points = np.concatenate([progressive_fill(unit_cube(2), 16, seed=1).points, np.zeros((1, 2))])
    found, _ = propose(points, points @ np.array([1.0, 2.0]))
    assert cdist(found[None], points).min() > 0.2  # the largest hole has a radius of about 0.25
