# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer functions on Volume objects whose grids are made by geometry nodes."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("bpy", reason="needs the Python module bpy: pip install 'spectral-scene[blender]'")

import bpy

from blender_addon import compat
from tests.blender_volume.test_volume_objects import _openvdb, translated  # noqa: F401 - a fixture


def with_cube(thing: Any, counts: tuple[int, int, int] = (6, 7, 8)) -> Any:
    """The object with nodes that make a grid of so many voxels, of density 0.5, from -1 to 1."""
    tree = bpy.data.node_groups.new("Grid", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    made, out = tree.nodes.new("GeometryNodeVolumeCube"), tree.nodes.new("NodeGroupOutput")
    for axis, count in zip("XYZ", counts, strict=True):
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


@pytest.mark.parametrize("count", [12, 16])
def test_a_cube_of_tiles_begins_at_its_first_voxel(blender: Any, count: int) -> None:
    """Cycles fades a grid in over the voxel before its first one, but not where tiles (cubes of 8³ voxels) begin."""
    import numpy as np

    from spectral_core.scene.geometry import VOLUME_BOX

    material = bpy.data.materials.new("Fog")
    compat.use_nodes(material).nodes.clear()
    shader, out = (material.node_tree.nodes.new(f"ShaderNode{name}") for name in ("VolumePrincipled", "OutputMaterial"))
    material.node_tree.links.new(shader.outputs[0], out.inputs["Volume"])
    bpy.ops.mesh.primitive_plane_add()
    tree = with_cube(bpy.context.object, (count,) * 3).modifiers[0].node_group
    painted, links = tree.nodes.new("GeometryNodeSetMaterial"), tree.links
    painted.inputs["Material"].default_value = material
    links.new(tree.nodes["Volume Cube"].outputs[0], painted.inputs[0])
    links.new(painted.outputs[0], tree.nodes["Group Output"].inputs[0])
    scene = translated()
    (box,) = [item.world_from_object for item in scene.instances if item.mesh == VOLUME_BOX]
    voxel, ends = 2 / (count - 1), box @ [[0, 1], [0, 1], [0, 1], [1, 1]]
    np.testing.assert_allclose(ends[:3, 0], -1 - (0.001 if count % 8 == 0 else 1.6) * voxel, atol=1e-6)
    np.testing.assert_allclose(ends[:3, 1], 1 + 1.6 * voxel, atol=1e-6)


@pytest.mark.parametrize("background", [0.0, 0.5])
def test_a_density_beyond_all_voxels_gets_a_note(blender: Any, tmp_path: Any, background: float) -> None:
    import numpy as np

    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb: Any = find_openvdb()
    grid = openvdb.FloatGrid(background)
    grid.copyFromArray(np.ones((4, 5, 6), np.float32))
    grid.name = "density"
    grid.transform = openvdb.createLinearTransform(voxelSize=0.2)
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


@pytest.mark.parametrize("kind", ["displaced", "moved", "deleted", "hidden"])
@pytest.mark.parametrize("has_transfer", [True, False])
def test_modifiers_change_the_grids_of_a_file(blender: Any, tmp_path: Any, kind: str, has_transfer: bool) -> None:
    """The file was rendered as it is: Blender keeps its path in the evaluated copy that the modifiers change."""
    import numpy as np

    from spectral_core.volume.files.formats.openvdb_format import find_openvdb

    openvdb = find_openvdb()
    if openvdb is None:
        pytest.skip("needs OpenVDB's module")
    grid = openvdb.FloatGrid(0.0)
    grid.name = "density"
    grid.copyFromArray(np.linspace(0.1, 1.0, 512, dtype=np.float32).reshape(8, 8, 8).copy())
    grid.transform = openvdb.createLinearTransform(voxelSize=0.2)
    openvdb.write(str(tmp_path / "fog.vdb"), grids=[grid])
    thing = bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog"))
    thing.data.filepath = str(tmp_path / "fog.vdb")
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    if kind in ("displaced", "hidden"):
        made = thing.modifiers.new("Displace", "VOLUME_DISPLACE")
        made.texture, made.strength = bpy.data.textures.new("Clouds", "CLOUDS"), 2.0
        made.texture_map_mode = "GLOBAL"
        made.show_viewport = kind == "displaced"
    else:
        tree = bpy.data.node_groups.new("Change", "GeometryNodeTree")
        for way in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        given, change, out = (
            tree.nodes.new(each) for each in ("NodeGroupInput", "GeometryNodeTransform", "NodeGroupOutput")
        )
        change.inputs["Translation"].default_value = (5.0, 0.0, 0.0)
        if kind == "moved":
            tree.links.new(given.outputs[0], change.inputs[0])
            tree.links.new(change.outputs[0], out.inputs[0])
        thing.modifiers.new("Nodes", "NODES").node_group = tree
    if has_transfer and kind != "deleted":
        assert bpy.ops.spectral.transfer_preset(preset="wide") == {"FINISHED"}
    elif has_transfer:
        assert bpy.ops.spectral.volume_material_add() == {"FINISHED"}
    else:
        material = bpy.data.materials.new("Fog")
        if material.node_tree is None:  # before Blender 5.0
            material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        links.new(
            nodes.new("ShaderNodeVolumePrincipled").outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Volume"]
        )
        thing.data.materials.append(material)
    scene = translated()
    if kind == "deleted":
        assert not scene.volumes and not scene.instances
        assert any("neither a file nor grids" in note.message for note in scene.notes)
        return
    if has_transfer:
        (volume,) = scene.volumes
        low = volume.world_from_index[:3, 3]
        size = 0.2 * np.array(volume.data.shape)
    else:
        (instance,) = scene.instances
        low, size = instance.world_from_object[:3, 3], np.diag(instance.world_from_object)[:3]
    assert (low[0] > 3.0) == (kind == "moved")
    assert (size > 2.4).all() == (kind == "displaced")  # the modifier makes room for the way that it moves voxels
