# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs that depend on the mesh, its mirrored scale or its normals equal those of Cycles."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
OpenEXR = pytest.importorskip("OpenEXR")

from tests.blender import cycles  # noqa: E402

CASES = {
    "alpha of a named color": ("ShaderNodeVertexColor", "Alpha", {"layer_name": "Lost"}, 1, 0.0),
    "alpha of no color": ("ShaderNodeVertexColor", "Alpha", {}, 1, 0.0),
    "alpha of an attribute": ("ShaderNodeAttribute", "Alpha", {"attribute_name": "Lost"}, 1, 1.0),
    "parametric": ("ShaderNodeNewGeometry", "Parametric", {}, 1, None),
    "parametric, mirrored": ("ShaderNodeNewGeometry", "Parametric", {}, -1, None),
}


def shown(build, kind, output, properties):
    """A square that emits 0.5 and a tenth of an output of a node, and the node tree."""
    from blender_addon import compat

    material = build.material("Shown", "ShaderNodeEmission")
    tree = compat.use_nodes(material)
    node, scaled = tree.nodes.new(kind), tree.nodes.new("ShaderNodeVectorMath")
    for name, value in properties.items():
        setattr(node, name, value)
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = (0.1,) * 3, (0.5,) * 3
    tree.links.new(node.outputs[output], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], next(each for each in tree.nodes if each.type == "EMISSION").inputs["Color"])
    return material, node, tree


def both(tmp_path):
    """Values of the output in a picture by Cycles and in one by this renderer, and the notes of the latter."""
    cycles.settings(samples=16, size=16)
    mine, notes = cycles.ours(16)
    return (cycles.cycles(tmp_path) - 0.5) / 0.1, (np.asarray(mine) - 0.5) / 0.1, notes


def seen_from_above(build):
    camera = build.camera()
    camera.location, camera.rotation_euler = (0, 0, 4), (0, 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.0


@pytest.mark.parametrize("case", CASES)
def test_inputs_of_a_mesh_equal_those_of_cycles(build, tmp_path, case):
    kind, output, properties, scale, expected = CASES[case]
    plane = build.plane(size=2.0, material=shown(build, kind, output, properties)[0])
    plane.scale.x = scale
    seen_from_above(build)
    theirs, mine, notes = both(tmp_path)
    assert np.abs(np.median(theirs, axis=(0, 1)) - np.median(mine[..., :3], axis=(0, 1))).max() < 0.03
    assert np.abs(np.sort(theirs, axis=None) - np.sort(mine, axis=None)).mean() < 0.01
    if expected is not None:
        np.testing.assert_allclose(mine, expected, atol=0.01)
        assert any(note.endswith(f"read {expected:.0f}") for note in notes)


@pytest.mark.parametrize("strength", [-0.3, 0.6])
def test_a_linked_strength_of_a_normal_map_may_be_negative(build, tmp_path, strength):
    material, node, tree = shown(build, "ShaderNodeNormalMap", "Normal", {})
    node.inputs["Color"].default_value = (0.9, 0.3, 0.6, 1.0)
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = strength
    tree.links.new(value.outputs[0], node.inputs["Strength"])
    build.plane(size=2.0, material=material)
    seen_from_above(build)
    theirs, mine, _ = both(tmp_path)
    bent = np.array((0.8 * strength, -0.4 * strength, 1.0 - 0.8 * max(strength, 0.0)))
    np.testing.assert_allclose(theirs.mean(axis=(0, 1)), bent / np.linalg.norm(bent), atol=0.01)
    np.testing.assert_allclose(mine.mean(axis=(0, 1)), bent / np.linalg.norm(bent), atol=0.01)


def test_incoming_does_not_depend_on_interpolated_normals(build, tmp_path):
    """On the sides of a smooth cube the normals lean away from the viewer by more than a right angle."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    cube = bpy.context.object
    cube.data.shade_smooth()
    cube.data.materials.append(shown(build, "ShaderNodeNewGeometry", "Incoming", {})[0])
    cube.rotation_euler = (0.0, 0.2, 0.0)
    camera = build.camera()  # above the lower part of the side that is seen
    camera.location, camera.rotation_euler = (-1.08, 0, 4), (0, 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.1
    theirs, mine, _ = both(tmp_path)
    for found in (theirs, mine):
        np.testing.assert_allclose(found, np.broadcast_to((0.0, 0.0, 1.0), found.shape), atol=0.02)


@pytest.mark.skipif(not hasattr(bpy.types.Material, "inline_shader_nodes"), reason="this Blender cannot inline trees")
@pytest.mark.parametrize("through", ["group", "output of a group", "muted"])
def test_blender_converts_constants_at_sockets_of_groups_and_muted_nodes(build, tmp_path, through):
    """(0.1, 0.5, 0.9) through a number is its mean 0.5."""
    material, node, tree = shown(build, "ShaderNodeCombineXYZ", "Vector", {})
    end = node.outputs[0].links[0].to_socket
    for socket, value in zip(node.inputs, (0.1, 0.5, 0.9), strict=True):
        socket.default_value = value
    if through == "muted":
        between = tree.nodes.new("ShaderNodeMath")
        between.mute = True
    else:
        group = bpy.data.node_groups.new("Pass", "ShaderNodeTree")
        kinds = ["NodeSocketFloat", "NodeSocketVector"]
        first, last = kinds if through == "group" else kinds[::-1]
        group.interface.new_socket("In", in_out="INPUT", socket_type=first)
        group.interface.new_socket("Out", in_out="OUTPUT", socket_type=last)
        start, stop = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        group.links.new(start.outputs[0], stop.inputs[0])
        between = tree.nodes.new("ShaderNodeGroup")
        between.node_tree = group
    tree.links.new(node.outputs[0], between.inputs[0])
    tree.links.new(between.outputs[0], end)
    build.plane(size=2.0, material=material)
    seen_from_above(build)
    theirs, mine, _ = both(tmp_path)
    np.testing.assert_allclose(theirs, 0.5, atol=0.01)
    np.testing.assert_allclose(mine, 0.5, atol=0.01)
