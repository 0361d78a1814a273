# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a fourth kind for the comparison with Cycles: fur under a sky, velvet, a lit ceiling, terrain, a forest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.render.cases.cycles_more import PRINCIPLED
from benchmarks.render.cases.cycles_scenes import (
    DIFFUSE,
    EMISSION,
    GLASS,
    box,
    gray,
    lamp_of,
    mesh,
    scattering,
    sphere,
)
from benchmarks.render.render_cycles import camera, light, new_material, new_object, new_world, plane, sky


def fur() -> None:
    """A patch of short, pale, thick fur on skin under an image of a sky."""
    import bpy

    rng = np.random.default_rng(77)
    count, length = 4000, 5
    roots = np.column_stack([rng.uniform(-1.2, 1.2, (count, 2)), np.zeros(count)])
    lean = rng.normal((0.25, 0.1, 1.0), (0.15, 0.15, 0.05), (count, 3))
    share = np.linspace(0, 1, length)[None, :, None]
    points = roots[:, None] + lean[:, None] * 0.45 * share + share**2 * np.array([0.1, 0.0, -0.12])
    curves = bpy.data.hair_curves.new("Fur")
    curves.add_curves([length] * count)
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radii = curves.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.tile(np.linspace(0.009, 0.002, length), count).astype(np.float32))
    curves.materials.append(new_material("ShaderNodeBsdfHairPrincipled", Color=(0.75, 0.6, 0.4, 1), Roughness=0.25))
    new_object("Fur", curves)
    plane(10, 0.5)
    new_world((1, 1, 1), sky(), 0.7)
    camera((0, -4.5, 2.0), (1.2, 0, 0), 55)


def velvet() -> None:
    """Folds of cloth with sheen under a sun and a dim world."""
    from blender_addon import compat

    cloth = new_material(PRINCIPLED, Base_Color=(0.35, 0.03, 0.08, 1), Roughness=0.9)
    shader = next(node for node in compat.use_nodes(cloth).nodes if node.bl_idname == PRINCIPLED)
    shader.inputs["Sheen Weight"].default_value = 1.0
    shader.inputs["Sheen Roughness"].default_value = 0.3
    n = 90
    x, y = np.meshgrid(np.linspace(-2.5, 2.5, n), np.linspace(-1.5, 3, n), indexing="ij")
    z = 0.25 + 0.2 * np.sin(3 * x + np.sin(2 * y)) + 0.1 * np.cos(5 * y + x)
    k = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack([k, k + n, k + n + 1, k + 1], axis=1).tolist()
    sheet = mesh("cloth", np.stack([x, y, z], axis=-1).reshape(-1, 3), faces, cloth)
    sheet.data.polygons.foreach_set("use_smooth", np.ones(len(faces), dtype=bool))
    light("SUN", 3, angle=0.02)
    new_world((0.1, 0.12, 0.18))
    camera((0, -5, 3.2), (1.0, 0, 0), 45)


def lit_ceiling() -> None:
    """A room with a glossy floor under a ceiling panel that emits light."""
    box("room", (-3, -3, 0), (3, 5, 2.8), gray(0.65), without=(2, 4))
    floor = new_material(PRINCIPLED, Base_Color=(0.25, 0.16, 0.1, 1), Roughness=0.12)
    mesh("floor", [(-3, -3, 0), (3, -3, 0), (3, 5, 0), (-3, 5, 0)], [(0, 1, 2, 3)], floor)
    glow = new_material(EMISSION, Color=(1, 0.95, 0.85, 1), Strength=4.0)
    for k in range(4):
        x, y = 2.4 * (k % 2) - 1.9, 2.4 * (k // 2)
        mesh("panel", [(x, y, 2.75), (x, y + 1.4, 2.75), (x + 1.4, y + 1.4, 2.75), (x + 1.4, y, 2.75)],
              [(0, 1, 2, 3)], glow)  # fmt: skip
    sphere((-1, 1.5, 0.5), 0.5, new_material(PRINCIPLED, Base_Color=(0.9, 0.9, 0.9, 1), Metallic=1.0, Roughness=0.1))
    box("cupboard", (1.0, 2.5, 0), (2.2, 3.3, 1.6), new_material(DIFFUSE, Color=(0.2, 0.35, 0.3, 1)))
    camera((0, -6, 1.5), (1.5, 0, 0), 35)


def terrain() -> None:
    """Hills whose heights and colors are noise, under a low sun and a sky."""
    from blender_addon import compat

    made = new_material(DIFFUSE)
    tree = compat.use_nodes(made)
    shader = next(node for node in tree.nodes if node.bl_idname == DIFFUSE)
    place, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 3.0, 10.0
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.12, 0.2, 0.05, 1), (0.5, 0.45, 0.4, 1)
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Color"])
    rng, n = np.random.default_rng(31), 160
    height = np.zeros((n, n))
    for octave in range(1, 7):
        cells = rng.uniform(-1, 1, (2**octave + 1, 2**octave + 1))
        t = np.linspace(0, 2**octave - 1e-6, n)
        low, part = t.astype(int), t % 1
        part = part * part * (3 - 2 * part)
        rows = cells[low] * (1 - part)[:, None] + cells[low + 1] * part[:, None]
        height += 0.55**octave * (rows[:, low] * (1 - part) + rows[:, low + 1] * part)
    x, y = np.meshgrid(np.linspace(-6, 6, n), np.linspace(-3, 9, n), indexing="ij")
    k = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack([k, k + n, k + n + 1, k + 1], axis=1).tolist()
    mesh("hills", np.stack([x, y, 2.2 * height], axis=-1).reshape(-1, 3), faces, made)
    lamp_of("SUN", 4.0, (0, 0, 9), angle=0.01).rotation_euler = (0.9, 0.6, 0)
    new_world((0.25, 0.4, 0.7))
    camera((0, -7, 3.5), (1.2, 0, 0), 40)


def liquid() -> None:
    """A glass of absorbing liquid on a table under a lamp and a sky."""
    import bpy

    from blender_addon import compat

    made = new_material(GLASS, Roughness=0.0, IOR=1.33)
    tree = compat.use_nodes(made)
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    absorbs = tree.nodes.new("ShaderNodeVolumeAbsorption")
    absorbs.inputs["Color"].default_value, absorbs.inputs["Density"].default_value = (0.9, 0.25, 0.05, 1), 2.5
    tree.links.new(absorbs.outputs[0], output.inputs["Volume"])
    for x in (-0.8, 0.8):
        bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=0.45, depth=1.2, location=(x, 0, 0.61))
        bpy.context.object.data.materials.append(made)
    plane(12, 0.6)
    lamp_of("AREA", 200, (2, 1.5, 4), size=1.2).rotation_euler = (-0.35, 0.45, 0)
    new_world((0.4, 0.45, 0.5))
    camera((0, -5.5, 2.0), (1.3, 0, 0), 50)


def slit() -> None:
    """A sun through a slit into a box of thin fog."""
    box("box", (-2, -2, 0), (2, 3, 2.6), gray(0.5), without=(2, 1))
    mesh("wall low", [(2, -2, 0), (2, 3, 0), (2, 3, 1.5), (2, -2, 1.5)], [(0, 1, 2, 3)], gray(0.5))
    mesh("wall high", [(2, -2, 1.9), (2, 3, 1.9), (2, 3, 2.6), (2, -2, 2.6)], [(0, 1, 2, 3)], gray(0.5))
    box("air", (-1.99, -1.99, 0.01), (1.99, 2.99, 2.59), scattering(0.1))
    lamp_of("SUN", 12.0, (6, 0, 5), angle=0.02).rotation_euler = (0.1, 0.95, 0)
    new_world((0.03, 0.04, 0.05))
    camera((0, -6, 1.3), (1.5708, 0, 0), 45)


def forest() -> None:
    """Nine hundred instances of a tree of leaves and a trunk, under a sun and a sky."""
    import bpy

    rng = np.random.default_rng(900)
    center = rng.normal(0, (0.35, 0.35, 0.45), (350, 3)) + np.array([0, 0, 1.4])
    axes = np.linalg.qr(rng.normal(size=(350, 3, 3)))[0]
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.1
    corners = (center[:, None] + np.einsum("kc,nci->nki", square, axes[:, :2])).reshape(-1, 3)
    green = new_material("ShaderNodeBsdfTranslucent", Color=(0.25, 0.45, 0.1, 1))
    mesh("crown", corners, [tuple(range(4 * k, 4 * k + 4)) for k in range(350)], green)
    crown = bpy.data.objects["crown"]
    box("trunk", (-0.06, -0.06, 0), (0.06, 0.06, 1.2), new_material(DIFFUSE, Color=(0.2, 0.12, 0.06, 1)))
    trunk = bpy.data.objects["trunk"]
    for k in range(900):
        at = (float(rng.uniform(-14, 14)), float(rng.uniform(-3, 25)), 0.0)
        size = float(rng.uniform(0.7, 1.6))
        for part in (crown, trunk):
            copy = new_object(f"{part.name} {k}", part.data, at)
            copy.scale, copy.rotation_euler = (size, size, size), (0, 0, float(rng.uniform(0, 6.28)))
    plane(60, 0.3)
    light("SUN", 4, angle=0.01)
    new_world((0.35, 0.5, 0.8))
    camera((0, -9, 4.0), (1.3, 0, 0), 35)


def sparks() -> None:
    """Four hundred small spheres that emit light, over a glossy floor."""
    floor = new_material(PRINCIPLED, Base_Color=(0.2, 0.2, 0.22, 1), Roughness=0.25)
    mesh("floor", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)], floor)
    rng = np.random.default_rng(400)
    rings = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    faces = [(0, 2, 4), (0, 4, 3), (0, 3, 5), (0, 5, 2), (1, 4, 2), (1, 3, 4), (1, 5, 3), (1, 2, 5)]
    looks = [new_material(EMISSION, Color=(1, c, 0.3, 1), Strength=40.0) for c in (0.4, 0.6, 0.8)]
    for look in looks:
        at = rng.uniform((-4, -2, 0.1), (4, 6, 2.5), (130, 3))
        corners = (at[:, None] + 0.03 * rings).reshape(-1, 3)
        mesh("sparks", corners, [tuple(6 * k + c for c in face) for k in range(130) for face in faces], look)
    for k in range(5):
        box("block", (1.6 * k - 4, 1, 0), (1.6 * k - 3.2, 1.8, 0.5 + 0.3 * k), gray(0.5))
    camera((0, -8, 2.6), (1.35, 0, 0), 40)


def bumps() -> None:
    """Bump-mapped metal under an image of a sky with a bright spot."""
    from blender_addon import compat

    for k, (metal, rough) in enumerate(((1.0, 0.2), (1.0, 0.4), (0.0, 0.3))):
        made = new_material(PRINCIPLED, Base_Color=(0.8, 0.55, 0.3, 1), Metallic=metal, Roughness=rough)
        tree = compat.use_nodes(made)
        shader = next(node for node in tree.nodes if node.bl_idname == PRINCIPLED)
        place, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
        bump = tree.nodes.new("ShaderNodeBump")
        noise.inputs["Scale"].default_value, bump.inputs["Strength"].default_value = 6.0, 0.5
        tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
        tree.links.new(noise.outputs[0], bump.inputs["Height"])
        tree.links.new(bump.outputs[0], shader.inputs["Normal"])
        sphere((1.5 * k - 1.5, 0, 0.7), 0.7, made)
    plane(12, 0.4)
    new_world((1, 1, 1), sky(), 0.6)
    camera((0, -6.5, 2.2), (1.3, 0, 0), 50)


STRANGE: dict[str, Callable[[], Any]] = {
    "fur under a sky": fur,
    "velvet": velvet,
    "lit ceiling": lit_ceiling,
    "terrain": terrain,
    "absorbing liquid": liquid,
    "sun through a slit": slit,
    "forest of instances": forest,
    "sparks": sparks,
    "bumped metal": bumps,
}
