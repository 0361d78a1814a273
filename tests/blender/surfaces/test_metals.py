# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors that stand for a metal's index of refraction and extinction are those of exactly that metal."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")


@pytest.mark.parametrize("index", [0.05, 0.5, 0.99, 1.3, 4.0])
@pytest.mark.parametrize("extinction", [0.0, 0.2, 3.0])
def test_facing_and_edge_colors_represent_a_metal(index, extinction):
    from blender_addon.translate.shading.shader_inputs import conductor_colors

    facing, edge, scale = conductor_colors(np.full(3, index), np.full(3, extinction))
    r, g = np.array(facing.linear_rgb)[0], np.array(edge.linear_rgb)[0] * scale
    assert 0 <= g / scale <= 1
    # Gulbrandsen 2014, Eqs. 3 to 5
    n = g * (1 - r) / (1 + r) + (1 - g) * (1 + np.sqrt(r)) / (1 - np.sqrt(r))
    k = np.sqrt(max((r * (n + 1) ** 2 - (n - 1) ** 2) / (1 - r), 0.0))
    np.testing.assert_allclose((n, k), (index, extinction), atol=2e-3)
