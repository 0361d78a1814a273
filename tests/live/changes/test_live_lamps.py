# SPDX-License-Identifier: GPL-3.0-or-later
"""A live view chooses among lamps by their light: less noise than by equal chances, the same mean, also after edits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render.job import Measure, RenderJob
from spectral_core.render.lights.mitsuba_lights import ChosenEmitters, MitsubaLights
from spectral_core.render.live.picture import ViewPicture
from spectral_core.render.live.stage import Stage
from spectral_core.render.live.view import Viewpoint, ViewRequest
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.render.trace.accumulate import Accumulator
from spectral_core.scene import (
    AreaLight,
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
    SpotLight,
    SunLight,
    World,
    gray,
)
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

WIDTH, HEIGHT, SAMPLES, SEEDS = 24, 16, 16, 8


def at(x: float, y: float, z: float) -> np.ndarray:
    placed = np.eye(4)
    placed[:3, 3] = x, y, z
    return placed


def square(name: str, half: float) -> Mesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32) * half
    return Mesh(name, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))


def line(center_nm: float) -> Spectrum:
    nm = np.arange(380.0, 781.0)
    return Spectrum(f"{center_nm:g} nm", SpectralGrid(nm), np.exp(-(((nm - center_nm) / 15) ** 2)))


def scene_of(lights: tuple, transport: str = "rgb", **changes) -> Scene:
    """A floor from above; an emissive pane is added with the name of its material."""
    made = Scene(
        camera=Camera(world_from_camera=at(0, 0, 9), field_of_view_rad=0.8),
        film=Film(WIDTH, HEIGHT, samples=SAMPLES, seed=1, filter_kind="box", filter_width=1.0),
        meshes=(square("floor", 6), square("pane", 0.4)),
        materials=(Material("gray", Diffuse(gray(0.5))), Material("glow", Emission(Color([1.0, 0.5, 0.2]), 1.0))),
        instances=(Instance("floor", "floor", np.eye(4), ("gray",)),),
        lights=lights,
        settings=RenderSettings(transport=transport, max_bounces=1),
    )
    return replace(made, **changes)


def sky() -> World:
    pixels = np.full((16, 32, 3), 0.2, np.float32)
    pixels[12, 5] = 50.0
    return World(ImageTexture("sky", pixels, color_space="linear"), 0.5)


LEFT = PointLight(name="left", world_from_light=at(-2, 0, 2), power_w=500.0, radius=0.1)
RIGHT = PointLight(name="right", world_from_light=at(2, 0, 2), power_w=5.0, radius=0.1)
MANY = tuple(
    kind(name=f"{kind.__name__} {k}", world_from_light=at(1.5 * k - 6, 3 * np.sin(k), 2.0), **numbers)
    for k, (kind, numbers) in enumerate(
        [
            (PointLight, {"power_w": 30.0, "radius": 0.05}),
            (AreaLight, {"power_w": 10.0, "size": (0.5, 0.3)}),
            (SpotLight, {"power_w": 200.0, "cone_angle_rad": 0.9, "blend": 0.2}),
        ]
        * 3
    )
)
SUN = SunLight(name="sun", world_from_light=at(0, 0, 0), irradiance=0.3, angle_rad=0.02)
COLORED = tuple(
    replace(RIGHT, name=f"{nm} nm", world_from_light=at(x, 1, 2), power_w=power, color=line(nm))
    for nm, x, power in ((450.0, -2, 600.0), (540.0, 0, 20.0), (620.0, 2, 5.0))
)
EMISSIVE = (Instance("floor", "floor", np.eye(4), ("gray",)), Instance("pane", "pane", at(1, 0, 1), ("glow",)))
CASES = {
    "two of 100 to 1": (scene_of((LEFT, RIGHT)), 2.0),
    "nine": (scene_of(MANY), 4.0),
    "lamps and a sky": (scene_of((LEFT, RIGHT, SUN), world=sky()), 0.5),
    "lamps and gray": (scene_of((LEFT, SUN), world=World(gray(0.2))), 2.0),
    "emissive mesh": (scene_of((LEFT, RIGHT), instances=EMISSIVE), 2.0),
    "colored, RGB": (scene_of(COLORED), 2.0),
    "colored, spectral": (scene_of(COLORED, "spectral"), 2.0),
}


def traced(job: RenderJob) -> np.ndarray:
    """(seeds, height, width, 3): independent pictures of a loaded scene."""
    loaded, found = job.loaded, []
    for seed in range(SEEDS):
        sums = Accumulator(
            loaded.mitsuba, job.scene.camera, replace(job.scene.film, seed=10 + seed), loaded.wavelengths
        )
        for _ in sums.add(loaded.first_hit, loaded.integrator, SAMPLES):
            pass
        found.append(sums.picture()[..., :3].astype(float))
    return np.array(found)


def loaded(scene: Scene) -> RenderJob:
    """A scene as a view loads it."""
    return RenderJob(scene, plan_from_data(scene, 0.0), Measure(movable=True))


def rendered(scene: Scene, *counts: int) -> list[np.ndarray]:
    """The picture of F12 after each number of samples."""
    job, found = RenderJob(scene, plan_from_data(scene, 0.0)), []
    for count in counts:
        job.trace(count - job.samples)
        found.append(job.picture()[..., :3].astype(float))
    return found


@pytest.mark.parametrize("name", CASES)
def test_lamps_are_chosen_by_their_light(name: str) -> None:
    scene, gain = CASES[name]
    job = loaded(scene)
    by_light = traced(job)
    job.loaded.integrator.lights = MitsubaLights(job.mitsuba, job.loaded.scene.scene)  # with equal chances
    by_number = traced(job)
    assert by_number.var(axis=0, ddof=1).mean() > gain * by_light.var(axis=0, ddof=1).mean()
    means, limit = by_light.mean(axis=(1, 2)), rendered(scene, 2048)[0].mean(axis=(0, 1))
    error = means.std(axis=0, ddof=1) / np.sqrt(SEEDS) + 3e-4 * limit
    assert np.all(np.abs(means.mean(axis=0) - limit) < 4 * error)


def test_linked_and_hidden_lamps_take_no_samples_where_they_give_no_light() -> None:
    hidden = replace(LEFT, name="hidden", power_w=5e4, hidden_from=Rays.DIFFUSE)
    unlit = replace(LEFT, name="unlit", power_w=5e4)
    floor = replace(EMISSIVE[0], unlit_by=("unlit",))
    alone = traced(loaded(scene_of((LEFT, RIGHT))))
    beside = traced(loaded(scene_of((LEFT, RIGHT, hidden, unlit), instances=(floor,))))
    np.testing.assert_allclose(beside.mean(axis=(0, 1, 2)), alone.mean(axis=(0, 1, 2)), rtol=0.01)
    assert beside.var(axis=0, ddof=1).mean() < 1.2 * alone.var(axis=0, ddof=1).mean()


class View:
    """A stage, and the pictures and kernels of its scenes."""

    def __init__(self) -> None:
        self.stage = Stage()

    def of(self, scene: Scene) -> tuple[np.ndarray, int]:
        """The picture of a scene, and the number of kernels that were compiled for it."""
        import drjit as dr

        self.stage.show(scene)
        self.stage.activate()
        viewpoint = Viewpoint.of_camera(scene.camera, scene.film)
        self.stage.look_from(viewpoint, WIDTH)
        picture = ViewPicture(self.stage.launcher, ViewRequest("stage", viewpoint, WIDTH, HEIGHT, SAMPLES, 0), 4)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            while not picture.is_done:
                picture.step()
            compiled = sum(not each["cache_hit"] for each in dr.kernel_history() if "cache_hit" in each)
        return picture.pixels()[..., :3].astype(float), compiled


def edited(scene: Scene, name: str, **numbers: object) -> Scene:
    return replace(scene, lights=tuple(replace(x, **numbers) if x.name == name else x for x in scene.lights))


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_an_edited_lamp_gets_its_share_at_once_and_compiles_nothing(transport: str) -> None:
    """With the shares of before an edit, a lamp of 1 W that gets 1000 W would have most samples of black."""
    lamps = (replace(LEFT, power_w=1000.0), replace(RIGHT, power_w=1.0, radius=0.0), MANY[1], MANY[2], SUN)
    scene, view = scene_of(lamps, transport, world=sky(), instances=EMISSIVE), View()
    view.of(scene)
    recordings = view.stage.launcher.recordings
    moved = at(-1, -1, 1.5)
    glow = replace(scene.materials[1], surface=replace(scene.materials[1].surface, strength=300.0))
    swapped = edited(edited(scene, "left", power_w=1.0), "right", power_w=1000.0)
    sequence = {
        "swapped": swapped,
        "back": scene,
        "color": edited(swapped, "right", color=Color([0.9, 0.3, 0.1])),
        "place": edited(swapped, "left", world_from_light=moved, power_w=1000.0),
        "size": edited(swapped, MANY[1].name, size=(2.0, 1.0), power_w=2000.0),
        "cone": edited(swapped, MANY[2].name, cone_angle_rad=0.3, power_w=2000.0),
        "sun": edited(swapped, "sun", irradiance=30.0),
        "world": replace(swapped, world=replace(scene.world, strength=5.0)),
        "glow": replace(swapped, materials=(scene.materials[0], glow)),
    }
    # other scenes than that of the view may add types of objects to its kernels, so they come later
    seen_in_view = {}
    for name, seen in sequence.items():
        seen_in_view[name], compiled = view.of(seen)
        assert (view.stage.loads, view.stage.launcher.recordings, compiled) == (1, recordings, 0), name
    for name, seen in sequence.items():
        # the first samples are a thirtieth of the limit, so that they seem to have a sixtieth less noise
        few, limit = rendered(replace(seen, film=replace(seen.film, seed=77)), SAMPLES, 512)
        error, usual = (np.abs(each - limit).mean() for each in (seen_in_view[name], few))
        assert error < 1.5 * usual + 1e-3 * limit.mean(), f"{name}: noise of the view {error:.3g}, of F12 {usual:.3g}"


def test_a_lamp_that_is_switched_off_and_on_is_chosen_again() -> None:
    scene, view = scene_of((LEFT, RIGHT, MANY[1])), View()
    limit = view.of(scene)[0]
    view.of(edited(scene, "left", power_w=0.0))
    np.testing.assert_allclose(view.of(scene)[0], limit, rtol=1e-4, atol=1e-5)
    only = view.of(scene_of((RIGHT,)))[0]
    np.testing.assert_allclose(only.mean(), rendered(scene_of((RIGHT,)), 256)[0].mean(), rtol=0.01)


def test_a_lamp_of_any_strength_and_place_keeps_the_loaded_scene() -> None:
    """F12 follows more bounces under a stronger or nearer lamp; a view would load the scene again at each edit."""
    scene = scene_of((LEFT, RIGHT), settings=RenderSettings(transport="rgb"))
    stage = Stage()
    stage.show(scene)
    bounces = {plan_from_data(scene).bounces}
    for numbers in ({"power_w": 1e6}, {"power_w": 1e-3}, {"world_from_light": at(0, 0, 0.01)}):
        now = edited(scene, "left", **numbers)
        stage.show(now)
        bounces.add(plan_from_data(now).bounces)
    assert len(bounces) > 1
    assert stage.loads == 1


def test_one_lamp_is_not_chosen() -> None:
    job = RenderJob(scene_of((LEFT,)), plan_from_data(scene_of((LEFT,)), 0.0), Measure(movable=True))
    assert not isinstance(job.loaded.integrator.lights, ChosenEmitters)
