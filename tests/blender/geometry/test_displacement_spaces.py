# SPDX-License-Identifier: GPL-3.0-or-later
"""Displacement in the space of a turned and scaled object, in the world's and along tangents, as in Cycles."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")

CASES = [
    ("ShaderNodeDisplacement", "OBJECT"), ("ShaderNodeDisplacement", "WORLD"),
    ("ShaderNodeVectorDisplacement", "TANGENT"), ("ShaderNodeVectorDisplacement", "OBJECT"),
    ("ShaderNodeVectorDisplacement", "WORLD"),
]  # fmt: skip


def scaled(build, kind: str, space: str) -> None:
    """A plane, turned and scaled differently along each axis, whose color shows where its points are."""
    material = build.material(shader="ShaderNodeEmission")
    material.displacement_method = "DISPLACEMENT"
    tree = material.node_tree
    moved, join, parts = (tree.nodes.new(f"ShaderNode{name}") for name in
                          (kind.removeprefix("ShaderNode"), "CombineColor", "SeparateXYZ"))  # fmt: skip
    moved.space, moved.inputs["Scale"].default_value = space, 1.0
    if kind == "ShaderNodeDisplacement":
        moved.inputs["Height"].default_value, moved.inputs["Midlevel"].default_value = 0.4, 0.1
    else:
        color = tree.nodes.new("ShaderNodeCombineXYZ")
        for name, value in zip("XYZ", (0.11, 0.07, 0.05), strict=True):
            color.inputs[name].default_value = value
        tree.links.new(color.outputs[0], moved.inputs["Vector"])
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["UV"], parts.inputs[0])
    place = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], place.inputs[0])
    for source, target in ((parts.outputs[0], "Red"), (parts.outputs[1], "Green"), (place.outputs["Z"], "Blue")):
        tree.links.new(source, join.inputs[target])
    tree.links.new(join.outputs[0], tree.nodes["shader"].inputs["Color"])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(moved.outputs[0], output.inputs["Displacement"])
    plane = build.plane(material=material)
    plane.scale, plane.rotation_euler = (2.0, 1.4, 3.0), (0.1, 0.15, 0.5)
    build.camera(type="ORTHO", ortho_scale=1.0)


@pytest.mark.parametrize(("kind", "space"), CASES)
def test_a_scaled_object_is_displaced_as_in_cycles(build, tmp_path, kind, space):
    settings(samples=1, size=8)
    scaled(build, kind, space)
    found, notes = ours(samples=16)
    assert not notes
    wanted = cycles(tmp_path)
    assert np.abs(np.median(found - wanted, axis=(0, 1))).max() < 0.01
