# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that compute other colors than Cycles in a file with another working space have a note."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


def linked(material, kind, to, output=0, **settings):
    """Link an output of a new node to a socket of the material's shader."""
    tree = material.node_tree
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(node, name, value)
    shader = next(each for each in tree.nodes if each.type == "EMISSION")
    tree.links.new(next(each for each in node.outputs[output:] if each.enabled), shader.inputs[to])


@pytest.mark.parametrize(
    ("kind", "to", "settings", "differs"),
    [
        ("ShaderNodeMix", "Color", {"data_type": "RGBA", "blend_type": "MULTIPLY"}, True),
        ("ShaderNodeMix", "Color", {"data_type": "RGBA"}, False),
        ("ShaderNodeMix", "Strength", {}, False),
        ("ShaderNodeSeparateColor", "Strength", {}, True),
        ("ShaderNodeNewGeometry", "Color", {}, True),
        ("ShaderNodeTexNoise", "Color", {"output": 1}, True),
        ("ShaderNodeTexNoise", "Color", {}, False),
        ("ShaderNodeRGB", "Color", {}, False),
        ("ShaderNodeValToRGB", "Color", {}, False),
    ],
)
def test_a_node_that_depends_on_the_working_space_has_a_note(
    build, translate, monkeypatch, kind, to, settings, differs
):
    from blender_addon import compat

    material = build.material("Glow", "ShaderNodeEmission")
    linked(material, kind, to, **settings)
    build.plane(material=material)
    build.camera()
    for space, expected in (("ACEScg", differs), ("Linear Rec.709", False)):
        monkeypatch.setattr(compat, "working_space", lambda data, space=space: space)
        notes = [note for note in translate().notes if "the file's working space" in note.message]
        assert bool(notes) is expected, notes
