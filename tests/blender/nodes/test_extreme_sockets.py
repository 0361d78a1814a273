# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets beyond their usual range are as in Cycles, or have a note."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender.surfaces.test_surfaces_against_cycles import stage  # noqa: E402, F401


@pytest.mark.parametrize(("shader", "roughness", "rtol"), [
    ("Metallic", -0.7, 0.03), ("Metallic", "varying", 0.03), ("Refraction", -0.6, 0.03), ("Glass", "varying", 0.08),
])  # fmt: skip
def test_a_negative_roughness(build, stage, tmp_path, shader, roughness, rtol):  # noqa: F811
    """Facets are smooth there, as in Cycles; Cycles' Refraction is as rough as for the positive number."""
    material = build.material(shader=f"ShaderNodeBsdf{shader}")
    tree = material.node_tree
    if roughness == "varying":  # from -1 to 1 along the ball's axis
        place, value = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(place.outputs["Object"], value.inputs[0])
    else:
        value = tree.nodes.new("ShaderNodeValue")
        value.outputs[0].default_value = roughness
    tree.links.new(value.outputs[-1], tree.nodes["shader"].inputs["Roughness"])
    theirs, ours, notes = stage(material, tmp_path, samples=192)
    np.testing.assert_allclose(ours, theirs, rtol=rtol)
    assert notes == []


@pytest.mark.parametrize(("weight", "count"), [(0.7, 0), (1.0, 0), (3.0, 1)])
def test_a_linked_sheen_weight_above_1(build, translate, weight, count):
    material = build.material(shader="ShaderNodeBsdfPrincipled")
    tree = material.node_tree
    number = tree.nodes.new("ShaderNodeValue")
    number.outputs[0].default_value = weight
    tree.links.new(number.outputs[0], tree.nodes["shader"].inputs["Sheen Weight"])
    build.plane(material=material)
    notes = translate().notes
    assert len(notes) == count and all("Sheen Weight of 3 is above 1" in note.message for note in notes)


@pytest.mark.parametrize(("distance", "feature", "exponent", "count"), [
    ("MINKOWSKI", "F1", 0.0, 1), ("MINKOWSKI", "SMOOTH_F1", 0.01, 1), ("MINKOWSKI", "F1", 0.05, 0),
    ("EUCLIDEAN", "F1", 0.0, 0), ("MINKOWSKI", "DISTANCE_TO_EDGE", 0.0, 0),
])  # fmt: skip
def test_a_minkowski_exponent_near_0(build, translate, distance, feature, exponent, count):
    material = build.material()
    tree = material.node_tree
    cells = tree.nodes.new("ShaderNodeTexVoronoi")
    cells.distance = "MINKOWSKI"
    cells.inputs["Exponent"].default_value = exponent
    cells.distance, cells.feature = distance, feature
    output = "Distance" if feature == "DISTANCE_TO_EDGE" else "Color"
    tree.links.new(cells.outputs[output], tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    notes = translate().notes
    assert len(notes) == count and all("Minkowski exponent" in note.message for note in notes)
