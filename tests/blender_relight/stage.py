# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene that the tests of the dial record, for the module bpy and for a Blender with a window."""

import bpy


def _linked(name, data, place):
    made = bpy.data.objects.new(name, data)
    made.location = place
    bpy.context.scene.collection.objects.link(made)
    return made


def _lamp(name, kind, energy, place):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.shadow_soft_size = energy, 0.3
    return _linked(name, data, place)


def _material(name, shader, **inputs):
    from blender_addon import compat

    made = bpy.data.materials.new(name)
    tree = compat.use_nodes(made)
    tree.nodes.clear()
    node = tree.nodes.new(shader)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def build_stage(path):
    """Build and save the scene in an empty file: a floor, "Key" (orange) and "Fill" above it, an emissive "Ball", a
    gray world.
    """
    from blender_addon import compat

    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL"
    scene.render.resolution_x, scene.render.resolution_y = 16, 12
    scene.spectral.render.samples = 16
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.context.object.data.materials.append(_material("Floor", "ShaderNodeBsdfDiffuse", Color=(0.6, 0.5, 0.4, 1)))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(0, 1.5, 0.6), segments=12, ring_count=8)
    bpy.context.object.name = "Ball"
    bpy.context.object.data.materials.append(
        _material("Glow", "ShaderNodeEmission", Color=(0.2, 0.4, 1, 1), Strength=3)
    )
    _lamp("Key", "POINT", 200.0, (-2, -1, 3)).data.color = (1.0, 0.6, 0.3)
    _lamp("Fill", "POINT", 80.0, (2, 1, 3))
    scene.world = bpy.data.worlds.new("World")
    tree = compat.use_nodes(scene.world)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.5, 0.5, 0.5, 1), 0.2
    camera = _linked("Camera", bpy.data.cameras.new("Camera"), (0, 0, 8))
    scene.camera = camera
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return scene
