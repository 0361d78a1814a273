# SPDX-License-Identifier: GPL-3.0-or-later
"""Combinations of real files: attributes of every domain, groups with unlinked inputs, shadows, linked emitters."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def _reading(material, kind, output, target, **values):
    """A node of the material whose output is linked to an input of its shader."""
    tree = material.node_tree
    node = tree.nodes.new(kind)
    for name, value in values.items():
        setattr(node, name, value)
    tree.links.new(node.outputs[output], tree.nodes["shader"].inputs[target])
    return node


def _values(translate, name):
    (mesh,) = translate().meshes
    (found,) = (attribute.values for attribute in mesh.attributes if attribute.name == name)
    return np.asarray(found)


def test_edge_attributes_are_means_at_the_vertices(build, translate):
    material = build.material()
    _reading(material, "ShaderNodeAttribute", "Fac", "Color", attribute_name="Edges")
    plane = build.plane(material=material)
    layer = plane.data.attributes.new("Edges", "FLOAT", "EDGE")
    layer.data.foreach_set("value", np.array([1.0, 2.0, 4.0, 8.0], np.float32))
    ends = np.array([edge.vertices[:] for edge in plane.data.edges])
    of_vertex = [np.mean([layer.data[k].value for k in np.flatnonzero((ends == v).any(1))]) for v in range(4)]
    np.testing.assert_allclose(sorted(_values(translate, "attribute_factor:Edges")[:, 0]), sorted(of_vertex))


@pytest.mark.parametrize(("kind", "stored", "factors"), [
    ("INT", (1, 2, 4, 8), {1.5: 2, 3.0: 3, 6.0: 6, 4.5: 5, 2.5: 3, 5.0: 5}),
    ("BOOLEAN", (True, False, False, False), {0.5: 1, 0.0: 0}),
])  # fmt: skip
def test_means_of_whole_numbers_are_rounded_and_a_vertex_of_a_true_edge_is_true(
    build, translate, kind, stored, factors
):
    material = build.material()
    _reading(material, "ShaderNodeAttribute", "Fac", "Color", attribute_name="Edges")
    plane = build.plane(material=material)
    layer = plane.data.attributes.new("Edges", kind, "EDGE")
    layer.data.foreach_set("value", stored)
    ends = np.array([edge.vertices[:] for edge in plane.data.edges])
    means = [float(np.mean([layer.data[k].value for k in np.flatnonzero((ends == v).any(1))])) for v in range(4)]
    assert sorted(_values(translate, "attribute_factor:Edges")[:, 0]) == sorted(factors[mean] for mean in means)


@pytest.mark.parametrize(("kind", "field", "stored", "factor"), [
    ("FLOAT2", "vector", (0.25, 0.75), 0.25),
    ("FLOAT_VECTOR", "vector", (0.3, 0.6, 0.9), 0.6),
    ("FLOAT_COLOR", "color", (0.3, 0.6, 0.9, 0.2), 0.6),
    ("QUATERNION", "value", (0.3, 0.6, 0.9, 0.2), 0.6),
])  # fmt: skip
def test_the_factor_of_an_attribute_is_that_of_cycles(build, translate, kind, field, stored, factor):
    material = build.material()
    _reading(material, "ShaderNodeAttribute", "Fac", "Color", attribute_name="Mine")
    plane = build.plane(material=material)
    layer = plane.data.attributes.new("Mine", kind, "POINT")
    layer.data.foreach_set(field, np.tile(np.array(stored, np.float32), 4))
    np.testing.assert_allclose(_values(translate, "attribute_factor:Mine"), factor, rtol=1e-6)


def test_weights_of_a_vertex_group_are_an_attribute(build, translate):
    material = build.material()
    _reading(material, "ShaderNodeAttribute", "Fac", "Color", attribute_name="Weights")
    plane = build.plane(material=material)
    plane.vertex_groups.new(name="Other")
    plane.vertex_groups.new(name="Weights").add([1, 2], 0.75, "REPLACE")
    found = _values(translate, "attribute_factor:Weights")[:, 0]
    assert sorted(found) == [0.0, 0.0, 0.75, 0.75]
    assert translate().notes == ()


def test_a_vector_that_a_group_leaves_unlinked_is_its_own_value(build, translate):
    """Cycles gives the texture the group's value there, not the coordinates that a texture alone would have."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector")
    tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end, noise = (tree.nodes.new(k) for k in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeTexNoise"))
    tree.links.new(start.outputs[0], noise.inputs["Vector"])
    tree.links.new(noise.outputs["Color"], end.inputs[0])
    material = build.material()
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = tree
    material.node_tree.links.new(group.outputs[0], material.node_tree.nodes["shader"].inputs["Color"])
    build.plane(material=material)
    from spectral_core.scene import Color

    (found,) = (item.surface for item in translate().materials)
    assert isinstance(found.color, Color)
    tree.links.remove(noise.inputs["Vector"].links[0])
    (found,) = (item.surface for item in translate().materials)
    assert "generated" in found.color.program.inputs


def test_without_transparent_shadows_a_surface_is_opaque_for_shadow_rays(build, translate):
    from spectral_core.scene import MixSurface, Transparent

    material = build.material(shader="ShaderNodeBsdfTransparent")
    build.plane(material=material)
    (found,) = (item.surface for item in translate().materials)
    assert isinstance(found, Transparent)
    material.use_transparent_shadow = False
    (found,) = (item.surface for item in translate().materials)
    assert isinstance(found, MixSurface) and isinstance(found.first, Transparent)
    assert found.factor.program.inputs == {"ray:Is Shadow Ray"}


def test_emissive_objects_are_linked_as_lamps_are(build, translate):
    glow = build.plane("Glow", material=build.material("Glow", "ShaderNodeEmission"))
    build.plane("Lit")
    unlit = build.plane("Unlit")
    chosen = glow.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    chosen.objects.link(bpy.data.objects["Lit"])
    by_name = {item.shown_as: item for item in translate().instances}
    assert by_name[unlit.name].unlit_by == (by_name["Glow"].name,)
    assert by_name["Lit"].unlit_by == ()


def test_limits_of_the_texture_mapping_panel_have_no_effect_as_in_cycles(build, translate):
    material = build.material()
    node = _reading(material, "ShaderNodeTexNoise", "Color", "Color")
    node.texture_mapping.use_min = True
    build.plane(material=material)
    (found,) = (item.surface.color.program for item in translate().materials)
    assert not [i for i in found.instructions if i.operation == "vector_math"]


@pytest.mark.parametrize(("kind", "is_moved"), [("TexNoise", False), ("TexGradient", False), ("TexSky", True)])
def test_the_panel_of_a_pattern_has_no_effect_on_a_vector_that_is_the_same_everywhere(build, translate, kind, is_moved):
    """As in Cycles, where only pictures are moved then: a gradient of 0.35 was 1."""
    colors = []
    for shift in (0.0, 0.6):
        material = build.material(f"{kind} {shift}")
        node = _reading(material, f"ShaderNode{kind}", "Color", "Color")
        node.texture_mapping.translation = (shift,) * 3
        if kind == "TexSky":  # others have no Vector
            node.sky_type = "PREETHAM"
        place = material.node_tree.nodes.new("ShaderNodeCombineXYZ")
        place.inputs["X"].default_value = place.inputs["Z"].default_value = 0.35
        material.node_tree.links.new(place.outputs[0], node.inputs["Vector"])
        build.plane(f"{kind} {shift}", material=material)
        color = next(item.surface.color for item in translate().materials if item.name == material.name)
        colors.append(np.asarray(color.linear_rgb))
    assert np.allclose(*colors) is not is_moved


def test_a_sky_has_its_own_color_at_the_zenith(build, translate):
    """The picture's last row was mixed with its first one, of the ground, where a Vector points straight up."""
    material = build.material()
    node = _reading(material, "ShaderNodeTexSky", "Color", "Color")
    node.sky_type, node.sun_direction = "PREETHAM", (0.0, 1.0, 0.2)
    place = material.node_tree.nodes.new("ShaderNodeCombineXYZ")
    material.node_tree.links.new(place.outputs[0], node.inputs["Vector"])
    build.plane(material=material)
    colors = []
    for height in (0.9999, 1.0, 3.0):
        place.inputs["Z"].default_value = height
        color = next(item.surface.color for item in translate().materials)
        colors.append(np.asarray(color.linear_rgb))
    assert np.allclose(colors[0], colors[1], rtol=0.03) and np.allclose(colors[1], colors[2])


def test_a_lamp_whose_nodes_are_not_linked_is_black(build, translate):
    lamp = build.light("POINT")
    lamp.data.use_nodes = True
    lamp.data.node_tree.links.clear()
    assert translate().lights == ()


def test_the_ball_of_the_feature_scenes_is_measured(blender):
    """A mask that covers all would measure errors of the ball against the whole picture."""
    from benchmarks.render.features.compare import ball_mask
    from benchmarks.render.features.stage import Stage

    mask = ball_mask(Stage(4))
    assert 0.2 < mask.mean() < 0.4
    height, width = mask.shape
    assert mask[height // 2, width // 2] and not mask[0].any() and not mask[:, 0].any()
