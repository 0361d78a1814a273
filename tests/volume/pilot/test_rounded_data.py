# SPDX-License-Identifier: GPL-3.0-or-later
"""Data of 32 and 64 bits are stored in single precision; the stated error knows what that loses."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View


@pytest.mark.parametrize("kind", ["uint32", "int64", "float64"])
def test_values_that_are_stored_as_one_lower_the_stated_error(kind):
    """Slabs that differ by 40 of 4e9, and a function that is 100 wide: at least 90 dB were stated."""
    data = np.zeros((16, 4, 4), kind)
    data[4:12] = 4_000_000_000 + np.arange(0, 320, 40)[:, None, None]
    volume = ScalarVolume("slabs", data)
    peak = np.array([3_999_999_990.0, 4_000_000_040.0, 4_000_000_140.0])
    transfer = TransferFunction((Material("peak", peak, [0.0, 0.3, 0.0], [1.0, 1.0, 1.0]),))
    view = View.around(volume, 0.0, 0.0, width=24, height=24, fov_deg=None)
    renderer = VolumeRenderer(volume)
    made = plan(renderer, view, transfer, 50.0)
    shown = renderer.render(view, transfer, made.stepping).picture()[12, 12, 0]
    # A ray along x through float64 voxels.
    places = np.clip((np.arange(160_000) + 0.5) / 10_000 - 0.5, 0, 15)
    values = np.interp(places, np.arange(16), data[:, 0, 0].astype(np.float64))
    truth = 1.0 - np.exp(-np.sum(np.interp(values, peak, [0.0, 0.3, 0.0], 0.0, 0.0)) / 10_000)
    snr = -20.0 * np.log10(max(abs(shown / truth - 1.0), 1e-9))
    assert snr < 40.0, "the case no longer shows the loss"
    assert made.estimate_db < snr + 6.0
    assert not made.is_reached


def test_data_that_single_precision_holds_lose_nothing(rng):
    for kind in ("uint8", "int16", "uint16", "float16", "float32"):
        values = (100 * rng.random((5, 4, 3))).astype(kind)
        assert VolumeRenderer(ScalarVolume("v", values)).rounding == 0.0
    assert VolumeRenderer(ScalarVolume("v", np.full((2, 2, 2), 1.0 / 3.0))).rounding == 0.0
    whole = rng.integers(0, 1 << 24, (5, 4, 3))
    assert VolumeRenderer(ScalarVolume("v", whole)).rounding == 0.0


@pytest.mark.parametrize("kind", ["float64", "int64"])
def test_the_rounding_of_values_is_in_proportion_to_them(kind):
    """Slabs of 1 to 1e9: one shift of all knots, by the rounding of 1e9, hid a peak at 30; 12 dB were stated."""
    data = np.zeros((19, 4, 4), kind)
    data[:] = np.round(10.0 ** (np.arange(19) / 2))[:, None, None]
    data[-1] += 1  # no number of single precision
    peak = np.array([10.0, 30.0, 90.0])
    transfer = TransferFunction((Material("peak", peak, [0.0, 0.3, 0.0], [1.0, 1.0, 1.0]),))
    volume = ScalarVolume("decades", data)
    view = View.around(volume, 0.0, 0.0, width=24, height=24, fov_deg=None)
    renderer = VolumeRenderer(volume)
    made = plan(renderer, view, transfer, 40.0)
    shown = renderer.render(view, transfer, made.stepping).picture()[12, 12, 0]
    places = np.arange(1_900_000) / 1e5 - 0.5
    values = np.interp(places, np.arange(19), data[:, 0, 0].astype(np.float64))
    truth = 1.0 - np.exp(-np.sum(np.interp(values, peak, [0.0, 0.3, 0.0], 0.0, 0.0)) / 1e5)
    assert made.is_reached
    assert -20.0 * np.log10(abs(shown / truth - 1.0)) > made.estimate_db - 1.0


def test_values_at_a_jump_are_not_moved_off_it():
    """Half of the voxels have the value of a jump, and knots are rounded as voxels are: 0 dB were stated."""
    data = np.where(np.arange(8) % 4 < 2, 0.7, 0.1)[:, None, None] * np.ones((8, 4, 4))
    transfer = TransferFunction((Material("step", [0.7, 0.7], [0.0, 0.3], [1.0, 1.0, 1.0]),))
    volume = ScalarVolume("labels", data)
    renderer = VolumeRenderer(volume)
    made = plan(renderer, View.around(volume, width=24, height=24), transfer, 50.0)
    assert made.is_reached


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("kind", ["float32", "float64", "uint8"])
def test_the_last_voxels_do_not_have_the_rounding_of_their_neighbors(axis, kind):
    """The outer half voxel was the end of the cell before it, so that 1e-9 beside 1 was 0 there."""
    import drjit.llvm as types

    small, large = (3, 200) if kind == "uint8" else (1e-9, 1.0)
    data = np.full((4, 4, 4), large, kind)
    last = [slice(None)] * 3
    last[axis] = -1
    data[tuple(last)] = small
    data[0, 0, 0] = 0
    device = VolumeRenderer(ScalarVolume("wall", data)).device_volume
    for place, expected in ((2.5, 0.5 * (large + small)), (3.0, small), (3.4, small)):
        point = [1.25, 1.5, 1.75]
        point[axis] = place
        value = device.value(types.Array3f(*(types.Float([each]) for each in point))).numpy()[0]
        assert value * device.unit + device.base == pytest.approx(expected, rel=1e-6)
