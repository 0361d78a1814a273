# SPDX-License-Identifier: GPL-3.0-or-later
"""Transparent bodies and bodies that are hidden from rays, on a floor: it is seen through their coinciding bottoms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.render.cases.meshes import at
from benchmarks.render.cases.plan_scenes import Stage
from spectral_core.render.plan.borders import MOST_STEPS, OFFSET, with_borders_apart
from spectral_core.scene import Diffuse, Rays, Scene, Transparent, World, gray
from spectral_core.scene.geometry import placed_boxes

CLEAR, GRAY = Transparent(gray(0.8)), Diffuse(gray(0.3))


def scene_of(*heights: float, surface=CLEAR, hidden: Rays = Rays.NONE) -> Scene:
    """A floor in z = 0 and boxes, each with its bottom at a height."""
    stage = Stage(world=World(gray(1.0)))  # a hole in the floor would shine
    for number, height in enumerate(heights):
        stage.add(f"box {number}", "box", at(0, 0, 1.0 + height, (2.0, 2.0, 1.0)), surface)
    made = stage.scene((24, 18), 1.0)
    kept = tuple(item for item in made.instances if "thin air" not in item.materials)
    return replace(made, instances=tuple(
        replace(item, hidden_from=hidden) if item.name.startswith("box") else item for item in kept
    ))  # fmt: skip


def bottoms(scene: Scene) -> list[float]:
    moved = with_borders_apart(scene)
    boxes = zip(moved.instances, placed_boxes(moved.meshes, moved.instances), strict=True)
    return [float(box[:, 2].min()) for item, box in boxes if item.name.startswith("box")]


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize(("surface", "hidden"), [(CLEAR, Rays.NONE), (GRAY, Rays.CAMERA | Rays.GLOSSY)])
def test_the_floor_is_seen_through_a_body_that_stands_on_it(surface, hidden, transport):
    """As through a body that floats slightly above the floor."""
    pytest.importorskip("mitsuba")
    from spectral_core.render import render_scene

    means = []
    for height in (0.0, 0.004):
        scene = scene_of(height, surface=surface, hidden=hidden)
        film, settings = replace(scene.film, samples=128), replace(scene.settings, transport=transport)
        means.append(render_scene(replace(scene, film=film, settings=settings)).pixels[..., :3].mean())
    assert means[0] == pytest.approx(means[1], rel=0.015)


def test_bodies_in_one_plane_are_drawn_in_by_different_ways_up_to_a_limit():
    found = bottoms(scene_of(0.0, 0.0, 0.0, 0.0, 0.0, 6.0))
    assert 1e-4 < found[0] < found[1] < found[2] == found[3] == found[4]
    assert found[4] < 3.0 * OFFSET * (1 + 2.5) * (MOST_STEPS + 1)
    assert found[5] == pytest.approx(6.0, abs=1e-6)


@pytest.mark.parametrize("hidden", [Rays.NONE, Rays.SHADOW])
def test_opaque_bodies_stay_where_they_stand(hidden):
    scene = scene_of(0.0, surface=GRAY, hidden=hidden)
    assert with_borders_apart(scene) is scene


def test_thousands_of_transparent_bodies_take_little_time():
    from time import thread_time

    scene = scene_of(0.0)
    box = next(item for item in scene.instances if item.name == "box 0")
    places = np.random.default_rng(8).uniform(-3, 3, (3000, 2))
    many = tuple(
        replace(box, name=f"leaf {k}", world_from_object=at(x, y, 0.2, (0.3, 0.3, 0.2)))
        for k, (x, y) in enumerate(places)
    )
    start = thread_time()
    with_borders_apart(replace(scene, instances=scene.instances + many))
    assert thread_time() - start < 5.0
