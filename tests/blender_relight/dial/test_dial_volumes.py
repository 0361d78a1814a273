# SPDX-License-Identifier: GPL-3.0-or-later
"""A volume that emits light has a bulb of its own on the dial."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon import compat  # noqa: E402
from blender_addon.editing.dial import kept_mix  # noqa: E402
from blender_addon.editing.dial.paths import transport_path  # noqa: E402
from blender_addon.editing.dial.recording import told  # noqa: E402
from spectral_core.scene import Note  # noqa: E402


@pytest.fixture
def glowing(stage):
    """The stage with a cube that a Principled Volume fills."""
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, -1.5, 1))
    bpy.context.object.name = "Cloud"
    made = bpy.data.materials.new("Cloud")
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Emission Strength"].default_value = 2.0
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    bpy.context.object.data.materials.append(made)
    bpy.ops.spectral.dial_record()
    return stage.spectral.dial


def test_a_recording_with_a_volume_is_loaded_again(glowing):
    assert [bulb.name for bulb in glowing.bulbs] == ["Ball", "Cloud", "Fill", "Key", "World"]
    path = transport_path(glowing)
    kept_mix._sessions.clear()
    assert bpy.ops.spectral.dial_load(filepath=str(path)) == {"FINISHED"}
    assert [bulb.name for bulb in glowing.bulbs] == ["Ball", "Cloud", "Fill", "Key", "World"]


def test_apply_dims_both_emissions_of_a_volume(glowing):
    cloud = bpy.data.materials["Cloud"].node_tree
    inputs = cloud.nodes["Principled Volume"].inputs
    key = bpy.data.objects["Key"].data
    inputs["Blackbody Intensity"].default_value = 0.5
    bpy.ops.spectral.dial_record()
    before, glowing.intensity = key.energy, 2.5 * len(glowing.bulbs)
    assert bpy.ops.spectral.dial_apply() == {"FINISHED"}
    assert inputs["Emission Strength"].default_value == pytest.approx(2.0 * 2.5)
    assert inputs["Blackbody Intensity"].default_value == pytest.approx(0.5 * 2.5)
    assert key.energy == pytest.approx(before * 2.5)


def test_apply_dims_a_computed_blackbody(glowing):
    cloud = bpy.data.materials["Cloud"].node_tree
    value = cloud.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 0.7
    target = cloud.nodes["Principled Volume"].inputs["Blackbody Intensity"]
    cloud.links.new(value.outputs[0], target)
    bpy.ops.spectral.dial_record()
    for factor in (2.0, 3.0):
        glowing.intensity = factor * len(glowing.bulbs)
        bpy.ops.spectral.dial_apply()
        dimmer = target.links[0].from_node
        assert dimmer.inputs[0].links[0].from_node == value
        assert dimmer.inputs[1].default_value == pytest.approx(factor)


def test_the_notes_of_a_recording_are_told():
    notes = [Note(f"Thing {number}", "is rendered plain") for number in range(5)]
    assert told(notes[:1]) == "; Thing 0: is rendered plain"
    assert told(notes).endswith("; Thing 2: is rendered plain; and 2 more notes")
    assert told(()) == ""
