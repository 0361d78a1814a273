# SPDX-License-Identifier: GPL-3.0-or-later
"""Generated coordinates of point clouds, and stretched ones, against Cycles."""

from __future__ import annotations

import numpy as np
import pytest

from ..cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")


def _points(build, material):
    """Three balls from a node tree."""
    tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    output, made = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("GeometryNodePoints")
    line, shown = tree.nodes.new("GeometryNodeInputIndex"), tree.nodes.new("GeometryNodeSetMaterial")
    scale = tree.nodes.new("ShaderNodeVectorMath")
    scale.operation, scale.inputs[1].default_value = "MULTIPLY", (0.8, 0.3, 0.2)
    tree.links.new(line.outputs[0], scale.inputs[0])
    tree.links.new(scale.outputs[0], made.inputs["Position"])
    made.inputs["Count"].default_value, made.inputs["Radius"].default_value = 3, 0.5
    shown.inputs["Material"].default_value = material
    tree.links.new(made.outputs[0], shown.inputs[0])
    tree.links.new(shown.outputs[0], output.inputs[0])
    item = build.mesh("Cloud", [], [])
    item.modifiers.new("Points", "NODES").node_group = tree
    return item


def test_generated_coordinates_of_points_are_their_positions(build, tmp_path):
    from blender_addon import compat

    settings(samples=64, size=24)
    material = build.material("Glow", "ShaderNodeEmission")
    tree = compat.use_nodes(material)
    place = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Generated"], tree.nodes["shader"].inputs["Color"])
    _points(build, material)
    build.camera((0.8, 0.3, 6), type="ORTHO", ortho_scale=3.2)
    bpy.context.view_layer.update()
    expected = cycles(tmp_path)
    found, notes = ours()
    assert not any("generated" in note for note in notes), notes
    assert expected.max() > 0.8
    off = np.abs(found - expected).reshape(6, 4, 6, 4, 3).mean((1, 3))
    assert off.max() < 0.03 * expected.max()


def test_uvs_that_points_and_strands_do_not_have_are_0(build, tmp_path):
    """As in Cycles; parametric coordinates of their triangles were shown, 0.19 in the mean."""
    from blender_addon import compat

    settings(samples=4, size=24)
    material = build.material("Glow", "ShaderNodeEmission")
    tree = compat.use_nodes(material)
    place, add = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    add.inputs[1].default_value = (0, 0, 0.5)
    tree.links.new(place.outputs["UV"], add.inputs[0])
    tree.links.new(add.outputs[0], tree.nodes["shader"].inputs["Color"])
    _points(build, material)
    curves = bpy.data.hair_curves.new("Curves")
    curves.add_curves([2])
    curves.points.foreach_set("position", [0.0, 0.8, 0.0, 1.6, 0.8, 0.0])
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", [0.2, 0.2])
    curves.materials.append(material)
    bpy.context.collection.objects.link(bpy.data.objects.new("Curves", curves))
    build.camera((0.8, 0.3, 6), type="ORTHO", ortho_scale=3.2)
    bpy.context.view_layer.update()
    expected = cycles(tmp_path)
    found, _ = ours()
    for picture in (found, expected):
        assert picture[..., 2].max() > 0.49
        assert np.abs(picture[..., :2]).max() < 1e-3 * picture[..., 2].max()


@pytest.mark.parametrize(("scale", "is_told"), [((1, 1, 1), False), ((2, -2, 2), False), ((1, 1, 0.5), True)])
def test_stretched_points_have_a_note(build, translate, scale, is_told):
    _points(build, build.material()).scale = scale
    bpy.context.view_layer.update()
    assert any("stretched" in note.message for note in translate().notes) == is_told


@pytest.mark.parametrize(("radius", "balls"), [(0.5, 3), (-0.5, 0)])
def test_points_of_a_negative_radius_are_not_seen(build, translate, radius, balls):
    """Nor in Cycles; their size was shown."""
    from blender_addon.translate.strands import ball

    tree = _points(build, build.material()).modifiers[0].node_group
    store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
    made = next(node for node in tree.nodes if node.bl_idname == "GeometryNodePoints")
    shown = next(node for node in tree.nodes if node.bl_idname == "GeometryNodeSetMaterial")
    tree.links.new(made.outputs[0], store.inputs[0])
    tree.links.new(store.outputs[0], shown.inputs[0])
    store.inputs["Name"].default_value = "radius"
    next(s for s in store.inputs if s.name == "Value" and s.enabled).default_value = radius
    bpy.context.view_layer.update()
    (mesh,) = translate().meshes
    assert len(mesh.triangles) == balls * len(ball(3)[1])
