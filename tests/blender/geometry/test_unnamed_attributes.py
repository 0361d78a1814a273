# SPDX-License-Identifier: GPL-3.0-or-later
"""Attribute nodes without a name read nothing."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def colored(build, kind, output="Color"):
    """A cylinder with random colors, shown by a node of ``kind`` without a name."""
    from blender_addon import compat

    bpy.ops.mesh.primitive_cylinder_add()
    can = bpy.context.object
    layer = can.data.color_attributes.new("Tone", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.random.default_rng(4).uniform(0.2, 0.9, 4 * len(layer.data)).astype(np.float32))
    material = build.material("Paint", "ShaderNodeEmission")
    tree = compat.use_nodes(material)
    shader = next(node for node in tree.nodes if node.type == "EMISSION")
    node = tree.nodes.new(kind)
    tree.links.new(node.outputs[output], shader.inputs["Strength" if output == "Alpha" else "Color"])
    can.data.materials.append(material)
    return can, node


def test_only_color_attribute_reads_the_active_color_without_a_name(build, translate):
    colored(build, "ShaderNodeAttribute")
    (mesh,) = translate().meshes
    assert not mesh.attributes
    scene = translate()
    color = scene.materials[0].surface.color
    assert np.allclose(getattr(color, "linear_rgb", 1.0), 0.0)
    bpy.data.objects.remove(bpy.context.object)
    colored(build, "ShaderNodeVertexColor")
    (mesh,) = translate().meshes
    assert mesh.attributes


def test_the_alpha_of_an_attribute_without_a_name_is_1(build, translate):
    colored(build, "ShaderNodeAttribute", "Alpha")
    assert translate().materials[0].surface.strength == 1.0
