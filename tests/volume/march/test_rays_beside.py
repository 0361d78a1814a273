# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that tell what rounding changes pass the field eight roundings beside the others, along each axis of it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.pilot.rounding import beside
from spectral_core.volume.view import View

EIGHT = 8.0 * 2.0**-24
SIGNS = np.array(list(product((1.0, -1.0), repeat=3)))


def ray(view: View, volume: ScalarVolume, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    """Start and direction in index space of the ray through a place in the picture, from the definition of a view."""
    matrix = view.world_from_camera
    half = view.ortho_width / 2 if view.fov_deg is None else np.tan(np.radians(view.fov_deg) / 2)
    across = np.array([(1 - 2 * x / view.width) * half, (1 - 2 * y / view.height) * half * view.height / view.width])
    start, toward = matrix[:3, 3], matrix[:3, 2]
    if view.fov_deg is None:
        start = start + matrix[:3, :2] @ across
    else:
        toward = toward + matrix[:3, :2] @ across
    inverse = np.linalg.inv(volume.world_from_index)
    return inverse[:3, :3] @ start + inverse[:3, 3], inverse[:3, :3] @ toward


@pytest.mark.parametrize("edges", [(1.0, 1.0, 1.0), (1.0, 1e5, 1e5), (3e4, 1.0, 0.2)])
@pytest.mark.parametrize("fov", [None, 40.0, 2.0])
@pytest.mark.parametrize("shape", [(9, 8, 7), (40, 3, 1)])
def test_rays_beside_are_eight_roundings_aside(edges, fov, shape) -> None:
    volume = ScalarVolume.from_spacing("v", np.zeros(shape, np.uint8), edges, origin=(3.0, -2.0, 7.0))
    view = View.around(volume, 33.0, 21.0, width=40, height=30, fov_deg=fov)
    x, y = np.random.default_rng(1).uniform(0, [[40], [30]], (2, 16))
    near_x, near_y = beside(view, volume, x, y)
    assert np.hypot(near_x - x, near_y - y).max() > 0.0
    size = EIGHT * np.array(shape)
    for place, moved in zip(np.stack([x, y], axis=1), np.stack([near_x, near_y], axis=1), strict=True):
        start, along = (part / size for part in ray(view, volume, *place))
        other, toward = (part / size for part in ray(view, volume, *moved))
        # The middle of the ray's way through the ball around the field, in units of eight roundings.
        middle = (np.array(shape) / 2 - 0.5) / size
        ahead = np.dot(middle - start, along) / np.dot(along, along)
        points = start + ahead * np.linspace(0.8, 1.6, 81)[:, None] * along
        targets = points[:, None] + SIGNS
        left = targets - other
        left -= (left @ toward / np.dot(toward, toward))[..., None] * toward
        assert np.linalg.norm(left, axis=-1).min() < 0.3
        direct = points - other
        direct -= (direct @ toward / np.dot(toward, toward))[:, None] * toward
        assert np.linalg.norm(direct, axis=-1).max() < 4.0
