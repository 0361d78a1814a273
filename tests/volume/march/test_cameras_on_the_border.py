# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras on corners, edges and faces of nearly opaque fields: a millionth of a voxel inside would be visible."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.march.device.voxels import opaque_doubles
from spectral_core.volume.march.loop import march
from spectral_core.volume.march.path import Placed, WorldRay, path_through
from spectral_core.volume.plan import plan
from spectral_core.volume.renderer import VolumeRenderer
from spectral_core.volume.transfer import Material, TransferFunction
from spectral_core.volume.view import View

OPAQUE = TransferFunction((Material("solid", [0.0], [1e4], [1.0, 0.5, 0.2]),))


def opaque_box(matrix: np.ndarray) -> ScalarVolume:
    return ScalarVolume("solid", np.full((20, 14, 9), 0.5, np.float32), matrix)


def rotated(angle: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = 3.0, -7.0, 1.0
    matrix[:3, 2] *= 2.5
    return matrix


def lengths(volume: ScalarVolume, view: View) -> np.ndarray:
    """Voxels per unit extinction that each ray spends inside the box, in world units, by a slab test in float64."""
    start, toward = view.rays_world()
    inverse = np.linalg.inv(volume.world_from_index)
    at, along = start @ inverse[:3, :3].T + inverse[:3, 3], toward @ inverse[:3, :3].T
    # The camera is on the border to rounding; a distance of 1e-12 voxels is none.
    at = np.where(np.abs(at - np.round(2 * at) / 2) < 1e-12, np.round(2 * at) / 2, at)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = (np.stack([np.full(3, -0.5), np.array(volume.shape) - 0.5])[:, None, None] - at) / along
    near, far = np.maximum(np.nanmax(ends.min(axis=0), axis=-1), 0.0), np.nanmin(ends.max(axis=0), axis=-1)
    return np.maximum(far - near, 0.0)


@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize("ends", [(0, 7), (7, 0), (3, 4), (6, 1)])
def test_a_camera_on_a_corner_sees_only_its_octant(ends, angle):
    """Rays along the faces began inside the field by rounding; the picture had 28 dB, and 45 to 70 dB were stated."""
    volume = opaque_box(rotated(angle))
    corners = volume.corners_world
    view = View.looking(corners[ends[0]], corners[ends[1]] + [1.0, 0.4, 0.0], width=60, height=60, fov_deg=70.0)
    renderer = VolumeRenderer(volume)
    made = plan(renderer, view, OPAQUE, 50.0)
    shown = renderer.render(view, OPAQUE, made.stepping).picture(colors=np.ones((1, 3)))[..., 0]
    truth = 1.0 - np.exp(-1e4 * lengths(volume, view))
    snr = 10.0 * np.log10(np.sum(truth**2) / max(np.sum((shown - truth) ** 2), 1e-30))
    assert snr > 60.0
    assert made.estimate_db <= snr + 3.0


def test_a_camera_that_single_precision_moves_has_a_lower_stated_error():
    """Less than a millionth of a voxel outside, where single precision has no number."""
    volume = opaque_box(np.eye(4))
    view = View.looking([19.5 + 7e-7, 13.5 + 4e-7, -0.5], [3.0, 2.0, 9.0], width=60, height=60, fov_deg=90.0)
    renderer = VolumeRenderer(volume)
    made = plan(renderer, view, OPAQUE, 50.0)
    shown = renderer.render(view, OPAQUE, made.stepping).picture(colors=np.ones((1, 3)))[..., 0]
    truth = 1.0 - np.exp(-1e4 * lengths(volume, view))
    snr = 10.0 * np.log10(np.sum(truth**2) / max(np.sum((shown - truth) ** 2), 1e-30))
    assert made.estimate_db <= snr + 3.0


def test_rays_of_a_scene_that_leave_a_face_meet_nothing():
    """A ray from a surface that touches a field begins on the field's face, wherever it is on it."""
    import drjit.llvm as types

    solid = TransferFunction((Material("solid", [0.0], [1e9], [1.0, 1.0, 1.0]),))
    volume = opaque_box(np.eye(4))
    rng = np.random.default_rng(2)
    start = (rng.random((400, 3)) * volume.shape - 0.5).astype(np.float32)
    toward = rng.normal(size=(400, 3))
    for k in range(400):
        axis, side = k % 3, k // 3 % 2
        start[k, axis] = (-0.5, volume.shape[axis] - 0.5)[side]
        toward[k, axis] = (-1.0, 1.0)[side] * abs(toward[k, axis])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    data = VolumeRenderer(volume).prepare(solid).march_input(Stepping("uniform", "midpoint", 1.0))
    rows = tuple(opaque_doubles(types, row) for row in np.eye(3))
    placed = Placed(data, rows, opaque_doubles(types, np.zeros(3)))
    endless = types.Float(np.full(400, 1e30, np.float32))
    for sign, shown in ((1.0, 0.0), (-1.0, 1.0)):
        ray = WorldRay(types.Array3f(start.T), types.Array3f((sign * toward).T.astype(np.float32)), endless)
        assert march(path_through([placed], ray)).amounts[0].numpy() == pytest.approx(shown, abs=1e-5)
