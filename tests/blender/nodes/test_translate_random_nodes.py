# SPDX-License-Identifier: GPL-3.0-or-later
"""Random node trees: nodes, settings, values and links. No translation may raise an error."""

from __future__ import annotations

import contextlib
import random

import numpy as np
import pytest

from spectral_core.scene import Computed

bpy = pytest.importorskip("bpy")

FAVOURITES = [
    "TexImage",
    "Mix",
    "Math",
    "MixShader",
    "AddShader",
    "BsdfPrincipled",
    "ValToRGB",
    "SeparateColor",
    "HueSaturation",
]
ABSTRACT = {"ShaderNode", "ShaderNodeTree", "ShaderNodeCustomGroup", "ShaderNodeGroup"}
EXTREMES = [0, 1, -1, 0.3, 100, 1e10, -3]


def random_tree(tree, chance, images):
    """Fill a node tree with 25 nodes and up to 90 links."""
    kinds = sorted(name for name in dir(bpy.types) if name.startswith("ShaderNode") and name not in ABSTRACT)
    kinds += [f"ShaderNode{name}" for name in FAVOURITES] * 6
    nodes = []
    for _ in range(25):
        try:
            node = tree.nodes.new(chance.choice(kinds))
        except RuntimeError:
            continue  # not allowed in this type of tree
        nodes.append(node)
        node.mute = chance.random() < 0.1
        if hasattr(node, "image"):
            node.image = chance.choice(images)
        for name in ("operation", "blend_type", "data_type", "mode", "projection", "interpolation_type", "vector_type"):
            if hasattr(node, name):
                choices = node.bl_rna.properties[name].enum_items.keys()
                with contextlib.suppress(TypeError):  # an option that depends on another setting
                    setattr(node, name, chance.choice(choices))
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            if isinstance(value, float):
                socket.default_value = chance.choice(EXTREMES)
            elif socket.type in ("RGBA", "VECTOR"):
                socket.default_value = [chance.choice(EXTREMES) for _ in value]
    for _ in range(90):
        start, end = chance.choice(nodes), chance.choice(nodes)
        if start is not end and start.outputs and end.inputs:
            output, socket = chance.choice(list(start.outputs)), chance.choice(list(end.inputs))
            if (output.type == "SHADER") == (socket.type == "SHADER"):
                tree.links.new(output, socket)
    ends = [node for node in tree.nodes if node.type.startswith("OUTPUT")]
    shaders = [node.outputs[0] for node in nodes if node.outputs and node.outputs[0].type == "SHADER"]
    if ends and shaders:
        for socket in list(ends[0].inputs)[:2]:
            tree.links.new(chance.choice(shaders), socket)


@pytest.mark.parametrize("seed", range(3))
def test_random_node_trees_become_a_scene(build, translate, seed, rng):
    from blender_addon import compat

    chance = random.Random(seed)
    images = [
        build.image("Bytes", rng.random((3, 5, 4))),
        build.image("Floats", 5 * rng.random((4, 4, 4)), float_buffer=True),
    ]
    for number in range(40):
        material = bpy.data.materials.new(f"Material {number}")
        random_tree(compat.use_nodes(material), chance, [*images, None])
        build.plane(f"Plane {number}", material=material)
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    random_tree(compat.use_nodes(world), chance, images)
    for kind in ("POINT", "SPOT", "SUN", "AREA"):
        random_tree(compat.use_nodes(build.light(kind).data), chance, images)
    scene = translate()
    assert len(scene.materials) == len(scene.instances) == 40
    assert len(set(scene.notes)) == len(scene.notes) > 20


@pytest.mark.parametrize("into", ["Hue", "Saturation", "Value", "Fac", "Color"])
def test_an_image_can_feed_any_socket_of_a_color_node(build, translate, into, rng):
    """A color in a socket for numbers counts by its luminance, as in Blender."""
    pixels = rng.random((2, 3, 4))
    material = build.material()
    tree = material.node_tree
    node, image = tree.nodes.new("ShaderNodeHueSaturation"), tree.nodes.new("ShaderNodeTexImage")
    image.image = build.image("Picture", pixels, float_buffer=True)
    node.inputs["Color"].default_value = (0.2, 0.4, 0.6, 1)
    tree.links.new(image.outputs["Color"], next(s for s in node.inputs if into in (s.name, s.identifier)))
    tree.links.new(node.outputs[0], tree.nodes["shader"].inputs["Color"])
    plane = build.plane(material=material)
    color = translate().materials[0].surface.color
    assert plane and isinstance(color, Computed) and color.program.width == 3
    if into == "Value":
        v, u = ((c.ravel() + 0.5) / size for c, size in zip(np.mgrid[0:2, 0:3], (2, 3), strict=True))
        values = color.program.evaluate(lambda name, shift: (u, v, 0 * u))
        luminance = pixels[..., :3].reshape(-1, 3) @ (0.2126, 0.7152, 0.0722)
        np.testing.assert_allclose(values, luminance[:, None] * (0.2, 0.4, 0.6), rtol=1e-4)
