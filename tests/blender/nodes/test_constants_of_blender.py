# SPDX-License-Identifier: GPL-3.0-or-later
"""From 5.0 on, Blender computes what some nodes make of constants: curves act exactly there, and Float Curve clips."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")
pytestmark = pytest.mark.skipif(not hasattr(bpy.types.Material, "inline_shader_nodes"), reason="from Blender 5.0 on")

SOURCES = {"none": None, "value": "ShaderNodeValue", "color": "ShaderNodeRGB", "math": "ShaderNodeMath"}
CURVES = {"ShaderNodeFloatCurve": "Value", "ShaderNodeRGBCurve": "Color", "ShaderNodeVectorCurve": "Vector"}


def glow(build, curve, source, value):
    """A square that emits what a steep curve makes of a constant outside of its range."""
    material = build.material("Glow", "ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new(curve)
    for each in node.mapping.curves:
        each.points.new(0.4, 0.7)
    node.mapping.update()
    socket = node.inputs[CURVES[curve]]
    if source is None:
        socket.default_value = (
            value if curve == "ShaderNodeFloatCurve" else (*[value] * 3, 1)[: len(socket.default_value)]
        )
    else:
        before = tree.nodes.new(source)
        if source == "ShaderNodeMath":
            before.inputs[0].default_value, before.inputs[1].default_value = value, 0.0
        else:
            before.outputs[0].default_value = (*[value] * 3, 1) if source == "ShaderNodeRGB" else value
        tree.links.new(before.outputs[0], socket)
    tree.links.new(node.outputs[0], next(node for node in tree.nodes if node.type == "EMISSION").inputs["Color"])
    build.plane(size=4.0, material=material)
    camera = build.camera()
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 4), "ORTHO", 1.0


@pytest.mark.parametrize("value", [2.5, 0.43])
@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("curve", CURVES)
def test_a_constant_on_a_curve_is_that_of_cycles(build, tmp_path, curve, source, value):
    glow(build, curve, SOURCES[source], value)
    settings(samples=1, size=4)
    mine, notes = ours(1)
    np.testing.assert_allclose(np.asarray(mine), cycles(tmp_path), rtol=2e-3, atol=2e-3)
    assert not notes


def test_float_curve_clips_a_constant(build, translate):
    glow(build, "ShaderNodeFloatCurve", None, 2.5)
    np.testing.assert_allclose(translate().materials[0].surface.color.linear_rgb, 1.0)
