# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of each rule by their formulas, brick by brick, and the numbers that they are made from."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march import bricks
from spectral_core.volume.march.brick_word import BrickWord
from spectral_core.volume.march.bricks import brick_statistics, voxel_statistics
from spectral_core.volume.march.ranges import RangeTables
from spectral_core.volume.march.rules import _with_neighbors, essential_frequency, step_grid
from spectral_core.volume.march.tables import tabulate
from spectral_core.volume.transfer import Material, TransferFunction


def tent(low: float = 20, middle: float = 70, high: float = 120) -> TransferFunction:
    return TransferFunction((Material("m", [low, middle, high], [0, 0.5, 0], [1, 1, 1]),))


def waves(size: int = 17) -> ScalarVolume:
    x, y, z = np.meshgrid(*[np.linspace(0, 5, size)] * 3, indexing="ij")
    return ScalarVolume("w", 60 + 50 * np.sin(x) * np.cos(1.3 * y) + 8 * z)


def test_statistics_of_voxels_by_loops() -> None:
    """Central differences, one-sided at the ends; the greatest slope within the window, values of the 26 neighbors."""
    rng = np.random.default_rng(3)
    volume = ScalarVolume("v", rng.normal(size=(6, 5, 4)))
    found = voxel_statistics(volume, 2)
    data = volume.data.transpose(2, 1, 0)
    slope = np.linalg.norm(np.gradient(data), axis=0)
    assert (found.edge, found.centered, found.shape) == (1, True, (4, 5, 6))
    for at in np.ndindex(*data.shape):
        near = tuple(slice(max(i - 1, 0), i + 2) for i in at)
        wide = tuple(slice(max(i - 2, 0), i + 3) for i in at)
        assert found.low[at] == pytest.approx(data[near].min(), rel=1e-6)
        assert found.high[at] == pytest.approx(data[near].max(), rel=1e-6)
        assert found.slope[at] == pytest.approx(slope[wide].max(), rel=1e-5)
    assert not found.second_difference.any()
    flat = voxel_statistics(ScalarVolume("f", rng.normal(size=(5, 1, 1))), 1)
    assert flat.shape == (1, 1, 5)


@pytest.mark.parametrize("edge", [1, 2, 4])
def test_slabs_of_a_field_have_the_statistics_of_the_whole(edge: int) -> None:
    """Also the second differences at the faces between two slabs, and the last, shorter one."""
    data = np.random.default_rng(4).normal(size=(15, 6, 5))
    layers = bricks._brick_count(15, edge)
    whole = bricks._slab(data, edge, 0, layers)
    for parts in ((0, 1, layers), (0, layers - 1, layers), tuple(range(layers + 1))):
        slabs = [bricks._slab(data, edge, a, b) for a, b in pairwise(parts)]
        for number, expected in enumerate(whole):
            np.testing.assert_array_equal(np.concatenate([slab[number] for slab in slabs]), expected)


def test_roughness_is_raised_by_the_roughest_neighbor() -> None:
    rough = np.zeros((5, 5, 5))
    rough[2, 2, 2], rough[2, 2, 3], rough[0, 0, 0] = 16.0, 4.0, 1e-9
    for own in (0.5, 0.75):
        found = _with_neighbors(rough, own)
        assert found[2, 2, 2] == pytest.approx(16.0)
        assert found[2, 2, 3] == pytest.approx(16.0 * 0.25**own)
        assert found[1, 1, 1] == pytest.approx(16.0 * 0.05**own)  # level beside a rough one: a twentieth counts
        assert found[2, 2, 4] == pytest.approx(4.0 * 0.05**own)
        assert found[4, 4, 4] == 0.0 and found[0, 0, 0] == pytest.approx(1e-9)


@pytest.mark.parametrize("edge", [2, 4])
def test_steps_of_the_error_rule_are_inverse_to_the_cube_root_of_roughness(edge: int) -> None:
    volume, transfer = waves(), tent()
    statistics = brick_statistics(volume, edge)
    ranges = RangeTables(tabulate(transfer, volume), 1.0)
    grid = step_grid("error", statistics, ranges, unit=2.0)
    shows = BrickWord.shown(grid.words)
    low, high = statistics.low, statistics.high
    bins = [ranges.bins(each) for each in (low, high)]
    kink, slope = ranges.kink[bins[0], bins[1]], ranges.slope[bins[0], bins[1]]
    assert 0.005 < slope.max() <= 0.01 + 1e-9  # at most the tent's own slope
    rough = np.where(shows, kink * statistics.slope + slope * statistics.second_difference, 0.0)
    rough = _with_neighbors(rough, 0.5 if edge == 2 else 0.75)
    typical = np.median(rough[shows])
    expected = np.cbrt(typical / np.maximum(rough, 1e-3 * typical))
    found = BrickWord.pack(expected.astype(np.float32), (2.0 / np.maximum(statistics.slope, 2e-9)).astype(np.float32),
                           ranges.empties(statistics)[1], shows)  # fmt: skip
    np.testing.assert_array_equal(grid.words, found)
    assert (grid.longest, grid.adapts, grid.first) == (3.0, True, 1.0)
    assert np.median(expected[shows]) == pytest.approx(1.0, abs=1e-3)


def test_what_the_other_rules_state() -> None:
    volume, transfer = waves(), tent()
    ranges = RangeTables(tabulate(transfer, volume), 1.0)
    uniform = step_grid("uniform", brick_statistics(volume, 2), ranges)
    assert (uniform.longest, uniform.adapts, uniform.first, uniform.edge) == (np.inf, False, 1.0, 2)
    statistics = voxel_statistics(volume, 2)
    thesis = step_grid("thesis", statistics, ranges)
    assert (thesis.longest, thesis.adapts, thesis.first, thesis.edge) == (4.0, False, 0.0, 1)
    relative = 1 / np.maximum(2 * essential_frequency(ranges.table) * statistics.slope.astype(float), 1e-12)
    empty = ranges.empties(statistics)[1]
    shows = ranges.empties(statistics)[0]
    np.testing.assert_array_equal(BrickWord.shown(thesis.words), shows)
    np.testing.assert_allclose(thesis.words.view(np.float32)[shows], relative[shows], rtol=1e-6)
    np.testing.assert_array_equal(thesis.words[~shows], empty[~shows])
    level = ScalarVolume("level", np.full((9, 9, 9), 60.0))
    flat = step_grid("error", brick_statistics(level, 2), RangeTables(tabulate(transfer, level), 1.0))
    assert BrickWord.shown(flat.words).all()
    steps = (flat.words & np.uint32(0xFFFF0000)).view(np.float32)
    np.testing.assert_array_equal(steps, 3.0)  # where nothing is rough, the longest step
    assert BrickWord.paces_of(flat.words).min() > 9e8


def test_the_box_of_visible_bricks() -> None:
    data = np.zeros((17, 13, 9))
    data[6:8, 3, 4] = 70.0
    volume = ScalarVolume("v", data)
    ranges = RangeTables(tabulate(tent(), volume), 1.0)
    grid = step_grid("error", brick_statistics(volume, 4), ranges)
    low, high = grid.bounds(volume.shape)
    # cells 5 to 8 along x lie in bricks 1 and (8 is a shared face) 1; along y brick 0, along z bricks 0 and 1
    assert low == [4.0, -0.5, -0.5] and high == [8.0, 4.0, 8.5]
    centered = step_grid("thesis", voxel_statistics(volume, 1), ranges)
    low, high = centered.bounds(volume.shape)
    assert low == [4.5, 1.5, 2.5] and high == [8.5, 4.5, 5.5]
    nothing = step_grid("error", brick_statistics(ScalarVolume("v", np.zeros((9, 9, 9))), 4),
                        RangeTables(tabulate(tent(), ScalarVolume("v", np.zeros((9, 9, 9)))), 1.0))  # fmt: skip
    assert nothing.bounds((9, 9, 9)) == ([1.0] * 3, [0.0] * 3)


@pytest.mark.parametrize("periods", [5, 12])
def test_the_essential_frequency_of_a_wave_is_its_own(periods: int) -> None:
    """Triangles with some periods over the range: a hundredth of their power lies in the harmonics above."""
    knots = np.linspace(0, 100, 2 * periods + 1)
    heights = np.arange(2 * periods + 1) % 2
    wave = TransferFunction((Material("m", knots, heights.astype(float), [1, 1, 1]),))
    volume = ScalarVolume("v", np.array([0.0, 100.0]).reshape(2, 1, 1))
    found = essential_frequency(tabulate(wave, volume))
    # the power of 4097 samples, minus their mean, padded to four times their number
    at = np.linspace(0, 100, 4097)
    curve = np.interp(at, knots, heights)
    power = np.abs(np.fft.rfft(np.concatenate([curve - curve.mean(), np.zeros(3 * 4097)]))) ** 2
    below = np.searchsorted(np.cumsum(power) / power.sum(), 0.99)
    assert found == pytest.approx(below / (4 * 4097 * 100 / 4096), rel=1e-6)
    assert essential_frequency(tabulate(wave, volume), 0.5) == pytest.approx(periods / 100, rel=0.15)
    level = TransferFunction((Material("m", [0.0, 100.0], [1.0, 1.0], [1, 1, 1]),))
    assert essential_frequency(tabulate(level, volume)) == 0.0
    single = ScalarVolume("v", np.full((2, 1, 1), 5.0))
    assert essential_frequency(tabulate(wave, single)) == 0.0
