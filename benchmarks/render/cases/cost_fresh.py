# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a fifth kind for predictions of error and time: what a stranger may build, made after the predictions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.render.cases.cost_scenes import hair
from benchmarks.render.cases.meshes import at
from benchmarks.render.cases.plan_scenes import POINT, Stage
from spectral_core.scene import (
    AreaLight,
    Color,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    ImageTexture,
    Metal,
    Moment,
    PointLight,
    Principled,
    ScatteringMedium,
    Scene,
    SpotLight,
    SunLight,
    Translucent,
    Transparent,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum


def study(stage: Stage) -> None:
    """A closed room with boards on the floor, a window behind the camera's left, and a lamp on a desk, out of focus."""
    boards = np.repeat(np.random.default_rng(5).uniform(0.25, 0.6, (1, 12, 1)), 12, axis=0) * np.array([1.0, 0.7, 0.45])
    plaster = Diffuse(Color(np.array([0.75, 0.72, 0.65])))
    stage.floor = Principled(ImageTexture("boards", boards.astype(np.float32), "linear"), roughness=0.35)
    for name, place in {
        "back": at(0, 3, 2, 3, ("x", 90)), "left": at(-3, 0, 2, (3, 7, 1), ("y", 90)),
        "right": at(3, 0, 2, (3, 7, 1), ("y", -90)), "roof": at(0, 0, 4.6, 7, ("x", 180)),
        "front": at(0, -6.5, 2, 7, ("x", -90)),
    }.items():  # fmt: skip
        stage.add(name, "square", place, plaster)
    stage.aperture = 0.06
    stage.lights = [
        AreaLight(name="window", world_from_light=at(-2.9, -2.0, 2.4, turn=("y", -90)), power_w=90, size=(1.6, 1.0)),
        SpotLight(name="desk", world_from_light=at(1.2, 1.2, 1.9), power_w=60, cone_angle_rad=1.4, radius=0.04),
    ]
    stage.add("desk", "box", at(1.2, 1.2, 0.4, (0.8, 0.5, 0.4)), Principled(Color(np.array([0.4, 0.2, 0.1]))))
    stage.add("vase", "sphere", at(0.9, 1.0, 1.1, (0.2, 0.2, 0.3)), Principled(Color(np.array([0.1, 0.3, 0.6]))))


def terrarium(stage: Stage) -> None:
    """A box of glass with mist and a plant's ball inside, under a soft lamp."""
    stage.lights = [AreaLight(name="lamp", world_from_light=at(0.3, -0.4, 3.6), power_w=150, size=(1.2, 1.2))]
    stage.add("glass", "box", at(0, 0, 0.8, (1.0, 0.7, 0.75)), Glass())
    stage.add("air", "box", at(0, 0, 0.8, (0.95, 0.65, 0.7)), Glass(ior=1 / 1.5))
    stage.media["air"] = ScatteringMedium(0.3, gray(0.9))
    stage.add("plant", "sphere", at(0, 0, 0.6, 0.4), Diffuse(Color(np.array([0.15, 0.4, 0.1]))))


def stained_window(stage: Stage) -> None:
    """Sheets of colored foil between a lamp and white paint, and a lamp shade of paper."""
    stage.floor = Diffuse(gray(0.8))
    stage.lights = [replace(POINT, radius=0.08, power_w=300)]
    for k, rgb in enumerate(([0.9, 0.1, 0.1], [0.1, 0.7, 0.2], [0.15, 0.2, 0.9], [0.9, 0.8, 0.1])):
        place = at(-0.9 + 0.6 * (k % 2) + 0.6, -0.6 + 0.6 * (k // 2), 1.4, 0.28)
        stage.add(f"foil {k}", "square", place, Transparent(Color(np.array(rgb))))
    stage.add("shade", "square", at(-1.4, 0.8, 0.7, 0.7, ("x", 80)), Translucent(Color(np.array([0.8, 0.7, 0.5]))))


def jewels(stage: Stage) -> None:
    """Balls and a wedge of flint glass, which disperses, on dark cloth under two lamps."""
    knots = np.arange(360.0, 831.0, 10.0)
    flint = Glass(ior=Spectrum("flint", SpectralGrid(knots), 1.65 + 18000 / knots**2))
    stage.floor = Diffuse(Color(np.array([0.12, 0.1, 0.15])))
    stage.lights = [
        AreaLight(name="left", world_from_light=at(-1.5, -1.0, 3.0), power_w=120, size=(0.6, 0.6)),
        AreaLight(name="right", world_from_light=at(1.5, -0.5, 3.0), power_w=80, size=(0.6, 0.6)),
    ]
    stage.add("wedge", "wedge", at(0.9, 0, 0.4), flint)
    for k in range(3):
        stage.add(f"ball {k}", "sphere", at(-1.4 + 0.8 * k, 0.3 * (-1) ** k, 0.35, 0.35), flint)


def street(stage: Stage) -> None:
    """Twenty-four sodium and mercury lamps above a wet street in thin mist, and painted boxes."""
    stage.floor = Principled(Color(np.array([0.15, 0.15, 0.16])), roughness=0.3)
    kinds = [catalogue.illuminant("HP1"), catalogue.illuminant("HP4")]
    stage.lights = [
        SpotLight(name=f"lamp {k}", world_from_light=at(-2.8 + 0.8 * (k % 8), -1.5 + 2.0 * (k // 8), 2.6), radius=0.05,
                  power_w=25, cone_angle_rad=1.8, color=kinds[k % 2])
        for k in range(24)
    ]  # fmt: skip
    stage.add("mist", "box", at(0, 0, 1.5, (3.0, 3.0, 1.45)), None)
    stage.media["mist"] = ScatteringMedium(0.04, gray(0.95), anisotropy=0.5)
    for k, rgb in enumerate(([0.7, 0.1, 0.1], [0.1, 0.2, 0.6], [0.2, 0.5, 0.1])):
        stage.add(f"box {k}", "box", at(-1.4 + 1.4 * k, 0.4, 0.4, 0.35), Diffuse(Color(np.array(rgb))))


def racing_ball(stage: Stage) -> None:
    """A glossy ball that crosses a checkered floor under a sun; ``fresh_scene`` adds the motion."""
    cells = (np.indices((12, 12)).sum(axis=0) % 2)[..., None] * np.array([0.5, 0.5, 0.4]) + 0.15
    stage.floor = Diffuse(ImageTexture("cells", cells.astype(np.float32), "linear"))
    stage.lights = [SunLight(name="sun", world_from_light=at(turn=("x", 35)), irradiance=3.0, angle_rad=0.2)]
    stage.world = World(Color(np.array([0.2, 0.3, 0.45])))
    stage.add("ball", "sphere", at(-0.9, 0, 0.6, 0.5), Glossy(Color(np.array([0.8, 0.5, 0.2])), 0.25))


def fur(stage: Stage) -> None:
    """A tuft of hair between three lamps of different colors, in front of a wall."""
    hair(stage)
    colors = ([1.0, 0.6, 0.4], [0.4, 0.6, 1.0], [0.9, 1.0, 0.8])
    stage.lights = [
        PointLight(name=f"lamp {k}", world_from_light=at(-2.0 + 2.0 * k, -1.5 + 1.8 * (k == 1), 2.5), radius=0.15,
                   power_w=80, color=Color(np.array(rgb)))
        for k, rgb in enumerate(colors)
    ]  # fmt: skip
    stage.add("wall", "square", at(0, 1.8, 1.5, (3, 1.5, 1), ("x", 90)), Diffuse(gray(0.6)))


def pots(stage: Stage) -> None:
    """Rough copper, steel and enamel under an image of a studio with two bright panels."""
    rows = 0.15 * np.ones((64, 128, 3))
    rows[30:50, 15:25] = 12.0
    rows[25:45, 80:84] = np.array([6.0, 8.0, 12.0])
    stage.lights, stage.world = [], World(ImageTexture("studio", rows.astype(np.float32), "linear"))
    copper = Metal(Color(np.array([0.9, 0.5, 0.35])), gray(0.95), 0.3)
    stage.add("copper", "sphere", at(-1.2, 0, 0.5, 0.5), copper)
    stage.add("steel", "box", at(0, 0.4, 0.5, 0.5), Metal(gray(0.6), gray(0.8), 0.12))
    enamel = Principled(Color(np.array([0.7, 0.75, 0.8])), roughness=0.2, coat_weight=1.0)
    stage.add("enamel", "sphere", at(1.2, 0, 0.5, 0.5), enamel)


def shop(stage: Stage) -> None:
    """Emissive signs of line spectra behind a pane of clear glass, blurred by a wide lens, above a satin floor."""
    stage.aperture = 0.08
    stage.floor = Glossy(gray(0.5), 0.3)
    stage.lights = [replace(POINT, power_w=40, radius=0.2)]
    tube = catalogue.illuminant("FL11")
    for k in range(3):
        stage.add(f"sign {k}", "box", at(-1.2 + 1.2 * k, 1.2, 1.0, (0.4, 0.04, 0.06)), Emission(tube, 6.0))
    stage.add("pane", "box", at(0, 0.6, 1.0, (2.0, 0.03, 0.9)), Glass())
    stage.add("doll", "sphere", at(0.2, 1.0, 0.4, 0.4), Diffuse(Color(np.array([0.7, 0.3, 0.3]))))


def basin(stage: Stage) -> None:
    """Water in a basin of tiles under the sun: its light arrives on one path in many thousands."""
    cells = (np.indices((16, 16)).sum(axis=0) % 2)[..., None] * np.array([0.1, 0.2, 0.25]) + 0.4
    stage.floor = Diffuse(ImageTexture("tiles", cells.astype(np.float32), "linear"))
    stage.world = World(Color(np.array([0.25, 0.35, 0.5])))
    stage.lights = [SunLight(name="sun", world_from_light=at(turn=("x", 25)), irradiance=3.0)]
    stage.add("water", "box", at(0, 0, 0.3, (1.8, 1.2, 0.28)), Glass(ior=1.33))
    stage.add("duck", "sphere", at(1.2, -0.3, 0.8, 0.25), Diffuse(Color(np.array([0.8, 0.65, 0.1]))))


FRESH: dict[str, Callable[[Stage], None]] = {
    effect.__name__.replace("_", " "): effect
    for effect in (study, terrarium, stained_window, jewels, street, racing_ball, fur, pots, shop, basin)
}


def fresh_scene(name: str, size: tuple[int, int]) -> Scene:
    """One of these scenes."""
    stage = Stage()
    FRESH[name](stage)
    scene = stage.scene(size, 1.0)
    if name == "racing ball":
        ball = next(instance for instance in scene.instances if instance.name == "ball")
        along = [replace(ball, world_from_object=at(-0.9 + 0.25 * k, 0, 0.6, 0.5)) for k in range(6)]
        scene = replace(scene, moments=tuple(Moment(scene.camera, (place,)) for place in along))
    return scene
