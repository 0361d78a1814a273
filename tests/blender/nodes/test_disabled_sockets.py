# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets of output nodes that a script has disabled: Blender does not find them by their names."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from spectral_core.scene import Film  # noqa: E402


def _tree(owner):
    from blender_addon import compat

    return compat.use_nodes(owner)


def test_disabled_inputs_of_output_nodes_count_as_unlinked(blender):
    """They count as unlinked. The render ended with ``KeyError: ... key "Surface" not found``."""
    from blender_addon.translate.scene import translate_scene

    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    world, paint = bpy.data.worlds.new("World"), bpy.data.materials.new("Paint")
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.world = world
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(paint)
    for each in (scene.camera, lamp):
        scene.collection.objects.link(each)
    trees = [_tree(each) for each in (world, paint, lamp.data)]
    tint = trees[0].nodes.new("ShaderNodeMapping")
    sky = trees[0].nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.new("Sky", 4, 2)
    trees[0].links.new(tint.outputs[0], sky.inputs["Vector"])
    shader = next(node for node in trees[0].nodes if node.type == "BACKGROUND")
    trees[0].links.new(sky.outputs[0], shader.inputs["Color"])
    aov = trees[1].nodes.new("ShaderNodeOutputAOV")
    aov.aov_name = "Mask"
    scene.view_layers[0].aovs.add().name = "Mask"
    film = Film(8, 8)
    before = translate_scene(bpy.context.evaluated_depsgraph_get(), film=film)
    for tree in trees:
        for node in tree.nodes:
            if node.type.startswith("OUTPUT") or node in (tint, aov):
                for socket in node.inputs:
                    socket.enabled = False
    assert "Surface" not in next(node for node in trees[1].nodes if node.type == "OUTPUT_MATERIAL").inputs
    for owner in (world, paint, lamp.data):
        owner.update_tag()
    after = translate_scene(bpy.context.evaluated_depsgraph_get(), film=film)
    shown = [float(np.max(each.surface.color.linear_rgb)) for each in after.materials]
    assert len(before.lights) == 1
    assert after.world is not None and before.world is not None and before.world.strength == 1.0
    assert (shown, after.lights, after.world.strength) == ([0.0], (), 0.0), "as without links"
