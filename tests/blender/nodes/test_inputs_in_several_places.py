# SPDX-License-Identifier: GPL-3.0-or-later
"""Values that a material reads in several places: its AOVs by name, and inputs of mixed shaders of worlds and lamps."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def test_each_aov_has_the_value_of_the_first_node_with_its_name(build, translate):
    material = build.material()
    for name, value in (("Color", 0.1), ("Number", 0.3), ("Color", 0.7), ("Unknown", 0.9)):
        node = material.node_tree.nodes.new("ShaderNodeOutputAOV")
        node.aov_name, node.inputs["Value"].default_value = name, value
        node.inputs["Color"].default_value = (value, value, value, 1.0)
    build.plane(material=material)
    for name, kind in (("Color", "COLOR"), ("Number", "VALUE")):
        aov = bpy.context.view_layer.aovs.add()
        aov.name, aov.type = name, kind
    found = dict(translate().materials[0].outputs)
    assert list(found) == ["Color", "Number"]
    np.testing.assert_allclose(found["Color"].linear_rgb, 0.1, rtol=1e-6)
    assert found["Number"] == pytest.approx(0.3)


@pytest.mark.parametrize("varying", [False, True])
def test_every_number_of_a_mixed_world_counts(build, translate, varying):
    """Plain backgrounds are added exactly, others in a picture of directions."""
    from blender_addon import compat
    from tests.settings_walk import fingerprint

    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(world)
    tree.nodes.clear()
    first, second, mix = (
        tree.nodes.new(kind) for kind in ("ShaderNodeBackground", "ShaderNodeEmission", "ShaderNodeMixShader")
    )
    for node, color in ((first, (0.1, 0.5, 0.9, 1.0)), (second, (0.8, 0.2, 0.1, 1.0))):
        node.inputs["Color"].default_value = color
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    if varying:
        tree.links.new(tree.nodes.new("ShaderNodeTexChecker").outputs["Color"], first.inputs["Color"])
    mix.inputs[0].default_value = 0.3
    before = fingerprint(translate().world)
    for socket in (first.inputs["Strength"], second.inputs["Strength"], mix.inputs[0]):
        kept = socket.default_value
        socket.default_value = kept + 0.5
        assert fingerprint(translate().world) != before, socket.name
        socket.default_value = kept
        assert fingerprint(translate().world) == before


@pytest.mark.parametrize(("name", "value"), [("operation", "ADD"), ("use_clamp", True)])
def test_the_strength_of_a_lamp_is_what_its_math_node_computes(build, translate, name, value):
    from blender_addon import compat
    from tests.settings_walk import fingerprint

    lamp = build.light("POINT", 10)
    tree = compat.use_nodes(lamp.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    product = tree.nodes.new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    product.inputs[0].default_value, product.inputs[1].default_value = 3.0, 5.0
    tree.links.new(product.outputs[0], emission.inputs["Strength"])
    before = fingerprint(translate().lights)
    setattr(product, name, value)
    assert fingerprint(translate().lights) != before


def test_an_aov_in_nested_groups_has_the_values_of_its_group(build, translate):
    aov = bpy.context.view_layer.aovs.add()
    aov.name, aov.type = "Mask", "VALUE"
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    node, start = inner.nodes.new("ShaderNodeOutputAOV"), inner.nodes.new("NodeGroupInput")
    node.aov_name = "Mask"
    inner.links.new(start.outputs[0], node.inputs["Value"])
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    within = outer.nodes.new("ShaderNodeGroup")
    within.node_tree = inner
    within.inputs[0].default_value = 0.375
    material = build.material()
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = outer
    build.plane(material=material)
    scene = translate()
    assert scene.materials[0].outputs == (("Mask", 0.375),) and scene.notes == ()
    group.mute = True
    assert translate().materials[0].outputs == ()
    bpy.context.view_layer.aovs.remove(aov)
