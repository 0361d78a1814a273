# SPDX-License-Identifier: GPL-3.0-or-later
"""Skies by formula, against values that Cycles 5.0.1 renders."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene.skies import daylight
from spectral_core.scene.skies.atmosphere import Atmosphere

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


def test_a_sun_below_the_horizon_counts_as_one_on_it_as_in_cycles():
    toward = {(0.0469548, 0.9557877, 0.2902847): (0.0251155, 0.0218351, 0.0143320),
              (0.6, 0.6, 0.5291503): (0.0165880, 0.0156306, 0.0123897)}  # fmt: skip
    found = Atmosphere("hosek", sun_direction=(0.5, 0.5, -0.5)).radiance(np.array(list(toward)))
    np.testing.assert_allclose(found, list(toward.values()), rtol=0.06)


def test_the_sky_is_finite_at_the_ends_of_its_settings():
    directions = np.array([(0, 0, 1.0), (1, 0, 0), (0, 0, -1), (0, 0.6, 0.8)])
    for turbidity in (0.0, 1.0, 5.5, 10.0, 30.0):
        for toward in ((0, 0, 1.0), (1, 0, 0), (0, 0.1, -1)):
            sky = Atmosphere("hosek", turbidity=turbidity, ground_albedo=1.0, sun_direction=toward)
            assert np.isfinite(sky.radiance(directions)).all() and (sky.radiance(directions) >= 0).all()


def test_a_night_of_single_scattering_is_dark_without_a_warning():
    directions = np.array([(0, 0, 1.0), (1, 0, 0), (0, 0.6, 0.8)])
    for elevation in (-0.5, -np.pi / 3, -np.pi / 2):
        assert not Atmosphere("single", sun_elevation=elevation).radiance(directions).any()


def test_without_mitsubas_data_there_is_no_such_sky(monkeypatch):
    monkeypatch.setattr(daylight, "COEFFICIENTS", "data/nowhere.bin")
    daylight._coefficients.cache_clear()
    assert not daylight.has_hosek()
    monkeypatch.undo()
    daylight._coefficients.cache_clear()
    assert daylight.has_hosek()


@pytest.mark.parametrize("model", ["single", "multiple"])
def test_a_drawn_sun_has_the_mean_of_its_disk_and_ends_at_the_horizon(model, rng):
    angle = 0.2
    high, half_set = (Atmosphere(model, sun_elevation=elevation) for elevation in (0.8, 0.0))
    around = rng.uniform(0, 2 * np.pi, 20_000)
    off = np.sqrt(rng.uniform(0, 1, len(around))) * angle / 2

    def seen(sky):
        toward = sky.toward_sun
        side = np.cross(toward, (0.0, 0.0, 1.0))
        side /= np.linalg.norm(side)
        up = np.cross(side, toward)
        across = np.cos(around)[:, None] * side + np.sin(around)[:, None] * up
        directions = np.cos(off)[:, None] * toward + np.sin(off)[:, None] * across
        return directions, sky.wide_sun(directions, angle)

    np.testing.assert_allclose(seen(high)[1].mean(0), high.sun_radiance(angle), rtol=0.02)
    directions, found = seen(half_set)
    assert not found[directions[:, 2] < -0.01].any() and found[directions[:, 2] > 0.01].all()
    assert not high.wide_sun(-high.toward_sun[None], angle).any()


def test_the_sun_without_air_has_the_solar_illuminance():
    """133.1 klx above the air (Darula, Kittler and Gueymard 2005), 683 lm of them in a watt of luminous power.

    The models' sun is a black body, so that it is up to a twentieth darker.
    """
    sky, angle = Atmosphere("single", sun_elevation=np.pi / 2, air=0.0, aerosol=0.0, ozone=0.0), 0.0093
    luminance = sky.sun_radiance(angle) @ (0.2126, 0.7152, 0.0722) / 0.8  # without the mean darkening of the limb
    assert luminance * np.pi * (angle / 2) ** 2 == pytest.approx(133_100 / 683, rel=0.06)


SINGLY_SCATTERED = {
    (-0.1350, 0.8958): (1.5705, 1.2523, 0.7553),
    (-0.0859, 2.3685): (1.5373, 1.4909, 1.0900),
    (0.0614, 2.1230): (4.5497, 5.2809, 4.5491),
    (0.8958, 1.3867): (0.8267, 1.2965, 2.2018),
    (1.3867, 1.3131): (0.6770, 1.0655, 1.8458),
}
"""Radiance that Cycles 5.0.1 renders by elevation and azimuth from a sun at an elevation of 0.4, in linear sRGB."""


def test_the_sky_of_single_scattering_is_cycles_below_and_above_the_horizon():
    places = np.array(list(SINGLY_SCATTERED))
    flat = np.cos(places[:, 0])
    directions = np.stack(
        [flat * np.sin(places[:, 1]), flat * np.cos(places[:, 1]), np.sin(places[:, 0])], axis=1
    )  # a sun without rotation is toward +Y
    found = Atmosphere("single", sun_elevation=0.4).radiance(directions)
    np.testing.assert_allclose(found, list(SINGLY_SCATTERED.values()), rtol=0.01)
