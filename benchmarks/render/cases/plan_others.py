# SPDX-License-Identifier: GPL-3.0-or-later
"""Further scenes for the plan, in which one effect matters: absorption, a filter, a pane, a colored corner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.render.cases.meshes import at
from benchmarks.render.cases.plan_scenes import POINT, Stage, texture
from spectral_core.scene import Color, Diffuse, Glass, Metal, ScatteringMedium, Transparent, gray
from spectral_core.spectra import catalogue


def glass_behind_the_camera(stage: Stage) -> None:
    """A glass ball that neither the camera nor light on its way to the floor meets."""
    stage.add("ball", "sphere", at(0, -30, 9, 0.8), Glass())


def smoked_air(stage: Stage) -> None:
    """A medium that absorbs and does not scatter."""
    stage.add("smoke", "box", at(0, 0, 1.0, (2.5, 2.5, 0.9)), None)
    stage.media["smoke"] = ScatteringMedium(0.3, gray(0.0))
    stage.expected |= {"media"}


def brushed_floor(stage: Stage) -> None:
    """A floor of rough metal, which only the lamp lights."""
    stage.floor = Metal(gray(0.6), gray(0.7), 0.5)


def filtered(stage: Stage) -> None:
    """A sheet of a measured color between a lamp and gray paint."""
    stage.lights = [replace(POINT, color=catalogue.illuminant("HP1"))]
    stage.add("sheet", "square", at(0.6, -0.6, 2.0, 0.7), Transparent(catalogue.reflectance("cyan")))
    stage.expected |= {"transparency", "transport"}


def pane(stage: Stage) -> None:
    """A rough pane of glass before a patterned floor."""
    texture(stage)
    stage.add("pane", "box", at(0, -0.5, 1.0, (1.5, 0.05, 1.0)), Glass(roughness=0.4))
    stage.expected |= {"bounces", "refractive_caustics"}


def red_corner(stage: Stage) -> None:
    """A red wall beside white paint."""
    stage.floor = Diffuse(gray(0.8))
    stage.add("wall", "square", at(-1.5, 0, 1, (1, 2, 1), ("y", 90)), Diffuse(Color(np.array([0.8, 0.1, 0.1]))))
    stage.expected |= {"bounces"}


OTHERS: dict[str, tuple[Callable[[Stage], None], ...]] = {
    effect.__name__.replace("_", " "): (effect,)
    for effect in (glass_behind_the_camera, smoked_air, brushed_floor, filtered, pane, red_corner)
}
