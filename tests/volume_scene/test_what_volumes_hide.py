# SPDX-License-Identifier: GPL-3.0-or-later
"""What a sampled volume leaves of things behind it: their passes, and the shadows on a shadow catcher."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.scene import (
    Camera,
    Color,
    Diffuse,
    Film,
    Instance,
    Material,
    Mesh,
    Passes,
    RenderSettings,
    Scene,
    SunLight,
    VolumeObject,
    World,
    gray,
)
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction

DEPTH, SKY = 1.2, 0.5
SEEN = np.exp(-DEPTH)
SHADOWS = np.array([1.0, np.exp(-DEPTH * 0.9 * np.sqrt(2)), np.exp(-DEPTH * 0.1 * np.sqrt(2))])
"""What the slab leaves of a sun at 45°, at three places of the floor; the camera sees the last one through it."""


def at(x: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[[0, 2], 3] = x, z
    return matrix


def slab(color=(0.0, 0.0, 0.0)) -> VolumeObject:
    """Fog from 0.1 to 1.1 along x, from 0.5 to 1.5 along z."""
    matrix = np.diag([0.25, 1.0, 0.25, 1.0])
    matrix[:3, 3] = 0.225, -1.5, 0.625
    fog = TransferFunction((VolumeMaterial("fog", [0.0, 2.0], [DEPTH] * 2, np.array(color), lit=False),))
    return VolumeObject("slab", np.ones((4, 4, 4), np.float32), matrix, fog, lighting="shadows")


def row(volume: VolumeObject, surface: Diffuse, *, samples: int, passes=(), catches=False, **film):
    """A floor at x of -1.5, -0.5 and 0.5, seen from above."""
    corners = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], np.float32)
    sun = np.eye(4)
    sun[:3, 0], sun[:3, 2] = np.array([1, 0, -1]) / np.sqrt(2), np.array([1, 0, 1]) / np.sqrt(2)
    wanted = Passes(passes) if passes else None
    scene = Scene(
        camera=Camera(world_from_camera=at(-0.5, 5.0), kind="orthographic", orthographic_scale=3.0),
        film=Film(3, 1, samples, filter_kind="box", filter_width=0.01, **film),
        volumes=(volume,),
        world=World(gray(1e-6), camera_view=World(gray(SKY))),
        lights=(SunLight(name="sun", world_from_light=sun, irradiance=3000.0, angle_rad=0.0),),
        meshes=(Mesh("floor", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)),),
        instances=(Instance("floor", "floor", np.eye(4), ("paint",), is_shadow_catcher=catches),),
        materials=(Material("paint", surface),),
        settings=RenderSettings(transport="rgb", passes=wanted),
    )
    return render_scene(scene)


def test_passes_count_a_surface_by_what_a_volume_leaves_of_it():
    """As in Cycles behind fog. A matte of the floor had the whole floor where smoke hid most of it."""
    names = ("Normal", "Diffuse Color", "CryptoObject", "Depth", "Denoising Albedo", "Denoising Normal")
    paint = Color([0.5, 0.1, 0.02])
    found = row(slab(), Diffuse(paint), samples=16, passes=names).passes
    left = np.array([1.0, 1.0, SEEN])
    for name in ("Normal", "Denoising Normal"):
        np.testing.assert_allclose(np.abs(found[name][0, :, 2]), left, rtol=0.01)
    for name in ("Diffuse Color", "Denoising Albedo"):
        np.testing.assert_allclose(found[name][0], left[:, None] * paint.linear_rgb, rtol=0.03)
    np.testing.assert_allclose(found["CryptoObject00"][0, :, 1], left, rtol=0.01)
    np.testing.assert_allclose(found["Depth"][0, :, 0], 5.0, rtol=1e-5)


def test_a_catcher_catches_the_shadow_of_a_volume():
    color, hidden = np.array([0.5, 0.2, 0.1]), np.array([0.0, 0.0, 1 - SEEN])
    shown = row(slab(color), Diffuse(gray(0.8)), samples=16, catches=True, transparent=True).pixels[0]
    np.testing.assert_allclose(shown[:, :3], hidden[:, None] * color, atol=0.01)
    np.testing.assert_allclose(shown[:, 3], 1 - (1 - hidden) * SHADOWS, atol=0.01)


def test_a_background_behind_a_catcher_is_seen_through_a_volume():
    color, hidden = np.array([0.5, 0.2, 0.1]), np.array([0.0, 0.0, 1 - SEEN])
    shown = row(slab(color), Diffuse(gray(0.8)), samples=16, catches=True).pixels[0]
    background = (1 - hidden) * SHADOWS * SKY
    np.testing.assert_allclose(shown[:, :3], hidden[:, None] * color + background[:, None], atol=0.01)
