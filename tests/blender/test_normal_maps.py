# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of Blender's normal maps."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")


def test_a_normal_map_reads_its_uv_map_by_name_only_if_another_one_renders(build, translate):
    import bpy

    from blender_addon import compat

    build.camera()
    material = bpy.data.materials.new("Bumpy")
    tree = compat.use_nodes(material)
    node = tree.nodes.new("ShaderNodeNormalMap")
    node.uv_map = "First"
    principled = next(each for each in tree.nodes if each.type == "BSDF_PRINCIPLED")
    tree.links.new(node.outputs[0], principled.inputs["Normal"])
    data = bpy.data.meshes.new("Square")
    data.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    first, second = data.uv_layers.new(name="First"), data.uv_layers.new(name="Second")
    data.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Square", data))

    def reads():
        (found,) = (item.surface for item in translate().materials)
        return found.normal.program.inputs

    first.active_render = True
    assert "tangent" in reads() and "attribute:First" not in reads()
    second.active_render = True
    assert "attribute:First" in reads() and "tangent" not in reads()


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
    inputs = {name: matrix @ axis / np.linalg.norm(matrix @ axis) for name, axis in zip(AXES, np.eye(3), strict=True)}
    inputs["normal"] = inverse[2] / np.linalg.norm(inverse[2])

    def transform(vector, kind, space, back):
        chosen = matrix if back else inverse
        return tuple(np.linalg.inv(chosen).T @ vector if kind == "NORMAL" else chosen @ vector)

    return np.ravel(surface_normal.program.evaluate(lambda name, shift: tuple(inputs[name]), transform=transform))


AXES = ("tangent", "bitangent", "normal")


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
