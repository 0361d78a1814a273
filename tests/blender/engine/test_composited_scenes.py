# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that the compositor of another scene shows are rendered in the size and the border of that scene."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")
pytestmark = pytest.mark.skipif(bpy.app.version < (5, 0), reason="its compositor has another tree")


def composited(scene, other):
    """The compositor of a scene shows another one."""
    tree = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("NodeGroupOutput")
    layers.scene = other
    tree.links.new(layers.outputs["Image"], output.inputs[0])
    scene.compositing_node_group = tree


@pytest.mark.parametrize(("size", "percentage", "bordered"), [(32, 100, False), (16, 50, False), (16, 100, True)])
def test_another_scene_has_the_size_of_the_one_that_shows_it(build, tmp_path, size, percentage, bordered):
    from blender_addon import jobs

    scene, other = bpy.context.scene, bpy.data.scenes.new("Other")
    other.collection.objects.link(build.plane(material=build.material(shader="ShaderNodeEmission")))
    other.camera = scene.camera = build.camera((0, 0, 1))
    other.collection.objects.link(other.camera)
    for each in (scene, other):
        each.render.engine, each.spectral.render.samples = "SPECTRAL", 1
        each.render.resolution_x, each.render.resolution_y, each.render.resolution_percentage = 16, 8, 100
    other.render.resolution_x, other.render.resolution_percentage = size, percentage
    scene.render.use_border = scene.render.use_crop_to_border = bordered
    scene.render.border_max_x = 0.5
    composited(scene, other)
    scene.render.filepath = str(tmp_path / "picture.png")
    jobs.records.clear()
    bpy.ops.render.render(write_still=True)
    assert [record.status for record in jobs.records] == ["done"] * len(jobs.records) != []
    shapes = {record.result.pixels.shape[:2] for record in jobs.records}
    assert shapes == {(8, 8 if bordered else 16)}
