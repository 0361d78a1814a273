# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables, bricks and grids compared with slow and simple implementations."""

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.brick_word import REACHES, BrickWord
from spectral_core.volume.march.bricks import brick_statistics
from spectral_core.volume.march.ranges import RangeTables
from spectral_core.volume.march.rules import step_grid
from spectral_core.volume.march.tables import tabulate
from spectral_core.volume.transfer import Material, TransferFunction, interpolate


def slow_statistics(volume, edge):
    data = volume.data.transpose(2, 1, 0).astype(float)
    bend = np.zeros_like(data)
    for axis in range(3):
        if data.shape[axis] > 1:
            padded = np.pad(data, [(1, 1) if a == axis else (0, 0) for a in range(3)], mode="edge")
            bend = np.maximum(bend, np.abs(np.diff(padded, 2, axis=axis)))
    shape = [max(1, -(-(n - 1) // edge)) for n in data.shape]
    out = np.zeros((4, *shape))
    for brick in np.ndindex(*shape):
        part = tuple(slice(i * edge, (i + 1) * edge + 1) for i in brick)
        cells = data[part]
        slopes = [np.abs(np.diff(cells, axis=a)).max() if cells.shape[a] > 1 else 0.0 for a in range(3)]
        out[(slice(None), *brick)] = cells.min(), cells.max(), np.linalg.norm(slopes), bend[part].max()
    return out


@pytest.mark.parametrize("shape", [(7, 9, 11), (1, 5, 2), (8, 8, 8), (2, 1, 1), (5, 17, 33)])
@pytest.mark.parametrize("edge", [1, 2, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, np.float64])
def test_brick_statistics_match_the_slow_ones(shape, edge, dtype, rng):
    volume = ScalarVolume("v", (rng.random(shape) * 250).astype(dtype))
    fast = brick_statistics(volume, edge)
    for got, wanted in zip(
        (fast.low, fast.high, fast.slope, fast.second_difference), slow_statistics(volume, edge), strict=True
    ):
        assert np.allclose(got, wanted, atol=1e-3)
    assert (fast.low <= slow_statistics(volume, edge)[0]).all() and (
        fast.high >= slow_statistics(volume, edge)[1]
    ).all()


def test_skips_are_empty_and_have_the_maximal_length(rng):
    shows = rng.random((7, 9, 12)) < 0.02
    words, around = BrickWord.pack_empty(shows), np.pad(shows, 40)
    for brick in zip(*np.nonzero(~shows), strict=True):
        for octant in range(8):
            level = BrickWord.level_of(words[brick], octant)

            def empty(size, brick=brick, octant=octant):
                ahead = [slice(i + 41 - size, i + 41) if octant >> axis & 1 else slice(i + 40, i + 40 + size)
                         for axis, i in zip((2, 1, 0), brick, strict=True)]  # fmt: skip
                return not around[tuple(ahead)].any()

            assert empty(REACHES[level]) and (level == 7 or not empty(REACHES[level + 1]))


@pytest.mark.parametrize("rule", ["uniform", "error"])
def test_a_brick_is_visible_exactly_if_a_value_in_its_range_is(rule, rng):
    volume = ScalarVolume("v", rng.normal(0, 50, (12, 12, 12)))
    peak = Material("peak", [3.0, 3.5, 4.0], [0, 1, 0], [1, 1, 1])
    transfer = TransferFunction((peak, Material("jump", [90.0, 90.0, 95.0], [0, 1, 0], [1, 1, 1])))
    statistics = brick_statistics(volume, 2)
    grid = step_grid(rule, statistics, RangeTables(tabulate(transfer, volume), 1.0))
    inside = [((statistics.high > a) & (statistics.low < b)) for a, b in ((3.0, 4.0), (90.0, 95.0))]
    inside.append((statistics.high >= 90.0) & (statistics.low <= 90.0))
    assert np.array_equal(BrickWord.shown(grid.words), np.logical_or.reduce(inside))


def test_a_jump_has_the_value_of_the_later_knot():
    x = np.array([0.0, 0.999, 1.0, 1.001, 2.0, 3.0])
    assert np.allclose(interpolate(x, [0, 1, 1, 2], [0, 0, 5, 5]), [0, 0, 5, 5, 5, 5])
    assert np.allclose(interpolate(x, [1, 1], [2, 5]), [2, 2, 5, 5, 5, 5])
    assert np.allclose(interpolate(x, [1], [4]), 4)


@pytest.mark.parametrize(("values", "extinction", "color", "words"), [
    ([1, 0], [0, 1], [1, 1, 1], "none below the one before"),
    ([0, 1], [0, -1], [1, 1, 1], "negative entry"),
    ([0, 1], [0, 1, 2], [1, 1, 1], "shape"),
    ([0, np.nan], [0, 1], [1, 1, 1], "not finite"),
    ([], [], [1, 1, 1], "at least one number"),
])  # fmt: skip
def test_invalid_materials_are_refused(values, extinction, color, words):
    with pytest.raises(InvalidInputError, match=words):
        Material("bone", values, extinction, color)


def test_invalid_functions_are_refused():
    bone = Material("bone", [0, 1], [0, 1], [1, 1, 1])
    with pytest.raises(InvalidInputError, match="at least one"):
        TransferFunction(())
    with pytest.raises(InvalidInputError, match="share a name"):
        TransferFunction((bone, bone))
    with pytest.raises(InvalidInputError, match="expected 4"):
        TransferFunction((bone,), [400, 500, 600, 700])
    with pytest.raises(InvalidInputError, match="go together"):
        Material("skin", [0, 1], [0, 1], [1, 1, 1], gradient_values=[0, 1])


@pytest.mark.parametrize("emission", [0.0, 0.1])
def test_more_extinction_than_fills_a_voxel_makes_no_picture_rougher(emission):
    """The slope is of 1 - exp(-σ·voxel): it stops growing with the extinction."""
    volume = ScalarVolume("v", np.arange(27, dtype=np.float32).reshape(3, 3, 3))
    slopes = []
    for extinction in (50.0, 5e6):
        wall = Material("wall", [0, 13, 14, 26], [0, 0, extinction, extinction], [1, 1, 1], [0, 0, emission, emission])
        slopes.append(RangeTables(tabulate(TransferFunction((wall,)), volume), 1.0).slope.max())
    assert slopes[1] < 40 * slopes[0]
    assert slopes[1] * 26 / 510 < 3.0


def test_reaches_are_those_that_the_device_computes_from_their_level():
    levels = np.arange(len(REACHES))
    np.testing.assert_array_equal(REACHES, 1 + levels * (levels + 1) // 2)


def test_a_material_without_gradient_weights_counts_at_every_gradient():
    """Beside one with weights: each material has its own column, and the plain one's is 1."""
    edge = Material("edge", [0, 50, 100], [0, 1, 0], [1, 1, 1], gradient_values=[2, 6], gradient_weights=[0, 1])
    plain = Material("plain", [0, 100], [0.1, 0.2], [1, 1, 1])
    for materials, columns in (((edge, plain), (0.5, 1.0)), ((plain, edge), (1.0, 0.5))):
        volume = ScalarVolume("v", np.arange(64.0).reshape(4, 4, 4))
        weights = tabulate(TransferFunction(materials), volume, 10.0).weights
        assert weights is not None
        np.testing.assert_allclose(weights.columns_at(np.array([4.0])), [columns])
