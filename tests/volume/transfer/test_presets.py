# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets are fitted to the data without fill values."""

import numpy as np
import pytest

from spectral_core.volume.documents.transfer_document import stated_in_fractions
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.fill_values import with_width
from spectral_core.volume.presets import PRESETS, preset
from spectral_core.volume.transfer import Material, TransferFunction


@pytest.mark.parametrize("fills", [[-9999.0], [1e20], [-9999.0, 1e20], [-3.4e38], [1e30, 1e20], [-1e6]])
@pytest.mark.parametrize("name", ["wide", "narrow", "opaque", "xray"])
def test_fill_values_do_not_change_a_preset(name, fills, rng):
    data = rng.random((12, 12, 12))
    filled = data.copy()
    for number, fill in enumerate(fills):
        filled[number::5, ::2] = fill
    plain, marked = (preset(name, ScalarVolume("v", d)) for d in (data, filled))
    for one, other in zip(plain.materials, marked.materials, strict=True):
        assert np.allclose(one.values, other.values, atol=0.02)


@pytest.mark.parametrize("name", [name for name in PRESETS if name != "edges"])
def test_data_of_few_values_and_a_background_keep_their_range(name):
    for values in ([0, 255], [0, 1, 2], [0, *range(1000, 1300)]):
        data = np.resize(np.array(values, np.int16), (8, 8, 8))
        knots = np.concatenate([m.values for m in preset(name, ScalarVolume("v", data)).materials])
        assert knots.min() <= 0.5 * max(values) and knots.max() <= max(values) + 1


def test_edges_of_a_small_object_in_an_empty_field_show():
    away = np.linalg.norm(np.indices((40, 40, 40)) - 20.0, axis=0)
    volume = ScalarVolume("v", (1e-3 * np.clip(4 - away, 0, 1)).astype(np.float32))
    transfer = preset("edges", volume)
    steepest = 1e-3
    assert all(0 < m.gradient_values[-1] < steepest for m in transfer.materials)
    assert np.isfinite(preset("edges", ScalarVolume("level", np.ones((4, 4, 4)))).materials[0].gradient_values).all()


@pytest.mark.parametrize("value", [0.7, 1e-20, 200.0])
def test_a_field_of_one_value_is_the_densest_part_of_a_range_from_zero(value):
    """Grids of constant density were invisible under every preset: their value was the least of the range."""
    volume = ScalarVolume("cube", np.full((4, 4, 4), value))
    for name in ("wide", "opaque", "xray"):
        made = preset(name, volume)
        assert made.shows(value, value)
        stated = stated_in_fractions(made, volume)
        assert max(float(m.values.max()) for m in stated.transfer.materials) == pytest.approx(1.0)
        again = stated.for_volume(volume)
        for before, after in zip(made.materials, again.materials, strict=True):
            assert np.allclose(before.values, after.values, rtol=1e-12, atol=0)
        assert again.shows(value * (1 + 1e-12), value * 2)


@pytest.mark.parametrize("value", [0.0, -3.0])
def test_a_field_of_one_value_that_is_not_above_zero_is_the_least_of_its_range(value):
    volume = ScalarVolume("cube", np.full((4, 4, 4), value))
    assert with_width(*volume.value_range) == (value, value + 1.0)
    assert not any(preset(name, volume).shows(value, value) for name in ("wide", "opaque", "xray"))


def test_what_a_function_shows():
    """A peak inside of the range, at an end of it, a jump at its border, a constant, and emission alone."""

    def shows(values, extinction, low, high, emission=None):
        material = Material("m", values, extinction, [1, 1, 1], emission)
        none = Material("none", [0.0], [0.0], [1, 1, 1])
        return TransferFunction((none, material)).shows(low, high)

    peak = [1.0, 1.5, 2.0], [0.0, 3.0, 0.0]
    assert shows(*peak, 0.0, 3.0) and shows(*peak, 1.9, 9.0) and shows(*peak, 1.5, 1.5)
    assert not shows(*peak, 2.0, 9.0) and not shows(*peak, -9.0, 1.0) and not shows(*peak, 2.5, 2.5)
    assert shows([1.0, 1.0], [0.0, 3.0], 1.0, 1.0) and not shows([1.0, 1.0], [0.0, 3.0], 0.0, 0.9)
    assert shows([5.0], [2.0], 0.0, 1.0) and not shows([5.0], [0.0], 0.0, 1.0)
    assert shows([1.0, 2.0], [0.0, 0.0], 0.0, 3.0, [0.0, 1.0])
