# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes that geometry nodes stored on instances: those of points with an ID, of instances in each other."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytestmark = pytest.mark.skipif(bpy.app.version < (5, 0), reason="Blender lists the geometry of instances from 5.0 on")


class Tree:
    """Geometry nodes on an object; ``add`` returns the first enabled output."""

    def __init__(self, owner):
        self.tree = bpy.data.node_groups.new("Tree", "GeometryNodeTree")
        self.tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        owner.modifiers.new("Tree", "NODES").node_group = self.tree

    def add(self, kind, settings=None, **inputs):
        node = self.tree.nodes.new(kind)
        for name, value in (settings or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            socket = next(s for s in node.inputs if s.name == name.replace("_", " ") and s.enabled)
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return next(s for s in node.outputs if s.enabled)

    def on_points(self, points, item, name):
        """Instances on points that store their x, y and z under a name."""
        made = self.add("GeometryNodeInstanceOnPoints", Points=points, Instance=item)
        place = self.add("GeometryNodeInputPosition")
        kinds = {"data_type": "FLOAT_VECTOR", "domain": "INSTANCE"}
        return self.add("GeometryNodeStoreNamedAttribute", kinds, Geometry=made, Name=name, Value=place)

    def show(self, output):
        self.tree.links.new(output, self.tree.nodes.new("NodeGroupOutput").inputs[0])


def colored(build, name):
    """A material by an attribute of the instancer."""
    material = build.material()
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "INSTANCER", name
    tree.links.new(node.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    return material


def host():
    made = bpy.data.objects.new("Host", bpy.data.meshes.new("Host"))
    bpy.context.scene.collection.objects.link(made)
    return made


def found(scene):
    """Position and attribute of each instance that has one."""
    rows = [(item.world_from_object[:3, 3], item.attributes[0][1][:3]) for item in scene.instances if item.attributes]
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


def spread(tree):
    """Points with an ID, which are not numbered one by one."""
    return tree.add("GeometryNodeDistributePointsOnFaces", Mesh=tree.add("GeometryNodeMeshGrid"), Density=30.0)


def test_instances_of_points_with_an_id_have_their_own_values(build, translate):
    tree = Tree(host())
    cube = tree.add("GeometryNodeSetMaterial", Geometry=tree.add("GeometryNodeMeshCube"), Material=colored(build, "at"))
    tree.show(tree.on_points(spread(tree), cube, "at"))
    scene = translate()
    positions, values = found(scene)
    assert len(values) > 10 and all("in one plane" in note.message for note in scene.notes)  # random ones overlap
    np.testing.assert_allclose(values, positions, atol=1e-5)


@pytest.mark.parametrize("stored", ["inner", "outer"])
def test_instances_in_each_other_have_the_values_of_either_level(build, translate, stored):
    tree = Tree(host())
    cube = tree.add(
        "GeometryNodeSetMaterial", Geometry=tree.add("GeometryNodeMeshCube"), Material=colored(build, stored)
    )
    inner = tree.on_points(spread(tree), cube, "inner")
    shown = tree.on_points(tree.add("GeometryNodeMeshLine", Count=3, Offset=(0.0, 0.0, 5.0)), inner, "outer")
    tree.show(shown)
    positions, values = found(translate())
    level = np.round(positions[:, 2] / 5.0) * 5.0
    expected = positions * (1, 1, 0) if stored == "inner" else np.stack([0 * level, 0 * level, level], axis=1)
    assert len(values) > 30
    np.testing.assert_allclose(values, expected, atol=1e-5)


def test_instances_of_a_scatterer_in_a_collection_have_their_values(build, translate):
    scatterer = host()
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.objects.unlink(scatterer)
    group.objects.link(bpy.data.objects.new("Other", None))
    group.objects.link(scatterer)
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (0, 0, 2)
    tree = Tree(scatterer)
    cube = tree.add("GeometryNodeSetMaterial", Geometry=tree.add("GeometryNodeMeshCube"), Material=colored(build, "at"))
    tree.show(tree.on_points(spread(tree), cube, "at"))
    positions, values = found(translate())
    assert len(values) > 10
    np.testing.assert_allclose(values, positions - (0, 0, 2), atol=1e-5)


def test_picked_objects_have_the_values_of_their_instances(build, translate):
    group = bpy.data.collections.new("Parts")
    for _ in range(2):
        part = build.plane(material=colored(build, "at"))
        bpy.context.scene.collection.objects.unlink(part)
        group.objects.link(part)
    tree = Tree(host())
    parts = tree.add("GeometryNodeCollectionInfo", Collection=group)
    tree.show(tree.on_points(spread(tree), parts, "at"))
    positions, values = found(translate())
    assert len(values) > 20
    np.testing.assert_allclose(values, positions, atol=1e-5)


@pytest.mark.parametrize(("kinds", "is_noted"), [(["SUBSURF", "NODES"], True), (["SUBSURF"], False)])
def test_before_blender_5_instances_of_nodes_are_named(kinds, is_noted):
    from types import SimpleNamespace

    from blender_addon.translate.shading.carried.instances import InstancePoints

    parent = SimpleNamespace(modifiers=[SimpleNamespace(type=kind) for kind in kinds])  # has no evaluated_geometry
    value, unknown = InstancePoints().value("shade", SimpleNamespace(parent=parent))
    assert value is None and unknown == ("instances is not read before Blender 5.0" if is_noted else "")


def test_a_rotation_is_no_color(build, translate):
    """Blender converts no rotation to a color, so that Cycles shows 0."""
    tree = Tree(host())
    cube = tree.add("GeometryNodeSetMaterial", Geometry=tree.add("GeometryNodeMeshCube"), Material=colored(build, "at"))
    made = tree.add("GeometryNodeInstanceOnPoints", Points=tree.add("GeometryNodeMeshLine", Count=3), Instance=cube)
    kinds = {"data_type": "QUATERNION", "domain": "INSTANCE"}
    tree.show(tree.add("GeometryNodeStoreNamedAttribute", kinds, Geometry=made, Name="at"))
    _, values = found(translate())
    assert len(values) == 3 and not values.any()


@pytest.mark.parametrize("stored", [["UVMap"], []])
def test_uv_maps_that_nodes_store_on_a_primitive_are_those_of_cycles(build, translate, stored):
    """The primitive's own output, which has no name, is the map for rendering until Blender 5.2; Cycles shows none."""
    from blender_addon import compat

    material = build.material(shader="ShaderNodeEmission")
    place = material.node_tree.nodes.new("ShaderNodeTexCoord")
    material.node_tree.links.new(place.outputs["UV"], material.node_tree.nodes["shader"].inputs["Color"])
    tree = Tree(host())
    cube = tree.add("GeometryNodeMeshCube")
    for name in stored:
        kinds, uvs = {"data_type": "FLOAT2", "domain": "CORNER"}, cube.node.outputs["UV Map"]
        cube = tree.add("GeometryNodeStoreNamedAttribute", kinds, Geometry=cube, Name=name, Value=uvs)
    tree.show(tree.add("GeometryNodeSetMaterial", Geometry=cube, Material=material))
    scene = translate()
    has_map = bool(stored) and not compat.is_before_5_2()
    notes = [note.message for note in scene.notes if "corner pixel" in note.message]
    assert bool(scene.meshes[0].uvs.any()) == has_map == (not notes)
    assert has_map or ("UV Map node" in notes[0]) == bool(stored)
