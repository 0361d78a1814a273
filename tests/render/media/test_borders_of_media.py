# SPDX-License-Identifier: GPL-3.0-or-later
"""Borders of media that share a plane with other faces: a ray leaves each medium, and meets each surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.render.cases.meshes import at
from benchmarks.render.cases.plan_scenes import Stage
from spectral_core.render.plan.borders import APART, OFFSET, with_borders_apart
from spectral_core.scene import ScatteringMedium, Scene, gray
from spectral_core.scene.geometry import Mesh, placed_boxes

FOG = ScatteringMedium(0.25, gray(0.9))


def scene_of(boxes: dict[str, tuple[np.ndarray, ScatteringMedium]]) -> Scene:
    """A floor in z = 0 and boxes of media."""
    stage = Stage()
    for name, (place, medium) in boxes.items():
        stage.add(name, "box", place, None)
        stage.media[name] = medium
    made = stage.scene((24, 18), 1.0)
    return replace(made, instances=tuple(item for item in made.instances if "thin air" not in item.materials))


def fog_on(height: float) -> tuple[np.ndarray, ScatteringMedium]:
    """A box of fog whose bottom is at a height."""
    return at(0, 0, 1.0 + height, (2.5, 2.5, 1.0)), FOG


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("case", ["on the floor", "in thin air on the floor", "twice", "turned"])
def test_media_in_one_plane_look_as_a_small_way_apart(case: str, transport: str) -> None:
    pytest.importorskip("mitsuba")
    from spectral_core.render import render_scene

    thin = ScatteringMedium(1e-9)
    turned = at(turn=("z", 33))
    boxes, apart = {
        "on the floor": ({"fog": fog_on(0.0)}, {"fog": fog_on(0.01)}),
        "in thin air on the floor": (
            {"fog": fog_on(0.0), "air": (at(0, 0, 1.5, (4, 4, 1.5)), thin)}, {"fog": fog_on(0.01)}),
        "twice": ({"fog": fog_on(0.0), "again": fog_on(0.0)},
                  {"fog": (fog_on(0.01)[0], replace(FOG, density=0.5))}),
        "turned": (
            {name: (turned @ place, medium) for name, (place, medium) in {
                "fog": fog_on(0.1), "air": (at(0, 0, 1.6, (4, 4, 1.5)), thin)}.items()},
            {"fog": (turned @ fog_on(0.11)[0], FOG)}),
    }[case]  # fmt: skip
    means = []
    for each in (boxes, apart):
        scene = scene_of(each)
        film, settings = replace(scene.film, samples=128), replace(scene.settings, transport=transport)
        means.append(render_scene(replace(scene, film=film, settings=settings)).pixels[..., :3].mean())
    assert means[0] == pytest.approx(means[1], rel=0.012)


def test_borders_are_drawn_in_by_different_ways_where_they_share_a_plane_and_stay_elsewhere() -> None:
    place, _ = fog_on(0.0)
    scene = scene_of({"one": (place, FOG), "two": (place, FOG), "three": (place, FOG), "apart": fog_on(6.0)})
    moved = with_borders_apart(scene)
    boxes = dict(zip((item.name for item in moved.instances), placed_boxes(moved.meshes, moved.instances), strict=True))
    bottoms = [float(boxes[name][:, 2].min()) for name in ("one", "two", "three")]
    assert 1e-4 < bottoms[0] < bottoms[1] < bottoms[2] < 0.02
    assert min(np.diff(bottoms)) > 2 * OFFSET * (1 + 2.5)
    was = {item.name: item for item in scene.instances}
    for item in moved.instances:
        assert (item is was[item.name]) == (item.name not in ("one", "two", "three"))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8, 0.95, 1.2])
def test_a_slightly_larger_border_is_not_drawn_in_onto_another(share: float) -> None:
    """It was moved inward by about the gap: rays passed one border of the two, and stayed in its medium."""
    place, _ = fog_on(6.0)
    gap = share * APART * OFFSET * (1 + 8.0)
    larger = place @ np.diag([1 + gap / 2.5, 1 + gap / 2.5, 1 + gap, 1.0])
    for boxes in ({"one": (place, FOG), "two": (larger, FOG)}, {"two": (larger, FOG), "one": (place, FOG)}):
        moved = with_borders_apart(scene_of(boxes))
        ends = {
            item.name: corners for item, corners in zip(
                moved.instances, placed_boxes(moved.meshes, moved.instances), strict=True)
        }  # fmt: skip
        apart = np.abs(ends["one"] - ends["two"])
        assert apart.min() > 1.4 * OFFSET * (1 + np.abs(ends["one"]).max())
        assert apart.max() < 0.01


def test_a_gap_of_the_size_of_an_offset_changes_no_picture() -> None:
    pytest.importorskip("mitsuba")
    from spectral_core.render import render_scene

    place, _ = fog_on(0.5)
    means = []
    for gap in (0.95 * APART * OFFSET * (1 + 2.5), 0.01):
        larger = place @ np.diag([1 + gap / 2.5, 1 + gap / 2.5, 1 + gap, 1.0])
        scene = scene_of({"fog": (place, FOG), "again": (larger, FOG)})
        made = replace(scene, film=replace(scene.film, samples=64), settings=replace(scene.settings, transport="rgb"))
        means.append(render_scene(made).pixels[..., :3].mean())
    assert means[0] == pytest.approx(means[1], rel=0.02)


def test_a_scene_without_media_stays_itself() -> None:
    scene = scene_of({})
    assert with_borders_apart(scene) is scene


def test_a_border_without_faces_stays() -> None:
    scene = scene_of({"fog": fog_on(0.5), "nothing": fog_on(0.0)})
    empty = Mesh("empty", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))
    gone = tuple(replace(item, mesh="empty") if item.name == "nothing" else item for item in scene.instances)
    scene = replace(scene, meshes=(*scene.meshes, empty), instances=gone)
    assert with_borders_apart(scene) is scene


def test_a_flat_border_is_not_turned_inside_out() -> None:
    scene = scene_of({"haze": (at(0, 0, 1e-4, (2, 2, 1e-4)), FOG)})
    moved = with_borders_apart(scene)
    item = next(item for item in moved.instances if item.name == "haze")
    assert np.all(np.linalg.det(item.world_from_object[:3, :3]) > 0)
    assert item.world_from_object[2, 2] == pytest.approx(1e-4)
