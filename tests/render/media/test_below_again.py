# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that goes below surfaces several times, each time in a channel that carries light."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Film,
    Instance,
    Material,
    PointLight,
    RenderSettings,
    Scene,
    Subsurface,
    gray,
)
from spectral_core.scene.geometry import unit_box
from tests.render.scenes import matrix


def picture(transport: str, bounces: int) -> Any:
    """Linear RGB of the inside of a closed box of 8 units with a lamp, whose walls light goes below."""
    return render_scene(
        Scene(
            camera=Camera(world_from_camera=matrix((0, 0, 2)), field_of_view_rad=1.2),
            film=Film(12, 12, samples=32),
            meshes=(unit_box(),),
            materials=(Material("wall", Subsurface(gray(0.8), radius=(1.0, 0.2, 0.1), scale=0.05)),),
            instances=(Instance("room", unit_box().name, matrix((-4, -4, -4), 8.0), ("wall",)),),
            lights=(PointLight(name="lamp", world_from_light=matrix((0.5, 0, 1)), power_w=1000, radius=0.2),),
            settings=RenderSettings(transport=transport, max_bounces=bounces),  # type: ignore[arg-type]
        )
    ).pixels[..., :3]


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_walks_in_turn_keep_to_the_channel_that_carries_the_light(transport: str) -> None:
    """Each walk drew its channel anew, so that few paths carried all light of later bounces: four times the noise of
    color with eight bounces, and dark pictures, since these few were missing.
    """

    def noise_of_color(bounces: int) -> float:
        pixels = picture(transport, bounces)
        red, _, blue = np.moveaxis(pixels / pixels.mean(axis=(0, 1)), 2, 0)
        return float(np.std(red - blue))

    assert noise_of_color(8) < 1.4 * noise_of_color(1)
