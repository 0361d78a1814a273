# SPDX-License-Identifier: GPL-3.0-or-later
"""Skies by formula, against values that Cycles 5.0.1 renders."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import daylight
from spectral_core.scene.atmosphere import Atmosphere

pytest.importorskip("mitsuba", reason="its data hold the coefficients")

SEEN = {
    (0.0469548, 0.9557877, 0.2902847): (0.0739028, 0.1264361, 0.2059702),
    (-0.8353221, -0.5006728, -0.2270763): (0.1815137, 0.2282541, 0.2338820),
    (0.9078580, -0.2274066, -0.3522501): (0.1394617, 0.1652649, 0.1555195),
}
"""Radiance by direction, with the sun at (0.4, 0.3, 0.6), turbidity 2.2 and albedo 0.3."""


def test_the_sky_of_hosek_and_wilkie_is_cycles():
    """Within 6 %: Cycles uses the coefficients of XYZ, these are those of RGB."""
    assert daylight.has_hosek()
    sky = Atmosphere("hosek", turbidity=2.2, ground_albedo=0.3, sun_direction=(0.4, 0.3, 0.6))
    found = sky.radiance(np.array(list(SEEN)))
    np.testing.assert_allclose(found, list(SEEN.values()), rtol=0.06)
    assert not sky.sun_radiance(0.01).any(), "it has no disk"


def test_the_sky_is_finite_at_the_ends_of_its_settings():
    directions = np.array([(0, 0, 1.0), (1, 0, 0), (0, 0, -1), (0, 0.6, 0.8)])
    for turbidity in (0.0, 1.0, 5.5, 10.0, 30.0):
        for toward in ((0, 0, 1.0), (1, 0, 0), (0, 0.1, -1)):
            sky = Atmosphere("hosek", turbidity=turbidity, ground_albedo=1.0, sun_direction=toward)
            assert np.isfinite(sky.radiance(directions)).all() and (sky.radiance(directions) >= 0).all()


def test_without_mitsubas_data_there_is_no_such_sky(monkeypatch):
    monkeypatch.setattr(daylight, "COEFFICIENTS", "data/nowhere.bin")
    daylight._coefficients.cache_clear()
    assert not daylight.has_hosek()
    monkeypatch.undo()
    daylight._coefficients.cache_clear()
    assert daylight.has_hosek()
