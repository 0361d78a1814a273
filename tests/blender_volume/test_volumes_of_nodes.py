# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions on Volume objects whose grids are made by geometry nodes."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from tests.blender_volume.test_volume_objects import _openvdb, translated  # noqa: F401 - a fixture


def with_cube(thing: Any) -> Any:
    """The object with nodes that make a grid of 6 × 7 × 8 voxels, of density 0.5."""
    tree = bpy.data.node_groups.new("Grid", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    made, out = tree.nodes.new("GeometryNodeVolumeCube"), tree.nodes.new("NodeGroupOutput")
    for axis, count in zip("XYZ", (6, 7, 8), strict=True):
        made.inputs[f"Resolution {axis}"].default_value = count
    made.inputs["Density"].default_value = 0.5
    tree.links.new(made.outputs[0], out.inputs[0])
    thing.modifiers.new("Nodes", "NODES").node_group = tree
    return thing


def test_a_transfer_function_shows_grids_of_nodes(blender: Any) -> None:
    thing = with_cube(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    assert bpy.ops.spectral.transfer_preset(preset="wide") == {"FINISHED"}
    assert thing.data.spectral.enabled and len(thing.data.spectral.materials) == 3
    thing.data.spectral.quality_db = 44.0
    scene = translated()
    (volume,) = scene.volumes
    assert volume.data.shape == (6, 7, 8) and volume.quality == 44.0 and len(volume.transfer.materials) == 3
    thing.data.spectral.grid = "heat"
    scene = translated()
    assert not scene.volumes and any("'heat'" in note.message for note in scene.notes)


@pytest.mark.parametrize("background", [0.0, 0.5])
def test_a_density_beyond_all_voxels_gets_a_note(blender: Any, tmp_path: Any, background: float) -> None:
    import numpy as np

    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb: Any = find_openvdb()
    grid = openvdb.FloatGrid(background)
    grid.copyFromArray(np.ones((4, 5, 6), np.float32))
    grid.name = "density"
    openvdb.write(str(tmp_path / "fog.vdb"), grids=[grid])
    thing = bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog"))
    thing.data.filepath = str(tmp_path / "fog.vdb")
    bpy.context.scene.collection.objects.link(thing)
    scene = translated()
    assert len(scene.instances) == 1
    assert [note.subject for note in scene.notes if "no voxels" in note.message] == (["Fog"] if background else [])


def test_a_mesh_whose_nodes_make_a_grid_has_no_transfer_function(blender: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    with_cube(bpy.context.object)
    assert translated().volumes == ()
