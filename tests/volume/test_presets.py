# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets are fitted to the data without fill values."""

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.presets import PRESETS, preset


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
