# SPDX-License-Identifier: GPL-3.0-or-later
"""Object Info in lamps and displacement, inputs that vertices lack, and files of luminaires that are no files."""

from __future__ import annotations

import os

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

RED = (0.9, 0.2, 0.1, 1.0)


def instanced(item):
    """Show an object through a collection instance, which has a color of its own."""
    group = bpy.data.collections.new("Group")
    bpy.context.scene.collection.objects.unlink(item)
    group.objects.link(item)
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.instance_type, empty.instance_collection, empty.color = "COLLECTION", group, RED


def displaced(build, kind, output):
    """A plane whose displacement is an output of a node."""
    material = build.material()
    material.displacement_method = "DISPLACEMENT"
    tree = material.node_tree
    move = tree.nodes.new("ShaderNodeDisplacement")
    move.inputs["Midlevel"].default_value, move.inputs["Scale"].default_value = 0.0, 1.0
    tree.links.new(tree.nodes.new(kind).outputs[output], move.inputs["Height"])
    end = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(move.outputs[0], end.inputs["Displacement"])
    return build.plane(material=material)


def shown(scene):
    """The one mesh that is shown."""
    (found,) = (mesh for mesh in scene.meshes if mesh.name == scene.instances[0].mesh)
    return found


def heights(scene):
    """Heights of its vertices."""
    return shown(scene).positions[:, 2]


def test_the_lamp_of_an_instance_has_the_color_of_its_instancer(build, translate):
    from blender_addon import compat

    lamp = build.light("POINT")
    tree = compat.use_nodes(lamp.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeObjectInfo").outputs["Color"], emission.inputs["Color"])
    instanced(lamp)
    (light,) = translate().lights
    np.testing.assert_allclose(light.color.linear_rgb, RED[:3], rtol=1e-5)


def test_the_displacement_of_an_instance_has_the_alpha_of_its_instancer(build, translate):
    plane = displaced(build, "ShaderNodeObjectInfo", "Alpha")
    plane.color = (1, 1, 1, 0.25)
    np.testing.assert_allclose(heights(translate()), 0.25, rtol=1e-5)
    instanced(plane)
    np.testing.assert_allclose(heights(translate()), 1.0, rtol=1e-5)


def test_an_input_that_vertices_lack_is_named(build, translate):
    displaced(build, "ShaderNodeCameraData", "View Distance")
    (text,) = (note.message for note in translate().notes if "displacement" in note.message)
    assert "depends on the camera transform" in text


def test_coordinates_that_vertices_have_need_no_note(build, translate):
    displaced(build, "ShaderNodeTexCoord", "Object")
    assert not translate().notes


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_in_place_of_a_luminaire_is_named_and_not_waited_for(build, translate, tmp_path):
    from blender_addon import compat

    pipe = tmp_path / "lamp.ies"
    os.mkfifo(pipe)
    lamp = build.light("POINT")
    tree = compat.use_nodes(lamp.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    node = tree.nodes.new("ShaderNodeTexIES")
    node.mode, node.filepath = "EXTERNAL", str(pipe)
    tree.links.new(node.outputs[0], emission.inputs["Strength"])
    assert any("pipe" in note.message for note in translate().notes)


@pytest.mark.parametrize("is_sharp", [False, True])
def test_displaced_faces_come_apart_at_sharp_edges_as_in_this_cycles(build, translate, is_sharp):
    from blender_addon import compat

    plane = displaced(build, "ShaderNodeValue", "Value")
    plane.active_material.node_tree.nodes["Value"].outputs[0].default_value = 1.0
    data = plane.data
    data.clear_geometry()
    data.from_pydata(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, -1), (0, 1, -1)], [], [(0, 1, 2, 3), (0, 3, 5, 4)]
    )
    data.shade_smooth()
    shared = next(edge for edge in data.edges if set(edge.vertices) == {0, 3})
    shared.use_edge_sharp = is_sharp
    ends = {tuple(np.round(place, 4)) for place in shown(translate()).positions}
    apart = {(0, 0, 1), (0, 1, 1), (-1, 0, 0), (-1, 1, 0)}
    assert (apart <= ends) == (is_sharp and compat.is_before_5_2())
    assert len(ends) == (8 if is_sharp and compat.is_before_5_2() else 6)


@pytest.mark.parametrize("node", ["ShaderNodeTangent", "ShaderNodeNewGeometry"])
def test_the_tangents_of_a_lamp_need_no_note(build, translate, node):
    """The Tangent node turns around an axis of the world; that of Geometry is 0, so that such a lamp is black."""
    from blender_addon import compat

    lamp = build.light("POINT")
    tree = compat.use_nodes(lamp.data)
    emission = next(item for item in tree.nodes if item.type == "EMISSION")
    tree.links.new(tree.nodes.new(node).outputs["Tangent"], emission.inputs["Color"])
    scene = translate()
    assert not scene.notes
    assert bool(scene.lights) == (node == "ShaderNodeTangent")  # lamps without light are left out
