# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras and lens openings: known directions, and the area outside a fisheye's circle."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.errors import SpectralError
from spectral_core.render import render_scene
from spectral_core.render.lens.aperture import in_polygon
from spectral_core.render.lens.camera_rays import camera_frame, rays
from spectral_core.render.lens.panorama import NumPyMath, direction_of
from spectral_core.scene import Aperture, Camera, Film, Panorama, Scene, World, gray

pytest.importorskip("mitsuba")
SENSOR = (36.0, 24.0)
KINDS = {
    "equirectangular": Panorama("equirectangular", (-np.pi, np.pi, -np.pi / 2, np.pi / 2)),
    "fisheye_equidistant": Panorama("fisheye_equidistant", (np.pi,)),
    "fisheye_equisolid": Panorama("fisheye_equisolid", (10.5, np.pi, *SENSOR)),
    "fisheye_polynomial": Panorama("fisheye_polynomial", (0.0, -0.03, 0.0, 0.0, 0.0, 3.0, *SENSOR)),
    "cube_face": Panorama("cube_face"),
    "cylinder": Panorama("cylinder", (-np.pi, np.pi, -1.0, 1.0)),
}


def look(panorama, x, y):
    direction, is_seen = direction_of(panorama, (np.float64(x), np.float64(y)), NumPyMath, float)
    return np.array(direction), bool(is_seen)


@pytest.mark.parametrize("kind", KINDS)
def test_the_center_looks_forward_and_the_sides_to_the_sides(kind):
    ahead, is_seen = look(KINDS[kind], 0.5, 0.5)
    assert is_seen and np.allclose(ahead, (0, 0, -1), atol=1e-12)
    right, above = look(KINDS[kind], 0.6, 0.5)[0], look(KINDS[kind], 0.5, 0.6)[0]
    assert right[0] > 0.05 and abs(right[1]) < 1e-12 and above[1] > 0.05 and abs(above[0]) < 1e-12
    assert np.isclose(np.linalg.norm(look(KINDS[kind], 0.31, 0.77)[0]), 1.0)


def test_angles_in_closed_form():
    assert np.allclose(look(KINDS["equirectangular"], 0.75, 0.5)[0], (1, 0, 0))
    assert np.allclose(look(KINDS["fisheye_equidistant"], 1.0, 0.5)[0], (1, 0, 0))
    assert np.allclose(look(KINDS["cube_face"], 1.0, 0.5)[0], np.array([1, 0, -1]) / np.sqrt(2))
    angle = 2 * np.arcsin(7.2 / 21.0)
    assert np.allclose(look(KINDS["fisheye_equisolid"], 0.7, 0.5)[0], (np.sin(angle), 0, -np.cos(angle)))
    assert np.allclose(look(KINDS["fisheye_polynomial"], 0.7, 0.5)[0], (np.sin(0.216), 0, -np.cos(0.216)))
    assert np.allclose(look(Panorama("mirror_ball"), 0.5, 0.5)[0], (0, 0, -1))  # the ball's center faces the viewer
    assert not look(KINDS["fisheye_equidistant"], 0.95, 0.95)[1]
    assert not look(Panorama("mirror_ball"), 0.95, 0.95)[1]


def test_the_picture_is_empty_outside_the_circle():
    camera = Camera(world_from_camera=np.eye(4), kind="panoramic", panorama=KINDS["fisheye_equidistant"])
    scene = Scene(camera=camera, film=Film(16, 16, samples=4, filter_width=0.01), world=World(gray(0.5)))
    pixels = render_scene(scene).pixels
    assert np.allclose(pixels[8, 8], (0.5, 0.5, 0.5, 1.0), atol=1e-3) and not pixels[0, 0].any()


def test_depth_of_field_of_a_panorama_keeps_the_focus_sharp():
    camera = Camera(
        world_from_camera=np.eye(4), kind="panoramic", panorama=KINDS["equirectangular"], aperture_radius=0.2,
        focus_distance=3.0, near=1e-6,
    )  # fmt: skip
    frame = camera_frame(camera, Film(8, 4))
    place, direction, _ = rays(frame, (np.float64(0.6), np.float64(0.4)), (0.0, 0.0), lambda *parts: np.array(parts))
    sharp = place + 3.0 * direction
    for lens in ((1.0, 0.0), (-0.3, 0.8)):
        start, toward, _ = rays(frame, (np.float64(0.6), np.float64(0.4)), lens, lambda *parts: np.array(parts))
        miss = (sharp - start) - toward * (toward @ (sharp - start))
        assert np.isclose(np.linalg.norm(start), 0.2 * np.hypot(*lens), atol=1e-5) and np.linalg.norm(miss) < 1e-5


@pytest.mark.parametrize("blades", [3, 5, 8])
def test_points_fill_the_polygon_evenly(blades):
    draws = np.random.default_rng(1).random((2, 200_000))
    x, y = in_polygon(Aperture(blades, 0.4), draws, NumPyMath, float)
    half = np.pi / blades
    for k in range(blades):  # inside every edge
        across = 0.4 + 2 * half * k
        assert (x * np.cos(across) + y * np.sin(across)).max() <= np.cos(half) + 1e-9
    # second moment of a regular polygon about its center
    assert np.isclose((x**2 + y**2).mean(), (2 + np.cos(2 * half)) / 6, rtol=0.01)


def test_invalid_panoramas_are_refused():
    with pytest.raises(SpectralError, match="fish"):
        Panorama("fish")
    with pytest.raises(SpectralError, match="expected 4"):
        Panorama("cylinder", (1.0,))
    with pytest.raises(SpectralError, match="panoramic"):
        Camera(world_from_camera=np.eye(4), kind="panoramic")
