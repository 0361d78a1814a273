# SPDX-License-Identifier: GPL-3.0-or-later
"""A lane begins its next path with its next ray: the picture is that of a loop over paths within one over samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render.job import RenderJob
from spectral_core.render.plan.effects import plan_effects
from spectral_core.scene import Film, Glass, PointLight, Scene, Surface, World, gray
from tests.render.scenes import lit_plane, matrix, sphere_mesh

pytest.importorskip("mitsuba", reason="needs Mitsuba: pip install 'spectral-scene[render]'")

LAMP = PointLight(name="lamp", world_from_light=matrix((1, 0.5, 3)), power_w=50.0, radius=0.3)


def balls(surface: Surface, transport: str) -> Scene:
    """A ball on a plane, so that some paths are long and others miss everything."""
    from spectral_core.scene import Instance, Material

    scene = lit_plane(LAMP, transport=transport, film=Film(24, 16, samples=9))
    ball = Instance("ball", "sphere", matrix((0, 0, 0.02), 0.03), ("ball",))
    return replace(
        scene,
        meshes=(*scene.meshes, sphere_mesh(16)),
        materials=(*scene.materials, Material("ball", surface)),
        instances=(*scene.instances, ball),
        world=World(gray(0.3)),
    )


def traced(scene: Scene, *, restarts: bool, monkeypatch: pytest.MonkeyPatch) -> tuple[np.ndarray, int]:
    """The picture after passes of 1, 3 and 5 samples, and the number of loops of paths that were recorded."""
    from spectral_core.render.trace.path.integrator import scene_path_class

    job = RenderJob(scene, plan_effects(scene, pilot=False))
    of, loops = scene_path_class(job.variant), []
    trace = of.trace
    with monkeypatch.context() as patch:
        patch.setattr(of, "restarts", restarts)
        patch.setattr(of, "trace", lambda *given: loops.append(1) or trace(*given))
        for samples in (1, 3, 5):
            job.trace(samples)
    return job.picture(), len(loops)


@pytest.mark.parametrize("transport", ["rgb", "spectral"])
@pytest.mark.parametrize("surface", [Glass(ior=1.5), None])
def test_the_picture_is_that_of_a_loop_over_paths(
    surface: Surface | None, transport: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from spectral_core.scene import Diffuse

    scene = balls(surface or Diffuse(gray(0.8)), transport)
    by_ray, none = traced(scene, restarts=True, monkeypatch=monkeypatch)
    by_path, three = traced(scene, restarts=False, monkeypatch=monkeypatch)
    # spectral transport loops over paths: each of the next rays would draw wavelengths and weigh them
    assert (none, three) == (0 if transport == "rgb" else 3, 3)
    assert by_ray[..., :3].max() > 0 and np.ptp(by_ray[..., :3]) > 0
    # equal random numbers; compilers may round a sum differently
    np.testing.assert_allclose(by_ray, by_path, rtol=2e-4, atol=1e-6)
