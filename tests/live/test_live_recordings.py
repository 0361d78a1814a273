# SPDX-License-Identifier: GPL-3.0-or-later
"""Launches that are recorded and kernels that are compiled for an edit: none, where only numbers or places change."""

from __future__ import annotations

import gc
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.scene import (
    Camera,
    Computed,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Instance,
    Material,
    Metal,
    Principled,
    RenderSettings,
    Scene,
    Sheen,
    Subsurface,
    SunLight,
    Toon,
    Translucent,
    Transparent,
    gray,
)
from spectral_core.scene.shading import Builder
from tests.live import test_live_session as session
from tests.live.test_live_session import HEIGHT, SAMPLES, WIDTH, at, with_light, with_stretch

scene = session.scene
PALE = gray(0.6)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_edits_of_meshes_record_nothing(scene: Scene, transport: Literal["rgb", "spectral"]) -> None:
    scene = replace(scene, settings=RenderSettings(transport=transport))
    stage = Stage()
    stage.show(scene)
    stage.activate()

    def trace(seen: Scene) -> None:
        request = ViewRequest("stage", Viewpoint.of_camera(seen.camera, seen.film), WIDTH, HEIGHT, SAMPLES, 0)
        stage.look_from(request.viewpoint)
        ViewPicture(stage.launcher, request, 4).step()

    trace(scene)
    before = stage.launcher.recordings
    assert stage.launcher.is_recorded, "launches are made anew each time, which takes many times as long"
    assert before == 1
    for name in ("two", "one"):
        scene = with_stretch(scene, name, (1.0, 1.0, 1.6))
        stage.show(scene)
        assert stage.how == "meshes"
        trace(scene)
    assert stage.launcher.recordings == before


def test_no_closure_keeps_what_it_computed(scene: Scene) -> None:
    """A closure that stores a value of the traced loop, such as the hit, ends the recording of the next launch."""
    kinds = (
        Diffuse(PALE), Diffuse(PALE, 0.5), Glossy(PALE, 0.3), Metal(PALE, roughness=0.3), Glass(roughness=0.2),
        Translucent(PALE), Toon(PALE), Transparent(), Sheen(PALE, 0.4), Subsurface(PALE), Emission(PALE),
        Principled(PALE, roughness=0.4, diffuse_roughness=0.3, coat_weight=0.5, anisotropic=0.5),
        Principled(PALE, transmission=0.5, sheen_weight=0.5, subsurface_weight=0.2),
    )  # fmt: skip
    materials = tuple(Material(f"kind {k}", surface) for k, surface in enumerate(kinds))
    more = tuple(Instance(f"more {k}", "two", at(k, 1, 2), (f"kind {k}",)) for k in range(len(kinds)))
    scene = replace(scene, materials=scene.materials + materials, instances=scene.instances + more)
    stage = Stage()
    for number in range(3):
        moved = replace(scene.instances[-1], world_from_object=at(number, 2, 2))
        seen = replace(scene, instances=(*scene.instances[:-1], moved))
        stage.show(seen)
        stage.activate()
        request = ViewRequest("stage", Viewpoint.of_camera(seen.camera, seen.film), WIDTH, HEIGHT, SAMPLES, 0)
        stage.look_from(request.viewpoint)
        ViewPicture(stage.launcher, request, 4).step()
        assert stage.launcher.is_recorded
    assert stage.launcher.recordings == 1


def test_launches_are_recorded_beside_another_scene_that_was_not_traced_yet(scene: Scene) -> None:
    """Of its sun, the numbers that follow the size of the scene were not known; each launch was then traced anew."""
    sun = SunLight(name="sun", world_from_light=at(0, 0, 5), irradiance=2.0, angle_rad=0.0)
    first, second = Stage(), Stage()
    first.show(replace(scene, lights=(sun,)))
    second.show(replace(scene, lights=(sun, *scene.lights)))
    request = ViewRequest("stage", Viewpoint.of_camera(scene.camera, scene.film), WIDTH, HEIGHT, SAMPLES, 0)
    for stage in (first, second):
        stage.activate()
        stage.look_from(request.viewpoint)
        ViewPicture(stage.launcher, request, 4).step()
        assert stage.launcher.is_recorded


@pytest.mark.parametrize("name", ["window", "step_x"])
def test_launches_are_recorded_where_materials_read_the_camera(scene: Scene, name: str) -> None:
    """Bumps and Window coordinates, say: launches were traced anew, as the camera was not among their inputs."""
    build = Builder()
    color = Computed(build.program(build.add("vector_input", (), name, 0)))
    scene = replace(scene, materials=tuple(Material(m.name, Diffuse(color)) for m in scene.materials))
    turned = replace(scene.camera, world_from_camera=at(0, 0, 9), kind="orthographic", orthographic_scale=12.0)

    def pictured(stage: Stage, camera: Camera) -> np.ndarray:
        stage.activate()
        viewpoint = Viewpoint.of_camera(camera, scene.film)
        stage.look_from(viewpoint, WIDTH)
        picture = ViewPicture(stage.launcher, ViewRequest("stage", viewpoint, WIDTH, HEIGHT, 1, 0), 4)
        while not picture.is_done:
            picture.step()
        assert stage.launcher.is_recorded
        return picture.pixels()

    stage, other = Stage(), Stage()
    stage.show(scene)
    before = pictured(stage, scene.camera)
    brighter = with_light(scene, "key", power_w=500.0)
    stage.show(brighter)  # the launcher collects its inputs again
    assert stage.how == "lights"
    pictured(stage, scene.camera)
    after = pictured(stage, turned)
    assert stage.launcher.recordings == 1
    other.show(brighter)
    np.testing.assert_allclose(after, pictured(other, turned), atol=1e-5)
    assert np.abs(after - before).mean() > 1e-3


def test_another_object_compiles_no_kernel(scene: Scene) -> None:
    import drjit as dr

    gc.collect()  # scenes of earlier tests occupy numbers of Mitsuba's registry
    stage = Stage()
    compiled = []
    for count in range(3):
        more = tuple(Instance(f"more {k}", "two", at(k, 1, 2), ("shiny",)) for k in range(count))
        seen = replace(scene, instances=scene.instances + more)
        stage.show(seen)
        assert stage.how == "loaded"
        viewpoint = Viewpoint.of_camera(seen.camera, seen.film)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            stage.look_from(viewpoint)
            ViewPicture(stage.launcher, ViewRequest("stage", viewpoint, WIDTH, HEIGHT, SAMPLES, 0), 4).step()
            compiled.append(sum(not each["cache_hit"] for each in dr.kernel_history() if "cache_hit" in each))
    assert compiled[1:] == [0, 0]
