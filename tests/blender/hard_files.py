# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds .blend files that are difficult for exporters: ``hard_files.py build FOLDER NAMES…`` writes all of them.

It then renders those named, one after another, through the entry point of the command line; ``render FOLDER NAMES…``
builds none. It prints one JSON line after each file, so that the output shows which file crashed Blender.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

CASES: dict[str, Callable[[Path], None]] = {}


def case(function: Callable[[Path], None]) -> Callable[[Path], None]:
    """Register a builder; its file has the function's name."""
    CASES[function.__name__] = function
    return function


def link(name, data, **values):
    made = bpy.data.objects.new(name, data)
    for key, value in values.items():
        setattr(made, key, value)
    bpy.context.scene.collection.objects.link(made)
    return made


def plane(name="Plane", material=None):
    data = bpy.data.meshes.new(name)
    data.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    data.uv_layers.new()
    if material is not None:
        data.materials.append(material)
    return link(name, data)


def material(name="Material"):
    made = bpy.data.materials.new(name)
    return made, made.node_tree, made.node_tree.nodes["Principled BSDF"]


def sun(**values):
    return link("Sun", bpy.data.lights.new("Sun", "SUN"), **values)


@case
def unknown_nodes(folder):
    made, tree, shader = material()
    noise, wave = tree.nodes.new("ShaderNodeTexIES"), tree.nodes.new("ShaderNodeParticleInfo")
    tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    tree.links.new(wave.outputs["Random"], shader.inputs["Base Color"])
    tree.links.new(tree.nodes.new("ShaderNodeBevel").outputs[0], shader.inputs["Normal"])
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs[0], shader.inputs["Metallic"])
    plane(material=made)
    sun()


@case
def group_without_tree(folder):
    made, tree, shader = material()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = bpy.data.node_groups.new("Lost", "ShaderNodeTree")
    group.node_tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    tree.links.new(group.outputs[0], shader.inputs["Base Color"])
    bpy.data.node_groups.remove(group.node_tree)
    plane(material=made)
    sun()


def library_file(folder):
    """Write a file that contains a plane, in the folder of the file that links it."""
    plane("Linked plane", material("Linked material")[0])
    path = folder / "library.blend"
    bpy.data.libraries.write(str(path), {bpy.data.objects["Linked plane"]})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def linked(folder):
    path = library_file(folder)
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = ["Linked plane"]
    bpy.context.scene.collection.objects.link(into.objects[0])
    sun()
    return path


@case
def linked_library(folder):
    linked(folder)


@case
def missing_library(folder):
    linked(folder)
    bpy.data.libraries[0].filepath = "//gone.blend"


@case
def missing_images(folder):
    made, tree, shader = material()
    for source, filepath in (("FILE", "//gone.png"), ("MOVIE", "//gone.mp4"), ("TILED", "//gone.<UDIM>.png")):
        image = bpy.data.images.new(filepath, 1, 1)
        image.source, image.filepath = source, filepath
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        tree.links.new(node.outputs[0], shader.inputs[{"FILE": 0, "MOVIE": "Roughness", "TILED": "Alpha"}[source]])
    plane(material=made)
    sun()


@case
def image_of_nans(folder):
    made, tree, shader = material()
    image = bpy.data.images.new("NaN", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.full(64, np.nan, dtype=np.float32))
    image.pack()
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs[0], shader.inputs["Base Color"])
    plane(material=made)
    sun()


@case
def hair(folder):
    fur = plane("Fur")
    fur.modifiers.new("Hair", "PARTICLE_SYSTEM")
    fur.particle_systems[0].settings.type = "HAIR"
    link("Locks", bpy.data.hair_curves.new("Locks"))
    link("Smoke", bpy.data.volumes.new("Smoke")).data.filepath = "//gone.vdb"
    link("Dots", bpy.data.pointclouds.new("Dots"))
    sun()


@case
def empty_meshes(folder):
    for name, vertices, edges in (
        ("Nothing", [], []),
        ("Point", [(0, 0, 0)], []),
        ("Edge", [(0, 0, 0), (1, 0, 0)], [(0, 1)]),
    ):
        data = bpy.data.meshes.new(name)
        data.from_pydata(vertices, edges, [])
        link(name, data)
    data = bpy.data.meshes.new("Needle")
    data.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 0)], [], [(0, 1, 2), (0, 3, 1)])
    link("Needle", data)
    link("Text", bpy.data.curves.new("Text", "FONT")).data.body = ""
    link("Curve", bpy.data.curves.new("Curve", "CURVE"))
    plane()
    sun()


@case
def zero_size_lights(folder):
    plane()
    for kind in ("POINT", "SPOT", "AREA", "SUN"):
        data = bpy.data.lights.new(kind, kind)
        for name in ("shadow_soft_size", "size", "size_y", "angle", "spot_size", "spot_blend", "spread"):
            if hasattr(data, name):
                setattr(data, name, 0.0)
        link(kind, data, location=(0, 0, 2))
        link(f"{kind} flat", data, location=(0, 0, 2), scale=(0, 0, 0))


@case
def negative_scale(folder):
    glass = bpy.data.materials.new("Glass")
    glass.node_tree.nodes["Principled BSDF"].inputs["Transmission Weight"].default_value = 1
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), dtype=bool))
    ball.data.materials.append(glass)
    ball.scale = (-1, 0.5, 1.5)
    parent = link("Parent", None, scale=(1, -2, 0.3), rotation_euler=(0.4, 0.2, 0.1))
    link("Sheared", ball.data, rotation_euler=(0.5, 0.3, 0.7), scale=(0.5, -1, 2)).parent = parent
    link("Squashed", ball.data, scale=(1, 1, 0))
    link("Gone", ball.data, scale=(0, 0, 0))
    link("Far", ball.data, location=(float("inf"), 0, 0))
    plane("Mirror").scale = (-3, 3, 3)
    sun(scale=(-1, 2, 0.5))


@case
def no_objects(folder):
    """A scene with only a camera, whose picture is empty."""


@case
def no_camera(folder):
    plane()
    sun()


@case
def camera_is_no_camera(folder):
    plane()
    sun()
    bpy.context.scene.camera = link("Lamp as camera", bpy.data.lights.new("Spot", "SPOT"), location=(0, 0, 5))


@case
def wild_numbers(folder):
    made, tree, shader = material()
    shader.inputs["Base Color"].default_value = (5, -1, 0, 1)
    shader.inputs["IOR"].default_value = 0.0
    shader.inputs["Emission Strength"].default_value = 1e6
    math = tree.nodes.new("ShaderNodeMath")
    math.operation, math.inputs[1].default_value = "DIVIDE", 0.0
    tree.links.new(math.outputs[0], shader.inputs["Roughness"])
    plane(material=made)
    light = sun()
    light.data.energy, light.data.angle = 1e7, 3.1
    link("Negative", bpy.data.lights.new("Negative", "POINT")).data.energy = -10


@case
def everything_past_its_slot(folder):
    thing = plane()
    thing.data.polygons[0].material_index = 30
    for _ in range(3):
        thing.data.materials.append(None)
    sun()


def build(folder: Path) -> None:
    """Write every file."""
    for name, function in CASES.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        function(folder)
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = 32, 24
        scene.spectral.render.samples = 2
        if scene.camera is None and name != "no_camera":
            scene.camera = link("Camera", bpy.data.cameras.new("Camera"), location=(0, 0, 5))
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
    (folder / "no_blend_file.blend").write_bytes(b"BLENDER-v500" + bytes(200))


def render(folder: Path, names: list[str]) -> None:
    """Render files and print one JSON line for each: exit status, messages, and statistics of the picture."""
    from blender_addon.commands import main

    for name in names:
        print(json.dumps({"begin": name}), flush=True)
        out = folder / f"{name}.exr"
        status = main(["render", str(folder / f"{name}.blend"), "--out", str(out), "--json"])
        report = {"name": name, "status": status}
        if out.is_file():
            image = bpy.data.images.load(str(out))
            pixels = np.array(image.pixels[:])
            report |= {
                "size": list(image.size),
                "finite": bool(np.isfinite(pixels).all()),
                "mean": float(pixels.mean()),
            }
        print(json.dumps(report), flush=True)


if __name__ == "__main__":
    import blender_addon

    blender_addon.register()
    if sys.argv[1] == "build":
        build(Path(sys.argv[2]))
    render(Path(sys.argv[2]), sys.argv[3:])
