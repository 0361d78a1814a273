# SPDX-License-Identifier: GPL-3.0-or-later
"""Curve nodes over -0.6 to 2.4: ends that continue or stay, and points outside of 0 to 1, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")

KINDS = {"ShaderNodeRGBCurve": "Color", "ShaderNodeVectorCurve": "Vector", "ShaderNodeFloatCurve": "Value"}


@pytest.mark.parametrize(("last", "extend"), [((1.6, 1.1), "EXTRAPOLATED"), ((0.8, 0.3), "HORIZONTAL")])
@pytest.mark.parametrize("kind", KINDS)
def test_a_curve_agrees_with_cycles(build, tmp_path, kind, last, extend):
    settings(samples=64, size=12)
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    node, scale = tree.nodes.new(kind), tree.nodes.new("ShaderNodeVectorMath")
    mapping = node.mapping
    mapping.use_clip, mapping.extend = False, extend
    for number, curve in enumerate(mapping.curves):
        curve.points[-1].location = (last[0], last[1] - 0.05 * number)
        curve.points.new(0.4, 0.2 + 0.1 * number)
    mapping.update()
    scale.operation = "MULTIPLY_ADD"
    scale.inputs[1].default_value, scale.inputs[2].default_value = (3, 2, 1), (-0.6, -0.6, 0.2)
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], scale.inputs[0])
    if kind == "ShaderNodeFloatCurve":
        parts = tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(scale.outputs[0], parts.inputs[0])
        tree.links.new(parts.outputs[0], node.inputs["Value"])
    else:
        tree.links.new(scale.outputs[0], node.inputs[KINDS[kind]])
    lift = tree.nodes.new("ShaderNodeVectorMath")  # light is never below zero
    lift.inputs[1].default_value = (4, 4, 4)
    tree.links.new(node.outputs[0], lift.inputs[0])
    tree.links.new(lift.outputs[0], tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    build.camera(type="ORTHO", ortho_scale=1.9)
    found, notes = ours(samples=64)
    assert not notes
    wanted = cycles(tmp_path)
    assert np.abs(found - wanted).mean() < 0.03
    assert np.abs(found - wanted).max() < 0.3
