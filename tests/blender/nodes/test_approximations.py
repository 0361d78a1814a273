# SPDX-License-Identifier: GPL-3.0-or-later
"""Notes on differences that depend on the whole scene; random numbers of objects equal those of Cycles."""

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


@pytest.mark.parametrize(
    ("kind", "tells"), [("Glass", True), ("Translucent", True), ("Transparent", True), ("Diffuse", False)]
)
def test_faces_that_coincide_with_a_floor_get_a_note_where_light_passes(build, translate, kind, tells):
    """Cycles meets one of the two faces by chance, and loses light between them."""
    build.plane(name="Ground", size=10.0)
    cube = smooth_cube()
    cube.location, cube.rotation_euler = (0.3, 0.2, 1.0), (0, 0, 0.5)
    shaded(cube, f"ShaderNodeBsdf{kind}")
    assert ("coincide with faces of 'Ground'" in messages(translate())) is tells
    cube.location.z = 1.01
    assert not translate().notes
    cube.location = (20.0, 0.0, 1.0)  # in the plane of the ground, beside it
    assert not translate().notes
    cube.location, cube.rotation_euler.z = (6.0, 0.0, 1.0), 0.0  # as a tile that touches the ground at an edge
    assert not translate().notes


@pytest.mark.parametrize("segments", [48, 400])
def test_a_bottom_of_many_small_faces_counts_as_a_whole(build, translate, segments):
    """Each face of the fan has far less than a hundredth of the area."""
    build.plane(name="Ground", size=10.0)
    bpy.ops.mesh.primitive_cone_add(vertices=segments, radius1=0.8, radius2=0.9, depth=1.6, end_fill_type="TRIFAN")
    cup = bpy.context.object
    cup.location = (0.3, 0.2, 0.8)
    shaded(cup, "ShaderNodeBsdfGlass")
    assert "coincide with faces of 'Ground'" in messages(translate())
    cup.location.z = 0.81
    assert not translate().notes


@pytest.mark.parametrize(("kind", "gap", "tells"), [("Translucent", 0.0, True), ("Translucent", 0.01, False),
                                                     ("Diffuse", 0.0, False)])  # fmt: skip
def test_faces_that_coincide_with_each_other_get_a_note(build, translate, kind, gap, tells):
    """Two boxes of one mesh, side by side."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
    boxes = corners + [(x + 1 + gap, y, z * 1.5) for x, y, z in corners]
    thing = build.mesh("Boxes", boxes, faces + [tuple(8 + k for k in face) for face in faces])
    shaded(thing, f"ShaderNodeBsdf{kind}")
    assert ("coincide with each other" in messages(translate())) is tells


def test_faces_of_both_windings_get_a_note_where_light_enters(build, translate):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    shaded(ball, "ShaderNodeBsdfTranslucent")
    assert not translate().notes
    for polygon in list(ball.data.polygons)[::4]:
        polygon.flip()
    ball.data.update()
    assert "Recalculate Outside" in messages(translate())
    shaded(ball, "ShaderNodeBsdfDiffuse")
    assert not translate().notes


def test_caustics_of_diffuse_and_glossy_surfaces_get_a_note_and_ray_visibility_none(build, translate):
    lamp = build.light("POINT")
    thing = build.plane()
    shaded(thing, "ShaderNodeBsdfDiffuse")
    lamp.visible_glossy = bpy.context.scene.cycles.caustics_reflective = False
    assert not translate().notes
    shaded(thing, "ShaderNodeBsdfPrincipled")
    (note,) = translate().notes  # lamps hidden from some rays leave out closures, so that nothing is approximated
    assert "caustics are off" in note.message


def test_generated_coordinates_of_a_modified_mesh_get_a_note(build, translate):
    cube = smooth_cube()
    tree, node = shaded(cube, "ShaderNodeBsdfDiffuse")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], node.inputs["Color"])
    assert not translate().notes
    cube.modifiers.new("Array", "ARRAY")
    assert "after its modifiers" in messages(translate())


def test_the_random_number_of_an_object_equals_that_of_cycles(build, translate):
    """Compared with a separate implementation of the hash of the object's name."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=4)
    bpy.context.object.name = "Sphere"
    assert translate().instances[0].random == pytest.approx(0.23682033, abs=1e-6)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
@pytest.mark.parametrize("shader", ["ShaderNodeBsdfPrincipled", "ShaderNodeBsdfGlass", "ShaderNodeEmission"])
def test_a_number_that_is_not_finite_gets_a_note_and_the_object_is_kept(build, translate, shader, bad):
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


def test_thousands_of_glass_instances_are_compared_up_to_a_limit(blender, monkeypatch):
    import numpy as np

    from blender_addon.translate import approximations
    from blender_addon.translate.context import Translation
    from blender_addon.translate.faces import coincident
    from spectral_core.scene import Camera, Film, Glass, Instance, Material, Mesh, Scene

    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5]], np.uint32)
    places = [np.eye(4) for _ in range(1500)]
    for number, matrix in enumerate(places):
        matrix[:3, 3] = 0.37 * number / 1500, 0.0, 0.1 * number / 1500  # all boxes overlap, few faces coincide
    scene = Scene(
        camera=Camera(world_from_camera=np.eye(4)), film=Film(4, 4),
        meshes=(Mesh("cube", corners, faces),), materials=(Material("glass", Glass()),),
        instances=tuple(Instance(f"cube {k}", "cube", matrix, ("glass",)) for k, matrix in enumerate(places)),
    )  # fmt: skip
    compared = []
    monkeypatch.setattr(coincident, "lies_on", lambda planes, others: compared.append(len(others)))
    monkeypatch.setattr(coincident, "MOST_COMPARED", 30_000)
    translation = Translation.of(bpy.context.evaluated_depsgraph_get(), bpy.data)
    approximations.note_approximations(translation, scene, compares_faces=True)
    assert 0 < sum(compared) <= 30_000


def test_faces_that_are_there_twice_get_a_note(build, translate):
    """Opaque ones as well: a copy in the same position, and a mirrored half that lies on the other one."""
    build.plane(name="Ground", size=10.0)
    from mathutils import Vector

    cube = smooth_cube()
    cube.location.z = 3.0
    assert not translate().notes
    copy = cube.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert f"are the same as faces of '{cube.name}'" in messages(translate())
    copy.location += Vector((0.01, 0.013, 0.017))
    assert not translate().notes
    bpy.data.objects.remove(copy)
    # the diagonals of the mirrored squares cross those of the first ones
    cube.modifiers.new("Mirror", "MIRROR").use_mirror_merge = False
    assert "are the same as each other" in messages(translate())


def test_a_scale_of_zero_lays_faces_on_each_other(build, translate):
    build.plane(name="Ground", size=10.0)
    cube = smooth_cube()
    cube.location.z = 3.0
    other = cube.copy()  # of the same mesh, and not flat
    other.location.x = 7.0
    bpy.context.scene.collection.objects.link(other)
    assert not translate().notes
    cube.scale.z = 0.0
    assert "are the same as each other" in messages(translate())
    cube.scale.z = 0.01
    assert not translate().notes
    cube.scale = (0.0, 0.0, 0.0)
    translate()


@pytest.mark.parametrize("setting", ["is_holdout", "is_shadow_catcher"])
def test_holdouts_and_shadow_catchers_beside_volumes_get_a_note(build, translate, setting):
    """Cycles shows fog in front of a holdout, and catches the shadow of fog."""
    ground = build.plane(name="Ground", size=10.0)
    setattr(ground, setting, True)
    assert "volumes" not in messages(translate())
    fog = smooth_cube()
    tree, _ = shaded(fog, "ShaderNodeBsdfTransparent")
    node = tree.nodes.new("ShaderNodeVolumeScatter")
    output = next(each for each in tree.nodes if each.type == "OUTPUT_MATERIAL")
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    found = [note.subject for note in translate().notes if "of volumes" in note.message]
    assert found == [ground.name]


@pytest.mark.parametrize(("joins", "tells"), [("Add", True), ("Mix", False)])
def test_a_sum_of_metals_gets_a_note(build, translate, joins, tells):
    """A sum of an emission and a metal has none."""
    ground = build.plane(name="Ground", size=10.0)
    tree, first = shaded(ground, "ShaderNodeBsdfMetallic")
    join, second = tree.nodes.new(f"ShaderNode{joins}Shader"), tree.nodes.new("ShaderNodeBsdfMetallic")
    light = tree.nodes.new("ShaderNodeEmission")
    output = next(each for each in tree.nodes if each.type == "OUTPUT_MATERIAL")
    ends = [socket for socket in join.inputs if socket.type == "SHADER"]
    tree.links.new(join.outputs[0], output.inputs["Surface"])
    tree.links.new(first.outputs[0], ends[0])
    tree.links.new(light.outputs[0], ends[1])
    assert "adds metals" not in messages(translate())
    tree.links.new(second.outputs[0], ends[1])
    assert ("adds metals" in messages(translate())) is tells


@pytest.mark.parametrize(("kind", "tells"), [("Transparent", True), ("Diffuse", False)])
def test_a_shadow_catcher_that_is_seen_through_gets_a_note(build, translate, kind, tells):
    ball = smooth_cube()
    ball.is_shadow_catcher = True
    shaded(ball, f"ShaderNodeBsdf{kind}")
    assert ("shadow catcher with transparent parts" in messages(translate())) is tells


def test_a_volume_that_shadow_linking_excludes_as_a_blocker_gets_a_note(build, translate):
    ball, lamp = smooth_cube(), build.light("POINT")
    linked = bpy.data.collections.new("casts no shadow")
    linked.objects.link(ball)
    lamp.light_linking.blocker_collection = linked
    linked.collection_objects[0].light_linking.link_state = "EXCLUDE"
    assert not translate().notes
    tree, _ = shaded(ball, "ShaderNodeBsdfDiffuse")
    fog, output = tree.nodes.new("ShaderNodeVolumeScatter"), tree.nodes["Material Output"]
    tree.links.new(fog.outputs[0], output.inputs["Volume"])
    (note,) = translate().notes
    assert note.subject == ball.name and f"takes light of {lamp.name!r} away" in note.message


@pytest.mark.parametrize("has_lamp", [True, False])
def test_shadow_linking_of_emission_beside_lamps_gets_a_note(build, translate, has_lamp):
    """Shadow linking of an object that emits nothing has none."""
    ground, ball = build.plane(name="Ground", size=10.0), smooth_cube()
    ball.location.z = 3.0
    linked = bpy.data.collections.new("casts shadows")
    linked.objects.link(ball)
    ground.light_linking.blocker_collection = ball.light_linking.blocker_collection = linked
    if has_lamp:
        build.light("POINT")
    assert "shadow linking" not in messages(translate())
    shaded(ball, "ShaderNodeEmission")
    found = [note.subject for note in translate().notes if "shadow linking" in note.message]
    assert found == ([ball.name] if has_lamp else [])


def test_a_long_row_of_shaders_searches_its_links_once(build, translate, monkeypatch):
    """Each socket compared itself with all links of its tree: 300 mixes in a row took 6 s, now 1 s."""
    from spectral_core.scene import Diffuse, Metal, weighted_leaves

    material = build.material("row")
    tree = material.node_tree
    tree.nodes.clear()
    last, end = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeBsdfMetallic")
    for _ in range(40):
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(last.outputs[0], mix.inputs[1])
        tree.links.new(end.outputs[0], mix.inputs[2])
        last = mix
    tree.links.new(last.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    build.plane(material=material)
    own, searched = bpy.types.NodeSocket.links, []
    counting = property(lambda socket: searched.append(socket.name) or own.fget(socket))
    monkeypatch.setattr(bpy.types.NodeSocket, "links", counting)
    found = {type(leaf): weight.constant for weight, leaf in weighted_leaves(translate().materials[0].surface)}
    assert found == {Diffuse: pytest.approx(0.5**40), Metal: pytest.approx(1 - 0.5**40)}
    assert len(searched) < 10
