# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside a real Blender: settings that bpy from PyPI may lack are read or get a note."""

import importlib
import sys

import bpy
import numpy as np

addon = next(name for name in sys.modules if name.endswith("spectral_scene"))
compat = importlib.import_module(f"{addon}.compat")
translate_scene = importlib.import_module(f"{addon}.translate.scene").translate_scene
programs_of = importlib.import_module("spectral_core.scene").programs_of

scene = bpy.context.scene
bpy.ops.mesh.primitive_plane_add()
material = bpy.data.materials.new("Newer")
bpy.context.object.data.materials.append(material)
tree = compat.use_nodes(material)
shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
normal = tree.nodes.new("ShaderNodeNormalMap")
tree.links.new(normal.outputs["Normal"], shader.inputs["Normal"])


def translated():
    found = translate_scene(bpy.context.evaluated_depsgraph_get())
    return found, {note.message for note in found.notes}


def bent(green):
    """The normal from a texel with this green value, at a point with normal z."""
    normal.inputs["Color"].default_value = (0.5, green, 0.9, 1.0)
    found, _ = translated()
    surface = next(each for each in found.materials if each.name == "Newer").surface
    up, along, sign = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    axes = {"normal": up, "true_normal": up, "attribute_smooth_normal": up, "attribute_tangent:": along,
            "attribute_tangent_sign:": sign}  # fmt: skip
    (program,) = programs_of(surface)
    place = lambda name, shift: tuple(np.full(1, each) for each in axes.get(name, ())) or np.zeros(1)  # noqa: E731
    stays = lambda vector, *_: vector  # the object is not turned  # noqa: E731
    return np.ravel(program.evaluate(place, np.float64, stays))


if hasattr(normal, "convention"):
    up = bent(0.75)
    normal.convention = "DIRECTX"
    print("CONVENTION", np.allclose(bent(0.25), up) and not np.allclose(bent(0.75), up))
if "Thin Wall" in shader.inputs:
    shader.inputs["Thin Wall"].default_value = True
    print("THIN WALL", any("a thin wall is not simulated" in text for text in translated()[1]))
if hasattr(getattr(scene.world, "cycles", None), "use_shadows"):
    scene.world.cycles.use_shadows = False
    scene.world.update_tag()
    print("WORLD SHADOWS", any("world light without shadows is not supported" in text for text in translated()[1]))
print("ALL TRIED")
