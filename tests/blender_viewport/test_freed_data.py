# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that geometry nodes name are deleted, replaced or loaded anew: nothing refers to the freed copy any more.

Without the handler Blender reads freed memory here, which ends the process: each case runs in a process of its own.
"""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

pytest.importorskip("bpy")

SCENE = """
    import sys, tempfile
    from pathlib import Path

    import bpy

    import blender_addon

    blender_addon.register_once()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    kind, way = sys.argv[1:]

    def placed(name, material=None):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        mesh.materials.append(material)
        made = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(made)
        return made

    lists = {"materials": "Material", "objects": "Object", "collections": "Collection"}
    named, spare = bpy.data.materials.new("Named"), bpy.data.materials.new("Spare")
    if kind == "objects":
        named, spare = placed("Named", named), placed("Spare", spare)
    if kind == "collections":
        inside = placed("Inside", named)
        named, spare = bpy.data.collections.new("Named"), bpy.data.collections.new("Spare")
        for each in (named, spare):
            bpy.context.scene.collection.children.link(each)
        named.objects.link(inside)
    if way == "reload":
        path, other = (str(Path(tempfile.mkdtemp()) / name) for name in ("a.blend", "b.blend"))
        bpy.data.libraries.write(path, {named})
        named.name = "Renamed"
        bpy.data.libraries.write(other, {named})
        with bpy.data.libraries.load(path, link=True) as (_there, here):
            setattr(here, kind, ["Named"])
        named = getattr(here, kind)[0]

    group = bpy.data.node_groups.new("Made", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    node = group.nodes.new({"materials": "GeometryNodeSetMaterial", "objects": "GeometryNodeObjectInfo",
                            "collections": "GeometryNodeCollectionInfo"}[kind])
    node.inputs[lists[kind]].default_value = named
    if kind == "materials":
        group.links.new(start.outputs[0], node.inputs[0])
    if kind == "objects":
        node.inputs["As Instance"].default_value = True
    group.links.new(node.outputs["Instances" if kind == "collections" else "Geometry"], end.inputs[0])
    host = placed("Host")
    host.modifiers.new("Made", "NODES").node_group = group
    layer = bpy.context.view_layer
    layer.update()
    evaluations = []
    bpy.app.handlers.depsgraph_update_post.append(lambda *_: evaluations.append(1))
    if way == "reload":
        named.library.filepath = other
        named.library.reload()
    elif way == "replace":
        named.user_remap(spare)
    else:
        getattr(bpy.data, kind).remove(named)
    layer.update()
    graph = layer.depsgraph
    known = {each.evaluated_get(graph).as_pointer() for each in [*bpy.data.materials, *bpy.data.objects]}
    used = []
    for instance in graph.object_instances:
        if instance.is_instance:
            assert instance.instance_object.as_pointer() in known
        used += [slot.material.as_pointer() for slot in instance.object.material_slots if slot.material is not None]
    assert set(used) <= known, (used, known)
    print("read", len(evaluations))
"""


@pytest.mark.parametrize("way", ("delete", "replace", "reload"))
@pytest.mark.parametrize("kind", ("materials", "objects", "collections"))
def test_evaluated_geometry_refers_to_no_freed_data(kind, way):
    program = [sys.executable, "-c", textwrap.dedent(SCENE), kind, way]
    done = subprocess.run(program, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "read" in done.stdout


IDLE = """
    import bpy

    import blender_addon

    blender_addon.register_once()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    group = bpy.data.node_groups.new("Made", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    node = group.nodes.new("GeometryNodeSetMaterial")
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], node.inputs[0])
    group.links.new(node.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.modifiers.new("Made", "NODES").node_group = group
    layer = bpy.context.view_layer
    layer.update()
    from blender_addon.editing.viewport import freed

    tagged = []
    bpy.app.handlers.depsgraph_update_post.append(lambda _scene, graph: tagged.append(freed.is_evaluated_again(graph)))
    group.update_tag()
    layer.update()
    node.inputs["Material"].default_value = bpy.data.materials.new("Set by the artist")
    layer.update()
    assert tagged and not any(tagged), tagged
"""


def test_other_edits_of_geometry_nodes_are_evaluated_once():
    """A tree that names the same data, and one whose objects Blender has evaluated itself."""
    program = [sys.executable, "-c", textwrap.dedent(IDLE)]
    done = subprocess.run(program, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
