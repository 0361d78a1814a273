# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions are exact over any range of data, on the host and in the tables of the march."""

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.llvm_library import use_newest_llvm
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.march.device.table import DeviceTable, Guide
from spectral_core.volume.march.device.voxels import DeviceVolume
from spectral_core.volume.march.ranges import RangeTables
from spectral_core.volume.march.tables import tabulate
from spectral_core.volume.transfer import Material, TransferFunction
from tests.volume.cases import two_tents

pytest.importorskip("drjit")
use_newest_llvm()
RNG = np.random.default_rng(4)


def shells_per_decade():
    """Density from 1 to 1e6, one thin shell per decade."""
    at = 10.0 ** np.arange(1, 6)
    peaks = tuple(Material(f"d{i}", [0.9 * v, v, 1.1 * v], [0, 1.0, 0], [1, 1, 1]) for i, v in enumerate(at))
    return TransferFunction(peaks), 10.0 ** RNG.uniform(0, 6, (6, 6, 6))


def one_metal_voxel():
    data = RNG.random((6, 6, 6))
    data[2, 3, 4] = 1e6
    return TransferFunction((Material("m", [0.3, 0.5, 0.7, 1e6], [0, 1, 0.2, 0.2], [1, 1, 1]),)), data


def one_value_in_a_ramp():
    ramp = np.arange(216, dtype=np.uint16).reshape(6, 6, 6) * 300
    return TransferFunction((Material("m", [29999, 30000, 30001], [0, 5, 0], [1, 1, 1]),)), ramp


def jumps_and_emission():
    first = Material("a", [10, 10, 50, 50, 90], [0, 1, 1, 0, 0], [1, 1, 1], [0, 0, 2, 0, 0])
    return TransferFunction((first, Material("b", [200, 200], [0, 3], [1, 1, 1]))), RNG.uniform(0, 255, (6, 6, 6))


def sawtooth():
    knots = np.repeat(np.linspace(0, 255, 900), 2)[1:-1]
    return TransferFunction((Material("m", knots, np.tile([0.0, 1.0], 899), [1, 1, 1]),)), RNG.uniform(
        0, 255, (6, 6, 6)
    )


def far_from_zero():
    return TransferFunction((Material("m", [1e6 + 2, 1e6 + 3], [0, 1], [1, 1, 1]),)), 1e6 + 5 * RNG.random((6, 6, 6))


def below_zero():
    at = -(10.0 ** np.arange(5, 0, -1))
    return TransferFunction((Material("m", at, [0, 1, 0, 1, 1], [1, 1, 1]),)), -(10.0 ** RNG.uniform(0, 6, (6, 6, 6)))


def constant():
    return two_tents(), np.full((3, 3, 3), 70.0)


CASES = (
    shells_per_decade,
    one_metal_voxel,
    one_value_in_a_ramp,
    jumps_and_emission,
    sawtooth,
    far_from_zero,
    below_zero,
    constant,
)


def made(case):
    transfer, data = case()
    volume = ScalarVolume("v", data)
    table = tabulate(transfer, volume)
    low, high = volume.value_range
    knots = table.knots
    near = np.concatenate(
        [knots, 0.5 * (knots[1:] + knots[:-1]), np.nextafter(knots, -np.inf), RNG.uniform(low, high, 500)]
    )
    if low > 0:
        near = np.concatenate([near, np.exp(RNG.uniform(np.log(low), np.log(high), 500))])
    return transfer, volume, table, np.clip(near, low, high)


@pytest.mark.parametrize("case", CASES)
def test_the_table_equals_the_function(case):
    transfer, _, table, at = made(case)
    exact = transfer.curves(at)[1]
    got = table.columns_at(at)[:, : len(transfer.materials)]
    assert np.allclose(got, exact, atol=1e-9 * max(1.0, exact.max()))


@pytest.mark.parametrize("case", CASES)
def test_the_device_finds_the_segment_and_its_columns(case):
    import drjit.llvm as types

    transfer, volume, table, at = made(case)
    device = DeviceVolume(types, volume)
    on_device = DeviceTable(types, table, device, integrals=True)
    stored = ((at - device.base) / device.unit).astype(np.float32)
    segment = on_device.find(types.Float(stored))
    # The device has values and knots as float32 in stored units, so the check uses the same.
    knots = ((table.knots - device.base) / device.unit).astype(np.float32)
    assert np.array_equal(segment.index.numpy(), np.searchsorted(knots, stored, side="right"))
    rounded = stored.astype(np.float64) * device.unit + device.base
    exact = transfer.curves(rounded)[1]
    columns = np.stack([c.numpy() for c in on_device.column_values(segment, segment.part)], axis=-1)
    height = exact.max() or 1.0
    steep = np.abs(table.rises).max() * np.abs(rounded - device.base) * 2.0**-22
    off = np.abs(columns[:, : exact.shape[1]] - exact).max(axis=1)
    at_jump = np.isin(stored, knots)
    assert (off <= 1e-6 * height + steep)[~at_jump].all()


@pytest.mark.parametrize("case", CASES[:-1])
def test_integrals_between_values_are_exact(case):
    import drjit.llvm as types

    transfer, volume, table, at = made(case)
    device = DeviceVolume(types, volume)
    on_device = DeviceTable(types, table, device, integrals=True)
    ends = np.sort(RNG.choice(at, (60, 2)), axis=1)
    ends = ends[ends[:, 1] > ends[:, 0]]
    sums = []
    for column in ends.T:
        stored = types.Float(((column - device.base) / device.unit).astype(np.float32))
        sums.append(np.stack([c.numpy() for c in on_device.running_integrals(on_device.find(stored))], axis=-1))
    got = (sums[1] - sums[0]).astype(float) * device.unit
    exact = np.array([trapezoid(transfer, low, high) for low, high in ends]).reshape(got.shape[0], -1)
    scale = np.abs(sums[1]).max(axis=-1, keepdims=True) * device.unit * 2.0**-20 + 1e-12
    slack = transfer.curves(at)[1].max() * np.abs(ends - device.base).max(axis=1, keepdims=True) * 2.0**-21
    assert (np.abs(got[:, : exact.shape[1]] - exact) <= scale + slack).all()


def trapezoid(transfer, low, high):
    """Integral of the sources over their own knots, with the limits from both sides."""
    knots = np.unique(np.concatenate([m.values for m in transfer.materials]))
    inner = np.concatenate([[low], knots[(knots > low) & (knots < high)], [high]])
    left, right = transfer.curves(inner[:-1])[1], transfer.curves(np.nextafter(inner[1:], -np.inf))[1]
    return (0.5 * (left + right) * np.diff(inner)[:, None]).sum(axis=0)


def test_a_lookup_needs_few_comparisons_for_any_knots():
    for knots in (
        np.linspace(0, 1, 2000),
        np.logspace(-6, 6, 500),
        np.array([0.0, 1.0]),
        np.array([5.0]),
        np.array([-1e6, -1.0, 0.0, 1e-6, 1e6]),
    ):
        guide = Guide.of(knots.astype(np.float32))
        assert guide.probes <= 2 and len(guide.first) <= 2**16
    tight = np.sort(np.concatenate([np.linspace(0, 1, 30), 0.5 + 1e-6 * np.arange(8)])).astype(np.float32)
    assert Guide.of(tight).probes <= 4


def test_narrow_features_that_uniform_bins_would_miss_are_kept(rng):
    transfer, data = shells_per_decade()
    table = tabulate(transfer, ScalarVolume("v", data))
    ranges = RangeTables(table, 1.0)
    assert not ranges.is_even
    inside = ranges.bins(np.array([9.5, 95.0, 9.5e4], np.float32))
    assert len(set(inside.tolist())) == 3
    assert (np.diagonal(ranges.slope)[inside] > 0).all()


@pytest.mark.parametrize(
    ("grid", "given", "words"),
    [
        (None, [0.5, 0.5], r"'m' has 2 entries; expected 3 \(linear RGB\)"),
        (
            [400.0, 500.0],
            [0.5, 0.5, 0.5],
            r"'m' has 3 entries; expected 2 \(the wavelengths of the transfer function\)",
        ),
    ],
)
def test_a_color_of_another_length_is_refused_with_what_it_should_hold(grid, given, words):
    material = Material("m", np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.array(given))
    with pytest.raises(InvalidInputError, match=words):
        TransferFunction((material,), wavelengths_nm=grid)
