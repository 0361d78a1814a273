# SPDX-License-Identifier: GPL-3.0-or-later
"""A vector in the factor of a mix is one number, and the direction of a Normal node has the length 1, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

VECTOR = (0.9, 2.0, -1.4)  # its mean is 0.5, the mean of its clamped components 0.63


@pytest.fixture
def glow(build, translate):
    """A material that emits, and a function that gives its color for an output of its tree."""
    material = build.material(shader="ShaderNodeEmission")
    build.plane(material=material)

    def color(output):
        tree = material.node_tree
        tree.links.new(output, tree.nodes["shader"].inputs["Color"])
        return translate().materials[0].surface.color.linear_rgb

    return material.node_tree, color


@pytest.mark.parametrize("kind", ["ShaderNodeMix", "ShaderNodeMixRGB"])
def test_a_vector_in_a_factor_is_one_number(glow, kind):
    tree, color = glow
    mixed, vector = tree.nodes.new(kind), tree.nodes.new("ShaderNodeCombineXYZ")
    for socket, value in zip(vector.inputs, VECTOR, strict=True):
        socket.default_value = value
    if kind == "ShaderNodeMix":
        mixed.data_type = "RGBA"
    first, second = [socket for socket in mixed.inputs if socket.type == "RGBA"][:2]
    first.default_value, second.default_value = (0, 0.2, 0.4, 1), (1, 0.6, 0.8, 1)
    tree.links.new(vector.outputs[0], mixed.inputs[0])
    output = next(socket for socket in mixed.outputs if socket.type == "RGBA")
    np.testing.assert_allclose(color(output), (0.5, 0.4, 0.6), atol=1e-6)


def test_a_vector_in_the_plain_factor_of_mixed_vectors_is_one_number(glow):
    tree, color = glow
    mixed, vector = tree.nodes.new("ShaderNodeMix"), tree.nodes.new("ShaderNodeCombineXYZ")
    for socket, value in zip(vector.inputs, VECTOR, strict=True):
        socket.default_value = value
    mixed.data_type, mixed.clamp_factor = "VECTOR", False
    second = next(socket for socket in mixed.inputs if socket.type == "VECTOR" and socket.name == "B")
    second.default_value = (0.2, 0.4, 0.6)
    tree.links.new(vector.outputs[0], next(socket for socket in mixed.inputs if socket.identifier == "Factor_Float"))
    output = next(socket for socket in mixed.outputs if socket.type == "VECTOR")
    np.testing.assert_allclose(color(output), (0.1, 0.2, 0.3), atol=1e-6)


def test_the_direction_of_a_normal_node_has_the_length_1(glow):
    tree, color = glow
    node = tree.nodes.new("ShaderNodeNormal")
    node.outputs[0].default_value = (0.0, 0.3, 0.4)
    np.testing.assert_allclose(color(node.outputs[0]), (0, 0.6, 0.8), atol=1e-6)
