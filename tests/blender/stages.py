# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes in which a setting of Blender matters: each function makes one and returns the struct of the settings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy


def lens(build: Any, _: Path) -> Any:
    build.plane(material=build.material())
    return build.camera().data


def moved(thing: Any, first: int = -3) -> None:
    """Turn and move an object around frame 1, by unequal amounts."""
    for k in range(4):
        thing.location, thing.rotation_euler = (0.3 * k * k, 0.1 * k, thing.location.z), (0.0, 0.0, 0.4 * k * k)
        for name in ("location", "rotation_euler"):
            thing.keyframe_insert(name, frame=first + 2 * k)


def flight(build: Any, _: Path) -> Any:
    """A plane that moves and becomes wider."""
    thing = build.plane(material=build.material())
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 3
    for frame, value in ((-1, 0.0), (3, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    moved(thing)
    output().use_motion_blur, output().motion_blur_shutter = True, 1.0
    return thing


def moving_camera(build: Any, folder: Path) -> Any:
    build.plane(material=build.material())
    output().use_motion_blur, output().motion_blur_shutter = True, 1.0
    camera = build.camera()
    moved(camera)
    return camera


def output(*_: Any) -> Any:
    return bpy.context.scene.render


def moving_output(build: Any, folder: Path) -> Any:
    flight(build, folder)
    return output()


def stereo(build: Any, folder: Path) -> Any:
    found = lens(build, folder)
    output().use_multiview = True
    return found


def panoramic_stereo(build: Any, folder: Path) -> Any:
    found = stereo(build, folder)
    found.type = "PANO"
    return found


def views(build: Any, folder: Path) -> Any:
    stereo(build, folder)
    output().views_format = "MULTIVIEW"
    for suffix, x in (("_L", -1.0), ("_R", 1.0), ("_T", 3.0)):
        build.camera((x, 0, 5)).name = f"Camera{suffix}"
    bpy.context.scene.camera = bpy.data.objects["Camera_L"]
    return output()


def coordinates(build: Any, _: Path) -> Any:
    """A plane whose color is its generated coordinates."""
    material = build.material(shader="ShaderNodeEmission")
    tree = material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], tree.nodes["shader"].inputs["Color"])
    plane = build.plane(material=material)
    plane.data.use_auto_texspace = False
    return plane.data


def grouped(build: Any, _: Path) -> Any:
    """An empty that shows a collection of a plane and another object."""
    group = bpy.data.collections.new("Group")
    for name in ("Plane", "Other"):
        thing = build.plane(name, material=build.material())
        bpy.context.scene.collection.objects.unlink(thing)
        group.objects.link(thing)
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    return empty


def on_faces(build: Any, _: Path) -> Any:
    """A plane that shows another one at each face or vertex."""
    below = build.plane("Below", material=build.material())
    small = build.plane("Small", size=0.3)
    small.parent = below
    below.instance_type = "FACES"
    return below


def lit_and_dark(build: Any, _: Path) -> Any:
    """A lamp that lights a collection of one of two planes, beside one that does not."""
    lamp, groups = build.light("POINT"), [bpy.data.collections.new(name) for name in ("Lit", "Dark")]
    for group, name in zip(groups, ("First", "Second"), strict=True):
        group.objects.link(build.plane(name, material=build.material()))
    lamp.light_linking.receiver_collection = lamp.light_linking.blocker_collection = groups[0]
    return lamp


def of_a_child(build: Any, folder: Path) -> Any:
    lamp = lit_and_dark(build, folder)
    outer = bpy.data.collections.new("Outer")
    outer.children.link(bpy.data.collections["Lit"])
    lamp.light_linking.receiver_collection = outer
    lamp.light_linking.blocker_collection = None
    return outer.collection_children[0].light_linking


def of_a_member(build: Any, folder: Path) -> Any:
    lit_and_dark(build, folder)
    return bpy.data.collections["Lit"].collection_objects[0].light_linking


def slot(build: Any, _: Path) -> Any:
    thing = build.plane(material=build.material("First"))
    slot = thing.material_slots[0]
    slot.link, slot.material = "OBJECT", build.material("Second")
    build.material("Third")
    return slot


def aov(build: Any, _: Path) -> Any:
    material = build.material()
    node = material.node_tree.nodes.new("ShaderNodeOutputAOV")
    node.aov_name = "Own"
    node.inputs["Color"].default_value, node.inputs["Value"].default_value = (0.1, 0.2, 0.3, 1.0), 0.7
    build.plane(material=material)
    aov = bpy.context.view_layer.aovs.add()
    aov.name = "Own"
    return aov


def world_of(name: str, strength: float) -> Any:
    from blender_addon import compat

    world = bpy.data.worlds.new(name)
    compat.use_nodes(world).nodes["Background"].inputs["Strength"].default_value = strength
    return world


def layer_of_passes(build: Any, _: Path) -> Any:
    bpy.context.scene.world, _ = world_of("World", 1.0), world_of("Other", 2.0)
    build.plane(material=build.material())
    layer = bpy.context.view_layer
    layer.use_pass_mist = layer.use_pass_normal = True
    return layer


def scene_of_two(build: Any, folder: Path) -> Any:
    flight(build, folder)
    output().use_motion_blur = False
    world_of("Other", 2.0)
    thing = build.plane("Behind")
    bpy.context.scene.collection.objects.unlink(thing)
    bpy.data.scenes.new("Set").collection.objects.link(thing)
    build.camera((1, 2, 6)).name = "Second"
    build.camera()
    return bpy.context.scene


def culled(build: Any, _: Path) -> Any:
    """A plane behind the camera and one far in front of it, which Simplify may leave out."""
    cycles = bpy.context.scene.cycles
    output().use_simplify = cycles.use_camera_cull = cycles.use_distance_cull = True
    cycles.distance_cull_margin = 20.0
    behind, far = build.plane("Behind"), build.plane("Far")
    behind.location, far.location = (0, 0, 9), (0, 0, -30)
    behind.cycles.use_camera_cull = far.cycles.use_distance_cull = True
    return cycles


def cut(build: Any, folder: Path) -> Any:
    culled(build, folder)
    bpy.data.objects["Far"].cycles.use_distance_cull = False
    return bpy.data.objects["Far"].cycles


def cloud(build: Any, folder: Path) -> Any:
    """A Volume object whose file is absent: a note names the file of the frame."""
    bpy.context.scene.frame_set(4)
    data = bpy.data.volumes.new("Cloud")
    data.filepath = str(folder / "cloud_0003.vdb")
    data.is_sequence, data.frame_duration = True, 4
    thing = bpy.data.objects.new("Cloud", data)
    bpy.context.scene.collection.objects.link(thing)
    material = build.material()
    tree = material.node_tree
    volume = tree.nodes.new("ShaderNodeVolumeScatter")
    tree.links.new(volume.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Volume"])
    data.materials.append(material)
    return data


def all_kinds(build: Any, folder: Path) -> Any:
    """A view layer with a plane, hair, curves and a cloud."""
    cloud(build, folder)
    thing = build.plane("Furry", material=build.material())
    thing.modifiers.new("P", "PARTICLE_SYSTEM")
    settings = thing.particle_systems[0].settings
    settings.type, settings.count = "HAIR", 3
    return bpy.context.view_layer


def shaped(build: Any, _: Path) -> Any:
    """What Simplify acts on: a plane with subdivisions."""
    thing = build.plane(material=build.material())
    thing.modifiers.new("S", "SUBSURF").render_levels = 3
    output().use_simplify = True
    return output()


def child(build: Any, _: Path) -> Any:
    """A plane that belongs to another object."""
    parent, other = build.plane("Parent"), build.plane("Other")
    parent.location, other.location = (1, 2, 3), (4, 5, 6)
    thing = build.plane(material=build.material())
    thing.parent = parent
    return thing


def culling_camera(build: Any, folder: Path) -> Any:
    culled(build, folder)
    return build.camera().data


def panoramic_output(build: Any, folder: Path) -> Any:
    found = lens(build, folder)
    found.type, found.panorama_type = "PANO", "FISHEYE_EQUISOLID"
    return output()


def tall_panorama(build: Any, folder: Path) -> Any:
    panoramic_output(build, folder).resolution_y = 64
    return bpy.data.cameras[0]


def culling_output(build: Any, _: Path) -> Any:
    """Planes at the sides of the picture, one of them in a wider picture, one in a higher one."""
    cycles = bpy.context.scene.cycles
    output().use_simplify = cycles.use_camera_cull = True
    cycles.camera_cull_margin = 0.0
    for x, y in ((1.3, 0.0), (0.0, 1.3), (0.0, 0.5)):
        thing = build.plane(f"Plane {x} {y}", size=0.2)
        thing.location, thing.cycles.use_camera_cull = (x, y, 0.0), True
    build.camera()
    return output()


def later(build: Any, folder: Path) -> Any:
    flight(build, folder)
    bpy.context.scene.frame_set(2, subframe=0.25)
    return bpy.context.scene
