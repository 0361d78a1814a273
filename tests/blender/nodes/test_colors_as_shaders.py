# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors and numbers at the sockets of shaders: Blender links them there as emission, also through groups and mixes."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.scene import AddSurface, Emission

bpy = pytest.importorskip("bpy")

RED = (0.8, 0.1, 0.2)


def constant(tree, kind):
    """An output of a type: a color, a vector or a number."""
    if kind == "number":
        node = tree.nodes.new("ShaderNodeValue")
        node.outputs[0].default_value = 0.6
        return node.outputs[0], (0.6, 0.6, 0.6)
    node = tree.nodes.new("ShaderNodeRGB" if kind == "color" else "ShaderNodeCombineXYZ")
    if kind == "color":
        node.outputs[0].default_value = (*RED, 1)
    else:
        for socket, value in zip(node.inputs, RED, strict=True):
            socket.default_value = value
    return node.outputs[0], RED


def end(tree, kind="OUTPUT_MATERIAL"):
    return next(node for node in tree.nodes if node.type == kind)


def shown(emission):
    """Radiance of an Emission of plain numbers."""
    assert isinstance(emission, Emission)
    return emission.strength * emission.color.linear_rgb


@pytest.mark.parametrize("kind", ["color", "vector", "number"])
def test_a_surface_shows_it(build, surface, kind):
    material = build.material()
    tree = material.node_tree
    output, expected = constant(tree, kind)
    tree.links.new(output, end(tree).inputs["Surface"])
    found, notes = surface(material)
    np.testing.assert_allclose(shown(found), expected, rtol=1e-6)
    assert notes == set()


def test_a_picture_is_shown_with_its_own_colors(build, surface):
    material = build.material()
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = build.image("colors", np.tile([0.2, 0.5, 0.9, 1.0], (4, 4, 1)))
    tree.links.new(texture.outputs["Color"], end(tree).inputs["Surface"])
    found, notes = surface(material)
    assert isinstance(found, Emission) and found.strength == 1 and notes == set()


def test_sums_and_groups_pass_it_on(build, surface):
    group = bpy.data.node_groups.new("sum", "ShaderNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Shader", in_out=way, socket_type="NodeSocketShader")
    given, taken = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    both = group.nodes.new("ShaderNodeAddShader")
    color, _ = constant(group, "vector")
    for source, target in ((given.outputs[0], both.inputs[0]), (color, both.inputs[1])):
        group.links.new(source, target)
    group.links.new(both.outputs[0], taken.inputs[0])
    material = build.material()
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    number, gray = constant(tree, "number")
    tree.links.new(number, node.inputs[0])
    tree.links.new(node.outputs[0], end(tree).inputs["Surface"])
    found, notes = surface(material)
    assert isinstance(found, AddSurface) and notes == set()
    np.testing.assert_allclose(shown(found.first), gray, rtol=1e-6)
    np.testing.assert_allclose(shown(found.second), RED, rtol=1e-6)


@pytest.mark.parametrize("kind", ["color", "number"])
def test_lamps_worlds_and_volumes_shine_with_it(build, translate, kind):
    from blender_addon import compat

    lamp, world, material = build.light("POINT").data, bpy.data.worlds.new("World"), build.material()
    bpy.context.scene.world = world
    build.plane(material=material)
    for owner, kind_of_end, socket in (
        (lamp, "OUTPUT_LIGHT", "Surface"), (world, "OUTPUT_WORLD", "Surface"), (material, "OUTPUT_MATERIAL", "Volume")
    ):  # fmt: skip
        tree = compat.use_nodes(owner)
        output, expected = constant(tree, kind)
        target = end(tree, kind_of_end)
        for link in list(target.inputs["Surface"].links):
            tree.links.remove(link)
        tree.links.new(output, target.inputs[socket])
    scene = translate()
    assert not scene.notes
    light, background, medium = scene.lights[0], scene.world, scene.materials[0].medium
    np.testing.assert_allclose(light.color.linear_rgb * light.power_w / lamp.energy, expected, rtol=1e-5)
    np.testing.assert_allclose(background.color.linear_rgb * background.strength, expected, rtol=1e-5)
    np.testing.assert_allclose(medium.emission_color.linear_rgb * medium.emission_strength, expected, rtol=1e-5)
