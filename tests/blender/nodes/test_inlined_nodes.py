# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of Blender 5 that Blender replaces before a render: menus, repeat zones, closures."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytestmark = pytest.mark.skipif(not hasattr(bpy.types.Material, "inline_shader_nodes"), reason="from Blender 5.0 on")


@pytest.fixture
def glow(build, translate):
    """A material that emits, its tree, and a function that gives its color and the notes."""
    material = build.material(shader="ShaderNodeEmission")
    build.plane(material=material)

    def color():
        scene = translate()
        return scene.materials[0].surface.color, [note.message for note in scene.notes]

    return material, color


def switch(tree):
    node = tree.nodes.new("GeometryNodeMenuSwitch")
    node.data_type = "RGBA"
    node.inputs["A"].default_value, node.inputs["B"].default_value = (1, 0, 0, 1), (0.25, 0.5, 0.125, 1)
    return node


@pytest.mark.parametrize("is_grouped", [False, True])
def test_a_menu_shows_the_chosen_color(glow, is_grouped):
    material, color = glow
    tree = material.node_tree
    if is_grouped:
        inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        inner.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
        node = switch(inner)
        inner.links.new(node.outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
        group = tree.nodes.new("ShaderNodeGroup")
        group.node_tree = inner
        output = group.outputs[0]
    else:
        node = switch(tree)
        output = node.outputs[0]
    tree.links.new(output, tree.nodes["shader"].inputs["Color"])
    node.inputs["Menu"].default_value = "B"
    found, notes = color()
    np.testing.assert_allclose(found.linear_rgb, (0.25, 0.5, 0.125))
    assert notes == []


def test_a_repeat_zone_is_repeated(glow):
    material, color = glow
    tree = material.node_tree
    first, last = tree.nodes.new("GeometryNodeRepeatInput"), tree.nodes.new("GeometryNodeRepeatOutput")
    first.pair_with_output(last)
    last.repeat_items.clear()
    last.repeat_items.new("FLOAT", "Value")
    first.inputs["Iterations"].default_value, first.inputs["Value"].default_value = 3, 0.125
    double = tree.nodes.new("ShaderNodeMath")
    double.operation = "MULTIPLY"
    double.inputs[1].default_value = 2.0
    tree.links.new(first.outputs["Value"], double.inputs[0])
    tree.links.new(double.outputs[0], last.inputs["Value"])
    tree.links.new(last.outputs["Value"], tree.nodes["shader"].inputs["Color"])
    found, notes = color()
    np.testing.assert_allclose(found.linear_rgb, 1.0)
    assert notes == []


def test_a_node_in_an_inlined_tree_keeps_its_spectrum(glow):
    from blender_addon.translate.spectra.stored import store_spectrum
    from spectral_core.spectra.catalogue import illuminant

    material, color = glow
    tree = material.node_tree
    tree.links.new(switch(tree).outputs[0], tree.nodes["shader"].inputs["Strength"])
    store_spectrum(tree.nodes["shader"].spectral, illuminant("HP1"))
    found, _ = color()
    assert found.name == "HP1"


@pytest.mark.parametrize("has_sky", [False, True])
def test_menus_of_lamps_and_worlds(build, translate, has_sky):
    from blender_addon import compat

    lamp, world = build.light("POINT").data, bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    build.plane()
    for owner, kind in ((lamp, "EMISSION"), (world, "BACKGROUND")):
        tree = compat.use_nodes(owner)
        shader, node = next(each for each in tree.nodes if each.type == kind), switch(tree)
        node.inputs["Menu"].default_value = "B"
        if has_sky and owner == world:
            tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], node.inputs["B"])
        tree.links.new(node.outputs[0], shader.inputs["Color"])
    scene = translate()
    np.testing.assert_allclose(scene.lights[0].color.linear_rgb, (0.25, 0.5, 0.125))
    if has_sky:
        assert len(scene.lights) == 2 and np.ptp(scene.world.color.pixels) > 0
    else:
        np.testing.assert_allclose(scene.world.color.linear_rgb, (0.25, 0.5, 0.125))
    assert scene.notes == ()


def _emitting_output(tree, linear_rgb, target="ALL"):
    """A Material Output of a tree that shows a color."""
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*linear_rgb, 1)
    output.target = target
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return output


def test_an_output_node_in_a_group_counts(glow):
    material, color = glow
    tree = material.node_tree
    tree.nodes.clear()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    _emitting_output(group.node_tree, (0.25, 0.5, 0.125))
    found, notes = color()
    np.testing.assert_allclose(found.linear_rgb, (0.25, 0.5, 0.125))
    assert notes == []


def test_an_output_for_cycles_in_a_group_comes_before_one_for_all_engines(glow):
    material, color = glow
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    _emitting_output(group.node_tree, (0.25, 0.5, 0.125), "CYCLES")
    found, notes = color()
    np.testing.assert_allclose(found.linear_rgb, (0.25, 0.5, 0.125))
    assert notes == []


def test_of_active_outputs_in_several_trees_the_first_counts(glow):
    material, color = glow
    for linear_rgb, also in (((0.25, 0.5, 0.125), True), ((1.0, 0.0, 0.0), False)):
        group = material.node_tree.nodes.new("ShaderNodeGroup")
        group.node_tree = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        output = _emitting_output(group.node_tree, linear_rgb, "CYCLES")
        output.is_active_output = True
        if also:
            _emitting_output(group.node_tree, (0.0, 0.0, 1.0)).is_active_output = True
            output.is_active_output = False
    found, _ = color()
    np.testing.assert_allclose(found.linear_rgb, (0.25, 0.5, 0.125))
