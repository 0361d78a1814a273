# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a third kind for predictions of error and time: nested glass, a tiny sun, lace, thick fog, metamers."""

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
    Computed,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    ImageTexture,
    MixSurface,
    PointLight,
    Principled,
    ScatteringMedium,
    SpotLight,
    Subsurface,
    Transparent,
    World,
    gray,
)
from spectral_core.scene.shading import Builder
from spectral_core.spectra import catalogue
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum


def hair_under_sky(stage: Stage) -> None:
    """A tuft of hair under a sky with a bright patch."""
    hair(stage)
    stage.lights, stage.world = [], World(_sky(8, 40.0))


def tiny_sun(stage: Stage) -> None:
    """Plastic and paint under an image of a sky whose sun is one of 131,072 pixels."""
    stage.lights, stage.world = [], World(_sky(1, 60000.0, height=256))
    plastic = Principled(Color(np.array([0.2, 0.5, 0.3])), roughness=0.35)
    stage.add("plastic", "sphere", at(-0.7, 0, 0.6, 0.6), plastic)
    stage.add("block", "box", at(0.8, 0.3, 0.5, 0.5), Diffuse(Color(np.array([0.6, 0.4, 0.2]))))


def _sky(size: int, sun: float, height: int = 64) -> ImageTexture:
    rows = np.linspace(0.1, 0.6, height)[:, None, None] * np.ones((1, 2 * height, 3)) * np.array([0.7, 0.85, 1.0])
    first = int(0.7 * height)
    rows[first : first + size, height // 3 : height // 3 + size] = sun
    return ImageTexture("sky", rows.astype(np.float32), "linear")


def full_bottle(stage: Stage) -> None:
    """A bottle of glass with a red liquid, lit by a window."""
    stage.lights = [AreaLight(name="window", world_from_light=at(1.5, -1.0, 2.8), power_w=90, size=(0.8, 0.8))]
    stage.add("glass", "sphere", at(0, 0, 0.9, (0.45, 0.45, 0.85)), Glass())
    stage.add("liquid", "sphere", at(0, 0, 0.85, (0.4, 0.4, 0.7)), Glass(ior=0.9))
    stage.media["liquid"] = ScatteringMedium(2.0, Color(np.array([0.0, 0.0, 0.0])))


def many_bulbs(stage: Stage) -> None:
    """Four hundred bulbs of very different powers between columns."""
    rng = np.random.default_rng(31)
    stage.lights = [
        PointLight(
            name=f"bulb {k}", world_from_light=at(*rng.uniform((-4, -4, 0.3), (4, 4, 2.8))), radius=0.02,
            power_w=float(10 ** rng.uniform(-1, 1.2)),
        )
        for k in range(400)
    ]  # fmt: skip
    for k in range(9):
        place = at(-2.4 + 2.4 * (k % 3), -2.4 + 2.4 * (k // 3), 0.7, (0.2, 0.2, 0.7))
        stage.add(f"column {k}", "box", place, Diffuse(gray(0.7)))


def emissive_bars(stage: Stage) -> None:
    """Thin bars that emit light of several colors above a satin floor."""
    stage.lights, stage.floor = [], MixSurface(0.4, Diffuse(gray(0.4)), Glossy(gray(0.8), 0.25))
    for k, rgb in enumerate(([1.0, 0.3, 0.1], [0.2, 1.0, 0.4], [0.3, 0.4, 1.0])):
        stage.add(f"bar {k}", "box", at(-1.4 + 1.4 * k, 0.6 * k - 0.5, 0.7, (0.03, 0.9, 0.03)),
                  Emission(Color(np.array(rgb)), 25.0))  # fmt: skip
    stage.add("ball", "sphere", at(0.4, -0.6, 0.5, 0.45), Diffuse(gray(0.7)))


def thick_fog(stage: Stage) -> None:
    """Dense fog around a lamp and a ball."""
    stage.lights = [SpotLight(name="spot", world_from_light=at(0.8, 0.5, 3.2), power_w=500, cone_angle_rad=0.9)]
    stage.add("fog", "box", at(0, 0, 1.6, (2.5, 2.5, 1.55)), None)
    stage.media["fog"] = ScatteringMedium(0.8, gray(0.97), anisotropy=0.4)
    stage.add("ball", "sphere", at(0.2, 0, 0.7, 0.5), Diffuse(Color(np.array([0.7, 0.3, 0.2]))))


def wax(stage: Stage) -> None:
    """A block and a ball of wax with a lamp behind them."""
    stage.lights = [replace(POINT, world_from_light=at(0.6, 1.6, 1.2), power_w=120, radius=0.1)]
    body = Subsurface(Color(np.array([0.9, 0.7, 0.45])), scale=0.6)
    stage.add("ball", "sphere", at(0, 0, 0.7, 0.7), body)
    stage.add("block", "box", at(1.2, 0.2, 0.4, 0.4), body)


def metamers(stage: Stage) -> None:
    """Two paints that are equal under daylight, under a lamp of lines."""
    stage.lights = [replace(POINT, color=catalogue.illuminant("FL11"), radius=0.2)]
    knots = np.arange(380.0, 781.0, 10.0)
    smooth = 0.35 + 0.15 * np.sin((knots - 380) / 90)
    ripple = smooth + 0.14 * np.sin((knots - 380) / 11) * np.sin((knots - 380) / 400 * np.pi)
    for k, values in enumerate((smooth, ripple)):
        paint = Spectrum(f"paint {k}", SpectralGrid(knots), np.clip(values, 0, 1))
        stage.add(f"patch {k}", "square", at(-0.7 + 1.4 * k, 0, 0.002, 0.7), Diffuse(paint))
        stage.add(f"wall {k}", "square", at(-0.7 + 1.4 * k, 1.0, 0.7, 0.7, ("x", 90)), Diffuse(paint))


def lace(stage: Stage) -> None:
    """A woven curtain with holes between a lamp and a patterned floor."""
    grid = np.indices((64, 64))
    holes = ((grid[0] % 8 < 4) & (grid[1] % 8 < 4)).astype(np.float32)[..., None] * np.ones(3, np.float32)
    cells = (grid.sum(axis=0) // 8 % 2 * 0.5 + 0.2)[..., None] * np.array([1.0, 0.8, 0.5])
    build = Builder()
    color = build.add("image_color", (build.add("vector_input", (), "uv", 0),), False, data=_image("holes", holes))
    open_share = Computed(build.program(build.as_width(color, 1)))
    stage.floor = Diffuse(_image("cells", cells))
    cloth = MixSurface(open_share, Diffuse(Color(np.array([0.8, 0.75, 0.6]))), Transparent(gray(1.0)))
    stage.add("curtain", "square", at(0.5, -0.4, 1.5, 1.0), cloth)
    stage.lights = [replace(POINT, radius=0.05)]


def _image(name: str, values: np.ndarray) -> ImageTexture:
    return ImageTexture(name, values.astype(np.float32), "linear")


def frosted_window(stage: Stage) -> None:
    """A closed room whose only light comes through a pane of frosted glass."""
    wall = Diffuse(gray(0.75))
    stage.floor = wall
    for name, place in {
        "back": at(0, 3, 2, 3, ("x", 90)), "right": at(3, 0, 2, 3, ("y", -90)), "roof": at(0, 0, 4.6, 7, ("x", 180)),
        "front": at(0, -6.5, 2, 7, ("x", -90)),
    }.items():  # fmt: skip
        stage.add(name, "square", place, wall)
    stage.add("pane", "box", at(-2.9, 0, 2, (0.03, 3, 2.6)), Glass(roughness=0.5))
    stage.lights = [AreaLight(name="day", world_from_light=at(-4.0, 0, 2.2, turn=("y", -90)), power_w=300, size=(3, 3))]
    stage.add("chest", "box", at(0.8, 0.8, 0.5, 0.5), Diffuse(Color(np.array([0.5, 0.25, 0.1]))))


STRANGE: dict[str, Callable[[Stage], None]] = {
    effect.__name__.replace("_", " "): effect
    for effect in (
        hair_under_sky, tiny_sun, full_bottle, many_bulbs, emissive_bars, thick_fog, wax, metamers, lace,
        frosted_window,
    )
}  # fmt: skip
