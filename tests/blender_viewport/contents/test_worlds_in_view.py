# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds whose nodes use the camera's space or frame: a view shows what F12 shows, and follows the camera."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import updated  # noqa: E402


@pytest.fixture
def seen(coarse):
    """The scene with a camera and a world, and its view."""
    stage = coarse
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -8, 4), (1.1, 0, 0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:  # before Blender 5
        world.use_nodes = True
    stage.background = world.node_tree.nodes["Background"]
    return stage


def by_coordinates(stage, name):
    tree = stage.background.id_data
    node = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(node.outputs[name], stage.background.inputs["Color"])


def in_a_group(stage, name):
    group = bpy.data.node_groups.new("Placed", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    node, end = group.nodes.new("ShaderNodeTexCoord"), group.nodes.new("NodeGroupOutput")
    group.links.new(node.outputs[name], end.inputs[0])
    tree = stage.background.id_data
    made = tree.nodes.new("ShaderNodeGroup")
    made.node_tree = group
    tree.links.new(made.outputs[0], stage.background.inputs["Color"])


def by_camera_data(stage, name):
    tree = stage.background.id_data
    node = tree.nodes.new("ShaderNodeCameraData")
    tree.links.new(node.outputs[name], stage.background.inputs["Color"])


USES = {
    "Window": by_coordinates, "Camera": by_coordinates, "Window in a group": in_a_group,
    "View Vector": by_camera_data,
}  # fmt: skip
MOVES = {
    "turned": lambda camera: setattr(camera, "rotation_euler", (1.3, 0, 0.6)),
    "lens": lambda camera: setattr(camera.data, "lens", 20.0),
    "moved": lambda camera: setattr(camera, "location", (3, -5, 2)),
}


def environments(stage):
    """Pixels of the environment that the view has, and of the one that F12 renders."""
    from blender_addon.translate.scene import translate_scene

    sent = next(iter(stage.link.scenes.values()))
    rendered = translate_scene(bpy.context.evaluated_depsgraph_get())
    return sent.world.color.pixels, rendered.world.color.pixels


@pytest.mark.parametrize("name", USES)
def test_a_world_by_the_camera_is_that_of_f12(seen, name):
    updated(seen, lambda stage: USES[name](stage, name.partition(" in ")[0]))
    np.testing.assert_array_equal(*environments(seen))
    before = environments(seen)[0]
    changed = False
    for move in MOVES.values():
        updated(seen, lambda stage, move=move: move(bpy.context.scene.camera))
        np.testing.assert_array_equal(*environments(seen))
        changed |= not np.array_equal(before, environments(seen)[0])
    assert changed
    notes = [note.message for note in next(iter(seen.link.scenes.values())).notes]
    assert any("of the scene's camera" in message for message in notes)


def test_an_edit_of_something_else_draws_no_environment_again(seen, monkeypatch):
    from blender_addon.translate import scene as scenes

    updated(seen, lambda stage: by_coordinates(stage, "Window"))
    drawn = []
    translated = scenes.translate_world
    monkeypatch.setattr(
        scenes, "translate_world", lambda *given, **settings: drawn.append(1) or translated(*given, **settings)
    )
    updated(seen, lambda _stage: setattr(bpy.data.lights["Lamp"], "energy", 55))
    assert drawn == []
    updated(seen, lambda _stage: setattr(bpy.context.scene.camera, "location", (1, 1, 1)))
    assert drawn == [1]


def test_a_view_of_a_scene_without_a_camera_shows_such_a_world(seen):
    updated(seen, lambda stage: by_coordinates(stage, "Camera"))
    updated(seen, lambda _stage: bpy.data.objects.remove(bpy.context.scene.camera))
    assert next(iter(seen.link.scenes.values())).world.color.pixels.any()
