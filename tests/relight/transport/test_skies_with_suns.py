# SPDX-License-Identifier: GPL-3.0-or-later
"""A sky and its sun are one light: recorded, mixed, re-lit with a new spectrum, and swept together."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spectral_core.explore.sweep.compute import rendering
from spectral_core.render import render_scene
from spectral_core.render.relight.groups import group_light, one_group_per_light
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storages import storage_named
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import Color, Film, ImageTexture, PointLight, RenderSettings, Scene, SunLight, World
from spectral_core.spectra import catalogue
from tests.render.scenes import lit_plane, looking_down, matrix

pytest.importorskip("mitsuba")


def _scene(watts: float = 40.0, sky: float = 0.4, white: Any = None) -> Scene:
    pixels = np.full((4, 8, 3), (0.2, 0.5, 1.0), np.float32)
    sun = SunLight(
        name="World sun 1", world_from_light=np.eye(4), color=Color([1.0, 0.7, 0.4]), irradiance=2.0 * sky,
        is_of_world=True,
    )  # fmt: skip
    lamp = PointLight(name="Lamp", world_from_light=matrix((0.5, 0, 2)), power_w=watts, radius=0.1)
    settings = RenderSettings(white=white, transport=None if white is None else "spectral")
    scene = lit_plane(lamp, sun, world=World(ImageTexture("sky", pixels, "linear"), sky), settings=settings)
    return replace(scene, camera=looking_down(4, 0.3), film=Film(4, 4, samples=256, seed=2))


def _mean(pixels: Any) -> Any:
    return pixels[..., :3].mean(axis=(0, 1))


def _rendered(scene: Scene) -> Any:
    return _mean(render_scene(scene, sampling_lights=SAMPLING_LIGHTS).pixels)


def test_the_sun_of_a_sky_is_in_the_group_of_the_world() -> None:
    grouped = one_group_per_light(_scene())
    assert [light.group for light in grouped.lights] == ["Lamp", "World"]
    assert grouped.world.group == "World"
    plain = replace(
        _scene(), lights=tuple(replace(each, is_of_world=False) for each in _scene().lights if each.name != "Lamp")
    )
    assert [light.group for light in one_group_per_light(plain).lights] == ["World sun 1"]


@pytest.mark.parametrize("storage", ["dial", "bands61", "exact"])
def test_a_mixture_dims_the_sun_with_its_sky(storage) -> None:
    transport = record_transport(_scene(), storage_named(storage), one_per_light=True)
    assert transport.groups == ("Lamp", "World")
    mixed = _mean(relight(transport, mix={"Lamp": 0.5, "World": 3.0}))
    assert mixed == pytest.approx(_rendered(_scene(20.0, 1.2)), rel=0.03)


def test_a_new_lamp_replaces_the_white_of_the_sky_and_of_its_sun() -> None:
    transport = record_transport(_scene(0.0), storage_named("bands121"), one_per_light=True)
    lamp = catalogue.illuminant("A")
    assert _mean(relight(transport, lights={"World": lamp})) == pytest.approx(
        _rendered(_scene(0.0, white=lamp)), rel=0.03
    )
    assert group_light(one_group_per_light(_scene(0.0)), "World") is not None


def test_a_swept_lamp_leaves_the_sun_of_the_sky_as_it_is() -> None:
    relighter = rendering.Relighter()
    for watts in (10.0, 200.0):
        picture = relighter.picture(_scene(watts)).pictures[""]
        assert _mean(picture) == pytest.approx(_rendered(_scene(watts)), rel=0.03)
