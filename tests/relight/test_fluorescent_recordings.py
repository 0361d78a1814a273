# SPDX-License-Identifier: GPL-3.0-or-later
"""Recordings of scenes with fluorescent dyes: mixtures equal renders, and other storages are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError
from spectral_core.render import render_scene
from spectral_core.render.relight.mix import relight
from spectral_core.render.relight.sampling import SAMPLING_LIGHTS
from spectral_core.render.relight.storages import storage_named
from spectral_core.render.relight.transport import record_transport
from spectral_core.scene import Film, Fluorescent, PointLight, RenderSettings, Scene, World, gray
from spectral_core.spectra import catalogue
from spectral_core.spectra.fluorescence import FluorescentDye
from tests.render.scenes import lit_plane, looking_down, matrix

pytest.importorskip("mitsuba")


def _scene(amount: float, sodium: float = 60.0) -> Scene:
    """A dyed floor under a sodium lamp and daylight."""
    above = matrix((0, 0, 3))
    return lit_plane(
        PointLight(
            name="Sodium", world_from_light=above, power_w=sodium, group="Sodium", color=catalogue.illuminant("HP1")
        ),
        world=World(gray(0.3), group="Day"),
        surface=Fluorescent(gray(0.3), (FluorescentDye.gaussian("green", 430, 560),), (amount,)),
        camera=looking_down(4, 0.3),
        film=Film(3, 3, samples=512, seed=3),
        settings=RenderSettings(transport="spectral"),
    )


@pytest.mark.parametrize("storage", ["bands31", "bands121", "exact"])
def test_storages_that_keep_spectra_are_refused_with_one_that_is_right(storage) -> None:
    with pytest.raises(InvalidInputError, match="fluorescent dyes.*record Mixtures"):
        record_transport(_scene(0.5), storage_named(storage))


def test_faint_or_overridden_dyes_are_recorded() -> None:
    film = Film(2, 2, samples=2)
    record_transport(replace(_scene(1e-6), film=film), storage_named("bands31"))
    off = RenderSettings(transport="spectral", overrides=(("fluorescence", "off"),))
    record_transport(replace(_scene(0.5), film=film, settings=off), storage_named("bands31"))


def test_a_mixture_with_dyes_equals_its_render() -> None:
    mixed = relight(record_transport(_scene(0.5), storage_named("dial")), mix={"Sodium": 2.5})[..., :3]
    rendered = render_scene(_scene(0.5, 150.0), sampling_lights=SAMPLING_LIGHTS).pixels[..., :3]
    assert mixed.mean(axis=(0, 1)) == pytest.approx(rendered.mean(axis=(0, 1)), rel=0.03)
    plain = render_scene(_scene(0.0, 150.0)).pixels[..., :3]
    assert np.abs(plain.mean(axis=(0, 1)) / rendered.mean(axis=(0, 1)) - 1).max() > 0.1
