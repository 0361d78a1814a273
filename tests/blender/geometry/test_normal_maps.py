# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of Blender's normal maps."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")


def test_a_normal_map_turns_the_smooth_normal_of_a_displaced_surface(build, translate):
    """As in Cycles: the displacement bends what has no normal of its own, and the horizon at which light fades."""
    from blender_addon import compat
    from spectral_core.scene.shading import OnRaised, Raised

    material = build.material(shader="ShaderNodeBsdfDiffuse")
    build.plane(material=material)
    tree = compat.use_nodes(material)
    output = next(each for each in tree.nodes if each.type == "OUTPUT_MATERIAL")
    noise, moved = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeDisplacement")
    tree.links.new(noise.outputs[0], moved.inputs["Height"])
    tree.links.new(moved.outputs[0], output.inputs["Displacement"])
    material.displacement_method = "BUMP"

    def normal():
        return next(item.surface.normal for item in translate().materials if item.name == material.name)

    assert isinstance(normal(), Raised)
    node = tree.nodes.new("ShaderNodeNormalMap")
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Normal"])
    found = normal()
    assert isinstance(found, OnRaised)
    assert "bump" in {step.operation for step in found.surface.program.instructions}
    assert "bump" not in {step.operation for step in found.program.instructions}
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], tree.nodes["shader"].inputs["Normal"])
    assert "bump" in {step.operation for step in normal().program.instructions}


SCALES = [(1.0, 1.0, 1.0), (1.0, 0.25, 2.0), (-1.0, 0.5, 1.0)]


def _direction(surface_normal, matrix):
    """What a program of directions gives on a plane whose UV map grows along x and y of its object."""
    inverse = np.linalg.inv(matrix)
    normal = inverse[2] / np.linalg.norm(inverse[2])
    inputs = {"normal": normal, "true_normal": normal, "backfacing": 0.0, "attribute_smooth_normal": np.zeros(3),
              "attribute_tangent:": np.array((1.0, 0.0, 0.0)), "attribute_tangent_sign:": np.ones(3)}  # fmt: skip

    def transform(vector, kind, space, back):
        chosen = matrix if back else inverse
        return tuple(np.linalg.inv(chosen).T @ vector if kind == "NORMAL" else chosen @ vector)

    def read(name, shift):
        return tuple(inputs[name]) if np.ndim(inputs[name]) else np.full(1, inputs[name])

    return np.ravel(surface_normal.program.evaluate(read, transform=transform))


@pytest.mark.parametrize("scale", SCALES)
def test_a_normal_map_applies_in_the_space_of_the_object(build, translate, scale):
    """As in Cycles: on a stretched object its normals turn as those of the mesh do."""
    from blender_addon import compat

    material = build.material(shader="ShaderNodeBsdfDiffuse")
    plane = build.plane(material=material)
    tree = compat.use_nodes(material)
    node = tree.nodes.new("ShaderNodeNormalMap")
    stored = np.array([0.4, 0.3, np.sqrt(0.75)])
    node.inputs["Color"].default_value = (*(0.5 + 0.5 * stored), 1)
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Normal"])
    plane.rotation_euler, plane.scale = (0.3, 0.5, 0.2), scale
    scene = translate()
    matrix = scene.instances[0].world_from_object[:3, :3]
    expected = np.linalg.inv(matrix).T @ stored
    (surface,) = (item.surface for item in scene.materials)
    np.testing.assert_allclose(_direction(surface.normal, matrix), expected / np.linalg.norm(expected), atol=1e-6)


@pytest.mark.parametrize("scale", SCALES)
def test_vector_displacement_follows_the_tangents_of_stretched_and_mirrored_objects(build, translate, scale):
    from blender_addon import compat

    material = build.material(shader="ShaderNodeBsdfDiffuse")
    plane = build.plane(size=2.0, material=material)
    tree = compat.use_nodes(material)
    node = tree.nodes.new("ShaderNodeVectorDisplacement")
    node.space, node.inputs["Midlevel"].default_value, node.inputs["Scale"].default_value = "TANGENT", 0.0, 1.0
    node.inputs["Vector"].default_value[:3] = 0.2, 0.3, 0.1  # along the tangent, the normal, the bitangent
    output = next(each for each in tree.nodes if each.type == "OUTPUT_MATERIAL")
    tree.links.new(node.outputs[0], output.inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"
    before = np.array([vertex.co[:] for vertex in plane.data.vertices])
    plane.scale = scale
    scene = translate()
    mesh = next(each for each in scene.meshes if each.name == scene.instances[0].mesh)
    found = np.unique(mesh.positions.round(5), axis=0)
    np.testing.assert_allclose(found, np.unique((before + np.array((0.2, 0.1, 0.3))).round(5), axis=0), atol=2e-5)
