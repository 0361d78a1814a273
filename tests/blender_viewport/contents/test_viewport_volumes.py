# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes that vary, in a 3D view: an edit evaluates only the grids that it changes, and every scene is up to date."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.blender_viewport.edits.test_viewport_edits import shader, updated, whole  # noqa: E402


def smoke(name, density=2.0):
    """A material whose density follows a noise."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    volume = tree.nodes.new("ShaderNodeVolumeScatter")
    noise, scaled = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeMath")
    scaled.name, scaled.operation, scaled.inputs[1].default_value = "Strength", "MULTIPLY", density
    noise.inputs["Scale"].default_value = 0.6
    tree.links.new(noise.outputs[0], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], volume.inputs["Density"])
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    return material


@pytest.fixture
def volumes(stage, tmp_path):
    """A cube of smoke, an object of the same mesh in a collection that an empty shows, and a file of grids."""
    from spectral_core.volume.field import ScalarVolume
    from spectral_core.volume.files import write_volume

    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 1))
    cube = bpy.context.object
    cube.data.materials.append(smoke("Smoke"))
    group = bpy.data.collections.new("Group")
    group.objects.link(cube)
    empty = bpy.data.objects.new("Shows", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (3, 0, 0)
    stage.scene.collection.objects.link(empty)
    for number in range(3):
        values = np.linspace(0.1, 1 + number, 8 * 6 * 5).reshape(8, 6, 5).astype(np.float32)
        grid = ScalarVolume.from_spacing("density", values, (0.2, 0.2, 0.2))
        path = write_volume(grid, tmp_path / f"smoke_{number}.vdb")
        data = bpy.data.volumes.new(f"Cloud {number}")
        data.filepath = str(path)
        data.spectral.enabled = False
        stage.scene.collection.objects.link(bpy.data.objects.new(f"Cloud {number}", data))
    return stage


@pytest.fixture
def evaluated(monkeypatch):
    """The shapes of the grids on which programs are evaluated."""
    from blender_addon.translate.shading.media.regions import Region

    shapes, at_voxels = [], Region.at_voxels
    monkeypatch.setattr(Region, "at_voxels", lambda region, p: shapes.append(region.shape) or at_voxels(region, p))
    return shapes


def cloud_material():
    """A material with a Principled Volume shader."""
    material = bpy.data.materials.new("Cloud")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    volume, output = tree.nodes.new("ShaderNodeVolumePrincipled"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    return material


def clouded(cloud):
    """A Principled Volume shader on a Volume object."""
    material = cloud_material()
    cloud.data.materials.append(material)
    return next(node for node in material.node_tree.nodes if node.type == "PRINCIPLED_VOLUME")


def is_up_to_date(stage):
    from spectral_core.render.live.in_place.changes import difference

    after = next(iter(stage.link.scenes.values()))
    left = difference(after, whole(stage))
    assert left.is_empty or set(left.singles) == {"film"}, (left.items, left.singles)
    names = [material.name for material in after.materials]
    assert len(names) == len(set(names))
    return after


def test_an_edit_evaluates_only_the_grids_that_it_changes(volumes, evaluated):
    principled = clouded(bpy.data.objects["Cloud 1"])
    updated(volumes)
    once = len([shape for shape in evaluated if shape == (10, 8, 7)]) // 3
    before = is_up_to_date(volumes)
    fogs = [material for material in before.materials if material.medium is not None]
    assert len(fogs) == 5, [material.name for material in before.materials]
    assert evaluated
    evaluated.clear()
    updated(volumes, lambda s: setattr(shader(s.material)["Roughness"], "default_value", 0.1))
    assert evaluated == [], "grids were evaluated again: of a file, or of a copy"
    after = is_up_to_date(volumes)
    for old, new in zip(before.materials, after.materials, strict=True):
        assert (old is new) == (new.name != "Paint")

    evaluated.clear()
    strength = bpy.data.materials["Smoke"].node_tree.nodes["Strength"].inputs[1]
    updated(volumes, lambda s: setattr(strength, "default_value", 3.0))
    assert evaluated, "the smoke in the cube was not evaluated again"
    assert not [shape for shape in evaluated if shape == (10, 8, 7)]
    changed = is_up_to_date(volumes)
    pairs = zip(after.materials, changed.materials, strict=True)
    assert {new.name for old, new in pairs if old is not new} == {"Smoke in Cube", "Smoke in Cube #2"}

    evaluated.clear()
    density = principled.inputs["Density"]
    updated(volumes, lambda s: setattr(density, "default_value", 3.0))
    assert len([shape for shape in evaluated if shape == (10, 8, 7)]) == once
    is_up_to_date(volumes)


def test_a_moved_cloud_and_another_file_are_followed(volumes, tmp_path):
    updated(volumes)
    is_up_to_date(volumes)
    updated(volumes, lambda s: setattr(bpy.data.objects["Cloud 1"], "location", (1, 2, 3)))
    is_up_to_date(volumes)
    updated(volumes, lambda s: setattr(bpy.data.objects["Cube"], "location", (1, 0, 1)))
    is_up_to_date(volumes)
    path = bpy.data.volumes["Cloud 0"].filepath
    updated(volumes, lambda s: setattr(bpy.data.volumes["Cloud 2"], "filepath", path))
    scene = is_up_to_date(volumes)
    first, last = (next(m for m in scene.materials if m.name == f"Cloud {k}") for k in (0, 2))
    np.testing.assert_array_equal(first.medium.grid.scattering, last.medium.grid.scattering)
    assert first.medium.density == last.medium.density


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder of saved grids."""
    from blender_addon.translate import volumes

    made = tmp_path / "saved"
    made.mkdir()
    monkeypatch.setattr(volumes, "_folder", lambda: made)
    return made


@pytest.fixture
def made(stage, folder):
    """A cloud that geometry nodes make on a mesh object; the node with its density."""
    tree = bpy.data.node_groups.new("Cloud", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube, given = tree.nodes.new("GeometryNodeVolumeCube"), tree.nodes.new("GeometryNodeSetMaterial")
    for axis in "XYZ":
        cube.inputs[f"Resolution {axis}"].default_value = 8
    given.inputs["Material"].default_value = cloud_material()
    tree.links.new(cube.outputs[0], given.inputs["Geometry"])
    tree.links.new(given.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    holder = bpy.data.objects.new("Holder", bpy.data.meshes.new("Nothing"))
    bpy.context.scene.collection.objects.link(holder)
    holder.modifiers.new("Cloud", "NODES").node_group = tree
    stage.density = cube.inputs["Density"]
    updated(stage)
    return stage


def files(folder):
    """The saved files of grids, with their times."""
    return {path: path.stat().st_mtime_ns for path in folder.iterdir()}


def densest(stage):
    (medium,) = (material.medium for material in is_up_to_date(stage).materials if material.medium is not None)
    return medium.density * float(medium.extinction.linear_rgb.max())


def test_a_cloud_of_geometry_nodes_is_saved_once(made, folder):
    before = files(folder)
    assert len(before) == 1
    densest(made)
    updated(made, lambda stage: setattr(shader(stage.material)["Roughness"], "default_value", 0.2))
    updated(made, lambda _stage: setattr(bpy.data.objects["Ball"], "location", (0, 1, 2)))
    updated(made, lambda _stage: setattr(bpy.data.objects["Holder"], "location", (0, 1, 2)))
    densest(made)
    assert files(folder) == before


def test_a_changed_cloud_replaces_its_file(made, folder):
    seen = [files(folder)]
    density = densest(made)
    for value in (2.0, 3.0):
        updated(made, lambda stage, value=value: setattr(stage.density, "default_value", value))
        assert densest(made) == pytest.approx(value * density)
        seen.append(files(folder))
    assert [len(each) for each in seen] == [1, 1, 1]
    assert len(set().union(*seen)) == 3


def test_an_animated_cloud_has_one_file(made, folder):
    for frame in (1, 20):
        made.density.default_value = frame
        made.density.keyframe_insert("default_value", frame=frame)
    found = set()
    for frame in range(2, 8):
        updated(made, lambda _stage, frame=frame: bpy.context.scene.frame_set(frame))
        found.add(densest(made))
        assert len(files(folder)) == 1
    assert len(found) == 6


def test_the_file_of_a_cloud_ends_with_it(made, folder):
    updated(made, lambda _stage: bpy.data.objects.remove(bpy.data.objects["Holder"]))
    assert files(folder) == {}
    assert whole(made).materials
    assert files(folder) == {}


def test_a_cloud_of_a_modifier_is_saved_once(stage, folder):
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 3))
    source = bpy.context.object
    source.hide_set(True)
    data = bpy.data.volumes.new("Made")
    holder = bpy.data.objects.new("Made", data)
    stage.scene.collection.objects.link(holder)
    modifier = holder.modifiers.new("Made", "MESH_TO_VOLUME")
    modifier.object = source
    data.materials.append(cloud_material())
    updated(stage)
    before = files(folder)
    assert len(before) == 1 and densest(stage) > 0
    updated(stage, lambda stage: setattr(shader(stage.material)["Roughness"], "default_value", 0.2))
    assert files(folder) == before
    updated(stage, lambda _stage: setattr(modifier, "density", 3.0))
    assert len(files(folder)) == 1 and files(folder) != before
    is_up_to_date(stage)


def test_a_script_that_sets_other_curves_or_lighting_updates_the_view(volumes):
    """Curves are a pointer to a node group: an assignment has to tell the view, as every other property does."""
    from blender_addon.translate.volume_looks.curves import add_material, curve_node

    data = bpy.data.volumes["Cloud 0"]
    data.spectral.enabled = True
    entry = add_material(data, "Fog")
    updated(volumes)
    before = is_up_to_date(volumes).volumes[0].transfer.materials[0].extinction.max()
    assert before > 0
    other = data.spectral.curves.copy()
    curve = other.nodes[f"{entry.uid} density"].mapping
    for point in curve.curves[0].points:
        point.location = (point.location[0], 0.5 * point.location[1])
    curve.update()
    updated(volumes)
    assert is_up_to_date(volumes).volumes[0].transfer.materials[0].extinction.max() == before
    updated(volumes, lambda s: setattr(data.spectral, "curves", other))
    assert data.spectral.curves == other and curve_node(data, entry, "density") is not None
    after = is_up_to_date(volumes).volumes[0].transfer.materials[0].extinction.max()
    assert after == pytest.approx(0.5 * before)
