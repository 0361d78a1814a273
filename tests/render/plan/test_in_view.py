# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances of what the camera sees of boxes, against points that are drawn in them and projected one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spectral_core.render import plan_from_data
from spectral_core.render.lens.in_view import points_in_view
from spectral_core.render.plan import bounds
from spectral_core.scene import Aperture, Camera, Film, Panorama
from spectral_core.scene.geometry import corners_of
from tests.render.scenes import lit_plane, matrix

FILM = Film(48, 32)


def turned(rng: np.random.Generator) -> Any:
    """A random rotation."""
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return axes * np.sign(np.linalg.det(axes))


def drawn(box: Any, count: int = 40) -> Any:
    """Points on an even grid inside a parallelepiped, by its corners."""
    steps = np.linspace(0, 1, count)
    shares = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    return box[0] + shares @ np.stack([box[2] - box[0], box[4] - box[0], box[1] - box[0]])


def seen_depths(camera: Camera, points: Any) -> Any:
    """Depths of the points that a perspective or orthographic camera without shift sees."""
    x, y, z = ((points - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]).T
    half = np.tan(camera.field_of_view_rad / 2) if camera.kind == "perspective" else camera.orthographic_scale / 2
    away = -z if camera.kind == "perspective" else np.ones_like(z)
    shown = (np.abs(x) <= half * away) & (np.abs(y) <= half * away * FILM.height / FILM.width) & (-z > camera.near)
    return -z[shown]


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_what_is_seen_of_a_box_lies_between_its_points(kind: Any) -> None:
    rng, far = np.random.default_rng(7), 0
    for number in range(150):
        view = np.eye(4)
        view[:3, :3], view[:3, 3] = turned(rng), rng.normal(size=3)
        camera = Camera(world_from_camera=view, kind=kind, near=0.05, field_of_view_rad=1.2)
        size = np.array([6.0, 4.0, 0.0 if number % 3 == 0 else 1.5])
        box = corners_of(rng.uniform(-1, 1, (9, 3)) * size) @ turned(rng).T + rng.normal(size=3)
        depths = seen_depths(camera, drawn(box))
        if not len(depths):
            continue
        found = bounds.depths(replace(lit_plane(), camera=camera), points_in_view(camera, FILM, [box]))
        assert found.min() <= depths.min() * (1 + 1e-9) and found.max() >= depths.max() * (1 - 1e-9)
        far += found.min() > 2 * camera.near
    assert far > 5  # it is no answer to call everything near


def standing(height: float, **camera: Any) -> Camera:
    """A camera above the floor z = 0 that looks along +y."""
    view = np.eye(4)
    view[:3, :3] = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    view[2, 3] = height
    return Camera(world_from_camera=view, field_of_view_rad=np.radians(40), **camera)


def test_a_floor_on_which_the_camera_stands_is_near() -> None:
    floor = corners_of(np.array([[-50.0, -50, 0], [50, 50, 0]]))
    scene = replace(lit_plane(), camera=standing(1.6), film=FILM)
    depths = bounds.depths(scene, points_in_view(scene.camera, FILM, [floor]))
    nearest = 1.6 / (np.tan(np.radians(20)) * FILM.height / FILM.width)
    assert nearest / 1.1 - 1e-6 <= depths.min() <= nearest
    assert depths.max() == pytest.approx(50)


def test_a_lens_that_focuses_on_the_far_end_of_the_floor_blurs_what_is_near() -> None:
    """Both corners in front of the camera were in focus: "nothing blurs by more than 0 pixels"."""
    lens = standing(1.6, aperture_radius=0.02, focus_distance=50.0)
    decision = plan_from_data(lit_plane(camera=lens, film=Film(480, 320)))["depth_of_field"]
    assert decision.value == "on" and decision.error > 50


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_a_wide_lens_and_flat_pixels_count(kind: Any) -> None:
    """A ratio of 0.1 opens the lens ten times as wide; of flat pixels there are ten times as many upward."""
    scene = lit_plane()
    lens = replace(scene.camera, kind=kind, aperture_radius=1e-4, focus_distance=1.0)

    def blur(ratio: float = 1.0, aspect: float = 1.0) -> float:
        shaped = replace(
            scene, camera=replace(lens, aperture=Aperture(ratio=ratio)), film=replace(scene.film, pixel_aspect=aspect)
        )
        return bounds.blur_of_lens(shaped, bounds.seen_points(shaped))

    assert blur(ratio=0.1) == pytest.approx(10 * blur()) and blur(ratio=10.0) == pytest.approx(blur())
    plain = blur()
    assert blur(aspect=0.1) == pytest.approx(10 * plain) and blur(aspect=1.0) == pytest.approx(plain)


def test_a_panorama_inside_a_room_is_near_its_floor() -> None:
    room = corners_of(np.array([[-5.0, -5, 0], [5, 5, 0]]))
    camera = Camera(
        world_from_camera=matrix((0, 0, 1.5)), kind="panoramic", panorama=Panorama("fisheye_equidistant", (3.0,))
    )
    scene = replace(lit_plane(), camera=camera)
    assert bounds.depths(scene, points_in_view(camera, FILM, [room])).min() == pytest.approx(1.5)
