# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB files with several grids of one name: the first is shown, as Blender does, and a note says so."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_core.volume.files.formats.openvdb_format import find_openvdb

bpy = pytest.importorskip("bpy")


def test_the_first_of_several_grids_is_shown_with_a_note(blender, tmp_path):
    from blender_addon.translate.scene import translate_scene

    openvdb, made = find_openvdb(), []
    if openvdb is None:
        pytest.skip("needs OpenVDB's module")
    for level in (1.0, 5.0):
        grid = openvdb.FloatGrid(0.0)
        grid.copyFromArray(np.linspace(0.5, level, 60, dtype=np.float32).reshape(5, 4, 3))
        grid.name = "density"
        made.append(grid)

    def shown(grids):
        path = tmp_path / f"grids{len(grids)}.vdb"
        openvdb.write(str(path), grids=grids)
        data = bpy.data.volumes.new("smoke")
        data.filepath = str(path)
        thing = bpy.data.objects.new("smoke", data)
        bpy.context.scene.collection.objects.link(thing)
        bpy.context.view_layer.objects.active = thing
        assert bpy.ops.spectral.volume_material_add() == {"FINISHED"}
        assert bpy.ops.spectral.transfer_preset(preset="xray") == {"FINISHED"}
        scene = translate_scene(bpy.context.evaluated_depsgraph_get())
        notes = [note.message for note in scene.notes if note.subject == thing.name]
        greatest = scene.volumes[-1].data.max()
        bpy.data.objects.remove(thing)
        return greatest, any("several grids named 'density'" in note for note in notes)

    assert shown(made) == (1.0, True)
    assert shown(made[1:]) == (5.0, False)
