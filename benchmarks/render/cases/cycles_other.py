# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a third kind for the comparison with Cycles: fire behind glass, leaves with alpha, strip lights, a bust."""

from __future__ import annotations

from collections.abc import Callable

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
    room,
    scattering,
    sphere,
)
from benchmarks.render.render_cycles import camera, new_material, new_world, plane, sky


def fireplace() -> None:
    """Flames of emissive meshes behind a pane of glass light a room."""
    room(open_side=(2,))
    box("hearth", (0.9, 2.2, 0), (1.9, 3.4, 0.9), new_material(DIFFUSE, Color=(0.25, 0.1, 0.07, 1)), without=(2,))
    rng = np.random.default_rng(12)
    for k in range(8):
        glow = new_material(EMISSION, Color=(1, 0.35 + 0.04 * k, 0.08, 1), Strength=25.0)
        x, y = rng.uniform((1.1, 2.5), (1.7, 3.1))
        corners = [(x - 0.06, y - 0.06, 0.05), (x + 0.06, y - 0.06, 0.05), (x, y + 0.07, 0.05), (x, y, 0.45)]
        mesh("flame", corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)], glow)
    box("pane", (0.95, 2.12, 0.02), (1.85, 2.15, 0.88), new_material(GLASS, Roughness=0.0, IOR=1.5))
    camera((0, -5, 1.3), (1.5708, 0, 0), 50)


def foliage() -> None:
    """Six hundred leaves cut out by alpha, some translucent, under a sun and a sky."""
    from blender_addon import compat

    made = new_material("ShaderNodeBsdfTranslucent", Color=(0.35, 0.6, 0.1, 1))
    tree = compat.use_nodes(made)
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    leaf = output.inputs["Surface"].links[0].from_socket
    clear, cut = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
    place, shape = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexVoronoi")
    edge = tree.nodes.new("ShaderNodeMath")
    shape.inputs["Scale"].default_value, edge.operation = 9.0, "GREATER_THAN"
    edge.inputs[1].default_value = 0.5
    tree.links.new(place.outputs["Object"], shape.inputs["Vector"])
    tree.links.new(shape.outputs["Distance"], edge.inputs[0])
    tree.links.new(edge.outputs[0], cut.inputs[0])
    tree.links.new(leaf, cut.inputs[1])
    tree.links.new(clear.outputs[0], cut.inputs[2])
    tree.links.new(cut.outputs[0], output.inputs["Surface"])
    rng = np.random.default_rng(600)
    center = rng.uniform((-2.6, -0.8, 0.2), (2.6, 2.0, 3.2), (600, 3))
    axes = np.linalg.qr(rng.normal(size=(600, 3, 3)))[0]
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.16
    corners = (center[:, None] + np.einsum("kc,nci->nki", square, axes[:, :2])).reshape(-1, 3)
    mesh("leaves", corners, [tuple(range(4 * k, 4 * k + 4)) for k in range(600)], made)
    plane(14, 0.4)
    lamp_of("SUN", 4.0, (0, 0, 5), angle=0.01).rotation_euler = (0.6, 0.3, 0)
    new_world((0.4, 0.5, 0.7))
    camera((0, -8, 2.0), (1.5, 0, 0), 50)


def strips() -> None:
    """Brushed metal under thirty long narrow lamps."""
    metal = new_material("ShaderNodeBsdfAnisotropic", Color=(0.8, 0.8, 0.85, 1), Roughness=0.25, Anisotropy=0.8)
    box("block", (-1.6, -0.5, 0), (-0.4, 0.7, 1.2), metal)
    sphere((0.9, 0, 0.7), 0.7, metal)
    plane(14, 0.3)
    for k in range(30):
        lamp = lamp_of("AREA", 12, (-3 + 0.2 * k, 0.0, 3.0), shape="RECTANGLE", size=0.03, size_y=4.0)
        lamp.data.color = (1.0, 0.7 + 0.01 * k, 0.4 + 0.02 * k)
    new_world((0.02, 0.02, 0.03))
    camera((0, -6, 2.2), (1.3, 0, 0), 50)


def bust() -> None:
    """A head of wax under an image of a sky."""
    import bpy

    wax = new_material(PRINCIPLED, Base_Color=(0.8, 0.65, 0.5, 1), Subsurface_Weight=1.0, Subsurface_Scale=0.15)
    bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1.0), rotation=(0, 0, 0.5))
    head = bpy.context.object
    head.modifiers.new("smooth", "SUBSURF").render_levels = 2
    head.data.materials.append(wax)
    box("plinth", (-0.7, -0.5, -0.5), (0.7, 0.7, 0.15), gray(0.5))
    plane(12, 0.4)
    new_world((1, 1, 1), sky(), 0.6)
    camera((0, -6, 2.0), (1.35, 0, 0), 55)


def spot_in_fog() -> None:
    """A narrow spot lamp and blocks in fog."""
    plane(14, 0.5)
    for k in range(4):
        box("block", (1.4 * k - 2.6, 0.3, 0), (1.4 * k - 2.0, 0.9, 1.4), gray(0.6))
    box("air", (-4, -3, 0.01), (4, 4, 3.6), scattering(0.12))
    lamp = lamp_of("SPOT", 900, (-3.2, -1.5, 3.0), spot_size=0.6, spot_blend=0.3, shadow_soft_size=0.05)
    lamp.rotation_euler = (0.55, -0.75, 0)
    camera((0, -8, 2.0), (1.45, 0, 0), 50)


OTHER: dict[str, Callable[[], None]] = {
    "fire behind glass": fireplace,
    "leaves with alpha": foliage,
    "strip lights": strips,
    "bust of wax": bust,
    "spot in fog": spot_in_fog,
}
