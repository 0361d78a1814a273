# SPDX-License-Identifier: GPL-3.0-or-later
"""A volume that emits light has a bulb of its own on the dial."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon import compat  # noqa: E402
from blender_addon.editing.dial import live  # noqa: E402
from blender_addon.editing.dial.paths import transport_path  # noqa: E402


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
    live._sessions.clear()
    assert bpy.ops.spectral.dial_load(filepath=str(path)) == {"FINISHED"}
    assert [bulb.name for bulb in glowing.bulbs] == ["Ball", "Cloud", "Fill", "Key", "World"]


def test_apply_names_the_volume_whose_strength_it_cannot_write(glowing):
    key = bpy.data.objects["Key"].data
    before, glowing.intensity = key.energy, 2.0
    with pytest.raises(RuntimeError, match="no light of this scene is known as 'Cloud'"):
        bpy.ops.spectral.dial_apply()
    assert key.energy == before
