# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes follow the Ray Visibility of their objects: closed forms of what passes a black slab."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.render.volumes_as_media import volumes_as_media
from spectral_core.scene import (
    Camera,
    Diffuse,
    Emission,
    Film,
    Glossy,
    Instance,
    Material,
    Mesh,
    PointLight,
    Rays,
    Scene,
    VolumeObject,
    gray,
)
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction

DEPTH = 1.2
SEEN = np.exp(-DEPTH)
SCATTERED = Rays.DIFFUSE | Rays.GLOSSY | Rays.TRANSMISSION


def slab(hidden_from: Rays = Rays.NONE, lighting: str = "shadows", name: str = "slab") -> VolumeObject:
    """Black fog between z = -0.5 and 0.5, through which a share of ``SEEN`` passes."""
    matrix = np.diag([5.0, 5.0, 0.25, 1.0])
    matrix[:3, 3] = [-7.5, -7.5, -0.375]
    fog = TransferFunction((VolumeMaterial("fog", [0.0, 2.0], [DEPTH] * 2, np.zeros(3), lit=False),))
    return VolumeObject(name, np.ones((4, 4, 4), np.float32), matrix, fog, lighting=lighting, hidden_from=hidden_from)


def wall(name: str, z: float) -> tuple[Mesh, Instance]:
    corners = np.array([[-9, -9, z], [9, -9, z], [9, 9, z], [-9, 9, z]], np.float32)
    mesh = Mesh(name, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    return mesh, Instance(name, name, np.eye(4), (name,))


def seen(*volumes: VolumeObject, mirrored: bool = False) -> float:
    """A floor under a lamp; or a mirror on the floor under a ceiling that emits light."""
    matrix = np.eye(4)
    matrix[2, 3] = 4.0
    camera = Camera(world_from_camera=matrix, kind="orthographic", orthographic_scale=0.2)
    surface = Glossy(gray(1.0), 0.0) if mirrored else Diffuse(gray(0.8))
    walls, materials = [wall("floor", -2.0)], [Material("floor", surface)]
    lamp = np.eye(4)
    lamp[2, 3] = 3.0
    lights = (PointLight(name="lamp", world_from_light=lamp, power_w=100.0),)
    if mirrored:
        walls, lights = [*walls, wall("sky", 6.0)], ()
        materials.append(Material("sky", Emission(gray(1.0), 1.0)))
    meshes, instances = zip(*walls, strict=True)
    film = Film(4, 4, samples=32, filter_kind="box", filter_width=1.0)
    scene = Scene(
        camera=camera, film=film, volumes=volumes, lights=lights,
        meshes=meshes, instances=instances, materials=tuple(materials),
    )  # fmt: skip
    return float(render_scene(scene).pixels[..., :3].mean())


@pytest.fixture(scope="module")
def floor() -> float:
    return seen()


@pytest.mark.parametrize(
    ("hidden", "share"),
    [
        (Rays.NONE, SEEN**2),
        (Rays.CAMERA, SEEN),
        (Rays.SHADOW, SEEN),
        (Rays.CAMERA | Rays.SHADOW, 1.0),
        (SCATTERED, SEEN**2),
    ],
)
def test_the_camera_and_the_lamp_see_a_volume_each_for_itself(floor, hidden, share):
    assert seen(slab(hidden)) == pytest.approx(share * floor, rel=0.02)


def test_without_shadows_only_the_camera_sees_it(floor):
    assert seen(slab(Rays.CAMERA, "even")) == pytest.approx(floor, rel=0.01)
    assert seen(slab(Rays.SHADOW | SCATTERED, "even")) == pytest.approx(SEEN * floor, rel=0.01)


@pytest.mark.parametrize(("hidden", "share"), [(Rays.NONE, SEEN**2), (SCATTERED, SEEN), (SCATTERED | Rays.CAMERA, 1.0)])
def test_a_mirror_shows_what_scattered_rays_see(hidden, share):
    assert seen(slab(hidden), mirrored=True) == pytest.approx(share, rel=0.02)


def test_one_of_two_volumes_may_be_hidden(floor):
    lower = replace(slab(Rays.CAMERA), name="lower")
    assert seen(slab(Rays.SHADOW), lower) == pytest.approx(SEEN**2 * floor, rel=0.02)
    assert seen(lower, slab(Rays.CAMERA | Rays.SHADOW)) == pytest.approx(SEEN * floor, rel=0.02)


def test_a_volume_among_media_is_hidden_from_the_same_rays():
    camera, film = Camera(world_from_camera=np.eye(4)), Film(4, 4)
    scene = volumes_as_media(Scene(camera=camera, film=film, volumes=(slab(Rays.CAMERA | Rays.GLOSSY),)))
    assert scene.instances[0].hidden_from == Rays.CAMERA | Rays.GLOSSY
