# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes whose names Cycles keeps for data of its own are not found by Attribute and Color Attribute."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

OWN = (0.1, 0.9, 0.4)


def shown(build, name, kind="ShaderNodeAttribute"):
    """A coarse ball with an attribute of a name and an emission that shows it."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1)
    ball = bpy.context.object
    layer = ball.data.attributes.new(name, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.tile(np.array([*OWN, 1], np.float32), len(layer.data)))
    material = build.material("Paint", "ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new(kind)
    setattr(node, "attribute_name" if kind.endswith("Attribute") else "layer_name", name)
    shader = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(node.outputs["Color"], shader.inputs["Color"])
    ball.data.materials.append(material)
    return ball


@pytest.mark.parametrize("kind", ["ShaderNodeAttribute", "ShaderNodeVertexColor"])
@pytest.mark.parametrize("name", ["color", "density", "vertex_color", "tangent", "velocity"])
def test_a_name_of_volumes_or_of_cycles_reads_nothing_with_a_note(build, translate, name, kind):
    shown(build, name, kind)
    scene = translate()
    assert not scene.meshes[0].attributes
    assert any(repr(name) in note.message and "rename" in note.message for note in scene.notes)


@pytest.mark.parametrize("kind", ["ShaderNodeAttribute", "ShaderNodeVertexColor", "ShaderNodeUVMap"])
def test_uv_map_of_such_a_name_is_read_by_the_node_uv_map_alone(build, translate, kind):
    """In Cycles, Attribute and Color Attribute are black there; they showed the UV map."""
    ball = shown(build, "Color", kind if kind != "ShaderNodeUVMap" else "ShaderNodeAttribute")
    uvs = np.tile(np.array([0.25, 0.75], np.float32), len(ball.data.loops))
    ball.data.uv_layers.new(name="density").uv.foreach_set("vector", uvs)
    tree = ball.data.materials[0].node_tree
    shader = next(node for node in tree.nodes if node.type == "EMISSION")
    node = tree.nodes.new(kind)
    setattr(node, {"ShaderNodeAttribute": "attribute_name", "ShaderNodeVertexColor": "layer_name"}.get(kind, "uv_map"),
            "density")  # fmt: skip
    tree.links.new(node.outputs[0], shader.inputs["Color"])
    scene = translate()
    read = [each.values for each in scene.meshes[0].attributes]
    if kind == "ShaderNodeUVMap":
        (values,) = read
        assert np.all(values == (0.25, 0.75, 0.0)) and not scene.notes
    else:
        assert not read
        assert any("'density'" in note.message and "rename" in note.message for note in scene.notes)


def test_programs_read_nothing_from_the_velocity_that_blurs_a_mesh(build, translate):
    """Cycles shows black, with motion blur and without; the materials had the velocity as their color."""
    ball = shown(build, "velocity")
    ball.data.attributes.remove(ball.data.attributes["velocity"])
    ball.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", [4.0, 0, 0] * 12)
    bpy.context.scene.render.use_motion_blur = True
    scene = translate()
    assert [each.name for mesh in scene.meshes for each in mesh.attributes] == ["velocity"]
    assert any("'velocity'" in note.message and "rename" in note.message for note in scene.notes)


@pytest.mark.parametrize("name", ["Color", "colors", "Ng"])
def test_other_names_are_read(build, translate, name):
    shown(build, name)
    scene = translate()
    (attribute,) = scene.meshes[0].attributes
    np.testing.assert_allclose(attribute.values, np.tile(OWN, (len(attribute.values), 1)), rtol=1e-6)
    assert not scene.notes


@pytest.mark.parametrize("name", ["uv", "generated", "pointiness", "random_per_island"])
def test_data_that_every_mesh_has_precede_an_attribute(build, translate, name):
    shown(build, name)
    scene = translate()
    assert not any(np.allclose(attribute.values, OWN) for attribute in scene.meshes[0].attributes)
    assert not scene.notes
    read = {item.name for item in scene.meshes[0].attributes}
    assert name == "uv" or any(part in each for each in read for part in (name, "island"))


def test_the_active_color_is_read_whatever_its_name(build, translate):
    ball = shown(build, "color", "ShaderNodeVertexColor")
    node = next(node for node in ball.data.materials[0].node_tree.nodes if node.type == "VERTEX_COLOR")
    node.layer_name = ""
    scene = translate()
    (attribute,) = scene.meshes[0].attributes
    assert np.allclose(attribute.values, OWN) and not scene.notes


@pytest.mark.parametrize("name", ["uv", "generated", "pointiness", "random_per_island"])
def test_color_attribute_finds_no_color_by_names_of_other_data(build, translate, name):
    """Cycles shows black there; it was the UV map, the coordinates or the pointiness."""
    shown(build, name, "ShaderNodeVertexColor")
    scene = translate()
    np.testing.assert_array_equal(scene.materials[0].surface.color.linear_rgb, 0.0)
    assert any(repr(name) in note.message and "rename" in note.message for note in scene.notes)


@pytest.mark.parametrize("kind", ["ShaderNodeAttribute", "ShaderNodeVertexColor"])
@pytest.mark.parametrize("data_type", ["FLOAT", "INT", "BOOLEAN", "FLOAT2", "FLOAT_VECTOR", "BYTE_COLOR"])
def test_color_attribute_has_a_note_for_what_is_no_color(build, translate, data_type, kind):
    """Cycles reads three numbers where there are one or two: its picture depends on the other attributes."""
    ball = shown(build, "mask", kind)
    ball.data.attributes.remove(ball.data.attributes["mask"])
    ball.data.attributes.new("mask", data_type, "POINT")
    noted = any("'mask' is no color" in note.message for note in translate().notes)
    assert noted == (kind == "ShaderNodeVertexColor" and data_type in ("FLOAT", "INT", "BOOLEAN", "FLOAT2"))


@pytest.mark.parametrize("name", ["N", "Normals"])
def test_a_uv_map_named_as_the_normals_has_a_note(build, translate, name):
    """Cycles does not read it; here it is read."""
    ball = shown(build, "mask")
    ball.data.uv_layers[0].name = name
    tree = ball.data.materials[0].node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = build.image("Picture", np.ones((2, 2, 4)))
    shader = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(image.outputs["Color"], shader.inputs["Color"])
    noted = any("'N' for normals" in note.message for note in translate().notes)
    assert noted == (name == "N")
