# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin films and physical metals of Blender's shaders."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import Computed

bpy = pytest.importorskip("bpy")


def worn(material, kind):
    """A shader as the material's surface."""
    tree = material.node_tree
    node = tree.nodes.new(kind)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfPrincipled", "ShaderNodeBsdfGlass", "ShaderNodeBsdfMetallic"])
def test_thin_films_with_a_thickness_are_translated(kind, build, surface):
    material = build.material()
    node = worn(material, kind)
    found, notes = surface(material)
    assert found.thin_film_thickness == 0 and not notes
    node.inputs["Thin Film Thickness"].default_value = 450
    node.inputs["Thin Film IOR"].default_value = 1.7
    found, notes = surface(material)
    assert (found.thin_film_thickness, found.thin_film_ior) == (450, pytest.approx(1.7)) and not notes
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs[0], node.inputs["Thin Film Thickness"])
    found, notes = surface(material)
    assert isinstance(found.thin_film_thickness, Computed) and not notes


def test_a_physical_conductor_keeps_its_index_and_extinction(build, surface):
    material = build.material()
    node = worn(material, "ShaderNodeBsdfMetallic")
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    n, k = np.array([0.2, 1.5, 3.0]), np.array([3.5, 2.0, 3.1])
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = n, k
    found, _ = surface(material)
    r, g = found.color.linear_rgb, found.edge_tint.linear_rgb
    index = (1 - g) * (1 + np.sqrt(r)) / (1 - np.sqrt(r)) + g * (1 - r) / (1 + r)
    np.testing.assert_allclose(index, n, rtol=1e-5)
    np.testing.assert_allclose((r * (n + 1) ** 2 - (n - 1) ** 2) / (1 - r), k**2, rtol=1e-5)
    assert found.physical
