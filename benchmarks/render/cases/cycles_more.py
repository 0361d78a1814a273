# SPDX-License-Identifier: GPL-3.0-or-later
"""Further scenes for the comparison with Cycles: hair, many textures, a lens, a tiny sun, plastic and metal, skin."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.render.cases.cycles_scenes import DIFFUSE, GLASS, box, gray, lamp_of, mesh, room, sphere
from benchmarks.render.render_cycles import camera, light, new_material, new_object, new_world, plane

PRINCIPLED = "ShaderNodeBsdfPrincipled"


def hair() -> None:
    """A tuft of bent strands on a ball, under a lamp and a dim world."""
    import bpy

    rng = np.random.default_rng(3)
    roots = rng.normal(size=(3000, 3))
    roots /= np.linalg.norm(roots, axis=1, keepdims=True)
    share = np.linspace(0, 1, 7)[None, :, None]
    points = roots[:, None] * (0.98 + 0.4 * share) + share**2 * np.array([0.35, 0.0, -0.35])
    count, length = points.shape[:2]
    curves = bpy.data.hair_curves.new("Strands")
    curves.add_curves([length] * count)
    placed = (points * 0.7 + np.array([0, 0, 0.9])).astype(np.float32)
    curves.attributes["position"].data.foreach_set("vector", placed.ravel())
    radii = curves.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(count * length, 0.006, np.float32))
    curves.materials.append(new_material("ShaderNodeBsdfHairPrincipled", Color=(0.4, 0.2, 0.08, 1)))
    new_object("Strands", curves)
    sphere((0, 0, 0.9), 0.68, gray(0.1))
    plane(10, 0.5)
    new_world((0.2, 0.22, 0.25))
    lamp_of("AREA", 250, (2, -2, 4), size=1.0).rotation_euler = (0.6, 0.45, 0)
    camera((0, -5.5, 1.6), (1.45, 0, 0), 50)


def _patterned(first: str, *others: str) -> Any:
    """Plastic whose color and roughness are procedural textures."""
    from blender_addon import compat

    made = new_material(PRINCIPLED, Roughness=0.4)
    tree = compat.use_nodes(made)
    shader = next(node for node in tree.nodes if node.bl_idname == PRINCIPLED)
    place = tree.nodes.new("ShaderNodeTexCoord")
    color = tree.nodes.new(first)
    color.inputs["Scale"].default_value = 7.0
    tree.links.new(place.outputs["Object"], color.inputs["Vector"])
    mixed = color.outputs["Color"]
    for kind in others:
        node, mix = tree.nodes.new(kind), tree.nodes.new("ShaderNodeMixRGB")
        node.inputs["Scale"].default_value = 11.0
        tree.links.new(place.outputs["Object"], node.inputs["Vector"])
        mix.blend_type = "MULTIPLY"
        tree.links.new(mixed, mix.inputs["Color1"])
        tree.links.new(node.outputs["Color"], mix.inputs["Color2"])
        mixed = mix.outputs["Color"]
    tree.links.new(mixed, shader.inputs["Base Color"])
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    return made


def textures() -> None:
    """Balls and blocks with stacks of procedural textures."""
    voronoi, noise, wave, checker = (f"ShaderNodeTex{name}" for name in ("Voronoi", "Noise", "Wave", "Checker"))
    stacks = ((voronoi, noise), (wave, noise, voronoi), (checker, noise), (noise, wave), (voronoi, wave, checker))
    for k, stack in enumerate(stacks):
        sphere((1.3 * k - 2.6, 0, 0.6), 0.6, _patterned(*stack))
        box("block", (1.3 * k - 3.0, 1.2, 0), (1.3 * k - 2.2, 2.0, 1.0), _patterned(*reversed(stack)))
    plane(14, 0.5)
    new_world((0.4, 0.5, 0.7))
    lamp_of("AREA", 300, (1.5, -3, 4), size=1.5).rotation_euler = (0.6, 0.3, 0)
    camera((0, -8, 2.6), (1.3, 0, 0), 50)


def depth_of_field() -> None:
    """Small bright balls far out of focus behind a sharp one."""
    import bpy

    plane(20, 0.4)
    sphere((0, 0, 0.7), 0.7, new_material(PRINCIPLED, Base_Color=(0.2, 0.4, 0.7, 1), Roughness=0.3))
    for k in range(9):
        glow = new_material("ShaderNodeEmission", Color=(1, 0.7, 0.4, 1), Strength=60.0)
        sphere((-4 + k, 6.0 + (k % 3), 0.5 + 0.5 * (k % 2)), 0.06, glow)
    new_world((0.05, 0.06, 0.1))
    lamp_of("AREA", 60, (1.5, -2, 4), size=1.5)
    camera((0, -5, 1.4), (1.45, 0, 0), 60)
    lens = bpy.context.scene.camera.data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 4.6, 0.8


def tiny_sun() -> None:
    """Plastic and paint under an image of a sky with one very bright pixel."""
    import bpy

    height, width = 128, 256
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.linspace(0.1, 0.7, height)[:, None, None] * np.array([0.7, 0.85, 1.0])
    pixels[100, 80, :3] = 15000.0
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    plane(12, 0.5)
    sphere((-0.8, 0, 0.7), 0.7, new_material(PRINCIPLED, Base_Color=(0.2, 0.5, 0.3, 1), Roughness=0.3))
    sphere((0.9, 0.2, 0.7), 0.7, gray(0.7))
    new_world((1, 1, 1), image)
    camera((0, -6, 2.2), (1.3, 0, 0), 50)


def sunny_window() -> None:
    """A room that the sun and the sky light through a window in one wall."""
    import bpy

    wall = gray(0.7)
    box("room", (-2, -3, 0), (2, 4, 2.6), wall, without=(0,))
    for low, high in (
        ((-2.05, -3, 0), (-2, 4, 0.9)), ((-2.05, -3, 2.1), (-2, 4, 2.6)), ((-2.05, -3, 0.9), (-2, 0.8, 2.1)),
        ((-2.05, 2.4, 0.9), (-2, 4, 2.1)),
    ):  # fmt: skip
        box("wall", low, high, wall)
    box("table", (-0.6, 1.2, 0), (0.6, 2.2, 0.7), new_material(DIFFUSE, Color=(0.6, 0.3, 0.15, 1)))
    sphere((0, 1.7, 1.0), 0.3, new_material(PRINCIPLED, Base_Color=(0.8, 0.6, 0.2, 1), Metallic=1.0, Roughness=0.2))
    light("SUN", 5, angle=0.01)
    bpy.data.objects["SUN"].rotation_euler = (0.0, -1.0, 0.0)
    new_world((0.5, 0.7, 1.0))
    camera((0, -2.6, 1.4), (1.5, 0, 0), 24)


def plastic_and_metal() -> None:
    """Coated plastic, brushed metal and glass on a glossy floor under panels."""
    floor = new_material(PRINCIPLED, Base_Color=(0.3, 0.3, 0.3, 1), Roughness=0.15)
    mesh("floor", [(-7, -7, 0), (7, -7, 0), (7, 7, 0), (-7, 7, 0)], [(0, 1, 2, 3)], floor)
    looks = (
        {"Base_Color": (0.7, 0.1, 0.1, 1), "Roughness": 0.5, "Coat_Weight": 1.0},
        {"Base_Color": (0.9, 0.7, 0.3, 1), "Metallic": 1.0, "Roughness": 0.25},
        {"Base_Color": (0.1, 0.3, 0.8, 1), "Roughness": 0.1},
    )
    for k, look in enumerate(looks):
        sphere((1.4 * k - 2.1, 0, 0.6), 0.6, new_material(PRINCIPLED, **look))
    sphere((2.1, 0, 0.6), 0.6, new_material(GLASS, Roughness=0.0, IOR=1.5))
    for k in range(2):
        lamp_of("AREA", 120, (3.0 - 6 * k, -2, 3), size=1.0).rotation_euler = (0.5, 0.7 - 1.4 * k, 0)
    new_world((0.1, 0.12, 0.15))
    camera((0, -7, 2.4), (1.3, 0, 0), 50)


def skin() -> None:
    """Balls with subsurface scattering under a soft lamp."""
    for k, scale in enumerate((0.05, 0.3)):
        look = {"Base_Color": (0.8, 0.5, 0.4, 1), "Subsurface_Weight": 1.0, "Subsurface_Scale": scale}
        sphere((1.6 * k - 0.8, 0, 0.7), 0.7, new_material(PRINCIPLED, **look))
    plane(12, 0.5)
    lamp_of("AREA", 150, (2, -2, 3.5), size=1.0).rotation_euler = (0.6, 0.45, 0)
    new_world((0.1, 0.1, 0.12))
    camera((0, -6, 2.2), (1.3, 0, 0), 50)


def bottle_room() -> None:
    """Glass in a closed box that a lamp in the ceiling lights."""
    room(open_side=(2,))
    sphere((-1.1, 0.6, 0.4), 0.4, new_material(GLASS, Roughness=0.0, IOR=1.45))
    sphere(
        (1.1, 0.4, 0.35), 0.35, new_material(PRINCIPLED, Base_Color=(0.9, 0.9, 0.9, 1), Metallic=1.0, Roughness=0.05)
    )
    lamp_of("AREA", 40, (0, 1.5, 2.55), size=0.8)
    camera((0, -5, 1.3), (1.5708, 0, 0), 50)


MORE: dict[str, Callable[[], None]] = {
    "hair": hair,
    "textures": textures,
    "depth of field": depth_of_field,
    "tiny sun": tiny_sun,
    "sunny window": sunny_window,
    "plastic and metal": plastic_and_metal,
    "skin": skin,
    "glass in a box": bottle_room,
}
