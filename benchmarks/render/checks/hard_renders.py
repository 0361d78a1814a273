# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes hard on 32-bit numbers: sizes, grazing light, faces on faces, extreme lights, spikes, black and white."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.render.cases.meshes import at, box, sphere, square
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Emission,
    Film,
    Glass,
    Glossy,
    Instance,
    Material,
    Metal,
    PointLight,
    Principled,
    RenderSettings,
    Scene,
    SpotLight,
    SunLight,
    Translucent,
    World,
    gray,
)
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid

SCALES = (1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6)
SURFACES = {
    "matte": Diffuse(gray(0.8)),
    "gloss": Glossy(gray(0.9), 0.1),
    "glass": Glass(gray(1.0), 0.0),
    "plastic": Principled(gray(0.5), coat_weight=0.5),
}


def spikes() -> Illuminant:
    """Three lines of 0.01 nm: nearly all wavelengths have no power."""
    knots = sorted(line + offset for line in (435.8, 546.1, 611.3) for offset in (-0.01, 0.0, 0.01))
    values = [1e6 if k % 3 == 1 else 0.0 for k in range(9)]
    return Illuminant("spikes", SpectralGrid(np.array(knots)), np.array(values))


def hard_scenes() -> Iterator[tuple[str, Scene]]:
    """(name, scene) of each hard case, 16 × 16 pixels."""
    lamp = PointLight(name="lamp", world_from_light=at(1, -1, 3), power_w=200)
    for scale in SCALES:
        yield f"scale {scale:g}", hard_scene(scale, lamps=(_scaled(lamp, scale),))
    for degrees in (89.0, 89.99, 89.9999, 90.0):
        sun = SunLight(name="sun", world_from_light=at(turn=("y", degrees)), irradiance=3.0, angle_rad=0.0)
        yield f"sun at {degrees:g}°", hard_scene(lamps=(sun,))
    flat = PointLight(name="low", world_from_light=at(3, 0, 1e-6), power_w=100)
    yield "lamp just above the floor", hard_scene(lamps=(flat,))
    on = PointLight(name="on", world_from_light=at(0, -1, 0), power_w=100)
    yield "lamp in the floor", hard_scene(lamps=(on,))
    twice = hard_scene(lamps=(lamp,))
    same = tuple(replace(each, name=f"{each.name} again") for each in twice.instances)
    yield "coplanar faces", replace(twice, instances=(*twice.instances, *same))
    panel = AreaLight(name="panel", world_from_light=at(0, 0, 0), power_w=100, size=(1.0, 1.0))
    yield "panel in the floor", hard_scene(lamps=(panel,))
    dim, bright = replace(lamp, name="dim", power_w=1e-3), replace(lamp, name="bright", power_w=1e3)
    yield "lights 1e6 to 1", hard_scene(lamps=(dim, replace(bright, world_from_light=at(-2, 1, 3))))
    yield (
        "light of 1e12 W and one of 1e-12 W",
        hard_scene(lamps=(replace(dim, power_w=1e-12), replace(bright, power_w=1e12))),
    )
    spot = SpotLight(name="beam", world_from_light=at(0, 0, 4), power_w=500, cone_angle_rad=1e-3, color=spikes())
    sun = SunLight(name="sun", world_from_light=at(turn=("y", 30)), irradiance=3.0, angle_rad=0.0, color=spikes())
    yield "delta lights of spikes", hard_scene(lamps=(replace(lamp, color=spikes()), spot, sun))
    for value in (0.0, 1.0):
        for name, surface in {
            "diffuse": Diffuse(gray(value)),
            "glossy": Glossy(gray(value), 0.0),
            "rough glossy": Glossy(gray(value), 1.0),
            "glass": Glass(gray(value), 0.5),
            "metal": Metal(gray(value), gray(value), 0.3),
            "translucent": Translucent(gray(value)),
            "principled": Principled(gray(value), coat_weight=1.0, transmission=0.5),
        }.items():
            materials = tuple(Material(each, surface) for each in SURFACES)
            yield f"{name} of albedo {value:g}", replace(hard_scene(lamps=(lamp,)), materials=materials)
    glow = hard_scene()
    rest = (material for material in glow.materials if material.name != "gloss")
    bright_ball = Material("gloss", Emission(gray(1.0), 1e12))
    yield "emissive ball of 1e12", replace(glow, materials=(bright_ball, *rest))


def _scaled(lamp: PointLight, scale: float) -> PointLight:
    placed = lamp.world_from_light.copy()
    placed[:3, 3] *= scale
    return replace(lamp, world_from_light=placed, power_w=lamp.power_w * scale**2)


def hard_scene(scale: float = 1.0, lamps: Any = (), world: World | None = None) -> Scene:
    """A floor with a ball, a glass ball and a block on it."""
    eye = at(0, -8 * scale, 4 * scale, turn=("x", 64))
    return Scene(
        camera=Camera(world_from_camera=eye, field_of_view_rad=0.7, near=1e-3 * scale, far=1e3 * scale),
        film=Film(16, 16, 64),
        meshes=(square(), sphere(), box()),
        materials=tuple(Material(name, surface) for name, surface in SURFACES.items()),
        instances=(
            Instance("floor", "square", at(scale=(5 * scale,) * 3), ("matte",)),
            Instance("ball", "sphere", at(-1.5 * scale, 0, 0.8 * scale, 0.8 * scale), ("gloss",)),
            Instance("glass", "sphere", at(0.2 * scale, -0.5 * scale, 0.8 * scale, 0.8 * scale), ("glass",)),
            Instance("block", "box", at(1.8 * scale, 0, 0.7 * scale, 0.7 * scale), ("plastic",)),
        ),
        lights=tuple(lamps),
        world=world or World(gray(0.01)),
        settings=RenderSettings(max_bounces=12),
    )
