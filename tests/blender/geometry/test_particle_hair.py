# SPDX-License-Identifier: GPL-3.0-or-later
"""Particle hair: position and thickness, instances, shortened children, the material of a view layer."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def with_hair(build, **values):
    """A plane with particle hair, and the settings of its particles."""
    thing = build.plane(size=2.0)
    thing.modifiers.new("P", "PARTICLE_SYSTEM")
    settings = thing.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 50, 1.0
    for name, value in values.items():
        setattr(settings, name, value)
    return thing, settings


def hair_of(scene):
    """The instances of hair, and their vertices in the world."""
    meshes = {mesh.name: mesh for mesh in scene.meshes if mesh.is_strands}
    found = [item for item in scene.instances if item.mesh in meshes]
    matrices = [item.world_from_object for item in found]
    places = [meshes[item.mesh].positions for item in found]
    return found, [place @ m[:3, :3].T + m[:3, 3] for place, m in zip(places, matrices, strict=True)]


def test_particle_hair_follows_the_position_of_its_object(build, translate):
    thing, _ = with_hair(build)
    thing.location = (10, 0, 0)
    scene = translate()
    _, (places,) = hair_of(scene)
    assert len(scene.instances) == 2 and 8.9 < places[:, 0].min() < places[:, 0].max() < 11.1
    assert 0.5 < np.ptp(places[:, 2]) < 1.5 and not scene.notes


def test_particle_hair_is_as_thick_as_the_scale_of_its_object_makes_it(build, translate):
    """The radius is a length in the object's space; strands grow along the normal all the same."""
    from blender_addon.translate.strands import SIDES, WIDER

    thing, _ = with_hair(build, radius_scale=0.2, root_radius=1.0, tip_radius=1.0)
    thing.scale = (0.5, 0.5, 2.0)
    _, (places,) = hair_of(translate())
    ring = places[:SIDES]
    assert np.linalg.norm(ring - ring.mean(axis=0), axis=1) == pytest.approx(0.1 * WIDER * 0.5, rel=0.02)


def test_instances_of_an_object_have_its_particle_hair(build, translate):
    """Of a collection that is in no scene, in each of its instances; an object that hides itself keeps its hair."""
    thing, _ = with_hair(build)
    thing.show_instancer_for_render = thing.show_instancer_for_viewport = False
    group = bpy.data.collections.new("Group")
    group.objects.link(thing)
    bpy.context.scene.collection.objects.unlink(thing)
    for x in (5, 9):
        empty = bpy.data.objects.new("Empty", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (x, 0, 0)
    scene = translate()
    found, places = hair_of(scene)
    assert len(scene.instances) == len(found)
    assert [round(float(place[:, 0].mean())) for place in places] == [5, 9] and found[0].mesh == found[1].mesh


def test_shortened_children_end_where_they_are_cut(build, translate):
    """Blender returns zeros beyond the end of a shortened child."""
    thing, _ = with_hair(build, child_type="SIMPLE", rendered_child_count=3, child_percent=3, child_length=0.5)
    thing.location = (10, 0, 3)
    _, (places,) = hair_of(translate())
    assert places[:, 0].min() > 8.5 and places[:, 2].min() > 2.9 and places[:, 2].max() < 4.0


def test_the_material_of_a_view_layer_is_that_of_hair_too(build, translate):
    with_hair(build)
    layer = bpy.context.view_layer
    layer.material_override = bpy.data.materials.new("All")
    scene = translate()
    assert {item.materials for item in scene.instances} == {("All",)}


def geometry_output(build, name, shader="ShaderNodeEmission"):
    """A material that shines with an output of the Geometry node."""
    material = build.material(shader=shader)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(node.outputs[name], tree.nodes["shader"].inputs["Color"])
    return material


def test_the_tangent_of_the_geometry_node_is_the_direction_of_the_strand(build, tmp_path):
    """Around the object's Z axis on meshes; Cycles has dPdu on hair."""
    from tests.blender import cycles

    cycles.settings()
    camera = build.camera(location=(0, -5, 0.6), type="ORTHO", ortho_scale=2.5)
    camera.rotation_euler = (np.pi / 2, 0, 0)
    thing, _ = with_hair(build, radius_scale=0.2, root_radius=1.0, tip_radius=1.0)
    thing.data.materials.append(geometry_output(build, "Tangent"))
    theirs = cycles.cycles(tmp_path)
    mine, notes = cycles.ours()
    assert mine.mean((0, 1))[2] > 0.1 and not notes
    np.testing.assert_allclose(mine.mean((0, 1)), theirs.mean((0, 1)), atol=0.02)


def test_a_displacement_by_the_tangent_of_a_mesh_has_no_note_of_strands(build, translate):
    material = geometry_output(build, "Tangent", "ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    node = next(node for node in tree.nodes if node.type == "NEW_GEOMETRY")
    move, output = tree.nodes.new("ShaderNodeVectorDisplacement"), tree.nodes["Material Output"]
    tree.links.new(node.outputs["Tangent"], move.inputs["Vector"])
    tree.links.new(move.outputs[0], output.inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"
    build.plane(material=material)
    assert not [note for note in translate().notes if "strand" in note.message]


@pytest.mark.parametrize(("weight", "count"), [(0.0, 0), (0.4, 1)])
def test_subsurface_light_of_hair_has_a_note(build, translate, weight, count):
    """Cycles renders it black there."""
    thing, _ = with_hair(build)
    thing.data.materials.append(build.material(shader="ShaderNodeBsdfPrincipled", **{"Subsurface Weight": weight}))
    notes = translate().notes
    assert sum("below the surface" in note.message for note in notes) == count == len(notes)


def test_parametric_coordinates_of_hair_have_a_note(build, translate):
    thing, _ = with_hair(build)
    thing.data.materials.append(geometry_output(build, "Parametric"))
    (note,) = translate().notes
    assert "Parametric" in note.message and note.subject == thing.name


@pytest.mark.parametrize("is_shown", [True, False])
def test_hair_has_uvs_where_the_pass_shows_them(build, translate, is_shown):
    """Those of its roots, as in Cycles, though no material reads them; the pass was 0."""
    with_hair(build)
    bpy.context.view_layer.use_pass_uv = is_shown
    scene = translate()
    (hair,) = (mesh for mesh in scene.meshes if mesh.is_strands)
    assert (hair.uvs is not None and np.ptp(hair.uvs[:, 0]) > 0.5) == is_shown and not scene.notes
