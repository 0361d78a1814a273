# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan counts the light that every closure scatters, and that every lamp may concentrate."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spectral_core.render import plan_from_data
from spectral_core.render.plan.bounds import error_of_medium
from spectral_core.render.plan.light.sources import radiances
from spectral_core.scene import (
    AddSurface,
    AreaLight,
    Diffuse,
    Emission,
    Falloff,
    Instance,
    Material,
    MixSurface,
    PointLight,
    ScatteringMedium,
    Sheen,
    Subsurface,
    SumSurface,
    Toon,
    Translucent,
    Transparent,
    gray,
    largest_sum,
)
from spectral_core.scene.geometry import unit_box
from spectral_core.scene.lights import Photometry
from spectral_core.scene.paint import Weight
from tests.render.scenes import lit_plane, matrix

LAMP = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100)


def bounces(surface: Any) -> int:
    return int(plan_from_data(lit_plane(LAMP, surface=surface))["bounces"].value)


@pytest.mark.parametrize("kind", [Sheen, Subsurface, Toon, Translucent])
def test_light_between_surfaces_is_followed_whatever_scatters_it(kind: Any) -> None:
    """Rooms of Toon and of Subsurface Scattering alone had two bounces and lost 60 % of their light, stated as 0."""
    assert bounces(kind(color=gray(0.8))) == bounces(Diffuse(gray(0.8))) > 20
    assert bounces(kind(color=gray(0.0))) == bounces(Emission()) == 2


def test_parts_of_a_sum_add_up() -> None:
    """A room of twice 45 % lost half of its light, stated as ΔE 0.14."""
    half = Diffuse(gray(0.4))
    twice = AddSurface(half, Translucent(gray(0.4)))
    assert bounces(twice) == bounces(Diffuse(gray(0.8))) > bounces(half)
    assert bounces(MixSurface(0.5, twice, Transparent())) == bounces(twice)
    assert bounces(MixSurface(0.5, half, half)) == bounces(half)
    assert bounces(SumSurface(((Weight(), half), (Weight(constant=1.0), half)))) == bounces(twice)


def test_a_deep_chain_of_shared_sums_is_read_once() -> None:
    surface: Any = Diffuse(gray(1e-6))
    count = [0]
    for _ in range(2000):
        surface = MixSurface(0.5, surface, surface)

    def value(_closure: Any) -> float:
        count[0] += 1
        return 0.3

    assert largest_sum(surface, value) == 0.3 and count == [1]
    assert largest_sum(None, value) == 0.0


def stated(lamp: Any) -> float:
    """The stated error of omitting thin fog between a lamp and the floor."""
    fog = Material("fog", None, ScatteringMedium(density=1e-7, color=gray(1.0)))
    scene = lit_plane(lamp)
    scene = replace(
        scene, meshes=(*scene.meshes, unit_box()), materials=(*scene.materials, fog),
        instances=(*scene.instances, Instance("fog", unit_box().name, matrix((0, 0, 0.5)), ("fog",))),
    )  # fmt: skip
    return error_of_medium(scene, fog)


def test_a_beam_in_thin_fog_has_the_intensity_of_its_spread() -> None:
    """A spread of 2 degrees makes an area light ten thousand times as strong along its axis."""
    wide, narrow = (
        AreaLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100, spread_rad=np.radians(angle))
        for angle in (180, 2)
    )
    half = np.radians(1)
    gain = np.tan(half) / (np.tan(half) - half)
    assert stated(narrow) > 100 * stated(wide) / (1 + stated(wide))
    assert stated(narrow) == pytest.approx(stated(replace(wide, power_w=100 * gain)))
    (first, _), *_ = radiances(lit_plane(narrow), [])
    (second, _), *_ = radiances(lit_plane(wide), [])
    assert first == pytest.approx(gain * second)


def test_a_luminaire_in_thin_fog_has_its_largest_strength() -> None:
    table = Photometry(np.array([0.0, 1.0]), np.array([0.0]), np.array([[2000.0, 0.0]]))
    assert stated(replace(LAMP, photometry=table)) == pytest.approx(stated(replace(LAMP, power_w=200_000)))


def test_a_lamp_that_does_not_fade_lights_distant_fog() -> None:
    """Blender's Constant falloff: the light 1,000 units away is that of 1 unit."""
    far = PointLight(name="lamp", world_from_light=matrix((0, 0, 1000)), power_w=100, falloff=Falloff(2))
    assert stated(far) >= stated(PointLight(name="lamp", world_from_light=matrix((0, 0, 2.5)), power_w=100))
