# SPDX-License-Identifier: GPL-3.0-or-later
"""Further hard scenes: media, subsurface scattering, hair and dyes at extremes, places far away, faces without area."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.render.cases.meshes import at
from benchmarks.render.checks.hard_renders import SURFACES, hard_scene, spikes
from spectral_core.scene import (
    AreaLight,
    Fluorescent,
    Glass,
    Hair,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    Metal,
    PointLight,
    Principled,
    ScatteringMedium,
    Scene,
    Sheen,
    Subsurface,
    SunLight,
    Toon,
    Transparent,
    World,
    gray,
)
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

LAMP = PointLight(name="lamp", world_from_light=at(1, -1, 3), power_w=200)


def more_hard_scenes() -> Iterator[tuple[str, Scene]]:
    """(name, scene) of each, 16 × 16 pixels."""
    for scale in (1e-4, 1e6):
        yield from _sized(scale)
    yield from _placed()
    yield from _lit()
    for value in (0.0, 1.0):
        yield from _black_or_white(value)
    yield from _lines()


def _sized(scale: float) -> Iterator[tuple[str, Scene]]:
    place = at(0.5 * scale, 0.5 * scale, 3 * scale)
    panel = AreaLight(name="panel", world_from_light=place, power_w=200 * scale**2, size=(scale, scale))
    scene = hard_scene(scale, lamps=(panel,))
    yield f"subsurface at scale {scale:g}", _made_of(scene, Subsurface(gray(0.8), scale=0.1 * scale), "gloss")
    yield f"fog at scale {scale:g}", _in_fog(scene, ScatteringMedium(0.2 / scale, gray(0.9)), scale)
    blurred = replace(scene.camera, aperture_radius=0.1 * scale, focus_distance=8 * scale)
    sun = SunLight(name="sun", world_from_light=at(turn=("y", 30)), irradiance=3.0, angle_rad=0.01)
    yield f"lens at scale {scale:g}", replace(hard_scene(scale, lamps=(sun,)), camera=blurred)


def _placed() -> Iterator[tuple[str, Scene]]:
    scene = hard_scene(lamps=(LAMP,))
    for far in (1e4, 1e6):
        lamp = replace(LAMP, world_from_light=_moved(LAMP.world_from_light, far))
        camera = replace(scene.camera, world_from_camera=_moved(scene.camera.world_from_camera, far))
        things = tuple(replace(each, world_from_object=_moved(each.world_from_object, far)) for each in scene.instances)
        yield f"all {far:g} away", replace(scene, camera=camera, instances=things, lights=(lamp,))
    for name, place in {"the floor": at(0, -8, 0, turn=("x", 90)), "glass": at(0.2, -0.5, 0.8, turn=("x", 90))}.items():
        yield f"camera in {name}", replace(scene, camera=replace(scene.camera, world_from_camera=place))
    flat = Mesh("box", np.zeros((3, 3), np.float32), np.array([[0, 1, 2], [0, 0, 0]], np.uint32))
    meshes = (*(each for each in scene.meshes if each.name != "box"), flat)
    yield "faces without area", replace(scene, meshes=meshes)
    tiny = (
        replace(e, world_from_object=at(0.2, -0.5, 0.8, 1e-12)) if e.name == "glass" else e for e in scene.instances
    )
    yield "glass of 1e-12", replace(scene, instances=tuple(tiny))


def _lit() -> Iterator[tuple[str, Scene]]:
    on_edge = at(3, 0, 1, turn=("y", 90))
    for name, place, size in (
        ("panel edge on", on_edge, (1.0, 1e-6)), ("panel of 1e-7", at(0, 0, 3), (1e-7, 1e-7)),
        ("panel of 1e7", at(0, 0, 3), (1e7, 1e7)),
    ):  # fmt: skip
        yield name, hard_scene(lamps=(AreaLight(name="panel", world_from_light=place, power_w=100, size=size),))
    yield (
        "world of 1e6 and lamp of 1e-6 W",
        hard_scene(lamps=(replace(LAMP, power_w=1e-6),), world=World(gray(1.0), strength=1e6)),
    )
    sky = np.full((16, 32, 3), 1e-6, np.float32)
    sky[10, 5] = 1e9
    yield "one pixel of 1e9 in the sky", hard_scene(world=World(ImageTexture("sky", sky, "linear")))


def _black_or_white(value: float) -> Iterator[tuple[str, Scene]]:
    scene, color = hard_scene(lamps=(LAMP,)), gray(value)
    every = Principled(
        color, roughness=value, metallic=value, anisotropic=value, sheen_weight=value, coat_weight=value,
        subsurface_weight=value, transmission=value, coat_tint=color, specular_tint=color,
    )  # fmt: skip
    for name, surface in {
        "subsurface": Subsurface(color), "sheen": Sheen(color, roughness=value), "hair": Hair(color),
        "velvet": Sheen(color, roughness=value, microfiber=False), "toon": Toon(color),
        "transparent": Transparent(color), "every principled input": every,
    }.items():  # fmt: skip
        yield f"{name} of {value:g}", _made_of(scene, surface, *SURFACES)
    onward = ScatteringMedium(0.3, color, anisotropy=0.999 * (2 * value - 1))
    yield f"medium of albedo {value:g}", _in_fog(scene, onward)


def _lines() -> Iterator[tuple[str, Scene]]:
    knots = np.arange(360.0, 831.0, 10.0)
    flint = Glass(ior=Spectrum("flint", SpectralGrid(knots), 1.6 + 16000 / knots**2))
    dye = FluorescentDye.gaussian("dye", 440, 530)
    sun = SunLight(name="sun", world_from_light=at(turn=("y", 30)), irradiance=3.0, angle_rad=0.0, color=spikes())
    scene = hard_scene(lamps=(replace(LAMP, color=spikes()), sun))
    film = Metal(gray(0.6), gray(0.6), 0.0, thin_film_thickness=400.0, thin_film_ior=1.5)
    for name, surface in {
        "dye": Fluorescent(gray(0.2), (dye,), (0.5,)), "film": film, "flint": flint, "subsurface": Subsurface(gray(0.8))
    }.items():  # fmt: skip
        yield f"spikes on {name}", _made_of(scene, surface, *SURFACES)


def _made_of(scene: Scene, surface: Any, *names: str) -> Scene:
    """The scene with another surface of the materials of some names."""
    made: dict[str, Any] = {**SURFACES, **dict.fromkeys(names, surface)}
    return replace(scene, materials=tuple(Material(each, made[each]) for each in SURFACES))


def _in_fog(scene: Scene, medium: ScatteringMedium, scale: float = 1.0) -> Scene:
    fog = Instance("fog", "box", at(0, 0, 2 * scale, (4 * scale, 4 * scale, 1.9 * scale)), ("fog",))
    material = Material("fog", None, medium)
    return replace(scene, materials=(*scene.materials, material), instances=(*scene.instances, fog))


def _moved(place: np.ndarray, far: float) -> np.ndarray:
    """The same place, farther along each axis."""
    moved = place.copy()
    moved[:3, 3] += far
    return moved
