# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras and presets against numbers worked out by hand."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from spectral_core.errors import InvalidInputError, UnknownNameError
from spectral_core.volume.field import ScalarVolume
from spectral_core.volume.image import Stepping
from spectral_core.volume.pilot.places import is_in_picture, rectangle
from spectral_core.volume.presets import preset
from spectral_core.volume.view import View


def box(size: tuple[int, int, int] = (4, 6, 8), spacing: tuple[float, ...] = (1, 1, 1)) -> ScalarVolume:
    return ScalarVolume.from_spacing("v", np.zeros(size, np.uint8), spacing, (1.0, 2.0, 3.0))


def test_rays_of_a_perspective_camera_by_trigonometry() -> None:
    """Looking along -x from (10, 0, 0): +x of the picture is +y of the world, rows run downwards."""
    view = View.looking((10, 0, 0), (0, 0, 0), width=4, height=2, fov_deg=90.0)
    start, toward = view.rays_world()
    for row in range(2):
        for column in range(4):
            right, up = (column + 0.5) / 4 * 2 - 1, (1 - (row + 0.5)) * 0.5
            expected = np.array([-1.0, right, up])
            np.testing.assert_allclose(start[row, column], [10, 0, 0], atol=1e-12)
            np.testing.assert_allclose(toward[row, column], expected / np.linalg.norm(expected), atol=1e-12)


def test_rays_of_an_orthographic_camera_are_parallel() -> None:
    view = View.looking((10, 0, 0), (0, 0, 0), width=2, height=4, fov_deg=None, ortho_width=3.0)
    start, toward = view.rays_world()
    np.testing.assert_allclose(toward, np.broadcast_to([-1.0, 0, 0], toward.shape), atol=1e-12)
    for row in range(4):
        for column in range(2):
            across, up = (column + 0.5) / 2 * 3 - 1.5, 3.0 - (row + 0.5) * 1.5
            np.testing.assert_allclose(start[row, column], [10, across, up], atol=1e-12)


@pytest.mark.parametrize("fov", [40.0, None])
@pytest.mark.parametrize("matrix", ["plain", "sheared"])
def test_rays_in_index_space_are_those_of_the_world(fov: float | None, matrix: str, rng: np.random.Generator) -> None:
    shape = np.eye(4)
    if matrix == "sheared":
        shape[:3] = [[2, 0.5, 0, 4], [0, 3, 0.25, -1], [0.5, 0, 1, 7]]
    volume = ScalarVolume("v", np.zeros((4, 5, 7), np.uint8), shape)
    view = View.around(volume, 20, 35, width=5, height=3, fov_deg=fov)
    start, toward = view.rays_world()
    found, back = view.index_rays(volume)
    inverse = np.linalg.inv(shape)
    for row in range(3):
        for column in range(5):
            at = np.array([1, column + 0.5, row + 0.5])
            points, directions, world = (at @ found[k] for k in range(3))
            np.testing.assert_allclose(world / np.linalg.norm(world), toward[row, column], atol=1e-12)
            np.testing.assert_allclose(directions, inverse[:3, :3] @ world, atol=1e-12)
            # the point lies on the ray, at the depth of the field's center
            away = shape[:3, :3] @ points + shape[:3, 3] - start[row, column]
            np.testing.assert_allclose(np.cross(away, toward[row, column]), 0, atol=1e-9)
            depth = view.world_from_camera[:3, 2] @ away
            middle = shape[:3, :3] @ ((np.array([4, 5, 7]) - 1) / 2) + shape[:3, 3]
            assert depth == pytest.approx(view.world_from_camera[:3, 2] @ (middle - view.world_from_camera[:3, 3]))
            if fov is None:
                assert back == np.inf
            else:
                np.testing.assert_allclose(
                    points - back * directions, (inverse @ [*start[row, column], 1])[:3], atol=1e-9
                )


def test_a_camera_around_a_field_sees_its_bounding_sphere() -> None:
    """A sphere of radius r fills the angle of view from r / sin(fov / 2); azimuth 0 is +x, elevation 90 is above."""
    volume = box()
    middle, radius = np.array([2.5, 4.5, 6.5]), np.sqrt(4 + 9 + 16)
    view = View.around(volume, 0.0, 0.0, fov_deg=60.0, zoom=2.0)
    np.testing.assert_allclose(view.world_from_camera[:3, 3], middle + np.array([radius, 0, 0]), rtol=1e-12)
    np.testing.assert_allclose(view.world_from_camera[:3, :3], [[0, 0, -1], [-1, 0, 0], [0, 1, 0]], atol=1e-12)
    view = View.around(volume, 90.0, 30.0, fov_deg=None)
    assert view.ortho_width == pytest.approx(2 * radius)
    np.testing.assert_allclose(
        view.world_from_camera[:3, 3], middle + 4 * radius * np.array([0, np.sqrt(0.75), 0.5]), rtol=1e-12
    )
    assert View.around(volume, fov_deg=None, ortho_width=7.0).ortho_width == 7.0
    # from above, +y is up; at 84 degrees still +z
    above = View.around(volume, 0.0, 90.0).world_from_camera
    np.testing.assert_allclose(above[:3, 1], [0, 1, 0], atol=1e-9)
    assert View.around(volume, 0.0, 84.9).world_from_camera[2, 1] > 0.08
    below = View.around(volume, 0.0, -85.0).world_from_camera
    np.testing.assert_allclose(below[:3, 1], [0, 1, 0], atol=1e-9)
    for zoom in (1e-7, 1e7):
        with pytest.raises(InvalidInputError, match="zoom"):
            View.around(volume, zoom=zoom)
    View.around(volume, zoom=1e6)


def test_impossible_cameras_are_refused_and_the_outermost_accepted() -> None:
    for width, height in ((0, 1), (1, 0), (-3, 5)):
        with pytest.raises(InvalidInputError, match=f"(width|height) of a view is {min(width, height)} pixels"):
            View(np.eye(4), width, height)
    assert View(np.eye(4), 1, 1).width == 1
    assert (View(np.eye(4)).width, View(np.eye(4)).height, View(np.eye(4)).fov_deg) == (512, 512, 30.0)
    for fov in (1e-6, 179.999):
        assert View(np.eye(4), fov_deg=fov).fov_deg == fov
    for fov in (1e-7, 180.0):
        with pytest.raises(InvalidInputError, match="fov_deg"):
            View(np.eye(4), fov_deg=fov)
    with pytest.raises(InvalidInputError, match="ortho_width"):
        View(np.eye(4), fov_deg=None)
    View(np.eye(4), fov_deg=None, ortho_width=1e-30)
    for origin, target, up in (((0, 0, 0), (0, 0, 1), (0, 0, 1)), ((1, 2, 3), (1, 2, 3), (0, 0, 1)),
                               ((0, 0, 0), (0, 0, 1), (1e-10, 0, 1))):  # fmt: skip
        with pytest.raises(InvalidInputError, match="no horizontal direction"):
            View.looking(origin, target, up)
    slanted = View.looking((0, 0, 0), (0, 0, 1e6), (1e-8, 0, 1))
    np.testing.assert_allclose(slanted.world_from_camera[:3, 1], [1, 0, 0], atol=1e-9)
    resized = View.looking((9, 0, 0), (0, 0, 0)).resized(7, 3)
    assert (resized.width, resized.height, resized.fov_deg) == (7, 3, 30.0)
    assert resized.key != View.looking((9, 0, 0), (0, 0, 0)).key


def test_cameras_of_mitsuba_have_the_same_rays() -> None:
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    volume = box()
    for fov, shift in itertools.product((35.0, None), ((0.0, 0.0), (0.7, -0.3))):
        view = View.around(volume, 20.0, 10.0, fov_deg=fov, width=6, height=4, shift=shift)
        film = {"type": "hdrfilm", "width": 6, "height": 4, "rfilter": {"type": "box"}}
        sensor = mi.load_dict({**view.mitsuba_sensor(), "film": film, "near_clip": 1e-3, "far_clip": 1e4})
        start, toward = view.rays_world()
        for row, column in ((0, 0), (3, 5), (1, 2)):
            at = mi.Point2f((column + 0.5) / 6, (row + 0.5) / 4)
            ray, _ = sensor.sample_ray(0.0, 0.5, at, mi.Point2f(0.5))
            np.testing.assert_allclose(np.array(ray.d).ravel(), toward[row, column], atol=1e-5)
            away = np.array(ray.o).ravel() - start[row, column]
            np.testing.assert_allclose(np.cross(away, toward[row, column]), 0, atol=2e-4 * np.linalg.norm(away) + 1e-4)


V = [10.0 * k for k in range(11)]
"""Tenths of the range 0 to 100."""


def ramp() -> ScalarVolume:
    """Values 0 to 100 whose largest thousandth is not above 100; voxels of 2 × 1 × 4 have the edge 2."""
    data = np.repeat(np.linspace(0, 100, 101), 10)[:1000].reshape(10, 10, 10).copy()
    data.flat[-5:] = 100.0
    return ScalarVolume.from_spacing("v", data, (2, 1, 4))


@pytest.mark.parametrize(
    ("name", "expected"),
    [("wide", [([10, 30, 50], [0, 0.01, 0]), ([30, 60, 80], [0, 0.05, 0]), ([60, 100], [0, 0.2])]),
     ("narrow", [([29, 30, 31], [0, 0.5, 0]), ([59, 60, 61], [0, 1.5, 0])]),
     ("opaque", [([20, 40, 60], [0, 0.3, 0]), ([40, 60, 100], [0, 1.5, 1.5])])],
)  # fmt: skip
def test_presets_have_their_places_and_extinctions(name: str, expected: list[tuple[list[float], list[float]]]) -> None:
    found = preset(name, ramp()).materials
    assert len(found) == len(expected)
    for material, (values, extinctions) in zip(found, expected, strict=True):
        np.testing.assert_allclose(material.values, values, atol=1e-9)
        np.testing.assert_allclose(material.extinction, extinctions, atol=1e-12)
    thicker = preset(name, ramp(), 3.0).materials
    np.testing.assert_allclose(thicker[0].extinction, np.array(expected[0][1]) * 3, atol=1e-12)


def test_the_radiograph_glows_in_proportion_to_the_value() -> None:
    """Half the longest axis, ten voxels of edge 2, has the unit amount at the largest value."""
    (glow,) = preset("xray", ramp()).materials
    np.testing.assert_allclose(glow.values, [10, 100], atol=1e-9)
    np.testing.assert_allclose(glow.extinction, [0, 0])
    np.testing.assert_allclose(glow.emission, [0, 0.1], atol=1e-12)
    assert not glow.lit


def test_edges_fade_in_with_the_gradient() -> None:
    """The 98th percentile of a constant gradient of 1 per voxel; a flat field has none, and 1 stands for it."""
    slope = np.broadcast_to(np.arange(20.0)[:, None, None], (20, 6, 6)).copy()
    soft, hard = preset("edges", ScalarVolume("v", slope)).materials
    low, high = 0.0, 19.0
    tenth = (high - low) / 10
    np.testing.assert_allclose(soft.values, [0, tenth, 5 * tenth, 6 * tenth], atol=1e-9)
    np.testing.assert_allclose(soft.extinction, [0, 0.3, 0.3, 0])
    np.testing.assert_allclose(hard.values, [5 * tenth, 6 * tenth, 10 * tenth], atol=1e-9)
    np.testing.assert_allclose(hard.extinction, [0, 1, 1])
    for material in (soft, hard):
        np.testing.assert_allclose(material.gradient_values, [0.2, 0.8], rtol=1e-6)
        np.testing.assert_array_equal(material.gradient_weights, [0.0, 1.0])
    flat = preset("edges", ScalarVolume("v", np.full((4, 4, 4), 7.0))).materials[0]
    np.testing.assert_allclose(flat.gradient_values, [0.2, 0.8])
    np.testing.assert_allclose(flat.values, [0.0, 0.7, 3.5, 4.2])
    with pytest.raises(UnknownNameError, match="transfer function preset"):
        preset("wid", ramp())


MEASURED = np.linspace(0.0, 3.0, 300).tolist()


def bounds(values: list[float]) -> tuple[float, float]:
    """First and last tenth of the range that a preset of these values has."""
    data = np.resize(np.array(values, dtype=np.float64), (16, 16, 16))
    core = preset("wide", ScalarVolume("v", data)).materials
    tenth = (core[2].values[1] - core[0].values[0]) / 9
    return float(core[0].values[0] - tenth), float(core[2].values[1])


@pytest.mark.parametrize(
    ("values", "expected"),
    [([0, 1, 2, 3, 40], (0, 40)), ([*MEASURED, 40], (0, 3)), ([*MEASURED, 32], (0, 32)),
     ([-40, 0, 1, 2, 3], (-40, 3)), ([-40, *MEASURED], (0, 3)), ([-29, *MEASURED], (-29, 3)),
     ([-999, 0, 200, 400, 900], (0, 900)), ([-998, 0, 200, 400, 900], (-998, 900)),
     ([0, 1, 40], (0, 40)), ([-9999, 0, 1, 2, 3, 32767], (0, 3)), ([-9999, 0, 1, 2, 3, 99999], (0, 3)),
     ([0, 10000, 20000, 30000, 65535], (0, 30000)), ([0, 1e14, 2e14, 3e14, 6.5e14], (0, 6.5e14)),
     ([0, 1e14, 2e14, 4e14, 1e15], (0, 4e14)), ([-1e9, 0, 2e8, 4e8, 9e8], (0, 9e8)), ([5, 5, 5, 5], (0, 5))],
)  # fmt: skip
def test_gaps_that_make_an_end_a_fill_value(values: list[float], expected: tuple[float, float]) -> None:
    """Once the range of the others for numbers that often mark missing data, ten times it beside measured data."""
    low, high = bounds(values)
    size = max(abs(low), abs(high))
    assert low == pytest.approx(expected[0], abs=1e-9 * size) and high == pytest.approx(expected[1], rel=1e-9)


def test_up_is_plus_z_unless_stated() -> None:
    view = View.looking((0, -5, 0), (0, 0, 0))
    np.testing.assert_allclose(view.world_from_camera[:3, 1], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(View.looking((4, -5, 1), (0, 0, 0)).world_from_camera[2, 0], 0, atol=1e-12)


@pytest.mark.parametrize("size", [1e-12, 1e-3, 1e12])
def test_up_may_have_any_length(size: float) -> None:
    """A short one counted as parallel to the view."""
    view = View.looking((0, 0, 5), (0, 0, 0), (0, size, 0))
    np.testing.assert_allclose(view.world_from_camera[:3, 1], [0, 1, 0], atol=1e-12)
    for up in ((0, 0, size), (0, 0, 0)):
        with pytest.raises(InvalidInputError, match="choose another up"):
            View.looking((0, 0, 5), (0, 0, 0), up)


@pytest.mark.parametrize("scale", [-1.0, float("nan"), float("inf"), 1e7, "x"])
def test_scales_that_no_march_has_are_refused(scale: float) -> None:
    """They were taken as the shortest step, or the longest one, without a word."""
    with pytest.raises(InvalidInputError, match="the scale of the steps"):
        Stepping("uniform", "midpoint", scale)


@pytest.mark.parametrize("fov", [90.0, None])
def test_a_shift_moves_the_picture_to_the_right_and_up(fov):
    """The camera looks along -x, so that y is right of it; the picture is 2 wide at distance 1."""
    view = View.looking((10, 0, 0), (0, 0, 0), width=4, height=2, fov_deg=fov, ortho_width=2.0, shift=(0.5, -0.25))
    start, toward = view.rays_world()
    # the middle of the picture is 0.5 · 2 right of and 0.25 · 2 below the axis
    place = start.mean(axis=(0, 1)) if fov is None else (toward / -toward[..., :1]).mean(axis=(0, 1))
    np.testing.assert_allclose(place[1:], [1.0, -0.5], atol=1e-12)
    volume = box()
    rays, _ = view.index_rays(volume)
    along = rays[1][0] + 2.5 * rays[1][1] + 0.5 * rays[1][2]
    expected = volume.index_from_world[:3, :3] @ toward[0, 2]
    np.testing.assert_allclose(along / np.linalg.norm(along), expected / np.linalg.norm(expected), atol=1e-12)
    with pytest.raises(InvalidInputError, match="shift of a view"):
        View.looking((10, 0, 0), (0, 0, 0), shift=(1e13, 0))
    assert view.key != View.looking((10, 0, 0), (0, 0, 0), width=4, height=2, fov_deg=fov, ortho_width=2.0).key


@pytest.mark.parametrize("fov", [50.0, None])
def test_the_pixels_of_a_field_are_those_whose_rays_meet_it(fov):
    rng = np.random.default_rng(3)
    volume = box()
    corners = volume.corners_world
    low, high = corners.min(axis=0), corners.max(axis=0)
    seen = 0
    for _ in range(40):
        shift = tuple(rng.uniform(-1.5, 1.5, 2))
        view = View.around(volume, *rng.uniform(-80, 80, 2), fov_deg=fov, width=30, height=20, shift=shift)
        start, toward = view.rays_world()
        ways = np.stack([(low - start) / toward, (high - start) / toward])
        rows, columns = np.nonzero(ways.min(axis=0).max(axis=-1) < ways.max(axis=0).min(axis=-1))
        if not len(rows):
            continue
        seen += 1
        assert is_in_picture(view, corners)
        first, last = rectangle(view, corners)[2:]
        for ends, places, size in zip(zip(first, last, strict=True), (columns, rows), (30, 20), strict=True):
            assert ends[0] <= places.min() and places.max() < ends[1]
            # A corner of the field may be beside the picture, so that the rectangle is larger; else it is as tight.
            inside = first.min() > 0 and last[0] < 30 and last[1] < 20
            assert not inside or (places.min() - ends[0] <= 1 and ends[1] - places.max() <= 2), size
    assert 5 < seen < 35


def test_a_field_behind_the_camera_is_in_no_picture():
    volume, ahead = box(), np.array([1.0, 0.0, 0.0])
    middle = volume.corners_world.mean(axis=0)
    assert not is_in_picture(View.looking(middle + 20 * ahead, middle + 40 * ahead), volume.corners_world)
    assert is_in_picture(View.looking(middle + ahead, middle + 40 * ahead), volume.corners_world)
