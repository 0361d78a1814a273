# SPDX-License-Identifier: GPL-3.0-or-later
"""Random edits of materials, lamps and the world."""

from __future__ import annotations

import bpy
import numpy as np


def one_of(rng, items, fits=lambda _item: True):
    """A random item that fits, None if there is none."""
    found = [item for item in items if fits(item)]
    return found[int(rng.integers(len(found)))] if found else None


def objects(*kinds):
    """Objects of this file, of these types."""
    return [obj for obj in bpy.context.scene.objects if obj.type in (kinds or (obj.type,)) and _is_own(obj)]


def _is_own(obj):
    return obj.library is None and (obj.data is None or obj.data.library is None)


def shader(material):
    if material is None or material.node_tree is None:
        return None
    return next((node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED"), None)


def on(pick, act):
    """An edit of a random item, if there is one."""

    def edit(rng):
        item = pick(rng)
        if item is not None:
            act(item, rng)

    return edit


def some_object(*kinds):
    return lambda rng: one_of(rng, objects(*kinds))


def some_shader(rng):
    return one_of(
        rng,
        [shader(material) for material in bpy.data.materials if material.library is None],
        lambda node: node is not None,
    )


def lamp(obj, rng):
    obj.data.energy = float(rng.uniform(0, 500))
    obj.data.color = rng.uniform(0.2, 1, 3)


def lamp_kind(obj, rng):
    obj.data.type = str(rng.choice(["POINT", "AREA", "SPOT", "SUN"]))


def lamp_size(obj, rng):
    """The radius, sides or angle of a lamp, 0 now and then."""
    data, size = obj.data, float(rng.choice([0.0, rng.uniform(0.05, 1.5)]))
    if data.type == "SUN":
        data.angle = 0.3 * size
    elif data.type == "AREA":
        data.size = max(size, 0.01)
    else:
        data.shadow_soft_size = size


def lamp_spectrum(obj, rng):
    """A lamp of the catalogue, with lines or smooth, or the color alone."""
    spectral, name = obj.data.spectral, str(rng.choice(["", "D65", "HP1", "FL11", "A", "LED-B3"]))
    if name:
        spectral.catalogue_name = name
    spectral.source = "CATALOGUE" if name else "NONE"


def number(node, rng):
    node.inputs["Roughness"].default_value = float(rng.uniform(0, 1))
    node.inputs["Base Color"].default_value = (*rng.uniform(0, 1, 3), 1.0)


WEIGHTS = ("Alpha", "Coat Weight", "Diffuse Roughness", "Emission Strength", "Metallic", "Sheen Weight",
           "Subsurface Weight", "Transmission Weight")  # fmt: skip


def weight(node, rng):
    """A weight of the shader, also to and from the value at which it has no effect."""
    socket = node.inputs.get(WEIGHTS[int(rng.integers(len(WEIGHTS)))])
    if socket is not None:
        socket.default_value = float(rng.choice((0.0, 1.0, rng.uniform(0, 1))))


def fog(material, rng):
    """A volume that varies, another strength of it, or no volume any more."""
    tree = material.node_tree
    output = next((node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"), None)
    if output is None:
        return
    socket, strength = output.inputs["Volume"], tree.nodes.get("Strength")
    if strength is None:
        volume, strength = tree.nodes.new("ShaderNodeVolumeScatter"), tree.nodes.new("ShaderNodeMath")
        strength.name, strength.operation = "Strength", "MULTIPLY"
        noise = tree.nodes.new("ShaderNodeTexNoise")
        noise.inputs["Scale"].default_value = noise.inputs["Detail"].default_value = 0.3  # a coarse grid is enough
        tree.links.new(noise.outputs[0], strength.inputs[0])
        tree.links.new(strength.outputs[0], volume.inputs["Density"])
        tree.links.new(volume.outputs[0], socket)
    elif socket.is_linked and rng.random() < 0.3:
        tree.links.remove(socket.links[0])
    strength.inputs[1].default_value = float(rng.uniform(0, 2))


def some_nodes(rng):
    return one_of(rng, list(bpy.data.materials), lambda material: material.node_tree is not None)


def node_added(node, rng):
    tree = node.id_data
    kind = str(rng.choice(["ShaderNodeTexNoise", "ShaderNodeTexCoord", "ShaderNodeAttribute", "ShaderNodeTexImage"]))
    made = tree.nodes.new(kind)
    if kind == "ShaderNodeTexCoord":
        made.object = one_of(rng, objects())
        tree.links.new(made.outputs["Object"], node.inputs["Base Color"])
        return
    if kind == "ShaderNodeAttribute":
        made.attribute_type = str(rng.choice(["OBJECT", "VIEW_LAYER", "GEOMETRY"]))
        made.attribute_name = "value"
    if kind == "ShaderNodeTexImage":
        made.image = one_of(rng, bpy.data.images) or bpy.data.images.new("Picture", 4, 4)
    tree.links.new(made.outputs[0], node.inputs["Base Color"])


def node_gone(node, rng):
    socket = node.inputs["Base Color"]
    if socket.is_linked:
        node.id_data.links.remove(socket.links[0])


def group_node(node, rng):
    """A node group that several materials share."""
    group = bpy.data.node_groups.get("Shared")
    if group is None:
        group = bpy.data.node_groups.new("Shared", "ShaderNodeTree")
        group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
        inside, output = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
        group.links.new(inside.outputs[0], output.inputs[0])
    made = node.id_data.nodes.new("ShaderNodeGroup")
    made.node_tree = group
    node.id_data.links.new(made.outputs[0], node.inputs["Base Color"])


def group_edit(_node, rng):
    group = bpy.data.node_groups.get("Shared")
    if group is not None:
        color = next(node for node in group.nodes if node.type == "RGB")
        color.outputs[0].default_value = (*rng.uniform(0, 1, 3), 1.0)


def paint(_node, rng):
    image = one_of(rng, bpy.data.images, lambda each: each.size[0])
    if image is not None:
        image.pixels.foreach_set(rng.uniform(0, 1, 4 * image.size[0] * image.size[1]).astype(np.float32))
        image.update()
        image.update_tag()


def world(rng):
    made = bpy.context.scene.world
    if made is None or rng.random() < 0.2:
        made = bpy.data.worlds.new("Surroundings")
        bpy.context.scene.world = made
    if made.node_tree is None:
        made.use_nodes = True
    background = next((node for node in made.node_tree.nodes if node.type == "BACKGROUND"), None)
    if background is not None:
        background.inputs["Color"].default_value = (*rng.uniform(0, 1, 3), 1.0)


def new_material(rng):
    made = bpy.data.materials.new("Paint")
    if made.node_tree is None:  # before Blender 5
        made.use_nodes = True
    obj = one_of(rng, objects("MESH"))
    if obj is not None and len(obj.data.materials) < 4:
        obj.data.materials.append(made)
