# SPDX-License-Identifier: GPL-3.0-or-later
"""Error without the light of fluorescent dyes: every dyed surface under every light of the scene."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.mitsuba_scene.fluorescent import daylight_rgb
from spectral_core.render.mitsuba_scene.paint import emitted_rgb, emitted_spectrum, unit_luminance
from spectral_core.render.plan.decision import LATER_BOUNCES, MOST_ERROR
from spectral_core.render.plan.inventory import dyed
from spectral_core.render.plan.light.sizes import in_a_room
from spectral_core.scene import Color, Fluorescent, Material, Scene
from spectral_core.spectra.color import delta_e_2000, lab_from_linear_rgb, luminance_from_linear_rgb
from spectral_core.spectra.spectrum import Spectrum

Array = NDArray[np.float64]
Light = Color | Spectrum


def error_without_dyes(scene: Scene, materials: list[Material], lights: list[Light]) -> float:
    """Largest ΔE2000 between dyed surfaces with and without their emission, at the exposure of white."""

    def reflected_alone(closure: Fluorescent, light: Spectrum, color: Array) -> Array:
        return daylight_rgb(Fluorescent(closure.color), light)

    return _worst(scene, materials, lights, reflected_alone)


def error_in_rgb(scene: Scene, materials: list[Material], lights: list[Light], reflections: int) -> float:
    """Largest ΔE2000 of RGB transport, which shows dyes with their daylight color under every light.

    ``reflections``: most surfaces that reflect visible light in turn, 1 if none is lit by another. Light that other
    surfaces send may excite dyes as daylight does, or not at all: in a room of a dye that emits red, the red light
    goes from wall to wall as the paint alone reflects it.
    """

    def in_daylight(closure: Fluorescent, light: Spectrum, color: Array) -> Array:
        return np.clip(daylight_rgb(closure), 0.0, 1.0) * color

    direct = _worst(scene, materials, lights, in_daylight)
    if reflections <= 1:
        return direct
    between = (_error_between(closure, reflections) for material in materials for closure in dyed(material))
    return min(max([direct, *between]), MOST_ERROR)


def _error_between(closure: Fluorescent, reflections: int) -> float:
    """The same of white light that a surface has sent on which excites no dye: once, and in a closed room."""
    whole, bare = (np.clip(daylight_rgb(each), 0.0, 1.0) for each in (closure, Fluorescent(closure.color)))
    exact = np.stack([bare, whole * in_a_room(bare, reflections - 1)])
    simple = np.stack([whole, whole * in_a_room(whole, reflections - 1)])
    bright = np.maximum(luminance_from_linear_rgb(exact), 1.0)[:, None]
    return float(np.max(delta_e_2000(lab_from_linear_rgb(exact / bright), lab_from_linear_rgb(simple / bright))))


def _worst(
    scene: Scene,
    materials: list[Material],
    lights: list[Light],
    shown: Callable[[Fluorescent, Spectrum, Array], Array],
) -> float:
    white = None if scene.settings.white is None else unit_luminance(scene.settings.white)
    worst = 0.0
    for closure in (closure for material in materials for closure in dyed(material)):
        for light in lights:
            spectrum, color = emitted_spectrum(light, white), emitted_rgb(light)
            size = max(float(luminance_from_linear_rgb(color)), 1e-30)
            pair = [daylight_rgb(closure, spectrum) / size, shown(closure, spectrum, color) / size]
            one, other = (lab_from_linear_rgb(np.maximum(rgb, 0.0)) for rgb in pair)
            worst = max(worst, float(delta_e_2000(one, other)))
    return min(LATER_BOUNCES * worst, MOST_ERROR)
