# SPDX-License-Identifier: GPL-3.0-or-later
"""An object without a material has Blender's default surface, also where a slot is empty."""

from __future__ import annotations

import numpy as np
import pytest

from ..cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize("slots", [0, 1])
def test_an_object_without_a_material_looks_as_in_cycles(build, tmp_path, slots):
    settings(samples=64, size=16)
    item = build.plane(size=20.0)
    for _ in range(slots):
        item.data.materials.append(None)
    build.light("AREA", 500, (0, 6, 1.5), size=1.0).rotation_euler = (-1.2, 0, 0)
    build.camera((0, -6, 1.2)).rotation_euler = (1.4, 0, 0)  # at a grazing angle, where a glossy layer shows
    bpy.context.view_layer.update()
    expected = cycles(tmp_path)
    found, _ = ours()
    rows = [picture[:8].reshape(4, 2, 16, 3).mean((1, 2)) for picture in (expected, found)]
    assert rows[0].min() > 0.01
    np.testing.assert_allclose(rows[1], rows[0], rtol=0.03)
