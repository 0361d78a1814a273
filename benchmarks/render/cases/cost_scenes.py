# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes for predictions of error and time beside those of the plan: rare light, media, hair, blur, many lamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.render.cases.meshes import at
from benchmarks.render.cases.plan_scenes import POINT, Stage
from spectral_core.scene import (
    STRAND_SIDES,
    STRAND_TANGENT,
    AreaLight,
    Color,
    Computed,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Hair,
    ImageTexture,
    Mesh,
    Metal,
    Moment,
    PointLight,
    Principled,
    ScatteringMedium,
    Scene,
    SpotLight,
    Subsurface,
    World,
    gray,
)
from spectral_core.scene.geometry import Attribute
from spectral_core.scene.shading import Builder
from spectral_core.spectra import catalogue

_STRANDS = 400


def glossy_floor(stage: Stage) -> None:
    """Small bright balls of light above a rough mirror."""
    stage.floor = Glossy(gray(0.6), 0.4)
    places = ((-1.2, 0.5, 0.6), (0.0, 0.8, 0.9), (1.3, 0.2, 0.5))
    stage.lights = [
        PointLight(name=f"bulb {k}", world_from_light=at(*place), power_w=12, radius=0.04, camera_visible=True)
        for k, place in enumerate(places)
    ]
    stage.add("block", "box", at(0.4, 1.6, 0.5, 0.5), Diffuse(Color(np.array([0.6, 0.3, 0.1]))))


def spot_in_fog(stage: Stage) -> None:
    """A spot lamp's cone in fog, and a ball in it."""
    stage.lights = [
        SpotLight(name="spot", world_from_light=at(0, 0, 3.6), power_w=300, cone_angle_rad=0.6, radius=0.05)
    ]
    stage.add("fog", "box", at(0, 0, 1.9, (2.5, 2.5, 1.85)), None)
    stage.media["fog"] = ScatteringMedium(0.12, gray(0.95))
    stage.add("ball", "sphere", at(0.2, 0, 0.6, 0.5), Diffuse(gray(0.6)))


def bokeh(stage: Stage) -> None:
    """Small lamps far out of focus behind a ball."""
    stage.aperture = 0.12
    stage.add("ball", "sphere", at(0, -0.6, 0.6, 0.5), Diffuse(Color(np.array([0.2, 0.4, 0.7]))))
    for k in range(6):
        place = at(-2.2 + 0.9 * k, 3.5, 0.5 + 0.4 * (k % 2), 0.05)
        stage.add(f"lamp {k}", "sphere", place, Emission(Color(np.array([1.0, 0.7, 0.4])), 150.0))


def papered_room(stage: Stage) -> None:
    """A closed room with patterned walls that one window lights."""
    cells = (np.indices((16, 16)).sum(axis=0) % 2)[..., None] * np.array([0.5, 0.4, 0.2]) + 0.2
    paper = Diffuse(ImageTexture("paper", cells.astype(np.float32), "linear"))
    stage.floor = paper
    for name, place in {
        "back": at(0, 3, 2, 3, ("x", 90)), "left": at(-3, 0, 2, 3, ("y", 90)), "right": at(3, 0, 2, 3, ("y", -90)),
        "roof": at(0, 0, 4.6, 7, ("x", 180)), "front": at(0, -6.5, 2, 7, ("x", -90)),
    }.items():  # fmt: skip
        stage.add(name, "square", place, paper)
    window = at(-2.9, -1.5, 2.2, turn=("y", -90))
    stage.lights = [AreaLight(name="window", world_from_light=window, power_w=150, size=(1.2, 1.2))]
    stage.add("chest", "box", at(0.8, 0.8, 0.5, 0.5), Diffuse(gray(0.5)))


def hair(stage: Stage) -> None:
    """A tuft of hair under a lamp."""
    stage.meshes = (*stage.meshes, _tuft())
    builder = Builder()
    tangent = Computed(builder.program(builder.add("vector_input", (), STRAND_TANGENT, 0)))
    stage.add("tuft", "tuft", at(0, 0, 0.0), Hair(Color(np.array([0.5, 0.25, 0.1])), tangent=tangent))


def _tuft() -> Mesh:
    """Straight strands that spread upward."""
    rng = np.random.default_rng(3)
    turn = 2 * np.pi * np.arange(STRAND_SIDES) / STRAND_SIDES
    positions, normals, faces, ways = [], [], [], []
    ring = np.arange(STRAND_SIDES)
    after = (ring + 1) % STRAND_SIDES
    for k in range(_STRANDS):
        root = np.array([*rng.uniform(-0.5, 0.5, 2), 0.0])
        way = np.array([*(1.2 * root[:2] + rng.normal(0, 0.2, 2)), 1.4])
        along = way / np.linalg.norm(way)
        side = np.cross(along, [0.0, 1.0, 0.3])
        side /= np.linalg.norm(side)
        around = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(along, side)
        positions += [root + 0.012 * around, root + way + 0.004 * around]
        normals += [around, around]
        ways += [np.tile(along, (2 * STRAND_SIDES, 1))]
        first = 2 * STRAND_SIDES * k
        faces += [np.stack([ring, after, after + STRAND_SIDES], axis=1) + first]
        faces += [np.stack([ring, after + STRAND_SIDES, ring + STRAND_SIDES], axis=1) + first]
    return Mesh(
        "tuft", np.concatenate(positions).astype(np.float32), np.concatenate(faces).astype(np.uint32),
        np.concatenate(normals).astype(np.float32), attributes=(Attribute(STRAND_TANGENT, np.concatenate(ways)),),
        is_strands=True,
    )  # fmt: skip


def bottle(stage: Stage) -> None:
    """A green glass bottle on a table, lit by a small lamp."""
    stage.floor = Diffuse(Color(np.array([0.5, 0.3, 0.15])))
    stage.lights = [AreaLight(name="lamp", world_from_light=at(1.2, -0.6, 2.6), power_w=60, size=(0.35, 0.35))]
    green = Glass(color=Color(np.array([0.5, 0.85, 0.6])), roughness=0.05)
    stage.add("body", "sphere", at(0, 0, 0.8, (0.4, 0.4, 0.8)), green)
    stage.add("neck", "sphere", at(0, 0, 1.7, (0.15, 0.15, 0.4)), green)


def colored_lamps(stage: Stage) -> None:
    """Eighty small lamps of many colors among blocks."""
    rng = np.random.default_rng(9)
    lamps = []
    for k in range(80):
        color = Color(np.clip(rng.uniform(0.0, 1.0, 3), 0.05, 1.0))
        place = at(*rng.uniform((-3, -3, 0.4), (3, 3, 2.2)))
        lamps.append(PointLight(name=f"lamp {k}", world_from_light=place, color=color, power_w=3, radius=0.03))
    stage.lights = lamps
    for k in range(6):
        stage.add(f"block {k}", "box", at(-2 + 0.8 * k, (-1) ** k * 0.8, 0.4, (0.25, 0.25, 0.4)), Diffuse(gray(0.6)))


def moving_ball(stage: Stage) -> None:
    """A ball that moves while the shutter is open; ``scene_of`` adds the motion."""
    stage.lights = [replace(POINT, radius=0.3)]
    stage.add("ball", "sphere", at(-0.6, 0, 0.6, 0.5), Diffuse(Color(np.array([0.7, 0.2, 0.1]))))


def skin(stage: Stage) -> None:
    """A ball with subsurface scattering under a soft lamp."""
    stage.lights = [AreaLight(name="lamp", world_from_light=at(1.0, -1.0, 3.0), power_w=100, size=(1.0, 1.0))]
    stage.add("ball", "sphere", at(0, 0, 0.8, 0.8), Subsurface(Color(np.array([0.8, 0.5, 0.4])), scale=0.3))


def lit_by_a_wall(stage: Stage) -> None:
    """A lamp behind a screen lights a wall, and the wall the rest."""
    stage.lights = [SpotLight(name="up", world_from_light=at(-1.5, 1.8, 0.6, turn=("x", 110)), power_w=400,
                              cone_angle_rad=1.6, radius=0.02)]  # fmt: skip
    stage.add("wall", "square", at(0, 3, 2, 3, ("x", 90)), Diffuse(Color(np.array([0.8, 0.75, 0.6]))))
    stage.add("screen", "square", at(-1.5, 1.6, 0.8, (0.9, 0.8, 1), ("x", 90)), Diffuse(gray(0.3)))


def chrome_under_sun(stage: Stage) -> None:
    """Chrome and a coated ball under a sky with a small bright sun in its image."""
    rows = np.linspace(0.1, 0.8, 64)[:, None, None] * np.ones((1, 128, 3)) * np.array([0.7, 0.85, 1.0])
    rows[46:48, 20:22] = 800.0
    stage.lights, stage.world = [], World(ImageTexture("sky", rows.astype(np.float32), "linear"))
    stage.add("chrome", "sphere", at(-0.7, 0, 0.6, 0.6), Metal(gray(0.7), gray(0.9), 0.15))
    stage.add("coated", "sphere", at(0.8, 0.1, 0.6, 0.6), Principled(Color(np.array([0.7, 0.1, 0.1])), roughness=0.2))


def neon_and_paints(stage: Stage) -> None:
    """Tubes with spectra of lines between colored walls."""
    stage.lights = []
    tube = catalogue.illuminant("FL11")
    for k in range(2):
        stage.add(f"tube {k}", "box", at(-1.4 + 2.8 * k, 0.5, 1.8, (0.05, 0.8, 0.05)), Emission(tube, 12.0))
    for k, rgb in enumerate(([0.7, 0.15, 0.1], [0.1, 0.5, 0.2], [0.2, 0.2, 0.7])):
        stage.add(f"wall {k}", "square", at(-1.6 + 1.6 * k, 1.6, 0.7, 0.7, ("x", 90)), Diffuse(Color(np.array(rgb))))


MORE: dict[str, Callable[[Stage], None]] = {
    effect.__name__.replace("_", " "): effect
    for effect in (
        glossy_floor, spot_in_fog, bokeh, papered_room, hair, bottle, colored_lamps, moving_ball, skin, lit_by_a_wall,
        chrome_under_sun, neon_and_paints,
    )
}  # fmt: skip


def scene_of(name: str, size: tuple[int, int]) -> Scene:
    """One of these scenes."""
    stage = Stage()
    MORE[name](stage)
    scene = stage.scene(size, 1.0)
    if name == "moving ball":
        ball = next(instance for instance in scene.instances if instance.name == "ball")
        along = [replace(ball, world_from_object=at(-0.6 + 0.15 * k, 0, 0.6, 0.5)) for k in range(8)]
        scene = replace(scene, moments=tuple(Moment(scene.camera, (place,)) for place in along))
    return scene
