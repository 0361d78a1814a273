# SPDX-License-Identifier: GPL-3.0-or-later
"""Imported sequences: their transfer functions, and their files."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def test_the_preset_of_a_sequence_that_begins_empty_spans_its_data(blender, tmp_path):
    """It was fitted to the first frame, and stretched from there: half of the data were brightest."""
    from blender_addon.translate.scene import translate_scene
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume

    for number, top in enumerate((0.0, 4.0, 10.0), 1):
        values = np.linspace(0.0, top, 60, dtype=np.float32).reshape(5, 4, 3)
        write_volume(ScalarVolume("plume", values), tmp_path / f"plume_{number:04d}.nrrd")
    path = str(tmp_path / "plume_0001.nrrd")
    assert bpy.ops.spectral.volume_import(filepath=path, sequence=True, preset="xray") == {"FINISHED"}
    thing = bpy.context.object
    assert list(thing.data["spectral_range"]) == [0.0, 10.0]
    bpy.context.scene.frame_set(3)
    (material,) = translate_scene(bpy.context.evaluated_depsgraph_get()).volumes[0].transfer.materials
    np.testing.assert_allclose(material.values, [1.0, 10.0], rtol=2e-3)
    bpy.context.scene.frame_set(7)
    (note,) = (
        note.message
        for note in translate_scene(bpy.context.evaluated_depsgraph_get()).notes
        if "no file for this frame" in note.message
    )
    assert ": ;" not in note


def test_a_changed_sequence_leaves_the_files_of_an_earlier_import(blender, tmp_path):
    """Only single files had names by their version: the earlier volume showed the voxels of the changed frames."""
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import read_volume, write_volume

    def imported(level: float):
        for number in (1, 2):
            values = np.full((3, 4, 5), number * level, np.float32)
            write_volume(ScalarVolume("plume", values), tmp_path / f"plume_{number:04d}.nrrd")
        path = str(tmp_path / "plume_0001.nrrd")
        assert bpy.ops.spectral.volume_import(filepath=path, sequence=True) == {"FINISHED"}
        return bpy.context.object.data

    earlier = bpy.path.abspath(imported(1.0).filepath)
    later = bpy.path.abspath(imported(7.0).filepath)
    assert [read_volume(path).data.max() for path in (earlier, later)] == [1.0, 7.0]


def test_changed_voxels_of_an_unchanged_header_leave_the_file_of_an_earlier_import(blender, tmp_path):
    from spectral_core.volume.files import read_volume

    header = ("NRRD0004", "type: uint8", "dimension: 3", "sizes: 2 2 2", "encoding: raw", "data file: head.raw", "")
    (tmp_path / "head.nhdr").write_text("\n".join(header))
    paths = []
    for level in (1, 7):
        (tmp_path / "head.raw").write_bytes(bytes([level] * 8))
        assert bpy.ops.spectral.volume_import(filepath=str(tmp_path / "head.nhdr")) == {"FINISHED"}
        paths.append(bpy.path.abspath(bpy.context.object.data.filepath))
    assert [read_volume(path).data.max() for path in paths] == [1, 7]


def test_smoke_whose_first_frame_holds_no_voxels(blender, tmp_path):
    """The import ended with "no active voxel". The size and the place of the object are those of the smoke."""
    from blender_addon.translate.scene import translate_scene
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb = find_openvdb()
    if openvdb is None:
        pytest.skip("needs OpenVDB's module")
    values = np.linspace(1.0, 5.0, 64, dtype=np.float32).reshape(4, 4, 4)
    for number in (1, 2):
        grid = openvdb.FloatGrid(0.0)
        grid.name = "density"
        if number == 2:
            grid.copyFromArray(values)
        openvdb.write(str(tmp_path / f"smoke_{number:04d}.vdb"), grids=[grid])
    path = str(tmp_path / "smoke_0001.vdb")
    assert bpy.ops.spectral.volume_import(filepath=path, sequence=True, preset="xray", size=2.0) == {"FINISHED"}
    thing = bpy.context.object
    assert list(thing.data["spectral_range"]) == [0.0, 5.0] and thing.scale[0] == pytest.approx(0.5)
    for number, shape in ((1, (1, 1, 1)), (2, (4, 4, 4))):
        bpy.context.scene.frame_set(number)
        scene = translate_scene(bpy.context.evaluated_depsgraph_get())
        assert scene.volumes[0].data.shape == shape and not [n for n in scene.notes if n.subject == thing.name]


def test_the_frames_of_a_sequence_of_blenders_own_share_the_range_of_a_preset(blender, tmp_path):
    """Each frame had curves of its own: smoke that fades to a sixteenth kept its density."""
    from blender_addon.translate.scene import translate_scene
    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb = find_openvdb()
    if openvdb is None:
        pytest.skip("needs OpenVDB's module")
    for number, top in ((1, 8.0), (2, 4.0), (4, 0.5)):  # frame 3 is missing
        grid = openvdb.FloatGrid(0.0)
        grid.name = "density"
        grid.copyFromArray(np.linspace(0.0, top, 64, dtype=np.float32).reshape(4, 4, 4).copy())
        openvdb.write(str(tmp_path / f"smoke_{number:04d}.vdb"), grids=[grid])
    (tmp_path / "smoke_0005.vdb").write_bytes(b"a frame that is being baked")
    data = bpy.data.volumes.new("smoke")
    data.filepath, data.is_sequence, data.frame_duration = str(tmp_path / "smoke_0001.vdb"), True, 5
    thing = bpy.data.objects.new("smoke", data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing

    def shown(frame: int):
        bpy.context.scene.frame_set(frame)
        scene = translate_scene(bpy.context.evaluated_depsgraph_get())
        return list(scene.volumes[0].transfer.materials[0].values), [note.message for note in scene.notes]

    assert bpy.ops.spectral.volume_material_add() == {"FINISHED"}
    assert any("ends of its curves" in note for note in shown(1)[1])
    assert bpy.ops.spectral.transfer_preset(preset="xray") == {"FINISHED"}
    assert list(data["spectral_range"]) == [0.0, 8.0]
    first, notes = shown(1)
    assert first == shown(2)[0] == shown(4)[0] == pytest.approx([0.8, 8.0], rel=2e-3)
    assert not any("ends of its curves" in note for note in notes)
    data.spectral.grid = "heat"  # has a range of its own
    assert "spectral_range" not in data
