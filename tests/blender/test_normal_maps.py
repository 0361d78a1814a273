# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of Blender's normal maps."""

from __future__ import annotations

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
