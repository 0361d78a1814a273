# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays of shading programs: Ambient Occlusion and Bevel compared with closed forms."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from math import acos, pi, sqrt

import numpy as np
import pytest

from spectral_core.scene import Computed, Diffuse, Emission, Film, Instance, Material, Mesh, PointLight
from spectral_core.scene.shading import Builder
from tests.render.scenes import lit_plane, looking_down, matrix, plane

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")


def shown(operation, inputs, settings, meshes, turns, height=2.0):
    """Color (3,) at the center of the first object, whose program has one operation."""
    from spectral_core.render.still import render_scene

    build = Builder()
    registers = [build.add("vector_input", (), "normal", 0) if each is None else build.number(each) for each in inputs]
    surface = Emission(Computed(build.program(build.as_width(build.add(operation, tuple(registers), *settings), 3))))
    base = lit_plane(surface=surface, film=Film(4, 4, samples=64), camera=looking_down(height, 0.002))
    materials = (base.materials[0], Material("plain", replace(surface, strength=0.0)))
    placed = tuple(
        Instance(f"object {k}", mesh.name, turn, ("paper" if k == 0 else "plain",))
        for k, (mesh, turn) in enumerate(zip(meshes, turns, strict=True))
    )
    scene = replace(base, meshes=tuple({m.name: m for m in meshes}.values()), materials=materials, instances=placed)
    return render_scene(scene).pixels[..., :3].mean((0, 1))


def wall(x):
    """Place a vertical plane at x."""
    return np.array([[0.0, 0, 1, x], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])


@pytest.mark.parametrize("distance", [1.5, 2.0, 1e4])
def test_a_wall_occludes_its_projection_onto_the_disk(distance):
    near = min(1.0 / distance, 1.0)
    expected = 1 - (acos(near) - near * sqrt(1 - near * near)) / pi
    wide = replace(plane(), positions=plane().positions * 40, name="wide")
    place = (plane(), wide), (np.eye(4), wall(1.0))
    found = shown("occlusion", (None, distance), (16, False, False), *place)
    np.testing.assert_allclose(found, expected, atol=0.01)
    if distance > 1.5:  # the distance is data of one kernel
        return
    alone = shown("occlusion", (None, distance), (16, False, True), *place)
    np.testing.assert_allclose(alone, 1.0)  # the wall is another object
    below = shown("occlusion", (None, distance), (16, True, False), *place)
    np.testing.assert_allclose(below, expected, atol=0.01)


def roof():
    """One mesh of a horizontal part (x < 0) and a vertical part below x = 0."""
    points = [(-5, -5, 0), (0, -5, 0), (0, 5, 0), (-5, 5, 0), (0, -5, -5), (0, 5, -5)]
    return Mesh("roof", np.array(points, np.float32), np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]], np.uint32))


def test_an_edge_changes_normals_within_the_radius_only():
    at_edge = shown("bevel", (None, 0.5), (400,), (roof(),), (matrix((0.005, 0, 0)),))
    np.testing.assert_allclose(at_edge, [sqrt(0.5), 0, sqrt(0.5)], atol=0.03)
    nearby = shown("bevel", (None, 0.5), (400,), (roof(),), (matrix((0.2, 0, 0)),))
    assert 0.02 < nearby[0] < at_edge[0] - 0.1
    np.testing.assert_allclose(shown("bevel", (None, 0.5), (400,), (roof(),), (matrix((2, 0, 0)),)), [0, 0, 1])
    np.testing.assert_allclose(shown("bevel", (None, 0.0), (400,), (roof(),), (matrix((0.005, 0, 0)),)), [0, 0, 1])


def test_editing_a_distance_compiles_nothing():
    build = Builder()
    normal = build.add("vector_input", (), "normal", 0)
    results = (build.add("occlusion", (normal, build.number(d)), 16, False, False) for d in (1.0, 2.0))
    programs = [build.program(result) for result in results]
    assert programs[0].shape == programs[1].shape


@pytest.mark.parametrize(("operation", "rest"), [("occlusion", (4, False, False)), ("bevel", (4,))])
def test_programs_find_the_scene_of_a_tracer_whose_job_has_ended(operation, rest):
    """``cost_curve`` keeps the tracer of a job, not the job; the scene ends with the tracer."""
    from spectral_core.render import cost_curve
    from spectral_core.render.cost.fixed import plan_of_render
    from spectral_core.render.job import RenderJob

    build = Builder()
    result = build.add(operation, (build.add("vector_input", (), "normal", 0), build.number(0.5)), *rest)
    surface = Diffuse(Computed(build.program(build.as_width(result, 3))))
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 1.0)), power_w=10)
    scene = lit_plane(lamp, surface=surface, film=Film(8, 8, samples=2))
    job = RenderJob(scene, plan_of_render(scene))
    loaded, tracer = weakref.ref(job.loaded.scene), job.chosen_pixels()
    del job
    gc.collect()
    numbers = np.arange(64)
    assert tracer.trace_halves(numbers, 0 * numbers, 0 * numbers + 1).colors[:, 2].min() > 0
    assert cost_curve(scene).now.delta_e > 0
    del tracer
    gc.collect()
    assert loaded() is None
