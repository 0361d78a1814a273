# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of a picture is no constant of a kernel: adaptive sampling launches another number of pixels each round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import everything_on
from spectral_core.render.still import render_scene
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import (
    Film,
    Glass,
    Hair,
    Instance,
    Material,
    PointLight,
    ScatteringMedium,
    Subsurface,
    World,
    gray,
)
from spectral_core.scene.medium_grid import MediumGrid
from tests.render.scenes import lit_plane, matrix, sphere_mesh

pytest.importorskip("mitsuba")

BALLS = {
    "two media": (
        Material("one", None, ScatteringMedium(0.5, gray(0.8))),
        Material("other", None, ScatteringMedium(1.0, gray(0.9))),
    ),
    "a medium that varies": (
        Material(
            "one", None, ScatteringMedium(
                1.0, gray(0.8), grid=MediumGrid(matrix((-0.5, -0.5, 0), 0.5), np.linspace(0, 1, 27, dtype=np.float32)
                                                .reshape(3, 3, 3))
            ),
        ),
    ),
    "disks below a surface": (Material("one", Subsurface(gray(0.8), model="burley", scale=0.2)),),
    "walks below a surface": (Material("one", Subsurface(gray(0.8), scale=0.2)),),
    "fibers and glass": (Material("one", Hair(gray(0.5))), Material("other", Glass(roughness=0.2))),
}  # fmt: skip


@pytest.mark.parametrize("name", BALLS)
def test_a_picture_of_another_size_needs_no_other_kernel(name):
    import drjit

    materials = BALLS[name]
    lamp = PointLight(name="lamp", world_from_light=matrix((1, 0, 3)), power_w=100)
    scene = lit_plane(lamp, transport="spectral", world=World(gray(0.2)))
    balls = tuple(
        Instance(each.name, "sphere", matrix((0.1 * k, 0, 0.3), 0.4), (each.name,)) for k, each in enumerate(materials)
    )
    scene = replace(
        scene, meshes=(*scene.meshes, sphere_mesh(6)), materials=(*scene.materials, *materials),
        instances=(*scene.instances, *balls),
    )  # fmt: skip
    history = []
    for width in (6, 9):
        sized = replace(scene, film=Film(width, 5, samples=1))
        job = RenderJob(sized, everything_on(sized))
        with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
            drjit.kernel_history_clear()
            job.trace(1)
            history.append([each for each in drjit.kernel_history() if each.get("operation_count", 0) > 500])
    assert all(history)
    assert {each["hash"] for each in history[1]} == {each["hash"] for each in history[0]}


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
def test_a_picture_of_one_pixel_is_that_pixel_of_a_larger_one(transport):
    """Dr.Jit refused the loop of a single lane in spectral transport: numbers of it count as constants."""
    lamp = PointLight(name="lamp", world_from_light=matrix((0, 0, 3)), power_w=100, radius=0.3)
    scene = lit_plane(lamp, transport=transport, world=World(gray(0.0)))
    bands = Bands.uniform(400.0, 700.0, 4) if transport == "spectral" else None
    one, two = (
        render_scene(replace(scene, film=Film(4, 3, samples=9, crop=(1, 1, width, 1))), bands=bands) for width in (1, 2)
    )
    assert one.pixels.shape == (1, 1, 4) and one.pixels[0, 0, 0] > 0
    np.testing.assert_allclose(one.pixels[0, 0], two.pixels[0, 0], rtol=1e-5)
    if bands is not None:
        assert one.band_pixels.shape == (1, 1, 4)
        np.testing.assert_allclose(one.band_pixels[0, 0], two.band_pixels[0, 0], rtol=1e-5)
