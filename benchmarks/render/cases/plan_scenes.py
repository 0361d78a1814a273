# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes in which exactly one effect matters, and pairs of them, each with decoys that need no effect.

Every scene holds decoys: a fog too thin to see, a lens too small to blur, a world too dark to show, a glass slot that
no face has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.render.cases.meshes import at, box, sphere, square, wedge
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Film,
    Fluorescent,
    Glass,
    Glossy,
    ImageTexture,
    Instance,
    Material,
    Mesh,
    Metal,
    PointLight,
    RenderSettings,
    ScatteringMedium,
    Scene,
    SunLight,
    Translucent,
    Transparent,
    VolumeObject,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import SpectralGrid, Spectrum

MESHES = (square(), box(), sphere(), wedge())
POINT = PointLight(name="lamp", world_from_light=at(1.5, -1.5, 4), power_w=250)
PANEL = AreaLight(name="panel", world_from_light=at(0.5, -0.5, 3.5), power_w=120, size=(0.8, 0.8))
VIEW = at(0, -6, 4.2, turn=("x", 56))


@dataclass
class Stage:
    """A floor under a lamp, to which effects add objects. ``expected``: effects that must be on."""

    floor: Any = field(default_factory=lambda: Diffuse(gray(0.5)))
    objects: list[tuple[str, str, np.ndarray, Any]] = field(default_factory=list)
    media: dict[str, ScatteringMedium] = field(default_factory=dict)
    lights: list[Any] = field(default_factory=lambda: [POINT])
    world: World = field(default_factory=lambda: World(gray(1e-7)))
    aperture: float = 1e-8
    volumes: tuple[VolumeObject, ...] = ()
    meshes: tuple[Mesh, ...] = MESHES
    expected: set[str] = field(default_factory=set)

    def add(self, name: str, mesh: str, place: np.ndarray, surface: Any) -> None:
        """Another object of one material."""
        self.objects.append((name, mesh, place, surface))

    def scene(self, size: tuple[int, int], tolerance: float) -> Scene:
        """The scene, with its decoys."""
        thin = ("thin air", "box", at(0, 0, 1.5, (4, 4, 1.4)), None)
        things = [("floor", "square", at(scale=(5, 5, 1)), self.floor), *self.objects, thin]
        media = {"thin air": ScatteringMedium(1e-9), **self.media}
        materials = tuple(Material(name, surface, media.get(name)) for name, _, _, surface in things)
        instances = tuple(
            Instance(name, mesh, place, (name, "unused glass") if name == "floor" else (name,))
            for name, mesh, place, _ in things
        )
        camera = Camera(
            world_from_camera=VIEW, field_of_view_rad=0.75, aperture_radius=self.aperture, focus_distance=7.0
        )
        return Scene(
            camera=camera, film=Film(*size, samples=64), meshes=self.meshes,
            materials=(*materials, Material("unused glass", Glass())), instances=instances, lights=tuple(self.lights),
            world=self.world, volumes=self.volumes, settings=RenderSettings(tolerance_delta_e=tolerance),
        )  # fmt: skip


def _black(stage: Stage) -> None:
    """A square that shades the floor and reflects nothing."""
    stage.add("shade", "square", at(0.3, 0.2, 1.0, 0.5), Diffuse(gray(0.0)))


def nothing(stage: Stage) -> None:
    _black(stage)


def sun(stage: Stage) -> None:
    stage.lights = [SunLight(name="sun", world_from_light=at(turn=("x", 30)), irradiance=3.0)]
    _black(stage)


def room(stage: Stage) -> None:
    wall = Diffuse(gray(0.8))
    stage.floor = wall
    for name, place in {
        "back": at(0, 3, 2, 3, ("x", 90)), "left": at(-3, 0, 2, 3, ("y", 90)), "right": at(3, 0, 2, 3, ("y", -90)),
        "roof": at(0, 0, 4.4, 4, ("x", 180)),
    }.items():  # fmt: skip
        stage.add(name, "square", place, wall)
    stage.expected |= {"bounces"}


def wall(stage: Stage) -> None:
    stage.add("wall", "square", at(0, 1.2, 1, (2, 1, 1), ("x", 90)), Diffuse(gray(0.6)))
    stage.expected |= {"bounces"}


def sodium(stage: Stage) -> None:
    stage.lights = [replace(POINT, color=catalogue.illuminant("HP1"))]
    _paints(stage)


def fluorescent(stage: Stage) -> None:
    stage.lights = [replace(POINT, color=catalogue.illuminant("FL2"))]
    _paints(stage)


def _paints(stage: Stage) -> None:
    for k, rgb in enumerate(([0.7, 0.1, 0.1], [0.1, 0.5, 0.1], [0.1, 0.15, 0.7])):
        stage.add(f"paint {k}", "square", at(-1.5 + 1.5 * k, 0, 0.002, 0.6), Diffuse(Color(np.array(rgb))))
    stage.expected |= {"transport"}


def measured_paints(stage: Stage) -> None:
    stage.lights = [replace(POINT, color=catalogue.illuminant("A"))]
    for k, name in enumerate(("orange", "cyan", "red")):
        stage.add(name, "square", at(-1.5 + 1.5 * k, 0, 0.002, 0.6), Diffuse(catalogue.reflectance(name)))
    stage.expected |= {"transport"}


def dyed(stage: Stage) -> None:
    stage.lights = [replace(POINT, color=catalogue.illuminant("D65"))]
    glow = FluorescentDye.gaussian("green", 440, 530)
    stage.add("dyed", "square", at(0, 0, 0.002, 0.8), Fluorescent(gray(0.2), (glow,), (0.5,)))
    stage.expected |= {"fluorescence"}  # its dye carries over to three channels


def oxide(stage: Stage) -> None:
    layer = Metal(gray(0.6), gray(0.6), 0.2, thin_film_thickness=300.0, thin_film_ior=2.0)
    stage.lights = [replace(PANEL, color=catalogue.illuminant("A"))]
    stage.add("oxide", "square", at(0, 0, 0.002, 0.8), layer)
    stage.expected |= {"thin_film", "transport"}


def prism(stage: Stage) -> None:
    knots = np.arange(360.0, 831.0, 10.0)
    index = Spectrum("flint", SpectralGrid(knots), 1.6 + 16000 / knots**2)
    stage.lights = [PANEL]
    stage.add("prism", "wedge", at(0, 0, 0.4), Glass(ior=index))
    stage.expected |= {"transport", "dispersion", "bounces", "refractive_caustics"}


def fog(stage: Stage) -> None:
    stage.add("fog", "box", at(0, 0, 1.0, (2.5, 2.5, 0.9)), None)
    stage.media["fog"] = ScatteringMedium(0.25, gray(0.9))
    stage.expected |= {"media", "bounces"}


def milk(stage: Stage) -> None:
    stage.add("milk", "sphere", at(0, 0, 1.0, 0.9), None)
    stage.media["milk"] = ScatteringMedium(4.0, gray(0.95))
    stage.expected |= {"media", "bounces"}


def lens(stage: Stage) -> None:
    stage.aperture = 0.2
    for k in range(5):
        stage.add(f"mark {k}", "square", at(-1 + k / 2, 2.0 - k, 0.002, 0.2), Diffuse(gray(0.0)))
    stage.expected |= {"depth_of_field"}


def sky(stage: Stage) -> None:
    stage.lights, stage.world = [], World(gray(0.6))
    _black(stage)
    stage.expected |= {"environment"}


def sky_image(stage: Stage) -> None:
    rows = np.linspace(0.1, 1.2, 16)[:, None, None] * np.ones((1, 32, 3))
    rows[11:13, 5:8] = 30.0
    stage.lights, stage.world = [], World(ImageTexture("sky", rows.astype(np.float32), "linear"))
    _black(stage)
    stage.expected |= {"environment"}


def emissive(stage: Stage) -> None:
    stage.lights = []
    stage.add("globe", "sphere", at(0, 0, 2.0, 0.5), Emission(gray(1.0), 6.0))
    stage.expected |= {"emissive_meshes"}


def curtain(stage: Stage) -> None:
    stage.add("curtain", "square", at(0.6, -0.6, 2.0, 0.7), Transparent(gray(0.4)))
    stage.expected |= {"transparency"}


def ball_lamp(stage: Stage) -> None:
    stage.lights = [replace(POINT, radius=0.5)]
    _black(stage)
    stage.expected |= {"lamp_bodies"}


def lamp_before_lamp(stage: Stage) -> None:
    """Bodies of lamps cast no shadows, so nothing is called for."""
    low = AreaLight(name="low", world_from_light=at(0.7, -0.7, 2.2), power_w=20, size=(1.0, 1.0))
    stage.lights = [POINT, low]


def texture(stage: Stage) -> None:
    cells = (np.indices((16, 16)).sum(axis=0) % 2 * 0.5 + 0.2)[..., None] * np.ones(3)
    stage.floor = Diffuse(ImageTexture("cells", cells.astype(np.float32), "linear"))
    stage.expected |= {"textures"}


def mirror(stage: Stage) -> None:
    stage.add("mirror", "square", at(0, 1.5, 1, (2, 1, 1), ("x", 90)), Glossy(gray(0.9), 0.0))
    stage.expected |= {"bounces"}


def facing_mirrors(stage: Stage) -> None:
    stage.add("one mirror", "square", at(0, 1.5, 1, (2, 1, 1), ("x", 80)), Glossy(gray(0.9), 0.0))
    stage.add("other mirror", "square", at(0, -1.0, 0.5, (2, 0.5, 1), ("x", -90)), Glossy(gray(0.9), 0.0))
    stage.expected |= {"bounces"}


def mirror_caustic(stage: Stage) -> None:
    stage.lights = [replace(PANEL, world_from_light=at(0.0, -1.5, 3.5))]
    stage.add("silver", "square", at(0, 1.0, 0.8, (1.5, 0.8, 1), ("x", 80)), Glossy(gray(0.95), 0.1))
    stage.expected |= {"reflective_caustics", "bounces"}


def glass_ball(stage: Stage) -> None:
    stage.add("ball", "sphere", at(0, 0, 0.9, 0.8), Glass())
    stage.expected |= {"bounces"}


def glass_caustic(stage: Stage) -> None:
    stage.lights = [replace(PANEL, size=(1.5, 1.5))]
    stage.add("ball", "sphere", at(0, 0, 1.0, 0.8), Glass())
    stage.expected |= {"refractive_caustics", "bounces"}


def leaf(stage: Stage) -> None:
    stage.add("leaf", "square", at(0.5, -0.5, 1.2, 0.9), Translucent(gray(0.6)))
    stage.expected |= {"bounces"}


def cloud(stage: Stage) -> None:
    from spectral_core.volume.transfer import Material as Stuff
    from spectral_core.volume.transfer import TransferFunction

    x = np.linspace(-1, 1, 24)
    density = np.exp(-4 * (x[:, None, None] ** 2 + x[:, None] ** 2 + x**2))
    stuff = Stuff("cloud", np.array([0.0, 0.2, 1.0]), np.array([0.0, 0.0, 3.0]), np.array([0.9, 0.6, 0.3]))
    stage.volumes = (VolumeObject("cloud", density, at(-1.2, -1.2, 0.4, 0.1), TransferFunction((stuff,))),)
    stage.expected |= {"volumes", "bounces"}


SINGLE: dict[str, tuple[Callable[[Stage], None], ...]] = {
    effect.__name__.replace("_", " "): (effect,)
    for effect in (
        nothing, sun, room, wall, sodium, fluorescent, measured_paints, dyed, oxide, prism, fog, milk, lens, sky,
        sky_image, emissive, curtain, ball_lamp, lamp_before_lamp, texture, mirror, facing_mirrors, mirror_caustic,
        glass_ball, glass_caustic, leaf, cloud,
    )
}  # fmt: skip
PAIRS: dict[str, tuple[Callable[[Stage], None], ...]] = {
    f"{one.__name__.replace('_', ' ')} + {other.__name__.replace('_', ' ')}": (one, other)
    for one, other in (
        (room, sodium), (lens, texture), (wall, curtain), (mirror, texture), (glass_ball, lens), (leaf, lens),
        (texture, ball_lamp), (wall, sky), (mirror, fluorescent), (fog, lens), (texture, curtain), (emissive, wall),
    )
}  # fmt: skip


def staged(
    effects: tuple[Callable[[Stage], None], ...], size: tuple[int, int], tolerance: float
) -> tuple[Scene, set[str]]:
    """The scene of some effects, and the names of the effects that a plan must simulate."""
    stage = Stage()
    for effect in effects:
        effect(stage)
    return stage.scene(size, tolerance), stage.expected
