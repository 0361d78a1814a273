# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a sixth kind for predictions of error and time, unlike all others: none chose a constant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.render.cases.meshes import at, sphere
from benchmarks.render.cases.plan_scenes import Stage
from spectral_core.scene import (
    AreaLight,
    Camera,
    Color,
    Diffuse,
    Emission,
    Fluorescent,
    Glossy,
    ImageTexture,
    Mesh,
    Metal,
    MixSurface,
    Panorama,
    Principled,
    ScatteringMedium,
    Scene,
    SpotLight,
    SunLight,
    Translucent,
    Transparent,
    VolumeObject,
    World,
    gray,
)
from spectral_core.spectra import catalogue
from spectral_core.spectra.fluorescence import FluorescentDye
from spectral_core.spectra.spectrum import Illuminant, SpectralGrid


def _rgb(*values: float) -> Color:
    return Color(np.array(values))


def _image(name: str, values: np.ndarray) -> ImageTexture:
    return ImageTexture(name, values.astype(np.float32), "linear")


def billiards(stage: Stage) -> None:
    """Fifteen coated balls on felt under three long lamps."""
    stage.floor = Principled(_rgb(0.05, 0.3, 0.12), roughness=0.9, sheen_weight=1.0)
    stage.lights = [
        AreaLight(name=f"tube {k}", world_from_light=at(0, -1.5 + 1.5 * k, 2.6), power_w=40, size=(2.4, 0.15))
        for k in range(3)
    ]
    rng = np.random.default_rng(15)
    row = [(x, y) for y in range(5) for x in range(y + 1)]
    for k, (x, y) in enumerate(row):
        paint = Principled(Color(rng.uniform(0.05, 0.8, 3)), roughness=0.3, coat_weight=1.0)
        stage.add(f"ball {k}", "sphere", at(0.52 * (x - y / 2), -0.9 + 0.45 * y, 0.26, 0.26), paint)


def theater(stage: Stage) -> None:
    """Spot lamps of saturated colors on a folded velvet curtain above a brushed floor."""
    stage.meshes = (*stage.meshes, _folds())
    stage.floor = Metal(gray(0.5), gray(0.6), 0.35, anisotropy=0.6)
    colors = ((1.0, 0.05, 0.02), (0.02, 0.9, 0.1), (0.05, 0.1, 1.0), (1.0, 0.8, 0.02), (0.9, 0.02, 0.8))
    stage.lights = [
        SpotLight(name=f"spot {k}", world_from_light=at(-2 + k, -1.2, 3.5, turn=("x", 35)), power_w=150, blend=0.4,
                  cone_angle_rad=0.7, radius=0.03, color=_rgb(*rgb))
        for k, rgb in enumerate(colors)
    ]  # fmt: skip
    velvet = Principled(_rgb(0.5, 0.02, 0.04), roughness=0.8, sheen_weight=1.0, sheen_roughness=0.3)
    stage.add("curtain", "folds", at(0, 1.6, 0, (3, 0.25, 3)), velvet)


def _folds(count: int = 160) -> Mesh:
    """An upright sheet of folds over x from -1 to 1, z from 0 to 1."""
    x = np.linspace(-1, 1, count + 1)
    y = np.sin(28 * x) + 0.4 * np.sin(61 * x)
    points = np.concatenate([np.stack([x, y, 0 * x + z], axis=1) for z in (0.0, 1.0)])
    k = np.arange(count)
    low, high = (k, k + 1), (k + count + 1, k + count + 2)
    faces = np.concatenate([np.stack([low[0], low[1], high[1]], axis=1), np.stack([low[0], high[1], high[0]], axis=1)])
    return Mesh("folds", points.astype(np.float32), faces.astype(np.uint32))


def canopy(stage: Stage) -> None:
    """Three hundred leaves over a path: spots of sunlight between them, and green light through them."""
    rng = np.random.default_rng(300)
    center = rng.uniform((-2.5, -1.5, 1.6), (2.5, 2.5, 3.0), (300, 3))
    axes = np.linalg.qr(rng.normal(size=(300, 3, 3)))[0]
    corners = np.array([[-1, 0], [0, -0.5], [1, 0], [0, 0.5]]) * 0.28
    points = center[:, None] + np.einsum("kc,nci->nki", corners, axes[:, :2])
    first = 4 * np.arange(300)[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    leaves = Mesh("leaves", points.reshape(-1, 3).astype(np.float32), faces.astype(np.uint32))
    stage.meshes = (*stage.meshes, leaves)
    leaf = MixSurface(0.5, Diffuse(_rgb(0.12, 0.3, 0.04)), Translucent(_rgb(0.25, 0.5, 0.05)))
    stage.add("leaves", "leaves", at(), leaf)
    stage.floor = Diffuse(_rgb(0.35, 0.28, 0.2))
    stage.lights = [SunLight(name="sun", world_from_light=at(turn=("x", 20)), irradiance=4.0, angle_rad=0.0093)]
    stage.world = World(_rgb(0.15, 0.25, 0.5))


def lantern(stage: Stage) -> None:
    """Lanterns of paper around small bright balls, the only light of a dark room."""
    wall = Diffuse(_rgb(0.4, 0.35, 0.3))
    stage.lights, stage.floor = [], wall
    stage.add("back", "square", at(0, 2.2, 2, 3, ("x", 90)), wall)
    for k, place in enumerate(((-1.1, 0.2, 0.9), (1.0, 0.8, 1.4))):
        stage.add(f"paper {k}", "sphere", at(*place, 0.45), Translucent(_rgb(0.9, 0.75, 0.5)))
        stage.add(f"flame {k}", "sphere", at(*place, 0.08), Emission(_rgb(1.0, 0.7, 0.4), 60.0))


def oil(stage: Stage) -> None:
    """Metal with films of 150 to 700 nm under a lamp of equal energy: colors of interference."""
    stage.lights = [
        AreaLight(
            name="panel", world_from_light=at(0, -1.0, 3.2), power_w=90, size=(2, 2), color=catalogue.illuminant("E")
        )
    ]
    stage.world = World(gray(0.2))
    for k in range(6):
        film = Metal(gray(0.5), gray(0.7), 0.15, thin_film_thickness=150.0 + 110 * k, thin_film_ior=1.5)
        stage.add(f"film {k}", "sphere", at(-1.8 + 0.72 * k, 0.4 * (-1) ** k, 0.34, 0.34), film)


def darkroom(stage: Stage) -> None:
    """A red safelight of one line, a violet lamp, a fluorescent sheet and measured paints in a corner."""
    line = np.array([655.0, 658.0, 661.0])
    red = Illuminant("safelight", SpectralGrid(line), np.array([0.0, 1.0, 0.0]))
    band = np.array([390.0, 405.0, 420.0])
    violet = Illuminant("violet", SpectralGrid(band), np.array([0.0, 1.0, 0.0]))
    above = at(-1.6, -0.8, 2.8), at(1.2, -0.6, 2.8)
    stage.lights = [
        SpotLight(name=color.name, world_from_light=place, power_w=power, cone_angle_rad=1.9, color=color, radius=0.1)
        for place, power, color in zip(above, (25, 40), (red, violet), strict=True)
    ]
    dye = FluorescentDye.gaussian("green", 410, 525)
    stage.add("sheet", "square", at(0.7, 0.2, 0.01, 0.7), Fluorescent(gray(0.1), (dye,), (0.7,)))
    stage.add("wall", "square", at(0, 1.6, 1.2, (2.5, 1.2, 1), ("x", 90)), Diffuse(gray(0.75)))
    for k, name in enumerate(("orange", "cyan")):
        paint = Diffuse(catalogue.reflectance(name))
        stage.add(name, "box", at(-1.2 + 0.9 * k, 0.5, 0.35, 0.35), paint)


def plume(stage: Stage) -> None:
    """A plume of dense smoke, sampled on a grid, in the sun."""
    from spectral_core.volume.transfer import Material as Stuff
    from spectral_core.volume.transfer import TransferFunction

    z, y, x = np.meshgrid(*(np.linspace(-1, 1, 20) for _ in range(3)), indexing="ij")
    wide = 0.2 + 0.25 * (z + 1)
    shape = np.exp(-((x - 0.3 * np.sin(3 * z)) ** 2 + y**2) / wide**2).transpose(2, 1, 0)
    stuff = Stuff("smoke", np.array([0.0, 0.3, 1.0]), np.array([0.0, 0.0, 6.0]), np.array([0.8, 0.8, 0.85]))
    stage.volumes = (VolumeObject("plume", shape, at(-1.0, -0.9, 0.1, 0.1), TransferFunction((stuff,))),)
    stage.lights = [SunLight(name="sun", world_from_light=at(turn=("y", 40)), irradiance=3.0, angle_rad=0.01)]
    stage.world = World(_rgb(0.2, 0.3, 0.5))


def courtyard(stage: Stage) -> None:
    """All around in a white yard: sun on one wall, the rest lit by it and the sky. A panoramic camera sees it."""
    white = Diffuse(gray(0.75))
    stage.floor = Diffuse(_rgb(0.5, 0.4, 0.3))
    for name, place in {
        "north": at(0, 3, 2, 3, ("x", 90)), "south": at(0, -3, 2, 3, ("x", -90)), "west": at(-3, 0, 2, 3, ("y", 90)),
        "east": at(3, 0, 2, 3, ("y", -90)),
    }.items():  # fmt: skip
        stage.add(name, "square", place, white)
    stage.add("well", "box", at(1.2, 1.0, 0.4, 0.4), Diffuse(_rgb(0.2, 0.35, 0.6)))
    stage.lights = [SunLight(name="sun", world_from_light=at(turn=("y", 55)), irradiance=4.0, angle_rad=0.0093)]
    stage.world = World(_rgb(0.2, 0.35, 0.7))


def embers(stage: Stage) -> None:
    """Two hundred grains that emit light of very different strength over rough metal."""
    rng = np.random.default_rng(200)
    stage.meshes = (*stage.meshes, replace(sphere(6), name="grain"))
    stage.lights, stage.floor = [], Metal(gray(0.4), gray(0.5), 0.3)
    for k in range(200):
        place = at(*rng.uniform((-2.5, -2.0, 0.03), (2.5, 2.0, 0.5))) @ at(scale=rng.uniform(0.01, 0.05))
        hot = float(10 ** rng.uniform(0, 2.3))
        stage.add(f"grain {k}", "grain", place, Emission(_rgb(1.0, 0.35, 0.08), hot))


def scoreboard(stage: Stage) -> None:
    """A board of colored diodes is the only light of a wet square, out of focus."""
    rng = np.random.default_rng(64)
    board = rng.uniform(0, 1, (24, 48, 3)) ** 4 * (rng.random((24, 48, 1)) < 0.5)
    stage.lights, stage.aperture = [], 0.06
    stage.floor = MixSurface(0.5, Diffuse(gray(0.25)), Glossy(gray(0.7), 0.2))
    stage.add("board", "square", at(0, 1.8, 1.3, (2.4, 1.2, 1), ("x", 90)), Emission(_image("board", board), 8.0))
    stage.add("post", "box", at(-0.6, 0.3, 0.5, (0.12, 0.12, 0.5)), Diffuse(gray(0.6)))
    stage.add("kiosk", "box", at(0.9, 0.0, 0.35, 0.35), Principled(_rgb(0.6, 0.5, 0.2), metallic=1.0, roughness=0.25))


def mine(stage: Stage) -> None:
    """A long dusty tunnel, lit by a lamp beside the camera alone."""
    rock = Diffuse(_rgb(0.35, 0.3, 0.27))
    stage.floor = rock
    for name, place in {
        "left": at(-1.6, 4, 1.5, (2, 11, 1), ("y", 90)), "right": at(1.6, 4, 1.5, (2, 11, 1), ("y", -90)),
        "roof": at(0, 4, 3.2, (2, 11, 1), ("x", 180)),
    }.items():  # fmt: skip
        stage.add(name, "square", place, rock)
    stage.add("beam", "box", at(0, 2.0, 2.4, (1.6, 0.12, 0.12)), Diffuse(_rgb(0.4, 0.25, 0.1)))
    stage.add("dust", "box", at(0, 3, 1.55, (1.55, 6, 1.5)), None)
    stage.media["dust"] = ScatteringMedium(0.03, gray(0.8), anisotropy=0.3)
    headlamp = at(0.3, -3.2, 2.2, turn=("x", 80))
    stage.lights = [SpotLight(name="head", world_from_light=headlamp, power_w=900, cone_angle_rad=0.9, radius=0.04)]


def sale(stage: Stage) -> None:
    """Sheets of film in all colors over printed cloth, two lamps of 3000 K and 6500 K: shadows of two tints."""
    rng = np.random.default_rng(8)
    print_of = np.kron(rng.uniform(0.1, 0.8, (12, 12, 3)), np.ones((4, 4, 1)))
    stage.floor = Diffuse(_image("cloth", print_of))
    warm, cold = _rgb(1.0, 0.65, 0.35), _rgb(0.8, 0.9, 1.0)
    stage.lights = [
        SpotLight(
            name=name, world_from_light=at(x, -1.0, 3.4), power_w=250, cone_angle_rad=1.6, radius=0.2, color=white
        )
        for name, x, white in (("warm", -1.5, warm), ("cold", 1.5, cold))
    ]
    for k in range(5):
        tint = Color(rng.uniform(0.1, 0.95, 3))
        stage.add(f"film {k}", "square", at(-1.6 + 0.8 * k, 0.2 * k - 0.5, 0.6 + 0.2 * k, 0.45), Transparent(tint))


FOREIGN: dict[str, Callable[[Stage], None]] = {
    effect.__name__.replace("_", " "): effect
    for effect in (
        billiards, theater, canopy, lantern, oil, plume, courtyard, embers, scoreboard, mine, sale, darkroom,
    )
}  # fmt: skip


def foreign_scene(name: str, size: tuple[int, int]) -> Scene:
    """One of these scenes."""
    stage = Stage()
    FOREIGN[name](stage)
    scene = stage.scene(size, 1.0)
    if name == "courtyard":
        around = Panorama("equirectangular", (-np.pi, np.pi, -0.9, 0.9))
        eye = Camera(world_from_camera=at(0.3, -0.4, 1.5, turn=("x", 90)), kind="panoramic", panorama=around)
        scene = replace(scene, camera=eye)
    if name == "mine":
        scene = replace(scene, camera=replace(scene.camera, world_from_camera=at(0, -4.5, 1.6, turn=("x", 86))))
    return scene
