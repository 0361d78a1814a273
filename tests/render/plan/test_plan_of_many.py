# SPDX-License-Identifier: GPL-3.0-or-later
"""The work of a plan grows with the lamps and objects of a scene, not with the number of their pairs."""

from __future__ import annotations

import cProfile
import pstats
from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.plan import bounds
from spectral_core.render.plan.effects import plan_from_data
from spectral_core.render.plan.light.reflections import direct_radiance
from spectral_core.scene import (
    AreaLight,
    Camera,
    Diffuse,
    Emission,
    Film,
    Instance,
    Material,
    PointLight,
    ScatteringMedium,
    Scene,
    SunLight,
    gray,
)
from spectral_core.scene.geometry import placed_boxes, unit_box
from tests.render.scenes import matrix

CALLS = 400
"""Calls of functions for each lamp and object; those for each pair would be some thousands."""


def crowd(count: int, radius: float, fogs: int = 0) -> Scene:
    """Boxes of paper and of thin fog, some of them emissive, and as many lamps around them."""
    rng = np.random.default_rng(count)
    papers = tuple(Material(f"paper {k}", Diffuse(gray(0.2 + 0.01 * (k % 50)))) for k in range(20))
    mist = tuple(Material(f"fog {k}", None, ScatteringMedium(1e-5, gray(0.9))) for k in range(fogs))
    glow = tuple(Material(f"glow {k}", Emission(gray(1.0), 2.0)) for k in range(5))
    places = [matrix(tuple(rng.uniform(-20, 20, 3)), rng.uniform(0.1, 1)) for _ in range(count + fogs)]
    named = [(*papers, *glow)[k % 25].name for k in range(count)] + [each.name for each in mist]
    return Scene(
        camera=Camera(world_from_camera=matrix((0, 0, 70))),
        film=Film(320, 240),
        meshes=(replace(unit_box(), name="box"),),
        materials=(*papers, *glow, *mist),
        instances=tuple(
            Instance(f"object {k}", "box", place, (name,))
            for k, (place, name) in enumerate(zip(places, named))  # noqa: B905
        ),
        lights=tuple(
            PointLight(
                name=f"lamp {k}", world_from_light=matrix(tuple(rng.uniform(-20, 20, 3))), power_w=10, radius=radius
            )
            for k in range(count)
        ),
    )


@pytest.mark.parametrize(("radius", "fogs"), [(0.05, 0), (0.0, 0), (0.0, 100)])
@pytest.mark.parametrize("lights_vary", [False, True])
def test_the_work_of_a_plan_is_not_that_of_pairs(radius, fogs, lights_vary):
    scene = crowd(400, radius, fogs)
    profile = cProfile.Profile()
    profile.runcall(plan_from_data, scene, 0.0 if lights_vary else 0.25, lights_vary=lights_vary)
    assert pstats.Stats(profile).total_calls < CALLS * (len(scene.lights) + len(scene.instances))


def box_distance(point: np.ndarray, corners: np.ndarray) -> float:
    """Distance from a point to a box by its nearest point."""
    nearest = np.array(
        [min(max(x, low), high) for x, low, high in zip(point, corners.min(0), corners.max(0), strict=True)]
    )
    return float(np.sqrt(((point - nearest) ** 2).sum()))


def test_the_penumbra_of_many_lamps_is_the_widest_of_each():
    scene = crowd(30, 0.02)
    boxes, points = placed_boxes(scene.meshes, scene.instances), bounds.seen_points(scene)
    widest = 0.0
    for light in scene.lights:
        center = light.world_from_light[:3, 3]
        nearest = min(box_distance(center, box) for box in boxes)
        reach = max(np.linalg.norm(corner - center) for box in boxes for corner in box)
        widest = max(widest, 2 * light.radius * reach / nearest if nearest > 2 * light.radius else np.inf)
    depth = min(70 - point[2] for point in points)
    pixels = 320 / (2 * np.tan(scene.camera.field_of_view_rad / 2)) / depth
    assert bounds.blur_of_lamps(scene, scene.lights, points, boxes) == pytest.approx(widest * pixels, rel=1e-9)


def test_lamps_that_are_too_many_for_distances_to_surfaces_light_no_more_than_at_the_box_of_objects():
    lamps = [PointLight(name=f"lamp {k}", world_from_light=matrix((0, 0, 3)), power_w=4 * np.pi**2) for k in range(70)]
    lamps += [SunLight(name="sun", world_from_light=np.eye(4), irradiance=2.0)]
    lamps += [AreaLight(name="off", world_from_light=matrix((0, 0, 1)), power_w=0.0)]
    scene = replace(crowd(1, 0.0), lights=tuple(lamps))
    scene = replace(scene, instances=(replace(scene.instances[0], world_from_object=np.eye(4)),))  # its top is at 1
    materials = [scene.materials[0]]
    # 4π² W have an intensity of π W/sr: an irradiance of π/4 at a distance of 2
    assert direct_radiance(scene, materials, 1.0) == pytest.approx(70 / 4 + 2 / np.pi, rel=1e-6)
