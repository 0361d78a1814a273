# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of unusual types and signs act as in Cycles: vectors for numbers, negative sizes, bumps without a slope."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

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


def test_the_sign_of_the_size_of_a_wireframe_has_no_effect(build, tmp_path):
    settings(samples=32, size=24)
    material = build.material(shader="ShaderNodeEmission")
    build.plane(material=material)
    build.camera(type="ORTHO", ortho_scale=3.0)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeWireframe")
    node.inputs["Size"].default_value = -0.4
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Color"])
    found, _ = ours(samples=64)
    wanted = cycles(tmp_path)
    assert 0.1 < wanted.mean() < 0.5
    assert abs(found.mean() - wanted.mean()) < 0.01


def test_a_bump_without_a_slope_passes_its_normal_as_it_is(build, translate):
    """A constant normal counts as none there: Cycles takes its link away before it looks at the Bump node."""
    material = build.material(shader="ShaderNodeEmission")
    build.plane(material=material)
    tree = material.node_tree
    node, height, normal = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Bump", "Value", "CombineXYZ"))
    tree.links.new(height.outputs[0], node.inputs["Height"])
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Color"])

    def shown():
        (item,) = translate().materials
        inputs = {"normal": (0.0, 0.6, 0.8), "incoming": (0.1, 0.2, 0.4)}
        read = lambda name, _: tuple(np.full(1, part) for part in inputs[name])  # noqa: E731
        return np.ravel(item.surface.color.program.evaluate(read))

    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"], node.inputs["Normal"])
    np.testing.assert_allclose(shown(), (0.1, 0.2, 0.4), atol=1e-6)
    normal.inputs["X"].default_value = 2.0
    tree.links.new(normal.outputs[0], node.inputs["Normal"])
    np.testing.assert_allclose(shown(), (0.0, 0.6, 0.8), atol=1e-6)


@pytest.mark.parametrize("socket", ["Midlevel", "Scale"])
def test_a_vector_in_a_number_of_vector_displacement_is_its_mean(glow, socket):
    tree, color = glow
    node, vector = tree.nodes.new("ShaderNodeVectorDisplacement"), tree.nodes.new("ShaderNodeCombineXYZ")
    node.space, node.inputs["Midlevel"].default_value, node.inputs["Scale"].default_value = "WORLD", 0.0, 1.0
    node.inputs["Vector"].default_value[:3] = 0.6, 0.7, 0.8
    for each, value in zip(vector.inputs, VECTOR, strict=True):
        each.default_value = value
    tree.links.new(vector.outputs[0], node.inputs[socket])
    wanted = (0.1, 0.2, 0.3) if socket == "Midlevel" else (0.3, 0.35, 0.4)
    np.testing.assert_allclose(color(node.outputs[0]), wanted, atol=1e-6)


def test_the_color_of_a_black_body_has_no_negative_parts_for_other_nodes(glow):
    """That of 800 K is outside of the display's colors: Cycles gives 5.41, 0, 0."""
    tree, color = glow
    body, added = tree.nodes.new("ShaderNodeBlackbody"), tree.nodes.new("ShaderNodeVectorMath")
    body.inputs[0].default_value, added.operation = 800.0, "ADD"
    tree.links.new(body.outputs[0], added.inputs[0])
    np.testing.assert_allclose(color(added.outputs[0]), (5.413, 0.0, 0.0), atol=0.02)
