# SPDX-License-Identifier: GPL-3.0-or-later
"""Random edits whose effect reaches other data: drivers, rigs, layers, linked files, images, color management."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
import numpy as np

from benchmarks.viewport.edits.shading import objects, on, one_of, shader, some_object, some_shader

MOST_IMAGES, MOST_LIBRARIES = 4, 3


def _driven(owner, path, index, source):
    """A driver of a property by the place of an object."""
    curve = owner.driver_add(path) if index < 0 else owner.driver_add(path, index)
    variable = curve.driver.variables.new()
    variable.name, variable.type = "x", "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].transform_type = source, "LOC_X"
    curve.driver.type, curve.driver.expression = "SCRIPTED", "0.5 + 0.2 * x"


def driver(node, rng):
    """A number of a material follows an object, or no longer."""
    source, socket = one_of(rng, objects()), node.inputs["Roughness"]
    if source is None or socket.is_linked:
        return
    if not socket.driver_remove("default_value"):
        _driven(socket, "default_value", -1, source)


def lamp_driver(obj, rng):
    if not obj.data.driver_remove("energy"):
        source = one_of(rng, objects(), lambda each: each != obj)
        if source is not None:
            _driven(obj.data, "energy", -1, source)
            obj.data.animation_data.drivers[0].driver.expression = "100 + 40 * x"


def place_driver(obj, rng):
    if not obj.driver_remove("location", 2):
        source = one_of(rng, objects(), lambda each: each != obj and each.parent != obj and not _follows(each, obj))
        if source is not None:
            _driven(obj, "location", 2, source)


def _follows(obj, other):
    """True if an object follows another one, or may, through others."""
    data = obj.animation_data
    return (
        obj.parent is not None
        or bool(obj.constraints)
        or (data is not None and bool(len(data.drivers)))
        or obj == other
    )


def animate(node, rng):
    """Keys of a number of a material, and another frame."""
    for frame in (1, 15):
        node.inputs["Roughness"].default_value = float(rng.uniform())
        node.inputs["Roughness"].keyframe_insert("default_value", frame=frame)
    bpy.context.scene.frame_set(int(rng.integers(1, 20)))


def animate_lamp(obj, rng):
    for frame in (1, 15):
        obj.data.energy = float(rng.uniform(0, 500))
        obj.data.keyframe_insert("energy", frame=frame)
        obj.hide_viewport = bool(rng.integers(4) == 0)
        obj.keyframe_insert("hide_viewport", frame=frame)
    bpy.context.scene.frame_set(int(rng.integers(1, 20)))


def animate_world(rng):
    world = bpy.context.scene.world
    if world is None or world.node_tree is None:
        return
    node = next((each for each in world.node_tree.nodes if each.type == "BACKGROUND"), None)
    if node is not None and not node.inputs[1].is_linked:
        for frame in (1, 15):
            node.inputs[1].default_value = float(rng.uniform(0, 2))
            node.inputs[1].keyframe_insert("default_value", frame=frame)
        bpy.context.scene.frame_set(int(rng.integers(1, 20)))


def shape_key(obj, rng):
    keys = obj.data.shape_keys
    if keys is None and len(obj.data.vertices):
        obj.shape_key_add(name="Basis")
        key = obj.shape_key_add(name="Pulled")
        key.data[int(rng.integers(len(key.data)))].co.z += 0.7
    elif keys is not None and len(keys.key_blocks) > 1:
        keys.key_blocks[-1].value = float(rng.uniform())


def armature(obj, rng):
    """A bone that bends a mesh, and its pose."""
    rig = next((each for each in objects("ARMATURE")), None)
    if rig is None:
        data = bpy.data.armatures.new("Rig")
        rig = bpy.data.objects.new("Rig", data)
        bpy.context.scene.collection.objects.link(rig)
        if rig.name not in bpy.context.view_layer.objects:
            return
        bpy.context.view_layer.objects.active = rig
        bpy.ops.object.mode_set(mode="EDIT")
        bone = data.edit_bones.new("Bone")
        bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
        bpy.ops.object.mode_set(mode="OBJECT")
    if not any(each.type == "ARMATURE" for each in obj.modifiers) and rig.pose.bones:
        group = obj.vertex_groups.get("Bone") or obj.vertex_groups.new(name="Bone")
        group.add(range(len(obj.data.vertices)), 1.0, "REPLACE")
        obj.modifiers.new("Rig", "ARMATURE").object = rig
    for bone in rig.pose.bones:
        bone.rotation_mode, bone.rotation_euler = "XYZ", rng.uniform(-0.6, 0.6, 3)


def constraint(obj, rng):
    if len(obj.constraints):
        obj.constraints.remove(obj.constraints[0])
    else:
        target = one_of(rng, objects(), lambda each: each != obj and not _follows(each, obj))
        if target is not None:
            made = obj.constraints.new("COPY_LOCATION")
            made.target, made.use_offset, made.influence = target, True, 0.3


def layers(rng):
    """A collection leaves the view layer, is hidden in it, held out, or seen by other objects alone."""
    child = one_of(rng, bpy.context.view_layer.layer_collection.children)
    if child is not None:
        name = str(rng.choice(["exclude", "hide_viewport", "holdout", "indirect_only"]))
        setattr(child, name, not getattr(child, name))


def collection(rng):
    """A collection is hidden in all layers."""
    made = one_of(rng, bpy.data.collections)
    if made is not None:
        made.hide_viewport = not made.hide_viewport


def linked(rng):
    """An object of another file, as it is there or with changes of its own."""
    source = one_of(rng, objects("MESH"), lambda each: each.library is None and each.data.library is None)
    if source is None or len(bpy.data.libraries) >= MOST_LIBRARIES:
        return
    path = str(Path(tempfile.mkdtemp(dir=bpy.app.tempdir)) / "linked.blend")
    bpy.data.libraries.write(path, {source})
    with bpy.data.libraries.load(path, link=True) as (there, here):
        here.objects = there.objects[:1]
    for each in here.objects:
        bpy.context.scene.collection.objects.link(each)
        if rng.random() < 0.5:
            own = each.override_create()
            own.location.x += 1


def picture(node, rng):
    """An image in a material; its pixels, size or color space change."""
    tree, socket = node.id_data, node.inputs["Base Color"]
    used = socket.links[0].from_node if socket.is_linked else None
    if used is None or used.type != "TEX_IMAGE":
        used = tree.nodes.new("ShaderNodeTexImage")
        tree.links.new(used.outputs[0], socket)
    image = used.image or one_of(rng, bpy.data.images, lambda each: each.source == "GENERATED")
    if image is None or (rng.random() < 0.2 and len(bpy.data.images) < MOST_IMAGES):
        image = bpy.data.images.new("Painted", 4, 4)
    used.image = image
    kind = int(rng.integers(5))
    if kind == 0:
        image.scale(int(rng.integers(2, 6)), 3)
    elif kind == 1:
        image.colorspace_settings.name = str(rng.choice(["sRGB", "Non-Color"]))
    elif kind == 2:
        image.generated_color = (*rng.uniform(0, 1, 3), 1.0)
        image.generated_type = str(rng.choice(["BLANK", "COLOR_GRID"]))
    else:
        image.pixels.foreach_set(rng.uniform(0, 1, len(image.pixels)).astype(np.float32))
        image.update()
    image.update_tag()  # as a stroke of a brush does; the pixels alone tell nobody
    used.interpolation = str(rng.choice(["Linear", "Closest"]))


def management(rng):
    """What is seen changes, what is rendered does not."""
    settings = bpy.context.scene.view_settings
    settings.view_transform = str(rng.choice(["Standard", "Raw", "AgX"]))
    settings.exposure, settings.gamma = float(rng.uniform(-1, 1)), float(rng.uniform(0.8, 1.2))


def resolution(rng):
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = (int(rng.integers(8, 64)) for _ in range(2))
    render.resolution_percentage = int(rng.choice([50, 100]))
    render.pixel_aspect_x = float(rng.choice([1.0, 1.5]))


def units(rng):
    bpy.context.scene.unit_settings.scale_length = float(rng.choice([1.0, 0.1]))


def input_of_nodes(obj, rng):
    """A number of a modifier's own: geometry nodes that move the mesh."""
    made = obj.modifiers.get("Lift")
    if obj.library is not None:
        return
    if made is None or made.node_group is None:
        group = bpy.data.node_groups.get("Lift") or _lift()
        made = made or obj.modifiers.new("Lift", "NODES")
        made.node_group = group
    identifier = next(each.identifier for each in made.node_group.interface.items_tree if each.name == "Height")
    _set_input(made, identifier, float(rng.uniform(-0.5, 0.5)))
    made.show_viewport = bool(rng.random() < 0.8)
    obj.update_tag()


def _set_input(modifier, identifier, value):
    """Set a number of geometry nodes; from Blender 5.2 on their inputs are no custom properties of the modifier."""
    if hasattr(modifier, "properties"):
        getattr(modifier.properties.inputs, identifier).value = value
    else:
        modifier[identifier] = value


def _lift():
    group = bpy.data.node_groups.new("Lift", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    group.interface.new_socket("Height", in_out="INPUT", socket_type="NodeSocketFloat")
    start, move, end = (group.nodes.new(kind) for kind in
                        ("NodeGroupInput", "GeometryNodeTransform", "NodeGroupOutput"))  # fmt: skip
    axis = group.nodes.new("ShaderNodeCombineXYZ")
    group.links.new(start.outputs["Height"], axis.inputs["Z"])
    group.links.new(start.outputs["Geometry"], move.inputs["Geometry"])
    group.links.new(axis.outputs[0], move.inputs["Translation"])
    group.links.new(move.outputs[0], end.inputs[0])
    return group


def vertex_colors(obj, rng):
    """Colors of corners or points that a material reads."""
    mesh = obj.data
    if not len(mesh.vertices):
        return
    made = mesh.color_attributes.get("Col") or mesh.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    made.data.foreach_set("color", rng.uniform(0, 1, 4 * len(made.data)).astype(np.float32))
    mesh.update()
    node = shader(one_of(rng, mesh.materials))
    if node is not None and not node.inputs["Base Color"].is_linked:
        colors = node.id_data.nodes.new("ShaderNodeAttribute")
        colors.attribute_name = "Col"
        node.id_data.links.new(colors.outputs["Color"], node.inputs["Base Color"])


EDITS = {
    "driver": on(some_shader, driver),
    "lamp driver": on(some_object("LIGHT"), lamp_driver),
    "place driver": on(some_object(), place_driver),
    "animate": on(some_shader, animate),
    "animate lamp": on(some_object("LIGHT"), animate_lamp),
    "animate world": animate_world,
    "shape key": on(some_object("MESH"), shape_key),
    "armature": on(some_object("MESH"), armature),
    "constraint": on(some_object(), constraint),
    "layers": layers,
    "collection": collection,
    "linked": linked,
    "picture": on(some_shader, picture),
    "management": management,
    "resolution": resolution,
    "units": units,
    "input of nodes": on(some_object("MESH"), input_of_nodes),
    "vertex colors": on(some_object("MESH"), vertex_colors),
}
