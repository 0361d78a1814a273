# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes behind, in and before things that a ray passes or that reflect it: closed forms of a slab of fog."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
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
    Mesh,
    PointLight,
    Rays,
    Scene,
    Transparent,
    VolumeObject,
    gray,
)
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction

DEPTH, COLOR = 1.2, np.array([0.8, 0.5, 0.2])
OPACITY = 1 - np.exp(-DEPTH)
SEEN = COLOR * OPACITY + 1 - OPACITY
"""The slab before a wall of radiance 1."""
MATERIALS = (
    Material("wall", Emission(gray(1.0), 1.0)),
    Material("floor", Diffuse(gray(0.8))),
    Material("matt", Diffuse(gray(0.5))),
    Material("veil", Transparent(gray(0.5))),
    Material("pane", Glass(ior=1.0001)),
    Material("mirror", Glossy(gray(1.0), 0.0)),
)
LAMP = {"power_w": 1e-3, "group": ""}


def at(x: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[[0, 2], 3] = x, z
    return matrix


def sheet(material: str, x: float, z: float, half: float = 0.45, **rules) -> tuple[Mesh, Instance]:
    name = f"{material} {x} {z}"
    corners = np.array([[-half, -2, 0], [half, -2, 0], [half, 2, 0], [-half, 2, 0]], np.float32)
    mesh = Mesh(name, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))
    return mesh, Instance(name, name, at(x, z), (material,), **rules)


def slab(lighting: str, x: float = 0.0, z: float = 0.0) -> VolumeObject:
    """Fog around a place, from -10 to 10 along x, -4 to 4 along y and -0.5 to 0.5 along z."""
    matrix = np.diag([5.0, 2.0, 0.25, 1.0])
    matrix[:3, 3] = [x - 7.5, -3.0, z - 0.375]
    fog = TransferFunction((VolumeMaterial("fog", [0.0, 2.0], [DEPTH] * 2, COLOR),))
    return VolumeObject("slab", np.ones((4, 4, 4), np.float32), matrix, fog, lighting=lighting)


def columns(count: int, sheets, volume: VolumeObject, lights=(), samples: int = 16, transparent: bool = False):
    """The pixels of a row, column k over x = k, seen from above."""
    meshes, instances = zip(*sheets, strict=True)
    place = at((count - 1) / 2, 5.0)
    film = Film(
        count, 1, samples=samples, filter_kind="box", filter_width=0.01,
        transparent=transparent, transparent_glass=transparent,
    )  # fmt: skip
    camera = Camera(world_from_camera=place, kind="orthographic", orthographic_scale=float(count))
    scene = Scene(
        camera=camera, film=film, volumes=(volume,), lights=lights,
        meshes=meshes, instances=instances, materials=MATERIALS,
    )  # fmt: skip
    return render_scene(scene).pixels[0]


def test_a_volume_is_seen_past_all_that_lets_rays_pass():
    """Bodies of lamps, objects hidden from the camera, veils and panes of glass each ended the view of a volume."""
    lights = (
        AreaLight(name="panel", world_from_light=at(1.0, -1.5), size=(0.9, 0.9), **LAMP),
        PointLight(name="ball", world_from_light=at(2.0, 0.0), radius=0.4, **LAMP),
    )
    sheets = [
        sheet("wall", 3.0, -2.0, half=6.0),
        sheet("matt", 3.0, 0.0, hidden_from=Rays.CAMERA),
        sheet("veil", 4.0, 1.0),
        sheet("pane", 5.0, 1.0),
    ]
    shown = columns(6, sheets, slab("even"), lights)
    expected = SEEN * np.array([1.0, 1.0, 1.0, 1.0, 0.5, 1.0])[:, None]
    np.testing.assert_allclose(shown[:, :3], expected, rtol=0.01)


def test_mirrors_show_a_volume_and_coverage_counts_it_behind_a_veil_or_a_pane():
    above = slab("even", z=2.0)
    from_below = [sheet("mirror", 0.0, 0.0), sheet("veil", 1.0, 4.0), sheet("wall", 0.0, 6.0)]
    mirror, veil, pane = columns(3, [*from_below, sheet("pane", 2.0, 4.0)], above, transparent=True)
    once, twice = COLOR * OPACITY, 1 - OPACITY
    np.testing.assert_allclose(mirror[:3], once + twice * (once + twice), rtol=0.01)
    np.testing.assert_allclose(veil, [*(0.5 * once), 1 - 0.5 * twice], rtol=0.01)
    np.testing.assert_allclose(pane, [*once, 1 - twice], rtol=0.01)


def test_light_reaches_a_floor_beside_a_volume_with_shadows_as_it_does_without():
    """Veils and the bodies of other lamps shadowed a lamp in full, and lamps of a radius shone through them wrongly."""
    lamp = PointLight(name="lamp", world_from_light=at(1.5, 2.0), power_w=100.0)
    panel = AreaLight(name="panel", world_from_light=at(2.0, 1.0), size=(0.9, 0.9), power_w=1e-6)
    sheets = [
        sheet("floor", 1.5, -2.0, half=9.0),
        sheet("veil", 0.0, -1.9),
        sheet("matt", 3.0, -1.9, hidden_from=Rays.SHADOW | Rays.CAMERA | Rays.DIFFUSE),
    ]
    beside = slab("shadows", x=30.0)
    shown = columns(4, sheets, beside, (lamp, panel), samples=64)[:, 0]
    squared = 16.0 + (np.arange(4) - 1.5) ** 2
    expected = 0.8 / np.pi * 100.0 / (4 * np.pi) * 4.0 / squared**1.5 * [0.25, 1.0, 1.0, 1.0]
    np.testing.assert_allclose(shown, expected, rtol=0.01)


def test_a_volume_with_shadows_lights_what_is_around_it():
    """An opaque slab that emits light shines on the floor below; it lit nothing."""
    glow = TransferFunction((VolumeMaterial("glow", [0.0, 2.0], [60.0] * 2, np.ones(3), lit=False),))
    volume = replace(slab("shadows"), transfer=glow, hidden_from=Rays.CAMERA)
    shown = columns(2, [sheet("floor", 0.5, -0.75, half=2.0)], volume, samples=256)
    np.testing.assert_allclose(shown[:, :3], 0.8, rtol=0.06)


def test_lamps_light_volumes_by_their_own_rules():
    """One that is hidden from volume scattering lit them, and one without Cast Shadow was shadowed there."""
    lamp = PointLight(name="lamp", world_from_light=at(0.0, 3.0), power_w=100.0, casts_shadow=False)
    lid = [sheet("matt", 0.0, 1.5, half=3.0, hidden_from=Rays.CAMERA)]
    volume = replace(slab("shadows"), quality=10.0, rule="uniform")
    (lit,) = columns(1, lid, volume, (lamp,))
    (unlit,) = columns(1, lid, volume, (replace(lamp, hidden_from=Rays.VOLUME),))
    assert (lit[:3] > 0.01).all() and (unlit[:3] == 0.0).all()
