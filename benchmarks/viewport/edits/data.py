# SPDX-License-Identifier: GPL-3.0-or-later
"""Random edits that exchange data: nested groups, muted nodes, swapped and remapped blocks, UV maps, text, hair,
deformers, files that are read again, a world that follows the camera.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
import numpy as np

from benchmarks.viewport.edits.shading import objects, on, one_of, shader, some_nodes, some_object, some_shader

MOST_TEXTS = 3


def nested_group(node, rng):
    """A color in a group in a group, which several materials share; it changes where both groups are used."""
    inner, outer = (bpy.data.node_groups.get(name) or _colored(name) for name in ("Inner", "Outer"))
    if not any(each.type == "GROUP" for each in outer.nodes):
        made = outer.nodes.new("ShaderNodeGroup")
        made.node_tree = inner
        end = next(each for each in outer.nodes if each.type == "GROUP_OUTPUT")
        outer.links.new(made.outputs[0], end.inputs[0])
    if rng.random() < 0.5:
        made = node.id_data.nodes.new("ShaderNodeGroup")
        made.node_tree = outer
        node.id_data.links.new(made.outputs[0], node.inputs["Base Color"])
    source = next(each for each in inner.nodes if each.type == "RGB")
    source.outputs[0].default_value = (*rng.uniform(0, 1, 3), 1.0)


def _colored(name):
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    source, end = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    group.links.new(source.outputs[0], end.inputs[0])
    return group


def muted(material, rng):
    """A node or a link is muted, or no longer."""
    tree = material.node_tree
    node = one_of(rng, tree.nodes, lambda each: each.type not in ("OUTPUT_MATERIAL", "BSDF_PRINCIPLED"))
    if node is not None and rng.random() < 0.7:
        node.mute = not node.mute
    elif len(tree.links):
        link = tree.links[int(rng.integers(len(tree.links)))]
        link.is_muted = not link.is_muted


def ramp(node, rng):
    """A color ramp over the object, and its elements."""
    socket = node.inputs["Base Color"]
    made = socket.links[0].from_node if socket.is_linked else None
    if made is None or made.type != "VALTORGB":
        tree = node.id_data
        made, place = tree.nodes.new("ShaderNodeValToRGB"), tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(place.outputs["Generated"], made.inputs[0])
        tree.links.new(made.outputs[0], socket)
    elements = made.color_ramp.elements
    elements[0].color = (*rng.uniform(0, 1, 3), 1.0)
    if len(elements) < 5:
        elements.new(float(rng.uniform(0, 1)))
    made.color_ramp.interpolation = str(rng.choice(["LINEAR", "CONSTANT", "EASE"]))


def swapped(obj, rng):
    """An object shows the mesh of another, or a copy of its own."""
    other = one_of(rng, objects("MESH"))
    obj.data = obj.data.copy() if rng.random() < 0.4 else other.data


def swapped_lamp(obj, rng):
    """Two lamps share their data, or no longer."""
    other = one_of(rng, objects("LIGHT"))
    obj.data = obj.data.copy() if rng.random() < 0.4 else other.data
    obj.data.energy = float(rng.uniform(10, 400))


def remapped(rng):
    """Everything that used a material or a mesh uses another one."""
    blocks = bpy.data.materials if rng.random() < 0.6 else bpy.data.meshes
    own = [each for each in blocks if each.library is None and each.override_library is None]
    old, new = one_of(rng, own), one_of(rng, own)
    if old is not None and old != new:
        old.user_remap(new)


def rewritten(obj, rng):
    """The mesh of an object is made anew by a script, at times without a face."""
    mesh = obj.data
    if mesh.shape_keys is not None or len(objects("MESH")) < 4:
        return
    mesh.clear_geometry()
    if rng.random() < 0.8:
        corners = rng.uniform(-1, 1, (4, 3))
        mesh.from_pydata(corners.tolist(), [], [(0, 1, 2), (0, 2, 3)])
    mesh.update()


def maps(obj, rng):
    """UV maps are added, edited, renamed, and chosen for the render."""
    layers = obj.data.uv_layers
    if not len(obj.data.loops):
        return
    if len(layers) < 3:
        layers.new(name="Map")
    if not len(layers):
        return
    made = layers[int(rng.integers(len(layers)))]
    made.data.foreach_set("uv", rng.uniform(0, 1, 2 * len(made.data)).astype(np.float32))
    made.active_render = bool(rng.integers(2)) or made.active_render
    made.name = str(rng.choice(["Map", "Other", "UVMap"]))
    obj.data.update()


def text(rng):
    """A text: its words, its size, its depth."""
    found = objects("FONT")
    if len(found) < MOST_TEXTS and rng.random() < 0.5:
        bpy.ops.object.text_add(location=tuple(rng.uniform(-2, 2, 3)))
        found = objects("FONT")
    made = one_of(rng, found)
    if made is not None:
        made.data.body = str(rng.choice(["a", "Hello", "two\nlines", ""]))
        made.data.size, made.data.extrude = float(rng.uniform(0.3, 1)), float(rng.choice([0.0, 0.1]))


def hair(rng):
    """Hair curves: their points and radii."""
    obj = one_of(rng, objects("CURVES"))
    if obj is None:
        data = bpy.data.hair_curves.new("Hair")
        data.add_curves([4, 4, 4])
        obj = bpy.data.objects.new("Hair", data)
        bpy.context.scene.collection.objects.link(obj)
    data = obj.data
    steps = np.cumsum(rng.uniform(0, 0.4, (len(data.points), 3)), axis=0)
    data.attributes["position"].data.foreach_set("vector", steps.astype(np.float32).ravel())
    radius = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(len(data.points), float(rng.uniform(0.01, 0.1)), np.float32))
    data.update_tag()


def lattice(obj, rng):
    """A lattice that bends a mesh, and its points."""
    cage = next((each for each in objects("LATTICE")), None)
    if cage is None:
        cage = bpy.data.objects.new("Cage", bpy.data.lattices.new("Cage"))
        cage.scale = (3, 3, 3)
        bpy.context.scene.collection.objects.link(cage)
    if not any(each.type == "LATTICE" for each in obj.modifiers):
        obj.modifiers.new("Cage", "LATTICE").object = cage
    point = cage.data.points[int(rng.integers(len(cage.data.points)))]
    point.co_deform = rng.uniform(-0.7, 0.7, 3)
    cage.data.update_tag()
    if len(obj.modifiers) > 1:
        obj.modifiers.move(len(obj.modifiers) - 1, 0)


def offset(rng):
    """The origin of a collection whose copies empties show."""
    made = one_of(rng, bpy.data.collections)
    if made is not None:
        made.instance_offset = rng.uniform(-1, 1, 3)


def reread(node, rng):
    """An image whose file another program has changed."""
    folder = Path(bpy.app.tempdir)
    path, made = folder / "reread.png", bpy.data.images.new("Written", 2, 2)
    made.pixels.foreach_set(np.append(rng.uniform(0, 1, 3), 1.0).astype(np.float32).repeat(4).reshape(4, 4).T.ravel())
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)
    image = next((each for each in bpy.data.images if each.filepath == str(path)), None)
    if image is None:
        image = bpy.data.images.load(str(path))
    else:
        image.reload()
    used = node.id_data.nodes.new("ShaderNodeTexImage")
    used.image = image
    node.id_data.links.new(used.outputs[0], node.inputs["Base Color"])


def library_reread(rng):
    """A library is read again, after its objects have moved there."""
    library = one_of(rng, bpy.data.libraries)
    if library is None:
        return
    other = one_of(rng, objects("MESH"), lambda each: each.data.library is None)
    path = str(Path(tempfile.mkdtemp(dir=bpy.app.tempdir)) / "again.blend")
    if other is not None:
        bpy.data.libraries.write(path, {other})
        library.filepath = path
    library.reload()


def world_by_camera(rng):
    """A world by coordinates of the scene's camera, which moves."""
    world, scene = bpy.context.scene.world, bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
    scene.camera.rotation_euler = rng.uniform(-1, 1, 3)
    scene.camera.data.lens = float(rng.uniform(20, 80))
    if world is None or world.node_tree is None:
        return
    background = next((node for node in world.node_tree.nodes if node.type == "BACKGROUND"), None)
    if background is None:
        return
    socket = background.inputs["Color"]
    if socket.is_linked:
        world.node_tree.links.remove(socket.links[0])
    if rng.random() < 0.6:
        place = world.node_tree.nodes.new("ShaderNodeTexCoord")
        world.node_tree.links.new(place.outputs[str(rng.choice(["Window", "Camera"]))], socket)


def copied_material(obj, rng):
    """A slot gets a copy of its material, whose number changes."""
    place = one_of(rng, obj.material_slots, lambda each: each.material is not None)
    if place is None or len(bpy.data.materials) > 20:
        return
    place.material = place.material.copy()
    node = shader(place.material)
    if node is not None:
        node.inputs["Base Color"].default_value = (*rng.uniform(0, 1, 3), 1.0)


EDITS = {
    "nested group": on(some_shader, nested_group),
    "muted": on(some_nodes, muted),
    "ramp": on(some_shader, ramp),
    "swapped": on(some_object("MESH"), swapped),
    "swapped lamp": on(some_object("LIGHT"), swapped_lamp),
    "remapped": remapped,
    "rewritten": on(some_object("MESH"), rewritten),
    "maps": on(some_object("MESH"), maps),
    "text": text,
    "hair": hair,
    "lattice": on(some_object("MESH"), lattice),
    "offset": offset,
    "reread": on(some_shader, reread),
    "library reread": library_reread,
    "world by camera": world_by_camera,
    "copied material": on(some_object("MESH"), copied_material),
}
