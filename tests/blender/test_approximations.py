# SPDX-License-Identifier: GPL-3.0-or-later
"""What only the whole scene shows is named in a note, and numbers that Cycles draws are the same here."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")


def shaded(thing, kind, **inputs):
    from blender_addon import compat

    material = bpy.data.materials.new(kind)
    tree = compat.use_nodes(material)
    tree.nodes.clear()
    node, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    thing.data.materials.clear()
    thing.data.materials.append(material)
    return tree, node


def messages(scene):
    return " ".join(note.message for note in scene.notes)


def smooth_cube():
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    for polygon in cube.data.polygons:
        polygon.use_smooth = True
    return cube


def test_glass_smooth_shaded_over_hard_edges_is_named(build, translate):
    cube = smooth_cube()
    shaded(cube, "ShaderNodeBsdfGlass")
    assert "smooth-shaded over hard edges" in messages(translate())
    for polygon in cube.data.polygons:
        polygon.use_smooth = False
    assert not translate().notes


def test_kinds_of_rays_on_surfaces_that_scatter_both_ways_are_named(build, translate):
    lamp = build.light("POINT")
    thing = build.plane()
    shaded(thing, "ShaderNodeBsdfDiffuse")
    lamp.visible_glossy = bpy.context.scene.cycles.caustics_reflective = False
    assert not translate().notes
    shaded(thing, "ShaderNodeBsdfPrincipled")
    found = messages(translate())
    assert "counts as diffuse" in found and "caustics are off" in found


def test_low_indices_are_named(build, translate):
    shaded(build.plane(), "ShaderNodeBsdfPrincipled", Emission_Strength=1.0, Coat_Weight=0.5, IOR=0.8)
    assert "below 1" in messages(translate())


def test_generated_coordinates_of_a_modified_mesh_are_named(build, translate):
    cube = smooth_cube()
    tree, node = shaded(cube, "ShaderNodeBsdfDiffuse")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], node.inputs["Color"])
    assert not translate().notes
    cube.modifiers.new("Array", "ARRAY")
    assert "after its modifiers" in messages(translate())


def test_the_random_number_of_an_object_is_the_one_of_cycles(build, translate):
    """Worked out from the name by another program of the hash."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=4)
    bpy.context.object.name = "Sphere"
    assert translate().instances[0].random == pytest.approx(0.23682033, abs=1e-6)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
@pytest.mark.parametrize("shader", ["ShaderNodeBsdfPrincipled", "ShaderNodeBsdfGlass", "ShaderNodeEmission"])
def test_a_number_that_is_none_is_named_and_the_object_stays(build, translate, shader, bad):
    material = build.material(shader=shader)
    numbers = [each for each in material.node_tree.nodes["shader"].inputs if each.type == "VALUE" and each.enabled]
    for socket in numbers:
        socket.default_value = bad
    written = [each for each in numbers if not abs(each.default_value) <= 1e38]
    build.plane(material=material)
    scene = translate()
    assert len(scene.instances) == 1
    told = [note.message for note in scene.notes if "which is not a finite number; 0 was used" in note.message]
    assert written and told
