# SPDX-License-Identifier: GPL-3.0-or-later
"""Histograms of figures: values that are equally frequent have bars of equal height."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.explore.page.axes import bins


@pytest.mark.parametrize("number", [2, 9, 20, 27, 40, 60])
def test_whole_numbers_of_equal_frequency_have_equal_bars(number: int) -> None:
    """Of 27 whole numbers in 20 bars, seven bars were twice as high."""
    values = np.repeat(np.arange(number) - 5.0, 3)
    found = np.histogram(values, bins(values, [], is_log=False))[0]
    assert found.sum() == len(values) and len(found) <= 20
    assert len(set(found[:-1])) <= 1 and found[-1] <= found[0]


def test_other_numbers_have_twenty_bars() -> None:
    for values in (np.array([0.5, 1.0, 7.0]), np.array([0.0, 1e300])):
        assert bins(values, [], is_log=False) == 20
    assert len(bins(np.array([3.0, 3.0]), [], is_log=False)) == len(bins(np.array([1.0, 3.0]), [], is_log=True)) == 21
