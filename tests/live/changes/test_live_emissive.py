# SPDX-License-Identifier: GPL-3.0-or-later
"""A live view, and a render beside a Volume object, keep the rules of emissive objects: visibility and linking.

What such an object must not light looks as it does without the object.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    PointLight,
    Rays,
    RenderSettings,
    Scene,
    VolumeObject,
    gray,
)
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction

SAMPLES = 256


def at(x: float, y: float, z: float) -> np.ndarray:
    placed = np.eye(4)
    placed[:3, 3] = x, y, z
    return placed


def square(name: str, half: float) -> Mesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * half
    return Mesh(name, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uvs=(corners[:, :2] / half / 2 + 0.5))


EVEN = Emission(Color([1.0, 0.5, 0.2]), 5.0)
STRIPES = Emission(ImageTexture("stripes", np.tile([[[0.1] * 3, [1.0] * 3]], (2, 4, 1)).astype(np.float32)), 5.0)
LAMP = PointLight(name="lamp", world_from_light=at(2, 0, 3), power_w=20.0, radius=0.1)
FLOOR = Instance("floor", "floor", np.eye(4), ("gray",))
PANE = Instance("pane", "pane", at(0, 0, 2), ("glow",))
STRIPED = Instance("striped", "pane", at(0, 1.2, 2), ("stripes",))
LID = Instance("lid", "lid", at(0, 0, 1), ("gray",), hidden_from=Rays.CAMERA | Rays.DIFFUSE)


def scene_of(*instances: Instance, lights: tuple = ()) -> Scene:
    """A floor from below the pane: the picture shows nothing but the floor."""
    return Scene(
        camera=Camera(world_from_camera=at(0, 0, 0.8), field_of_view_rad=0.8),
        film=Film(8, 8, samples=SAMPLES, seed=3),
        meshes=(square("floor", 6), square("pane", 0.5), square("lid", 2)),
        materials=(Material("gray", Diffuse(gray(0.5))), Material("glow", EVEN), Material("stripes", STRIPES)),
        instances=instances,
        lights=lights,
        settings=RenderSettings(transport="rgb", max_bounces=1),
    )


def live(scene: Scene) -> float:
    """Mean of the picture as a view traces it."""
    job = RenderJob(scene, plan_from_data(scene, 0.0), Measure(movable=True))
    job.trace(SAMPLES)
    return float(job.picture()[..., :3].mean())


@pytest.mark.parametrize("lights", [(), (LAMP,)], ids=["alone", "beside a lamp"])
def test_emissive_objects_do_not_light_what_their_rules_except(lights: tuple) -> None:
    """One that is evenly bright, and one whose brightness varies."""
    without, even = live(scene_of(FLOOR, lights=lights)), live(scene_of(FLOOR, PANE, lights=lights))
    lit = live(scene_of(FLOOR, PANE, STRIPED, lights=lights))
    assert without + 0.05 < even < lit - 0.02
    unlit = replace(FLOOR, unlit_by=("pane", "striped"))
    hidden = (replace(each, hidden_from=Rays.DIFFUSE) for each in (PANE, STRIPED))
    for placed in ((FLOOR, *hidden), (unlit, PANE, STRIPED)):
        assert live(scene_of(*placed, lights=lights)) == pytest.approx(without, rel=0.02, abs=1e-6)
    glossy = (replace(each, hidden_from=Rays.GLOSSY | Rays.SHADOW) for each in (PANE, STRIPED))
    assert live(scene_of(FLOOR, *glossy, lights=lights)) == pytest.approx(lit, rel=0.02)


def test_an_object_that_casts_no_shadow_of_an_emissive_one_lets_its_light_pass() -> None:
    lit, dark = live(scene_of(FLOOR, PANE)), live(scene_of(FLOOR, PANE, LID))
    assert dark < 0.3 * lit
    assert live(scene_of(FLOOR, PANE, replace(LID, clear_for=("pane",)))) == pytest.approx(lit, rel=0.02)


def test_a_render_beside_a_volume_object_keeps_the_rules_of_emissive_objects() -> None:
    """Mitsuba's own emitters light such a scene, too."""
    clear = TransferFunction((VolumeMaterial("clear", [0, 1], [0, 1e-9], [1, 1, 1]),))
    far = VolumeObject("volume", np.ones((2, 2, 2), np.float32), at(0, 0, 50), clear)

    def rendered(*placed: Instance) -> float:
        scene = replace(scene_of(*placed, lights=(LAMP,)), volumes=(far,))
        job = RenderJob(scene, plan_from_data(scene, 0.0))
        job.trace(SAMPLES)
        return float(job.picture()[..., :3].mean())

    without, lit = rendered(FLOOR), rendered(FLOOR, PANE)
    assert lit > without + 0.05
    for placed in ((FLOOR, replace(PANE, hidden_from=Rays.DIFFUSE)), (replace(FLOOR, unlit_by=("pane",)), PANE)):
        assert rendered(*placed) == pytest.approx(without, rel=0.02)
