# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry: arrays compared with Blender corner by corner, shared meshes, modifiers, unusual meshes."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def corners_of(mesh):
    """Position, normal and UV of every triangle corner of a translated mesh."""
    index = mesh.triangles.ravel()
    parts = [array[index] for array in (mesh.positions, mesh.normals, mesh.uvs) if array is not None]
    return np.concatenate(parts, axis=1)


def corners_in_blender(source, *, normals, uvs):
    """The same data, read from Blender one corner at a time: the slow oracle."""
    source.calc_loop_triangles()
    rows = []
    for triangle in source.loop_triangles:
        for loop in triangle.loops:
            row = list(source.vertices[source.loops[loop].vertex_index].co)
            row += list(source.corner_normals[loop].vector) if normals else []
            row += list(source.uv_layers[0].uv[loop].vector) if uvs else []
            rows.append(row)
    return np.array(rows, dtype=np.float32)


@pytest.mark.parametrize("shading", ["flat", "smooth", "sharp", "custom"])
@pytest.mark.parametrize("uvs", [False, True])
def test_every_corner_equals_that_of_blender(blender, shading, uvs):
    from blender_addon.translate.meshes.triangles import translate_mesh

    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=7)
    source = bpy.context.object.data
    source.polygons.foreach_set("use_smooth", np.full(len(source.polygons), shading != "flat"))
    if shading == "sharp":
        edges = source.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
        edges.data.foreach_set("value", np.arange(len(source.edges)) % 3 == 0)
    if shading == "custom":
        source.normals_split_custom_set([(0.0, 0.6, 0.8)] * len(source.loops))
    source.update()
    mesh = translate_mesh("sphere", source, frozenset(("uv",)) if uvs else frozenset())
    expected = corners_in_blender(source, normals=shading != "flat", uvs=uvs)
    np.testing.assert_allclose(corners_of(mesh), expected, atol=1e-6)
    if shading in ("flat", "smooth") and not uvs:
        assert len(mesh.positions) == len(source.vertices)  # nothing needs a split
    if shading == "sharp":
        distinct = {(v, row.tobytes()) for v, row in zip(mesh.triangles.ravel(), corners_of(mesh), strict=True)}
        assert len(distinct) == len(mesh.positions)


@pytest.mark.parametrize("kind", ["cube", "cylinder"])
def test_smooth_faces_beside_flat_ones_have_the_normals_of_their_vertices(blender, kind):
    """As in Cycles, as long as no edge is sharp; Blender's own corner normals split at flat faces."""
    from blender_addon.translate.meshes.triangles import translate_mesh

    getattr(bpy.ops.mesh, f"primitive_{kind}_add")()
    source = bpy.context.object.data
    for number, face in enumerate(source.polygons):
        face.use_smooth = number % 2 == 1
    source.update()
    mesh = translate_mesh("thing", source)
    source.calc_loop_triangles()
    expected = [
        source.vertices[v].normal if source.polygons[t.polygon_index].use_smooth else t.normal
        for t in source.loop_triangles for v in t.vertices
    ]  # fmt: skip
    np.testing.assert_allclose(mesh.normals[mesh.triangles.ravel()], expected, atol=1e-6)
    source.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data[0].value = True
    source.update()
    sharp = translate_mesh("thing", source)
    np.testing.assert_allclose(corners_of(sharp), corners_in_blender(source, normals=True, uvs=False), atol=1e-6)


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="normals of faces are a vector attribute from Blender 5.0 on")
def test_normals_that_faces_have_by_an_attribute_bend_smooth_faces_alone(blender):
    """As in Cycles: a smooth face has the mean of the normals around each vertex, a flat one that of the geometry."""
    from blender_addon.translate.meshes.triangles import translate_mesh

    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1)
    source = bpy.context.object.data
    faces = [tuple(face.vertices) for face in source.polygons]
    true = np.array([face.normal[:] for face in source.polygons], np.float32)
    is_smooth = np.arange(len(faces)) % 3 > 0
    source.polygons.foreach_set("use_smooth", is_smooth)
    chosen = true + np.float32([0.5, 0.2, 0.0])
    chosen /= np.linalg.norm(chosen, axis=1, keepdims=True)
    source.attributes.new("custom_normal", "FLOAT_VECTOR", "FACE").data.foreach_set("vector", chosen.ravel())
    source.update()
    mesh = translate_mesh("thing", source)
    around = np.array([chosen[[v in face for face in faces]].mean(0) for v in range(len(source.vertices))])
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    expected = [around[v] if is_smooth[k] else true[k] for k, face in enumerate(faces) for v in face]
    found = mesh.normals[mesh.triangles.ravel()]
    np.testing.assert_allclose(found / np.linalg.norm(found, axis=1, keepdims=True), expected, atol=1e-5)


def test_split_keeps_equal_corners_together(rng):
    from blender_addon.translate.meshes.splits import split_corners

    corners = rng.integers(0, 50, 600).astype(np.int32)
    attributes = rng.integers(0, 2, (600, 3)).astype(np.float32)
    vertex, corner = split_corners(corners, attributes, 50)
    kinds = {(v, row.tobytes()) for v, row in zip(corners, attributes, strict=True)}
    assert len(corner) == len(kinds) == vertex.max() + 1
    np.testing.assert_array_equal(attributes[corner[vertex]], attributes)
    np.testing.assert_array_equal(corners[corner[vertex]], corners)


def test_hash_collisions_cost_memory_and_change_nothing(monkeypatch):
    """If two different rows have the same hash, every row becomes a separate vertex."""
    from blender_addon.translate.meshes import splits

    vertices, attributes = np.array([3, 3, 4]), np.array([[1.0], [2.0], [1.0]], dtype=np.float32)
    monkeypatch.setattr(splits.np, "unique", lambda *_, **__: (None, np.array([0]), np.zeros(3, dtype=int)))
    one, kind = splits.same_rows(vertices, attributes)
    np.testing.assert_array_equal(one[kind], [0, 1, 2])


def test_modifiers_are_applied_and_instances_share_one_mesh(build, translate):
    source = build.plane()
    source.modifiers.new("Array", "ARRAY").count = 4
    plain = build.mesh("Tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    twin = build.object("Twin", plain.data, (5, 0, 0))
    twin.scale = (-1, 2, 3)
    scene = translate()
    by_name = {instance.name: instance for instance in scene.instances}
    assert len(next(mesh for mesh in scene.meshes if mesh.name == by_name["Plane"].mesh).triangles) == 8
    assert by_name["Tri"].mesh == by_name["Twin"].mesh and len(scene.meshes) == 2
    np.testing.assert_allclose(by_name["Twin"].world_from_object, np.diag([-1.0, 2, 3, 1]) + np.eye(4, k=3) * 5)


def test_collection_instances_and_geometry_nodes_share_one_mesh(build, translate):
    tri = build.mesh("Tri", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    flock = bpy.data.collections.new("Flock")
    flock.objects.link(tri)
    bpy.context.scene.collection.objects.unlink(tri)
    for place in range(3):
        empty = build.object(f"Empty {place}", None, (place, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", flock
    scene = translate()
    assert len(scene.meshes) == 1 and len(scene.instances) == 3
    assert sorted(i.world_from_object[0, 3] for i in scene.instances) == [0, 1, 2]
    assert len({i.name for i in scene.instances}) == 3


def test_materials_go_with_their_faces_and_objects(build, translate):
    red, green, blue = (build.material(name) for name in ("Red", "Green", "Blue"))
    pair = build.mesh("Pair", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)], red)
    pair.data.materials.append(green)
    pair.data.polygons[1].material_index = 1
    twin = build.object("Twin", pair.data)
    twin.material_slots[1].link = "OBJECT"
    twin.material_slots[1].material = blue
    bare = build.mesh("Bare", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    bare.data.polygons[0].material_index = 2  # past the last slot
    scene = translate()
    assigned = {instance.name: instance.materials for instance in scene.instances}
    assert assigned["Pair"] == ("Red", "Green") and assigned["Twin"] == ("Red", "Blue")
    assert assigned["Bare"] == ("No material",) * 3
    np.testing.assert_array_equal(scene.meshes[0].material_indices, [0, 1])


@pytest.mark.parametrize("kind", ["CURVE", "FONT", "META", "SURFACE"])
def test_curves_text_and_metaballs_become_meshes(blender, translate, kind):
    if kind == "CURVE":
        bpy.ops.curve.primitive_bezier_circle_add()
        bpy.context.object.data.bevel_depth = 0.1
    elif kind == "FONT":
        bpy.ops.object.text_add()
    elif kind == "META":
        bpy.ops.object.metaball_add()
    else:
        bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.context.object.data.materials.append(bpy.data.materials.new("Gold"))
    scene = translate()
    assert [instance.materials for instance in scene.instances] == [("Gold",)]
    assert len(scene.meshes[0].triangles) > 4 and scene.notes == ()


def test_objects_without_faces_are_omitted_and_unsupported_ones_get_a_note(build, translate):
    build.mesh("Empty", [], [])
    build.mesh("Edge", [(0, 0, 0), (1, 0, 0)], [])
    fur = build.plane("Fur")
    fur.modifiers.new("Hair", "PARTICLE_SYSTEM")
    fur.particle_systems[0].settings.type = "HAIR"
    build.object("Cloud", bpy.data.volumes.new("Cloud"))
    build.object("Locks", bpy.data.hair_curves.new("Locks"))
    hidden = build.plane("Hidden")
    hidden.hide_viewport = True
    scene = translate()
    assert [instance.name for instance in scene.instances] == ["Fur", "Fur Hair"]
    assert {note.subject for note in scene.notes} == {"Cloud"}


def test_a_mesh_with_coordinates_that_are_not_finite_is_omitted_with_a_note(build, translate):
    build.mesh("Broken", [(0, 0, 0), (float("nan"), 0, 0), (0, 1, 0)], [(0, 1, 2)])
    build.plane("Whole")
    scene = translate()
    assert [instance.name for instance in scene.instances] == ["Whole"]
    assert [note.subject for note in scene.notes] == ["Broken"] and "not finite" in scene.notes[0].message


def test_the_uv_map_of_the_material_is_used(build, translate):
    material = build.material()
    tree = material.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = build.image("Dots", np.zeros((2, 2, 4)))
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "Second"
    tree.links.new(uv.outputs[0], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], tree.nodes["shader"].inputs["Color"])
    plane = build.plane(material=material)
    second = plane.data.uv_layers.new(name="Second")
    second.uv.foreach_set("vector", np.full(8, 0.25, dtype=np.float32))
    lonely = build.mesh("No UVs", [(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1, 2)], material)
    scene = translate()
    by_name = {mesh.name: mesh for mesh in scene.meshes}
    (moved,) = by_name["Plane"].attributes
    assert moved.name == "attribute:Second" and np.all(moved.values[:, :2] == 0.25)
    assert by_name[lonely.data.name].attributes == ()
    assert [(note.subject, "'Second'" in note.message) for note in scene.notes] == [("No UVs", True)]


def test_generated_coordinates_of_renders_are_those_before_all_modifiers(build):
    """Modifiers that add vertices, and shape keys: Blender carries the positions before them along for renders."""
    from blender_addon.translate.scene import translate_scene

    found = []

    class Engine(bpy.types.RenderEngine):
        bl_idname, bl_label = "TRANSLATES", "Translates"

        def render(self, depsgraph):
            found.append(translate_scene(depsgraph))

    material = build.material()
    tree = material.node_tree
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], tree.nodes["shader"].inputs["Color"])
    thing = build.plane(material=material)
    thing.shape_key_add(name="Basis")
    for point in thing.shape_key_add(name="Large").data:
        point.co *= 3.0
    thing.data.shape_keys.key_blocks["Large"].value = 1.0
    subdivision = thing.modifiers.new("Subdivision", "SUBSURF")
    subdivision.subdivision_type, subdivision.render_levels = "SIMPLE", 1
    data = bpy.data.cameras.new("Camera")
    bpy.context.scene.camera = bpy.data.objects.new("Camera", data)
    bpy.context.scene.collection.objects.link(bpy.context.scene.camera)
    bpy.utils.register_class(Engine)
    try:
        bpy.context.scene.render.engine = "TRANSLATES"
        bpy.ops.render.render()
    finally:
        bpy.context.scene.render.engine = "SPECTRAL"
        bpy.utils.unregister_class(Engine)
    (scene,) = found
    (mesh,) = scene.meshes
    (values,) = [each.values for each in mesh.attributes if each.name == "generated"]
    assert not scene.notes and np.abs(mesh.positions[:, :2]).max() == pytest.approx(3.0)
    assert values[:, :2] == pytest.approx(mesh.positions[:, :2] / 6.0 + 0.5, abs=1e-6)


def test_generated_coordinates_use_the_texture_space_before_modifiers(build, translate):
    material = build.material()
    tree = material.node_tree
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], tree.nodes["shader"].inputs["Color"])
    thing = build.plane(material=material)
    thing.data.use_auto_texspace = False
    thing.data.texspace_location, thing.data.texspace_size = (1, 0, 0), (2, 4, 1)
    taper = thing.modifiers.new("Taper", "SIMPLE_DEFORM")
    taper.deform_method, taper.factor = "TAPER", 0.8
    (mesh,) = translate().meshes
    (found,) = [each.values for each in mesh.attributes if each.name.startswith("generated")]
    corners = {(-1, -1): (0.0, 0.375), (1, -1): (0.5, 0.375), (1, 1): (0.5, 0.625), (-1, 1): (0.0, 0.625)}
    assert {tuple(row) for row in np.round(found[:, :2].astype(float), 4)} == set(corners.values())
    assert not np.allclose(np.abs(mesh.positions[:, :2]), 1.0)  # the modifier moved vertices
