# SPDX-License-Identifier: GPL-3.0-or-later
"""A render whose cost was measured compiles nothing: the measurement used its kernels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spectral_core.render import cost_curve, render_scene
from spectral_core.scene import (
    Diffuse,
    Emission,
    Film,
    Glossy,
    ImageTexture,
    Instance,
    Material,
    MixSurface,
    Principled,
    gray,
)
from tests.render.scenes import lit_plane, matrix, sphere_mesh

pytest.importorskip("mitsuba")


def test_a_render_has_the_kernels_of_its_measurement():
    import drjit

    cells = np.indices((8, 8)).sum(axis=0)[..., None] % 2 * np.ones(3, np.float32)
    board = Emission(ImageTexture("cells", cells.astype(np.float32), "linear"), 8.0)
    scene = lit_plane(surface=MixSurface(0.5, Diffuse(gray(0.5)), Glossy(gray(0.8), 0.3)), film=Film(16, 12, samples=4))
    things = (
        Instance("board", "sphere", matrix((0.2, 0, 1.0), 0.1), ("board",)),
        Instance("post", "sphere", matrix((-0.2, 0, 0.2), 0.1), ("post",)),
    )
    scene = replace(
        scene, meshes=(*scene.meshes, sphere_mesh(6)), instances=(*scene.instances, *things),
        materials=(*scene.materials, Material("board", board), Material("post", Principled(metallic=1.0))),
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
