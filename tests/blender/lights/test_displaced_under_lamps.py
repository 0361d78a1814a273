# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that displacement turns toward a lamp are lit by it, though the normals before the displacement are not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blender.cycles import cycles, ours, settings

bpy = pytest.importorskip("bpy")


def faceted(build, shader, lamp):
    """A smooth ball that displacement turns into a stone of large faces, lit from one side."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
    ball = bpy.context.object
    ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), bool))
    material = build.material(shader=shader)
    material.displacement_method = "BOTH"
    tree = material.node_tree
    cells, moved = (tree.nodes.new(f"ShaderNode{name}") for name in ("TexVoronoi", "Displacement"))
    cells.inputs["Scale"].default_value, moved.inputs["Scale"].default_value = 4.0, 0.3
    place = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    for source, target in ((place, cells.inputs["Vector"]), (cells.outputs[0], moved.inputs["Height"]),
                           (moved.outputs[0], output.inputs["Displacement"])):  # fmt: skip
        tree.links.new(source, target)
    ball.data.materials.append(material)
    if lamp:
        point = build.light("POINT")
        point.location, point.data.energy = (2.0, 3.5, 3.0), 1000.0
    else:
        world = bpy.context.scene.world = bpy.data.worlds.new("World")
        world.color = (0.5, 0.5, 0.5)
    build.camera(type="ORTHO", ortho_scale=2.4)


@pytest.mark.parametrize("lamp", [True, False])
@pytest.mark.parametrize("shader", ["ShaderNodeBsdfDiffuse", "ShaderNodeBsdfPrincipled"])
def test_they_are_as_bright_as_in_cycles(build, tmp_path, shader, lamp):
    settings(samples=64, size=32)
    faceted(build, shader, lamp)
    found, notes = ours(samples=64)
    assert not notes
    wanted = cycles(tmp_path)
    quarters = [np.mean(picture.reshape(4, 8, 4, 8, -1)[..., :3], axis=(1, 3, 4)) for picture in (found, wanted)]
    assert np.abs(quarters[0] - quarters[1]).max() < 0.02 * wanted[..., :3].mean() + 0.02 * quarters[1].max()
