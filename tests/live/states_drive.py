# SPDX-License-Identifier: GPL-3.0-or-later
# ruff: noqa: E402
"""Runs inside a Blender with a window: Rendered mode in unusual states, what it then shows, and if that is stale.

``blender --python states_drive.py``; SPECTRAL_PATHS holds folders for sys.path, SPECTRAL_OUT a folder for pictures
of the screen (made by ImageMagick's ``import``; none without it), SPECTRAL_ONLY names of steps. Each state is
compared with a whole translation; the mean of its picture shows if it is empty.
"""

import os
import sys
import traceback
from pathlib import Path

sys.path[:0] = [path for path in os.environ.get("SPECTRAL_PATHS", "").split(os.pathsep) if path]

import bmesh
import bpy

import blender_addon
from benchmarks.viewport.window import inside
from benchmarks.viewport.window.inside import area, in_view, space
from benchmarks.viewport.window.view_states import told, told_of

blender_addon.register_once()
bpy.context.preferences.view.show_splash = False
ONLY = os.environ.get("SPECTRAL_ONLY", "").split(",")


def build():
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.spectral.viewport.samples = 4
    scene.render.resolution_x, scene.render.resolution_y = 320, 180
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(2.5, 0, 1), segments=24, ring_count=12)
    paint = bpy.data.materials.new("Paint")
    if paint.node_tree is None:
        paint.use_nodes = True
    bpy.data.objects["Sphere"].data.materials.append(paint)
    bpy.data.objects["Cube"].location = (0, 0, 1)
    bpy.data.lights["Light"].energy = 1000
    space().shading.type = "RENDERED"


def active(name):
    with in_view():
        if bpy.context.object is not None and bpy.context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = bpy.data.objects[name]
    bpy.data.objects[name].select_set(True)
    return bpy.data.objects[name]


def mode(name, kind):
    active(name)
    with in_view():
        bpy.ops.object.mode_set(mode=kind)


def edit_mode():
    mode("Cube", "EDIT")
    mesh = bpy.data.objects["Cube"].data
    editor = bmesh.from_edit_mesh(mesh)
    for vertex in editor.verts:
        vertex.co.z *= 2
    bmesh.update_edit_mesh(mesh)


def sculpt_mode():
    mode("Sphere", "SCULPT")
    with in_view():
        bpy.ops.sculpt.mesh_filter(type="INFLATE", strength=1.0, start_mouse=(0, 0))


def subdivided():
    active("Cube").modifiers.new("Subdivision", "SUBSURF").levels = 3


def geometry_nodes():
    """The cube becomes a row of cubes, made by nodes."""
    group = bpy.data.node_groups.new("Row", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    line, spread = group.nodes.new("GeometryNodeMeshLine"), group.nodes.new("GeometryNodeInstanceOnPoints")
    line.inputs["Count"].default_value = 5
    line.inputs["Offset"].default_value = (0, 0.8, 0)
    group.links.new(line.outputs[0], spread.inputs["Points"])
    group.links.new(start.outputs[0], spread.inputs["Instance"])
    group.links.new(spread.outputs[0], end.inputs[0])
    active("Cube").modifiers.clear()
    bpy.data.objects["Cube"].scale = (0.3, 0.3, 0.3)
    bpy.data.objects["Cube"].modifiers.new("Row", "NODES").node_group = group


def nodes_edited():
    line = next(node for node in bpy.data.node_groups["Row"].nodes if node.bl_idname == "GeometryNodeMeshLine")
    line.inputs["Count"].default_value = 9


def particles():
    """Hair on the sphere, in Particle Edit."""
    ball = active("Sphere")
    ball.modifiers.new("Hair", "PARTICLE_SYSTEM")
    hair = ball.particle_systems[0].settings
    hair.type, hair.count, hair.hair_length = "HAIR", 200, 0.5
    with in_view():
        bpy.ops.particle.particle_edit_toggle()


def local_view():
    active("Sphere")
    with in_view():
        bpy.ops.view3d.localview(frame_selected=False)


def linked():
    path = Path(bpy.app.tempdir) / "library.blend"
    bpy.data.libraries.write(str(path), {bpy.data.objects["Sphere"]})
    with bpy.data.libraries.load(str(path), link=True) as (there, here):
        here.objects = list(there.objects)
    for obj in here.objects:
        if obj is not None:
            bpy.context.scene.collection.objects.link(obj)
            made = obj.override_create()
            made.location = (-2.5, 0, 1)
            bpy.context.scene.collection.objects.link(made)


def huge():
    active("Sphere")
    with in_view():
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=4, location=(0, 0, 3))


def border(use):
    view = space()
    view.use_render_border = use
    view.render_border_min_x, view.render_border_max_x = 0.3, 0.6
    view.render_border_min_y, view.render_border_max_y = 0.4, 0.8


def camera_border(use):
    render = bpy.context.scene.render
    space().region_3d.view_perspective = "CAMERA"
    render.use_border, render.border_min_x, render.border_max_x = use, 0.0, 0.5
    render.border_min_y, render.border_max_y = 0.5, 1.0


def new_window():
    with in_view():
        bpy.ops.wm.window_new()
    screen = bpy.context.window_manager.windows[-1].screen
    other = next(each for each in screen.areas if each.type == "VIEW_3D") if screen.areas else None
    if other is not None:
        other.spaces.active.shading.type = "RENDERED"


def close_window():
    window = bpy.context.window_manager.windows[-1]
    with bpy.context.temp_override(window=window):
        bpy.ops.wm.window_close()


def quad():
    with in_view():
        bpy.ops.screen.region_quadview()


def play():
    ball = bpy.data.objects["Sphere"]
    for frame, height in ((1, 1.0), (20, 3.0)):
        ball.location.z = height
        ball.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_end = 20
    with in_view():
        bpy.ops.screen.animation_play()


def stop():
    with in_view():
        bpy.ops.screen.animation_cancel(restore_frame=False)


def emptied():
    for block in list(bpy.data.objects):
        bpy.data.objects.remove(block)


def no_lights():
    for block in [each for each in bpy.data.objects if each.type == "LIGHT"]:
        bpy.data.objects.remove(block)
    bpy.context.scene.world = None


def no_camera():
    space().region_3d.view_perspective = "PERSP"
    bpy.data.objects.remove(bpy.data.objects["Camera"])


STEPS = {
    "first": lambda: None,
    "edit mode": edit_mode,
    "object mode": lambda: active("Cube"),
    "sculpt mode": sculpt_mode,
    "subdivided": subdivided,
    "subdivided edit mode": lambda: mode("Cube", "EDIT"),
    "geometry nodes": geometry_nodes,
    "nodes edited": nodes_edited,
    "particle edit": particles,
    "hidden": lambda: (active("Sphere"), bpy.data.objects["Sphere"].hide_set(True)),
    "shown again": lambda: bpy.data.objects["Sphere"].hide_set(False),
    "local view": local_view,
    "whole view": local_view,
    "linked": linked,
    "border": lambda: border(True),
    "no border": lambda: border(False),
    "camera border": lambda: camera_border(True),
    "camera": lambda: camera_border(False),
    "quad view": quad,
    "one view": quad,
    "two windows": new_window,
    "edited in both": lambda: setattr(bpy.data.objects["Sphere"], "location", (2, 1, 1)),
    "one window": close_window,
    "playing": play,
    "stopped": stop,
    "huge mesh": huge,
    "no camera": no_camera,
    "no lights": no_lights,
    "empty": emptied,
}  # fmt: skip


def drive():
    yield 1.0
    build()
    assert area() is not None
    for name, step in STEPS.items():
        if ONLY != [""] and name not in (*ONLY, "first"):
            continue
        try:
            step()
        except Exception:
            told["errors"].append(f"{name}: {traceback.format_exc(limit=4)}")
            continue
        yield from told_of(name, name != "playing")


inside.drive(drive(), told)
