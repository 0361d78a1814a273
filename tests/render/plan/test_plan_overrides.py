# SPDX-License-Identifier: GPL-3.0-or-later
"""Decisions that the artist states: their cost, wrong names and values, two for one effect; bands of a render."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.render import Bands, plan_from_data
from spectral_core.scene import Diffuse, RenderSettings
from spectral_core.spectra import catalogue
from tests.render.plan.test_plan import _with_material


def test_overrides_of_the_artist_have_their_cost():
    scene = _with_material(Diffuse(catalogue.reflectance("red")))
    scene = replace(
        scene, settings=RenderSettings(transport="rgb", max_bounces=3, overrides=(("environment", "none"),))
    )
    plan = plan_from_data(scene)
    assert not plan.is_spectral and plan.bounces == 3
    assert plan["transport"].source == "artist" and plan["transport"].cost_if_left_out
    assert "set by the artist" in plan["transport"].reason


@pytest.mark.parametrize(
    ("overrides", "error", "match"),
    [
        ((("bloom", "on"),), UnknownNameError, "no effect is named 'bloom'"),
        ((("transport", "polarized"),), InvalidInputError, "rgb or spectral"),
        ((("media", "on"),), InvalidInputError, "cannot be 'on'"),
        ((("bounces", "-1"),), InvalidInputError, "whole number"),
        ((("bounces", "99999"),), InvalidInputError, "0 to 1024"),
        ((("textures", "off"),), InvalidInputError, "cannot be set"),
        ((("bounces", 2.5),), InvalidInputError, "whole number"),
    ],
)
def test_wrong_overrides_are_refused(overrides, error, match):
    with pytest.raises(error, match=match):
        plan_from_data(
            _with_material(Diffuse(), settings=None)
            if False
            else replace(_with_material(Diffuse()), settings=RenderSettings(overrides=overrides))
        )


@pytest.mark.parametrize("fixed", [{"transport": "spectral"}, {"max_bounces": 3}])
def test_overrides_beside_a_fixed_setting_are_checked_and_not_dropped(fixed):
    """They were ignored without a check: bounces 'x' beside max_bounces rendered."""
    name, value, other = ("transport", "spectral", "rgb") if "transport" in fixed else ("bounces", 3, 5)

    def planned(stated):
        settings = RenderSettings(overrides=((name, stated),), **fixed)
        return plan_from_data(replace(_with_material(Diffuse()), settings=settings))[name].value

    assert planned(value) == str(value)  # a number of bounces may be a number
    with pytest.raises(InvalidInputError, match="in overrides and .* state it once"):
        planned(other)
    with pytest.raises(InvalidInputError, match=f"effect '{name}'"):
        planned("x")


def test_a_recording_in_spectra_has_no_other_transport_beside_it():
    settings = RenderSettings(overrides=(("transport", "rgb"), ("media", "off")), max_bounces=2)
    forced = settings.in_spectra()
    assert (forced.transport, forced.overrides, forced.max_bounces) == ("spectral", (("media", "off"),), 2)
    assert plan_from_data(replace(_with_material(Diffuse()), settings=forced)).is_spectral


@pytest.mark.parametrize("tolerance", [-1.0, float("nan"), float("inf")])
def test_a_tolerance_is_a_number_from_0(tolerance):
    with pytest.raises(InvalidInputError, match=r"the tolerance \(ΔE2000\) is"):
        plan_from_data(_with_material(Diffuse()), tolerance)


@pytest.mark.parametrize("ends", [(700, 400), (500, 500), (300, 700), (400, 900)])
def test_bands_are_a_rising_range_of_visible_light(ends):
    with pytest.raises(InvalidInputError, match="expected a rising range in 360 to 830 nm"):
        Bands.uniform(*ends, 31)
