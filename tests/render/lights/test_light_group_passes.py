# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of light groups add up to the picture: with volumes that emit light, and with a world that the camera sees in
another color.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import render_scene
from spectral_core.render.result import RenderResult
from spectral_core.scene import (
    Camera,
    Color,
    Film,
    Instance,
    Material,
    Passes,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    World,
    gray,
)
from spectral_core.scene.geometry import unit_box
from tests.render.scenes import lit_plane, matrix

pytest.importorskip("mitsuba")
LAMP = PointLight(name="lamp", world_from_light=matrix((-1, 0, 3)), power_w=100, group="lamp")
ROOM = lit_plane(
    LAMP,
    camera=Camera(world_from_camera=matrix((0, 0, 8)), field_of_view_rad=0.6),
    film=Film(8, 8, samples=64),
    world=World(gray(0.2), group="sky"),
)
SMALL = replace(ROOM, instances=(replace(ROOM.instances[0], world_from_object=np.diag([0.02, 0.02, 1, 1])),))


def _rendered(scene: Scene, transport: str, transparent: bool, groups: tuple[str, ...]) -> RenderResult:
    settings = RenderSettings(transport=transport, passes=Passes(light_groups=groups))  # type: ignore[arg-type]
    return render_scene(replace(scene, settings=settings, film=replace(scene.film, transparent=transparent)))


def _assert_sum(result: RenderResult, groups: tuple[str, ...]) -> dict[str, np.ndarray]:
    means = {name: result.passes[f"Combined_{name}"][..., :3].mean(axis=(0, 1)) for name in groups}
    np.testing.assert_allclose(sum(means.values()), result.pixels[..., :3].mean(axis=(0, 1)), atol=2e-3)
    return means


@pytest.mark.parametrize(
    ("transport", "transparent"), [("rgb", True), ("spectral", False)], ids=["transparent film", "background"]
)
def test_the_emission_of_a_volume_is_in_the_group_of_its_object(transport: str, transparent: bool) -> None:
    """Two objects of one material, in two groups; the environment behind them is not in a transparent picture."""
    fire = ScatteringMedium(0.5, gray(0.5), emission_strength=1.0, emission_color=Color([1, 0.4, 0.1]))
    box = unit_box()
    low, high = matrix((-1, -1, 0.5), 2.0), matrix((-1, -1, 2.5), 2.0)
    scene = replace(
        SMALL,
        meshes=(*SMALL.meshes, box),
        materials=(*SMALL.materials, Material("fire", None, fire)),
        instances=(
            *SMALL.instances,
            Instance("low", box.name, low, ("fire",), "low"),
            Instance("high", box.name, high, ("fire",), "high"),
        ),
    )
    groups = ("lamp", "sky", "low", "high")
    means = _assert_sum(_rendered(scene, transport, transparent, groups), groups)
    assert means["high"][0] > 1.5 * means["low"][0] > 0.1  # light from below passes the other volume
    assert means["high"][2] < 0.2 * means["high"][0]


@pytest.mark.parametrize("transparent", [False, True], ids=["background", "transparent film"])
def test_the_world_that_the_camera_sees_is_in_the_group_of_the_world(transparent: bool) -> None:
    world = replace(SMALL.world, camera_view=World(Color([0.1, 0.2, 1.0]), 2.0))
    result = _rendered(replace(SMALL, world=world), "rgb", transparent, ("lamp", "sky"))
    means = _assert_sum(result, ("lamp", "sky"))
    assert (means["sky"][2] > 1.0) is not transparent
