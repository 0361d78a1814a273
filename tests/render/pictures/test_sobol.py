# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampler's points: the Sobol sequence by its definition, stratification of each pair, independent seeds."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.render.trace import sobol

INDEX = np.arange(1 << 12, dtype=np.uint32)


@pytest.fixture(autouse=True)
def _wrapping():
    with np.errstate(over="ignore"):
        yield


def _second_by_definition(index):
    """Sobol's second dimension by its direction numbers."""
    result, direction = 0, 1 << 31
    while index:
        if index & 1:
            result ^= direction
        index >>= 1
        direction ^= direction >> 1
    return result


def test_the_sequence_is_that_of_sobol():
    assert np.array_equal(sobol.second_sobol(INDEX), [_second_by_definition(int(k)) for k in INDEX])
    assert np.array_equal(
        sobol.reversed_bits(sobol.reversed_bits(INDEX * np.uint32(2654435761))), INDEX * np.uint32(2654435761)
    )
    assert [int(v) >> 29 for v in sobol.first_sobol(INDEX[:8])] == [0, 4, 2, 6, 1, 5, 3, 7]


@pytest.mark.parametrize("seed", [0, 1, 12345, 0xFFFFFFFF])
@pytest.mark.parametrize("start", [0, 256, 1024])
def test_each_power_of_two_fills_every_elementary_interval(seed, start):
    """Each of the 256 cells has exactly one of 256 consecutive points, for any shape of the cells."""
    first, second = sobol.pair(INDEX[start : start + 256], np.array([seed], np.uint32))
    for bits in range(9):
        column = first.astype(np.uint64) >> np.uint64(32 - bits)
        row = second.astype(np.uint64) >> np.uint64(24 + bits)
        assert len(set(zip(column.tolist(), row.tolist(), strict=True))) == 256


def test_seeds_give_independent_points():
    points = (
        np.array([sobol.pair(INDEX[:64], np.array([seed], np.uint32)) for seed in range(200)], dtype=np.float64) / 2**32
    )
    flat = points.reshape(400, 64)
    correlation = np.corrcoef(flat)[~np.eye(400, dtype=bool)]
    assert abs(correlation.mean()) < 0.01 and np.abs(correlation).max() < 0.75
    assert flat.mean(axis=1) == pytest.approx(np.full(400, 0.5), abs=0.01)
