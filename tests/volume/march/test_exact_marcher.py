# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact marcher against integrals in fractions, for data that differ by less than float64 holds of their size."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import exp

import numpy as np
import pytest

from benchmarks.volume.checks.exact import exact_amounts
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

STEPS = np.array([0, 1, 3, 2, 4, 7, 7, 9, 5, 9])
KNOTS = [(0.0, 0.1), (1.5, 0.2), (1.5, 0.05), (2.5, 0.3), (4.0, 0.0), (6.5, 1.0), (7.0, 0.1)]
"""(steps above the least voxel, extinction)."""


def depth(voxels: list[Fraction], knots: list[Fraction]) -> Fraction:
    """Optical depth of a ray along a row of voxels, the two halves at its ends included."""
    heights = [Fraction(height) for _, height in KNOTS]

    def height(value: Fraction) -> Fraction:
        after = next((i for i, knot in enumerate(knots) if knot > value), len(knots))
        if after in (0, len(knots)):
            return heights[min(after, len(knots) - 1)]
        low, high = knots[after - 1], knots[after]
        return heights[after - 1] + (heights[after] - heights[after - 1]) * (value - low) / (high - low)

    def mean(a: Fraction, b: Fraction) -> Fraction:
        """Over the values between two voxels: linear between the knots among them, so that middles suffice."""
        if a == b:
            return height(a)
        low, high = min(a, b), max(a, b)
        ends = [low, *sorted({knot for knot in knots if low < knot < high}), high]
        return sum(((q - p) * height((p + q) / 2) for p, q in pairwise(ends)), Fraction(0)) / (high - low)

    inner = sum((mean(a, b) for a, b in pairwise(voxels)), Fraction(0))
    return inner + (height(voxels[0]) + height(voxels[-1])) / 2


@pytest.mark.parametrize(
    ("base", "step", "kind"),
    [(2**63 - 10**7, 4096, "int64"), (-(2**63), 3000, "int64"), (18 * 10**18, 10**6, "uint64"), (0, 10**18, "uint64"),
     (18 * 10**18, 10**6, "float64"), (-(10**6), 10, "int32"), (-128, 20, "int8"), (3, 7, "float32")],
)  # fmt: skip
def test_differences_far_below_the_size_of_the_data_are_kept(base: int, step: int, kind: str) -> None:
    """Near 9.2e18 the amount was wrong by 0.01, since a step of the data was taken for none."""
    row = np.array([base + step * int(each) for each in STEPS]).astype(kind)
    volume = ScalarVolume("row", np.broadcast_to(row[:, None, None], (10, 3, 3)).copy())
    knots = np.array([float(base + round(step * at)) for at, _ in KNOTS])
    transfer = TransferFunction((Material("some", knots, [height for _, height in KNOTS], [1.0, 1.0, 1.0]),))
    view = View.around(volume, 0.0, 0.0, width=5, height=5, fov_deg=None)
    truth = 1.0 - exp(-depth([Fraction(each.item()) for each in row], [Fraction(float(knot)) for knot in knots]))
    assert 0.5 < truth < 0.99
    assert exact_amounts(volume, transfer, view, 16)[2, 2, 0] == pytest.approx(truth, abs=1e-8)
