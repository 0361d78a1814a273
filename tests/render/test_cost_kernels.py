# SPDX-License-Identifier: GPL-3.0-or-later
"""A render whose cost was measured compiles nothing: the measurement used its kernels."""

from __future__ import annotations

from dataclasses import replace

import pytest

from spectral_core.render import cost_curve, render_scene
from spectral_core.scene import Emission, Film, Glossy, Instance, Material, PointLight, gray
from tests.render.scenes import lit_plane, matrix, sphere_mesh

pytest.importorskip("mitsuba")


def test_a_render_has_the_kernels_of_its_measurement():
    import drjit

    lamp = PointLight(name="lamp", world_from_light=matrix((1, 0, 3)), power_w=100, radius=0.2)
    scene = lit_plane(lamp, surface=Glossy(gray(0.8), 0.3), film=Film(16, 12, samples=4))
    bulb = Instance("bulb", "sphere", matrix((0.2, 0, 1.0), 0.1), ("bulb",))
    scene = replace(
        scene, meshes=(*scene.meshes, sphere_mesh(6)), instances=(*scene.instances, bulb),
        materials=(*scene.materials, Material("bulb", Emission(gray(1.0), 5.0))),
    )  # fmt: skip
    found = []
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory, True):
        for measure in (cost_curve, render_scene):
            drjit.kernel_history_clear()
            measure(scene)
            history = drjit.kernel_history()
            found.append({each["hash"] for each in history if each.get("operation_count", 0) > 500})
    assert found[1]
    assert found[1] <= found[0]
