# SPDX-License-Identifier: GPL-3.0-or-later
"""Relative paths in a linked library count from the library's folder."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

IES = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 100\n0 45 90\n0\n100 50 0\n"


def test_an_ies_file_of_a_linked_lamp_is_read_beside_its_library(build, translate, tmp_path):
    (tmp_path / "library").mkdir()
    (tmp_path / "library/lamp.ies").write_text(IES)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    if hasattr(lamp, "use_nodes"):
        lamp.use_nodes = True
    nodes = lamp.node_tree.nodes
    node, emission = nodes.new("ShaderNodeTexIES"), next(each for each in nodes if each.type == "EMISSION")
    node.mode, node.filepath = "EXTERNAL", "//lamp.ies"
    lamp.node_tree.links.new(node.outputs[0], emission.inputs["Strength"])
    library = str(tmp_path / "library/lamps.blend")
    bpy.data.libraries.write(library, {bpy.data.objects.new("Lamp", lamp)}, path_remap="NONE")
    bpy.data.lights.remove(lamp)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.objects = ["Lamp"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    scene = translate()
    assert [note.message for note in scene.notes if "cannot be read" in note.message] == []
    assert len(scene.lights) == 1
