# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of curves, texts, metaballs and geometry nodes: a render leaves no memory of Blender behind."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("bpy")
pytest.importorskip("mitsuba")

SCRIPT = """
import bpy, blender_addon
blender_addon.register()
scene = bpy.context.scene
for obj in list(bpy.data.objects):
    bpy.data.objects.remove(obj)
bpy.ops.curve.primitive_bezier_circle_add()
bpy.context.object.data.bevel_depth = 0.2
bpy.ops.object.text_add()
bpy.ops.object.metaball_add()
bpy.ops.mesh.primitive_cube_add()
bpy.ops.mesh.primitive_plane_add()
tree = bpy.data.node_groups.new("g", "GeometryNodeTree")
tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
names = "GeometryNodeMeshCube", "GeometryNodeMeshGrid", "GeometryNodeInstanceOnPoints", "NodeGroupOutput"
cube, grid, place, output = (tree.nodes.new(name) for name in names)
tree.links.new(grid.outputs[0], place.inputs["Points"])
tree.links.new(cube.outputs[0], place.inputs["Instance"])
tree.links.new(place.outputs[0], output.inputs[0])
bpy.context.object.modifiers.new("g", "NODES").node_group = tree
bpy.ops.object.camera_add(location=(0, 0, 6))
scene.camera = bpy.context.object
scene.render.engine = "SPECTRAL"
scene.spectral.render.samples, scene.spectral.render.transport = 1, "RGB"
scene.render.resolution_x = scene.render.resolution_y = 8
scene.render.use_simplify = scene.cycles.use_camera_cull = scene.render.use_motion_blur = True
assert bpy.ops.render.render() == {"FINISHED"}
"""


def test_a_render_leaves_no_memory_behind():
    """Blender counts its blocks at exit."""
    ended = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=300)
    told = ended.stdout + ended.stderr
    assert ended.returncode == 0, told
    assert "Not freed memory" not in told
