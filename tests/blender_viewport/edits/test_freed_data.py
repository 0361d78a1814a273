# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that geometry nodes name are deleted, replaced or loaded anew: nothing refers to the freed copy any more.

Without the handler Blender reads freed memory here, which ends the process: the cases run in a process of their own.
"""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

pytest.importorskip("bpy")

PROGRAM = """
    import sys, tempfile, traceback
    from pathlib import Path

    import bpy

    import blender_addon

    blender_addon.register_once()
    from blender_addon.editing.viewport import freed

    def placed(name, material=None):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        mesh.materials.append(material)
        made = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(made)
        return made


    def case(kind, way):
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
        assert evaluations


    def idle():
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
        tagged = []
        told = lambda _scene, graph: tagged.append(freed.is_evaluated_again(graph))
        bpy.app.handlers.depsgraph_update_post.append(told)
        group.update_tag()
        layer.update()
        node.inputs["Material"].default_value = bpy.data.materials.new("Set by the artist")
        layer.update()
        assert tagged and not any(tagged), tagged


    def tried(test, *given):
        bpy.ops.wm.read_factory_settings(use_empty=True)  # which removes the handlers of the case before
        try:
            test(*given)
        except Exception:
            traceback.print_exc()
        else:
            print("passed", *given, flush=True)


    for kind in ("materials", "objects", "collections"):
        for way in ("delete", "replace", "reload"):
            tried(case, kind, way)
    tried(idle)
"""


@pytest.fixture(scope="module")
def passed():
    """What the process printed, with a line for each case that passed."""
    program = [sys.executable, "-c", textwrap.dedent(PROGRAM)]
    done = subprocess.run(program, capture_output=True, text=True, check=False, timeout=300)
    return f"{done.stdout}{done.stderr}\nstatus {done.returncode}"


@pytest.mark.parametrize("way", ("delete", "replace", "reload"))
@pytest.mark.parametrize("kind", ("materials", "objects", "collections"))
def test_evaluated_geometry_refers_to_no_freed_data(passed, kind, way):
    assert f"passed {kind} {way}" in passed.splitlines(), passed


def test_other_edits_of_geometry_nodes_are_evaluated_once(passed):
    """A tree that names the same data, and one whose objects Blender has evaluated itself."""
    assert "passed" in passed.splitlines(), passed
