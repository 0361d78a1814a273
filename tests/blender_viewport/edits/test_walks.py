# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of numbers do not walk over every object, and send the same scene as a walk."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")


def shader(name="Paint"):
    tree = bpy.data.materials[name].node_tree
    return next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED").inputs


def instanced(count=4):
    """A cube on each point of a grid, by geometry nodes."""
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(0, 0, 3))
    cube = bpy.context.object
    cube.name = "Seed"
    cube.data.materials.append(bpy.data.materials["Paint"])
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    grid, on, info = (tree.nodes.new(f"GeometryNode{name}") for name in ("MeshGrid", "InstanceOnPoints", "ObjectInfo"))
    grid.inputs["Vertices X"].default_value = grid.inputs["Vertices Y"].default_value = count
    info.inputs["Object"].default_value = cube
    out = tree.nodes.new("NodeGroupOutput")
    tree.links.new(grid.outputs["Mesh"], on.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], on.inputs["Instance"])
    tree.links.new(on.outputs["Instances"], out.inputs[0])
    holder = bpy.data.objects.new("Holder", bpy.data.meshes.new("Nothing"))
    bpy.context.scene.collection.objects.link(holder)
    holder.modifiers.new("Scatter", "NODES").node_group = tree


@pytest.fixture
def walks(stage, monkeypatch):
    """The scene with scattered cubes in a view, and the number of walks since the last look at it."""
    from blender_addon.translate import objects

    instanced()
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if world.node_tree is None:  # before Blender 5
        world.use_nodes = True
    stage.walked = []
    walked = objects._walked
    monkeypatch.setattr(objects, "_walked", lambda *given: stage.walked.append(1) or walked(*given))
    after(stage, lambda: None)
    return stage


def after(stage, edit):
    """Number of walks of an edit, whose scene must equal a complete translation."""
    from blender_addon.translate.scene import translate_scene
    from spectral_core.render.live.in_place.changes import difference
    from spectral_core.scene import Camera

    def follow(_scene, depsgraph):
        stage.session.update(stage.context, depsgraph)

    stage.walked.clear()
    bpy.app.handlers.depsgraph_update_post.append(follow)
    try:
        edit()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(follow)
    stage.session.look(stage.context, bpy.context.view_layer.depsgraph)
    count = len(stage.walked)
    sent = next(iter(stage.link.scenes.values()))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = Camera(world_from_camera=np.eye(4))
    whole = translate_scene(depsgraph, film=sent.film, seen_from=camera, shows=lambda _instance: True)
    left = difference(sent, whole)
    assert (list(left.items), [name for name in left.singles if name != "notes"]) == ([], [])
    assert {(note.subject, note.message) for note in sent.notes} == {(n.subject, n.message) for n in whole.notes}
    return count


def put(owner, name, value):
    return lambda: setattr(owner, name, value)


def muted(owner):
    """Blender reports the node tree of ``owner`` and not ``owner``."""
    if owner.node_tree is None:
        owner.use_nodes = True
        bpy.context.view_layer.update()
    return put(owner.node_tree.links[0], "is_muted", True)


NUMBERS = {
    "roughness": lambda: put(shader()["Roughness"], "default_value", 0.31),
    "color": lambda: put(shader()["Base Color"], "default_value", (0.1, 0.7, 0.2, 1)),
    "lamp": lambda: put(bpy.data.lights["Lamp"], "energy", 321),
    "lamp kind": lambda: put(bpy.data.lights["Lamp"], "type", "AREA"),
    "lamp moved": lambda: put(bpy.data.objects["Lamp"], "location", (1, 2, 3)),
    "ball moved": lambda: put(bpy.data.objects["Ball"], "location", (1, 2, 3)),
    "world": lambda: put(bpy.context.scene.world.node_tree.nodes["Background"].inputs[1], "default_value", 0.4),
    "muted link of a material": lambda: muted(bpy.data.materials["Paint"]),
    "muted link of a world": lambda: muted(bpy.context.scene.world),
}
MORE = {
    "lamp off": lambda: put(bpy.data.lights["Lamp"], "energy", 0),
    "source of instances moved": lambda: put(bpy.data.objects["Seed"], "location", (0, 1, 3)),
    "instancer moved": lambda: put(bpy.data.objects["Holder"], "location", (0, 1, 3)),
    "hidden": lambda: lambda: bpy.data.objects["Ball"].hide_set(True),
    "object color": lambda: put(bpy.data.objects["Ball"], "color", (1, 0, 0, 1)),
    "pass": lambda: put(bpy.data.objects["Ball"], "pass_index", 4),
    "ray visibility": lambda: put(bpy.data.objects["Ball"], "visible_shadow", False),
    "light group": lambda: put(bpy.data.objects["Ball"], "lightgroup", "Key"),
    "renamed": lambda: put(bpy.data.objects["Ball"], "name", "Apple"),
    "renamed material": lambda: put(bpy.data.materials["Paint"], "name", "Varnish"),
    "renamed lamp": lambda: put(bpy.data.objects["Lamp"], "name", "Bulb"),
    "more instances": lambda: put(bpy.data.node_groups["Scatter"].nodes["Grid"].inputs[2], "default_value", 5),
    "muted link of a lamp": lambda: muted(bpy.data.lights["Lamp"]),
    "deleted": lambda: lambda: bpy.data.objects.remove(bpy.data.objects["Lamp"]),
    "override": lambda: put(bpy.context.view_layer, "material_override", bpy.data.materials.new("Clay")),
}  # fmt: skip


@pytest.mark.parametrize("name", NUMBERS)
def test_an_edited_number_needs_no_walk(walks, name):
    assert after(walks, NUMBERS[name]()) == 0
    assert after(walks, NUMBERS["roughness"]()) == 0


@pytest.mark.parametrize("name", [name for name in MORE if name != "light group"])  # Blender does not report it
def test_other_edits_are_seen(walks, name):
    after(walks, MORE[name]())


@pytest.mark.parametrize("name", MORE)
def test_other_edits_are_seen_together_with_a_number(walks, name):
    other, number = MORE[name](), NUMBERS["color"]()

    def edit():
        number()
        other()

    after(walks, edit)
    after(walks, NUMBERS["lamp"]() if "Lamp" in bpy.data.objects else lambda: None)


def test_a_child_moves_with_its_parent(walks):
    bpy.data.objects["Floor"].parent = bpy.data.objects["Ball"]
    after(walks, lambda: None)
    after(walks, put(bpy.data.objects["Ball"], "location", (0, 0, 5)))


def test_a_material_that_reads_an_object_is_read_again(walks):
    tree = bpy.data.materials["Paint"].node_tree
    place, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
    place.object = bpy.data.objects["Lamp"]
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], shader()["Roughness"])
    after(walks, lambda: None)
    after(walks, NUMBERS["lamp moved"]())


def test_a_custom_property_is_read_again(walks):
    tree, ball = bpy.data.materials["Paint"].node_tree, bpy.data.objects["Ball"]
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name, ball["shine"] = "OBJECT", "shine", 0.2
    tree.links.new(node.outputs["Fac"], shader()["Roughness"])
    after(walks, lambda: None)

    def edit():
        ball["shine"] = 0.9
        bpy.data.lights["Lamp"].energy = 55

    after(walks, edit)


def test_a_linked_lamp_is_followed(walks):
    lit = bpy.data.collections.new("Lit")
    lit.objects.link(bpy.data.objects["Floor"])
    after(walks, put(bpy.data.objects["Lamp"].light_linking, "receiver_collection", lit))
    after(walks, lambda: lit.objects.link(bpy.data.objects["Ball"]))
    after(walks, NUMBERS["roughness"]())


def test_a_note_of_a_material_leaves_with_its_cause(walks):
    tree = bpy.data.materials["Paint"].node_tree
    bump = tree.nodes.new("ShaderNodeScript")
    after(walks, lambda: tree.links.new(bump.outputs[0], shader()["Roughness"]) if bump.outputs else None)
    after(walks, lambda: tree.nodes.remove(bump))


def test_a_walk_reads_once_what_instances_share(walks, monkeypatch):
    """16 instances differ in their matrices, names and random numbers only."""
    from blender_addon.translate.meshes import placed

    read = []
    shared = placed._shared
    monkeypatch.setattr(placed, "_shared", lambda *given: read.append(given[1].name) or shared(*given))
    after(walks, lambda: bpy.data.objects["Seed"].hide_set(True))
    scene = next(iter(walks.link.scenes.values()))
    assert read.count("Holder") == 4  # in two walks (of the edit, of the comparison): its own mesh, the instanced mesh
    assert len({item.world_from_object.tobytes() for item in scene.instances if item.shown_as == "Holder"}) == 16


def test_meshes_of_deleted_and_renamed_objects_are_freed(walks):
    """They were kept until an undo: a long session that adds and deletes objects took ever more memory."""
    from blender_addon.editing.viewport import session

    kept = next(iter(session._stages.values())).kept
    meshes, parts = len(kept.meshes), len(kept.parts)
    for number in range(4):

        def exchange(number=number):
            bpy.data.objects.remove(bpy.data.objects["Ball"])
            bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
            bpy.context.object.name = "Ball"
            bpy.context.object.data.name = f"Ball {number}"

        after(walks, exchange)
        after(walks, lambda number=number: setattr(bpy.data.objects["Ball"].data, "name", f"Other {number}"))
    assert len(kept.meshes) == meshes
    assert len(kept.parts) <= parts + 1


def test_the_light_group_of_an_object_in_an_instanced_collection_is_seen(walks):
    """Blender does not report it, and the scene does not list the object."""
    kept = bpy.data.collections.new("Kept")
    bpy.ops.mesh.primitive_cube_add(size=0.3, location=(0, 2, 0))
    cube = bpy.context.object
    kept.objects.link(cube)
    bpy.context.scene.collection.objects.unlink(cube)
    place = bpy.data.objects.new("Place", None)
    place.instance_type, place.instance_collection = "COLLECTION", kept
    bpy.context.scene.collection.objects.link(place)
    after(walks, lambda: None)
    group, number = put(cube, "lightgroup", "Key"), NUMBERS["color"]()

    def edit():
        group()
        number()

    after(walks, edit)
