# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of an animation in a view: what Blender evaluates anew is translated anew, and nothing else of the meshes."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from blender_addon.editing.viewport.stages import Stage
from blender_addon.translate.scene import translate_scene
from spectral_core.scene import Camera

EYE = Camera(world_from_camera=np.eye(4))


def ball(name):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    bpy.context.object.name = bpy.context.object.data.name = name
    return bpy.context.object


def waving():
    ball("waving").modifiers.new("Wave", "WAVE")


def shaped():
    found = ball("shaped")
    found.shape_key_add(name="rest")
    key = found.shape_key_add(name="stretched")
    for point in key.data:
        point.co.z *= 2.0
    for frame, value in ((1, 0.0), (5, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)


def boned():
    armature = bpy.data.objects.new("bones", bpy.data.armatures.new("bones"))
    bpy.context.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("bone")
    bone.tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    found = ball("boned")
    found.vertex_groups.new(name="bone").add(range(len(found.data.vertices)), 1.0, "REPLACE")
    found.modifiers.new("Armature", "ARMATURE").object = armature
    pose = armature.pose.bones["bone"]
    for frame, x in ((1, 0.0), (5, 1.0)):
        pose.location.x = x
        pose.keyframe_insert("location", frame=frame)


def timed():
    """Geometry nodes that read the scene's time."""
    found = ball("timed")
    tree = bpy.data.node_groups.new("timed", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    begin, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    place, clock = tree.nodes.new("GeometryNodeSetPosition"), tree.nodes.new("GeometryNodeInputSceneTime")
    tree.links.new(begin.outputs[0], place.inputs["Geometry"])
    tree.links.new(clock.outputs["Seconds"], place.inputs["Offset"])
    tree.links.new(place.outputs[0], end.inputs[0])
    found.modifiers.new("Nodes", "NODES").node_group = tree


def driven():
    """A modifier's number that a driver reads from the frame."""
    strength = ball("driven").modifiers.new("Cast", "CAST").driver_add("factor").driver
    strength.expression = "frame / 10"


@pytest.mark.parametrize("animate", [waving, shaped, boned, timed, driven])
def test_animated_meshes_follow_the_frame_and_the_others_stay(blender, animate):
    ball("still")
    animate()
    scene = bpy.context.scene
    depsgraph = bpy.context.evaluated_depsgraph_get()
    stage, before = Stage(), {}
    collected = []

    @bpy.app.handlers.persistent
    def follow(_scene, depsgraph):
        stage.keep_up(depsgraph)
        collected.append(translate_scene(depsgraph, seen_from=EYE, kept=stage.kept))

    bpy.app.handlers.frame_change_post.append(follow)
    try:
        for frame in (1, 2, 4, 5, 2):
            scene.frame_set(frame)
            kept = {mesh.name: mesh for mesh in collected[-1].meshes}
            fresh = {mesh.name: mesh for mesh in translate_scene(depsgraph, seen_from=EYE).meshes}
            assert kept.keys() == fresh.keys()
            for name, mesh in fresh.items():
                np.testing.assert_array_equal(kept[name].positions, mesh.positions, err_msg=f"{name} in frame {frame}")
            if before:
                assert kept["still"] is before["still"], "it was translated again"
                moved = animate.__name__
                assert not np.array_equal(kept[moved].positions, before[moved].positions)
            before = kept
    finally:
        bpy.app.handlers.frame_change_post.remove(follow)
