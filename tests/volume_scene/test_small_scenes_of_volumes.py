# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled volumes in scenes of millimeters, which the renderer scales."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from spectral_core.render import render_scene
from spectral_core.scene import Camera, Emission, Film, Instance, Material, Mesh, Scene, Transparent, VolumeObject, gray
from spectral_core.volume.transfer import Material as VolumeMaterial
from spectral_core.volume.transfer import TransferFunction

COUNT, GAP = 8, 0.02
SHEETS = (("wall", -0.5 - GAP), ("veil", 0.5 + GAP), ("veil", 0.5 + 2 * GAP))


def scene(size: float) -> Scene:
    """A wall of radiance 1, close above it a volume with a ball of larger values, and close above that two veils."""
    steps = (np.arange(8) - 3.5) / 4
    ball = np.exp(-2.0 * (steps[:, None, None] ** 2 + steps[None, :, None] ** 2 + steps[None, None, :] ** 2))
    shell = VolumeMaterial(
        "shell", [0.0, 1.0], np.array([0.5, 3.0]) / size, [0.8, 0.5, 0.2], emission=np.array([0.0, 2.0]) / size,
        gradient_values=np.array([0.0, 2.0]) / size, gradient_weights=[0.2, 1.0],
    )  # fmt: skip
    placed = np.diag([size / 8] * 3 + [1.0])
    placed[:3, 3] = -3.5 * size / 8
    volume = VolumeObject("ball", ball.astype(np.float32), placed, TransferFunction((shell,)), lighting="even")
    meshes, instances = [], []
    for name, height in SHEETS:
        corners = np.array([[-1, -1, height], [1, -1, height], [1, 1, height], [-1, 1, height]], np.float32) * size
        place = f"{name} {height}"
        meshes.append(Mesh(place, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)))
        instances.append(Instance(place, place, np.eye(4), (name,)))
    above = np.eye(4)
    above[2, 3] = 2.0 * size
    camera = Camera(
        world_from_camera=above, kind="orthographic", orthographic_scale=size, near=0.01 * size, far=9 * size
    )
    materials = (Material("wall", Emission(gray(1.0), 1.0)), Material("veil", Transparent(gray(0.5))))
    return Scene(
        camera=camera, film=Film(COUNT, COUNT, samples=16), volumes=(volume,), meshes=tuple(meshes),
        instances=tuple(instances), materials=materials,
    )  # fmt: skip


@pytest.mark.parametrize("size", [1e-3, 1e-6])
def test_a_volume_close_to_surfaces_does_not_depend_on_the_size_of_the_scene(size):
    """Rays begin 0.1 mm off a surface: in a scene of 1 mm the second veil was passed over, and a part of the volume."""
    expected, found = (render_scene(scene(each)).pixels[..., :3] for each in (1.0, size))
    assert expected.std() > 0.02
    np.testing.assert_allclose(found, expected, rtol=0.02)
