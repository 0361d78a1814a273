# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds of the plan take the light of a spectrum as it is rendered, with Y = 1, whatever the unit of its values."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import plan_from_data
from spectral_core.render.plan.light.sources import radiances
from spectral_core.scene import AreaLight, Diffuse, Emission, Material, World, gray
from spectral_core.spectra.catalogue import illuminant
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid
from tests.render.scenes import lit_plane, matrix

LAMP = illuminant("HP1")


def measured(unit: float) -> Illuminant:
    """A sodium lamp, its values in some unit."""
    return Illuminant("lamp", LAMP.grid, LAMP.values * unit)


@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e6])
def test_a_world_is_kept_whatever_the_unit_of_its_spectrum(unit):
    """In watts instead of milliwatts its error was ΔE 0.09 instead of 127, and the picture black."""
    plans = [plan_from_data(lit_plane(world=World(measured(one), 0.5)), 0.25) for one in (1.0, unit)]
    assert [plan["environment"].value for plan in plans] == ["constant", "constant"]
    assert plans[1]["environment"].error == pytest.approx(plans[0]["environment"].error)


def test_radiances_of_sources_do_not_depend_on_the_unit():
    def of(unit: float) -> list[float]:
        material = Material("sign", Emission(measured(unit), 2.0))
        panel = AreaLight(name="panel", world_from_light=matrix((0, 0, 3)), color=measured(unit))
        return [value for value, _ in radiances(lit_plane(panel, world=World(measured(unit))), [material])]

    np.testing.assert_allclose(of(1e-6), of(1.0))


def test_the_blue_of_a_blue_lamp_counts_in_full():
    """Three times its luminance was assumed; blue light of 450 nm has fifty times its luminance in one channel."""
    blue = Illuminant("blue", SpectralGrid([440.0, 450.0, 460.0]), np.array([0.0, 1.0, 0.0]))
    (value, _), *_ = radiances(lit_plane(world=World(blue)), [Material("gray", Diffuse(gray(0.5)))])
    assert value > 30


def test_a_light_that_removes_light_is_not_called_dark():
    plan = plan_from_data(lit_plane(world=World(measured(1.0), -0.5)), 0.25)
    assert plan["environment"].value == "constant"
