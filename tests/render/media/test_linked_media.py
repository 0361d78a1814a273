# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking of objects with volumes."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spectral_core.render import render_scene
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Emission,
    Film,
    Instance,
    Material,
    RenderSettings,
    ScatteringMedium,
    Scene,
    gray,
)
from tests.render.media.test_light_in_media import LAMPS, _column, _once_scattered
from tests.render.media.test_medium import box
from tests.render.scenes import matrix, sphere_mesh

pytest.importorskip("mitsuba")

LEFT, RIGHT = matrix((-1.5, 0, 0)), matrix((1.5, 0, 0))
PANEL = AreaLight(name="panel", world_from_light=matrix((0, -3.0, 2.5)), power_w=40.0, size=(1.0, 1.0))


@pytest.mark.parametrize("floor", [False, True])
def test_fog_without_a_lamp_is_the_integral_over_the_others(floor):
    scene = _column(floor=floor)
    cube, *rest = scene.instances
    scene = replace(scene, instances=(replace(cube, unlit_by=("far",)), *rest))
    expected = _once_scattered(floor=floor, lamps=LAMPS[:1])
    assert expected < 0.6 * _once_scattered(floor=floor)
    assert render_scene(scene).pixels[..., :3].mean() == pytest.approx(expected, rel=0.008)


def _pair(left, right, *lamps, glow=()):
    """Two balls of one material of fog, seen from above; each half of the picture shows one."""
    fog = Material("fog", None, ScatteringMedium(density=1.5, color=gray(0.9)))
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 6)), field_of_view_rad=1.0, near=0.01),
        film=Film(16, 8, samples=256),
        meshes=(sphere_mesh(), box()),
        materials=(fog, Material("glow", Emission(gray(1.0), 20.0)), Material("gray", Diffuse(gray(0.5)))),
        instances=(
            Instance("left", "sphere", LEFT, ("fog",), unlit_by=left),
            Instance("right", "sphere", RIGHT, ("fog",), unlit_by=right),
            *glow,
        ),
        lights=lamps,
        settings=RenderSettings(max_bounces=6),
    )


def _halves(scene):
    pixels = render_scene(scene).pixels[..., :3]
    return pixels[:, :8].mean(), pixels[:, 8:].mean()


def test_objects_that_share_a_material_are_linked_separately():
    """What lights one half alone comes from the other ball, which scatters little over to it."""
    lit = _halves(_pair((), (), PANEL))
    left, right = _halves(_pair((), ("panel",), PANEL))
    assert left == pytest.approx(lit[0], rel=0.06) and right < 0.06 * lit[1]
    assert max(_halves(_pair(("panel",), ("panel",), PANEL))) == 0


def test_an_emissive_object_lights_the_linked_volumes_only():
    lamp = Instance("lamp", "box", matrix((0, -3.0, 1.0), 0.5), ("glow",))
    lit = _halves(_pair((), (), glow=(lamp,)))
    left, right = _halves(_pair(("lamp",), (), glow=(lamp,)))
    assert right > 0.9 * lit[1] and left < 0.2 * lit[0]
