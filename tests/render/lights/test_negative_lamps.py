# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps of negative power and worlds of negative strength take light away, whatever their color is given by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.scene import AreaLight, Color, Film, PointLight, RenderSettings, SpotLight, SunLight, World
from spectral_core.spectra.catalogue import illuminant
from tests.render.scenes import lit_plane, looking_down, matrix

PLACE = matrix((0.2, 0.1, 3.0))


def _lamp(kind: type, power: float, color: Any) -> Any:
    own = {"irradiance": power / 50} if kind is SunLight else {"power_w": power}
    if kind is AreaLight:
        own |= {"shape": "rectangle"}
    return kind(name=f"{power:g}", world_from_light=PLACE, color=color, **own)


@pytest.mark.parametrize("kind", [PointLight, SunLight, SpotLight, AreaLight])
@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("color", [illuminant("HP1"), Color(np.array([1.0, 0.5, 0.2]))], ids=["spectrum", "color"])
def test_a_lamp_of_negative_power_takes_half_of_the_light(kind: type, transport: str, color: Any) -> None:
    """With a measured spectrum the render failed: no light's power is below 0."""

    def mean(*powers: float) -> Any:
        lamps = [_lamp(kind, power, color) for power in powers]
        settings = RenderSettings(transport=transport)  # type: ignore[arg-type]
        film = Film(4, 4, samples=64, seed=3)
        scene = lit_plane(*lamps, film=film, camera=looking_down(4, 0.3), settings=settings)
        return render_scene(scene).pixels[..., :3].mean(axis=(0, 1))

    alone = mean(20.0, 30.0)  # two lamps, too: the same kernel renders both
    np.testing.assert_allclose(mean(100.0, -50.0), alone, rtol=0.03, atol=1e-3 * alone.max())


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("color", [illuminant("HP1"), Color(np.array([1.0, 0.5, 0.2]))], ids=["spectrum", "color"])
def test_a_world_of_negative_strength_takes_light_away(transport: str, color: Any) -> None:
    """With a spectrum it was dark: no strength of a world was below 0."""

    def mean(strength: float) -> Any:
        settings = RenderSettings(transport=transport)  # type: ignore[arg-type]
        scene = lit_plane(
            _lamp(SunLight, 250.0, color), film=Film(4, 4, samples=64, seed=3), camera=looking_down(4, 0.3),
            world=World(color, strength), settings=settings,
        )  # fmt: skip
        return render_scene(scene).pixels[..., :3].mean(axis=(0, 1))

    alone, less, more = (mean(strength) for strength in (0.0, -0.5, 0.5))
    np.testing.assert_allclose(less + more, 2 * alone, rtol=0.01, atol=1e-3 * alone.max())
    assert less[0] < 0.7 * alone[0]
