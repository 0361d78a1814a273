# SPDX-License-Identifier: GPL-3.0-or-later
"""Random edits of a Blender file, each of a type that an artist makes; none may fail for any file."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from benchmarks.viewport.edits.data import EDITS as DATA
from benchmarks.viewport.edits.rigs import EDITS as RIGS
from benchmarks.viewport.edits.shading import (
    fog,
    group_edit,
    group_node,
    lamp,
    lamp_kind,
    lamp_size,
    lamp_spectrum,
    new_material,
    node_added,
    node_gone,
    number,
    objects,
    on,
    one_of,
    paint,
    some_nodes,
    some_object,
    some_shader,
    weight,
    world,
)

Edit = Callable[[np.random.Generator], None]
MOST_OBJECTS = 30


def move(obj, rng):
    obj.location = rng.uniform(-2, 2, 3)


def turn(obj, rng):
    obj.rotation_euler = rng.uniform(-3, 3, 3)
    obj.scale = rng.choice([1.0, 0.7, -1.2], 3)


def parent(obj, rng):
    other = one_of(rng, objects())
    seen = other
    while seen is not None and seen != obj:
        seen = seen.parent
    obj.parent = other if seen is None else None


def reshape(obj, rng):
    mesh = obj.data
    if len(mesh.vertices):
        mesh.vertices[int(rng.integers(len(mesh.vertices)))].co.z += rng.uniform(-0.3, 0.3)
        mesh.update()


def modify(obj, rng):
    if len(obj.modifiers) and rng.random() < 0.5:
        obj.modifiers.remove(obj.modifiers[0])
    elif len(obj.modifiers) < 2:
        array = obj.modifiers.new("Array", "ARRAY")
        array.count = int(rng.integers(1, 4))


def shade(obj, rng):
    smooth = bool(rng.integers(2))
    for face in obj.data.polygons:
        face.use_smooth = smooth
    obj.data.update()


def slot(obj, rng):
    material = one_of(rng, [*bpy.data.materials, None])
    if len(obj.material_slots) and rng.random() < 0.7:
        place = obj.material_slots[int(rng.integers(len(obj.material_slots)))]
        place.link = str(rng.choice(["OBJECT", "DATA"]))
        place.material = material
    elif material is not None and len(obj.data.materials) < 4:
        obj.data.materials.append(material)


def faces(obj, rng):
    for face in obj.data.polygons:
        face.material_index = int(rng.integers(3))
    obj.data.update()


def add(rng):
    if len(objects()) >= MOST_OBJECTS:
        return
    kind = int(rng.integers(5))
    place = tuple(rng.uniform(-2, 2, 3))
    if kind == 0:
        bpy.ops.mesh.primitive_cube_add(location=place)
    elif kind == 1:
        bpy.ops.mesh.primitive_uv_sphere_add(location=place, segments=8, ring_count=5)
    elif kind == 2:
        bpy.ops.object.light_add(type=str(rng.choice(["POINT", "AREA", "SPOT", "SUN"])), location=place)
    elif kind == 3:
        bpy.ops.object.text_add(location=place)
    else:
        bpy.ops.object.empty_add(location=place)


def copy(obj, rng):
    if len(objects()) < MOST_OBJECTS:
        made = obj.copy()
        if obj.data is not None and rng.random() < 0.5:
            made.data = obj.data.copy()
        bpy.context.scene.collection.objects.link(made)


def delete(obj, _rng):
    if len(objects()) > 5:
        bpy.data.objects.remove(obj)


def instance(obj, rng):
    """An empty shows a collection again."""
    collection = one_of(rng, bpy.data.collections)
    if collection is not None and obj.name not in collection.all_objects:
        obj.instance_type, obj.instance_collection = "COLLECTION", collection


def gather(obj, rng):
    """Put an object into a collection, or remove it."""
    collection = one_of(rng, bpy.data.collections) or bpy.data.collections.new("Group")
    if collection.name not in bpy.context.scene.collection.children:
        bpy.context.scene.collection.children.link(collection)
    if obj.instance_collection == collection:
        return
    if obj.name in collection.objects:
        collection.objects.unlink(obj)
        if not obj.users_collection:
            bpy.context.scene.collection.objects.link(obj)
    else:
        collection.objects.link(obj)


def rename(_rng_item, rng):
    item = one_of(
        rng,
        [*bpy.data.objects, *bpy.data.meshes, *bpy.data.materials, *bpy.data.lights],
        lambda each: each.library is None,
    )
    item.name = str(rng.choice(["Thing", "Other", "Cube"]))


def visibility(obj, rng):
    name = str(rng.choice(["visible_camera", "visible_shadow", "visible_glossy", "is_holdout", "is_shadow_catcher"]))
    setattr(obj, name, not getattr(obj, name))


def hide(obj, rng):
    kind = int(rng.integers(3))
    if kind == 0:
        obj.hide_set(not obj.hide_get())
    elif kind == 1:
        obj.hide_viewport = not obj.hide_viewport
    else:
        obj.hide_render = not obj.hide_render


def identity(obj, rng):
    obj.pass_index = int(rng.integers(10))
    obj.color = (*rng.uniform(0, 1, 3), 1.0)
    obj["value"] = float(rng.uniform(0, 1))
    obj.update_tag()


def light_group(obj, rng):
    layer = bpy.context.view_layer
    if not len(layer.lightgroups):
        layer.lightgroups.add(name="Key")
    obj.lightgroup = str(rng.choice(["", "Key"]))
    obj.update_tag()


def linking(obj, rng):
    """A lamp lights one collection alone."""
    obj.light_linking.receiver_collection = one_of(rng, [*bpy.data.collections, None])


def frame(rng):
    obj = one_of(rng, objects("MESH"))
    if obj is not None and rng.random() < 0.5:
        obj.keyframe_insert("location", frame=int(rng.integers(1, 20)))
    bpy.context.scene.frame_set(int(rng.integers(1, 20)))


def film(rng):
    bpy.context.scene.render.film_transparent = bool(rng.integers(2))


def scatter(obj, rng):
    """Cones over a surface, in another number, size or place than before: geometry nodes, or hair that is objects."""
    made = obj.modifiers.get("Scatter")
    if made is not None and rng.random() < 0.3:
        obj.modifiers.remove(made)
    elif made is None and rng.random() < 0.4:
        hair = next((each for each in obj.particle_systems), None)
        if hair is None:
            obj.modifiers.new("Hair", "PARTICLE_SYSTEM")
            hair = obj.particle_systems[0]
        _strew(hair.settings, obj, rng)
    else:
        made = made or obj.modifiers.new("Scatter", "NODES")
        made.node_group = made.node_group or _cones()
        nodes = made.node_group.nodes
        nodes["Points"].inputs["Density"].default_value = float(rng.choice([1.0, 3.0, 6.0]))
        nodes["Points"].inputs["Seed"].default_value = int(rng.integers(9))
        nodes["Copies"].inputs["Scale"].default_value = (float(rng.choice([0.1, 0.2])), 0.1, 0.2)
        nodes["Paint"].inputs["Material"].default_value = one_of(rng, [*bpy.data.materials, None])


def _cones():
    """A node group that adds cones to a surface."""
    group = bpy.data.node_groups.new("Cones", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    made = {}
    for name, kind in {"In": "NodeGroupInput", "Out": "NodeGroupOutput", "Cone": "GeometryNodeMeshCone",
                       "Points": "GeometryNodeDistributePointsOnFaces", "Copies": "GeometryNodeInstanceOnPoints",
                       "Paint": "GeometryNodeSetMaterial", "Both": "GeometryNodeJoinGeometry"}.items():  # fmt: skip
        made[name] = group.nodes.new(kind)
        made[name].name = name
    made["Cone"].inputs["Vertices"].default_value = 5
    links = {("In", 0): ("Points", "Mesh"), ("Points", "Points"): ("Copies", "Points"), ("Cone", 0): ("Paint", 0),
             ("Paint", 0): ("Copies", "Instance"), ("Copies", 0): ("Both", 0), ("Both", 0): ("Out", 0)}  # fmt: skip
    for (first, out), (second, into) in links.items():
        group.links.new(made[first].outputs[out], made[second].inputs[into])
    group.links.new(made["In"].outputs[0], made["Both"].inputs[0])
    return group


def _strew(settings, obj, rng):
    """Hair that shows another object of the scene in place of each strand."""
    settings.type, settings.render_type = "HAIR", "OBJECT"
    settings.count, settings.particle_size = int(rng.choice([20, 100, 150])), float(rng.choice([0.05, 0.1]))
    settings.instance_object = one_of(rng, objects("MESH"), lambda each: each != obj and not each.particle_systems)


def override(rng):
    bpy.context.view_layer.material_override = one_of(rng, [*bpy.data.materials, None, None])


EDITS: dict[str, Edit] = {
    "move": on(some_object(), move),
    "turn": on(some_object(), turn),
    "parent": on(some_object(), parent),
    "reshape": on(some_object("MESH"), reshape),
    "modify": on(some_object("MESH"), modify),
    "shade": on(some_object("MESH"), shade),
    "slot": on(some_object("MESH"), slot),
    "faces": on(some_object("MESH"), faces),
    "add": add,
    "copy": on(some_object(), copy),
    "delete": on(some_object(), delete),
    "instance": on(some_object("EMPTY"), instance),
    "gather": on(some_object(), gather),
    "rename": on(some_object(), rename),
    "visibility": on(some_object("MESH", "LIGHT"), visibility),
    "hide": on(some_object(), hide),
    "identity": on(some_object(), identity),
    "light group": on(some_object("MESH", "LIGHT"), light_group),
    "linking": on(some_object("LIGHT"), linking),
    "lamp": on(some_object("LIGHT"), lamp),
    "lamp kind": on(some_object("LIGHT"), lamp_kind),
    "lamp size": on(some_object("LIGHT"), lamp_size),
    "lamp spectrum": on(some_object("LIGHT"), lamp_spectrum),
    "number": on(some_shader, number),
    "weight": on(some_shader, weight),
    "node added": on(some_shader, node_added),
    "node gone": on(some_shader, node_gone),
    "group node": on(some_shader, group_node),
    "group edit": on(some_shader, group_edit),
    "paint": on(some_shader, paint),
    "fog": on(some_nodes, fog),
    "world": world,
    "frame": frame,
    "film": film,
    "override": override,
    "scatter": on(some_object("MESH"), scatter),
    "new material": new_material,
    **RIGS,
    **DATA,
}
