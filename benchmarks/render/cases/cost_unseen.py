# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes with which no constant of the predictions was chosen: frosted panes, a narrow beam in fog, hair against light,
fluorescence under lines of mercury, an image of clouds with a small sun, sunlight through a rippled pane.
"""

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
    Fluorescent,
    Glass,
    Glossy,
    ImageTexture,
    Mesh,
    Metal,
    Principled,
    ScatteringMedium,
    SpotLight,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.fluorescence import FluorescentDye


def shower(stage: Stage) -> None:
    """A corner between panes of frosted glass, with a lamp behind one of them and a mirror on the wall."""
    tiles = Diffuse(gray(0.7))
    stage.floor = tiles
    stage.add("back", "square", at(0, 2.5, 2, 2.5, ("x", 90)), tiles)
    stage.add("mirror", "square", at(0.8, 2.45, 1.3, (0.7, 0.8, 1), ("x", 90)), Glossy(gray(0.9), 0.0))
    for k, place in enumerate((at(-1.6, 0.6, 1.2, (0.02, 1.4, 1.2)), at(1.7, 0.6, 1.2, (0.02, 1.4, 1.2)))):
        stage.add(f"pane {k}", "box", place, Glass(roughness=0.3))
    lamp = at(-2.6, 0.6, 1.8, turn=("y", -90))
    stage.lights = [AreaLight(name="lamp", world_from_light=lamp, power_w=150, size=(0.4, 0.4))]
    stage.add("soap", "sphere", at(0.2, 0.2, 0.4, 0.4), Principled(Color(np.array([0.8, 0.5, 0.6])), roughness=0.3))


def beam(stage: Stage) -> None:
    """A beam of two degrees through dense smoke that scatters forward, and the spot where it ends."""
    stage.lights = [
        SpotLight(
            name="beam", world_from_light=at(-1.4, 0.3, 2.6, turn=("y", -35)), power_w=60000, cone_angle_rad=0.035
        )
    ]
    stage.add("smoke", "box", at(0, 0, 1.4, (2.5, 2.0, 1.35)), None)
    stage.media["smoke"] = ScatteringMedium(0.5, gray(0.9), anisotropy=0.6)
    stage.add("block", "box", at(0.9, 0.6, 0.4, 0.4), Diffuse(Color(np.array([0.3, 0.5, 0.7]))))


def hair_against_light(stage: Stage) -> None:
    """A tuft of hair before a lamp that shines toward the camera."""
    hair(stage)
    behind = at(0.2, 2.2, 1.4, turn=("x", -90))
    stage.lights = [AreaLight(name="rim", world_from_light=behind, power_w=150, size=(0.5, 0.5), camera_visible=False)]


def posters(stage: Stage) -> None:
    """Three fluorescent posters and a white wall under a lamp of mercury lines."""
    stage.lights = [replace(POINT, color=catalogue.illuminant("FL12"), radius=0.15)]
    for k, (absorbed, emitted) in enumerate(((400, 450), (450, 530), (500, 610))):
        dye = FluorescentDye.gaussian(f"dye {k}", absorbed, emitted)
        paper = Fluorescent(gray(0.2), (dye,), (0.6,))
        stage.add(f"poster {k}", "square", at(-1.4 + 1.4 * k, 0.9, 0.7, 0.6, ("x", 90)), paper)
    stage.add("wall", "square", at(-2.4, 0, 1, 1.5, ("y", 90)), Diffuse(gray(0.8)))


def clouded_sun(stage: Stage) -> None:
    """Glass, metal and paint under an image of broken clouds with a sun of four pixels."""
    rng = np.random.default_rng(77)
    coarse = rng.uniform(0.1, 1.5, (16, 32))
    clouds = np.kron(coarse, np.ones((16, 16))) * rng.uniform(0.8, 1.2, (256, 512))
    image = clouds[..., None] * np.array([0.8, 0.9, 1.0])
    image[170:172, 150:152] = 15000.0
    stage.lights, stage.world = [], World(ImageTexture("clouds", image.astype(np.float32), "linear"))
    stage.add("glass", "sphere", at(-1.2, 0, 0.5, 0.5), Glass())
    stage.add("metal", "sphere", at(0, 0.4, 0.5, 0.5), Metal(gray(0.8), gray(0.9), 0.3))
    stage.add("paint", "box", at(1.2, 0, 0.4, 0.4), Diffuse(Color(np.array([0.7, 0.2, 0.1]))))


def rippled_pane(stage: Stage) -> None:
    """A small lamp above a rippled pane of glass, whose caustics are lines on the floor."""
    stage.meshes = (*stage.meshes, _ripples())
    stage.lights = [AreaLight(name="lamp", world_from_light=at(0.4, 0.3, 4.0), power_w=120, size=(0.2, 0.2))]
    stage.add("pane", "ripples", at(0, 0, 1.2, 1.2), Glass())
    stage.add("ball", "sphere", at(1.4, 0.9, 0.4, 0.4), Diffuse(Color(np.array([0.3, 0.6, 0.3]))))


def _ripples(cells: int = 48) -> Mesh:
    """A closed slab of half-width 1 whose upper side is a product of waves."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-1, 1, cells + 1), np.linspace(-1, 1, cells + 1)))
    top = np.stack([x, y, 0.1 + 0.03 * np.sin(9 * x) * np.sin(7 * y)], axis=1)
    side = cells + 1
    corner = (np.arange(cells)[:, None] * side + np.arange(cells)).ravel()
    up = np.concatenate([
        np.stack([corner, corner + 1, corner + side + 1], axis=1),
        np.stack([corner, corner + side + 1, corner + side], axis=1),
    ])  # fmt: skip
    ring = np.concatenate([
        np.arange(side), np.arange(1, side) * side + cells, (side - 1) * side + np.arange(cells)[::-1],
        np.arange(side - 2, 0, -1) * side,
    ])  # fmt: skip
    after, below = np.roll(ring, -1), side * side
    walls = np.concatenate([
        np.stack([ring, ring + below, after + below], axis=1), np.stack([ring, after + below, after], axis=1)
    ])  # fmt: skip
    faces = np.concatenate([up, up[:, ::-1] + below, walls])
    points = np.concatenate([top, np.stack([x, y, 0 * x], axis=1)])
    return Mesh("ripples", points.astype(np.float32), faces.astype(np.uint32))


UNSEEN: dict[str, Callable[[Stage], None]] = {
    effect.__name__.replace("_", " "): effect
    for effect in (shower, beam, hair_against_light, posters, clouded_sun, rippled_pane)
}  # fmt: skip
