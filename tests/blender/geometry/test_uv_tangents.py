# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents of UV maps and normal maps by them equal those of Blender's MikkTSpace and of Cycles, on both sides."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")

READS = frozenset(("attribute_tangent:", "attribute_tangent_sign:", "attribute_smooth_normal"))


def rough_ball(rng, smooth: bool, mirrored: bool):
    """A ball of triangles, no two in one plane, with seams and, if wanted, mirrored parts in its UV map."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    data = bpy.context.object.data
    for vertex in data.vertices:
        vertex.co *= rng.uniform(0.7, 1.3)
    layer = data.uv_layers.active
    for face in data.polygons if mirrored else ():
        if face.center.x > 0:  # a jagged border: parts of one orientation touch in corners alone
            for corner in face.loop_indices:
                u, v = layer.uv[corner].vector
                layer.uv[corner].vector = 3.0 - u, v
    for face in data.polygons:
        face.use_smooth = smooth
    data.update()
    return data


@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize("smooth", [True, False])
def test_tangents_equal_those_of_blender(rng, smooth, mirrored):
    """Blender's own are the original MikkTSpace, in C++; on triangles Cycles' are the same."""
    from blender_addon.translate.meshes.triangles import translate_mesh

    data = rough_ball(rng, smooth, mirrored)
    mesh = translate_mesh("thing", data, READS)
    values = {item.name: item.values[mesh.triangles.ravel()] for item in mesh.attributes}
    data.calc_tangents()
    corners = [corner for triangle in data.loop_triangles for corner in triangle.loops]
    wanted = np.array([data.loops[corner].tangent[:] for corner in corners])
    signs = np.array([data.loops[corner].bitangent_sign for corner in corners])
    found = values["attribute_tangent:"]
    np.testing.assert_allclose(found, wanted, atol=2e-3)
    np.testing.assert_array_equal(values["attribute_tangent_sign:"][:, 0], signs)
    assert ("attribute_smooth_normal" in values) == smooth


def test_corners_of_a_triangle_without_area_take_the_tangents_of_others():
    from blender_addon.translate.meshes.tangents import tangents_of

    places = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0), (0, 0, 0), (1, 0, 0)], float)
    up = np.tile((0.0, 0.0, 1.0), (6, 1))
    uvs = places[:, :2] @ np.array([(0.0, 1.0), (1.0, 0.0)])  # u grows along y: mirrored
    tangents, signs = tangents_of(places, up, uvs)
    np.testing.assert_allclose(tangents, np.tile((0, 1, 0), (6, 1)), atol=1e-6)
    np.testing.assert_array_equal(signs, -1)


def shown(build, mesh, space="TANGENT", turn=(0.5, 0.3, 0.2)):
    """An object whose color is its normal by a normal map."""
    settings(samples=4, size=24)
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    node, color = tree.nodes.new("ShaderNodeNormalMap"), tree.nodes.new("ShaderNodeVectorMath")
    node.space, node.inputs["Color"].default_value, color.operation = space, (0.75, 0.4, 0.9, 1), "MULTIPLY_ADD"
    for socket in color.inputs[1:3]:
        socket.default_value = 0.5, 0.5, 0.5
    tree.links.new(node.outputs[0], color.inputs[0])
    tree.links.new(color.outputs[0], tree.nodes["shader"].inputs["Color"])
    mesh.materials.append(material)
    thing = build.object("Thing", mesh)
    thing.rotation_euler = turn
    build.camera(type="ORTHO", ortho_scale=1.6)


def primitive(kind: str, **settings_of):
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**settings_of)
    thing = bpy.context.object
    data = thing.data
    bpy.data.objects.remove(thing)
    data.shade_smooth()
    return data


@pytest.mark.parametrize(("kind", "turn", "space"), [
    ("cube", (0.5, 0.3, 0.2), "TANGENT"), ("cone", (0.9, 0.3, 0.2), "TANGENT"), ("plane", (3.0, 0.3, 0.2), "TANGENT"),
    ("plane", (3.0, 0.3, 0.2), "OBJECT"), ("plane", (3.0, 0.3, 0.2), "WORLD"),
])  # fmt: skip
def test_normal_maps_equal_those_of_cycles(build, tmp_path, kind, turn, space):
    """On coarse smooth meshes, and on the back of a face, whose normal is the opposite of that of its front."""
    sizes = {"cone": {"radius1": 1.2, "depth": 2.0}, "cube": {"size": 1.4}}.get(kind, {"size": 4.0})
    shown(build, primitive(kind, **sizes), space, turn)
    found, notes = ours(samples=16)
    assert not notes
    assert np.abs(np.median(found - cycles(tmp_path), axis=2)).mean() < 0.01


def test_a_mesh_without_a_uv_map_has_tangents_around_its_origin(build, tmp_path):
    data = primitive("cube", size=1.4)
    data.uv_layers.remove(data.uv_layers[0])
    shown(build, data)
    found, notes = ours(samples=16)
    assert any("it has no UV map; its normal maps and tangents turn around its origin" in note for note in notes)
    assert np.abs(found - cycles(tmp_path)).mean() < 0.01


def test_a_normal_map_by_a_missing_uv_map_has_no_effect(build, translate):
    from blender_addon import compat

    data = primitive("plane", size=2.0)
    shown(build, data)
    node = next(each for each in compat.node_tree(data.materials[0]).nodes if each.type == "NORMAL_MAP")
    node.uv_map = "Lost"
    assert any("it has no UV map 'Lost' for normal maps" in note.message for note in translate().notes)
