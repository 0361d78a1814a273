# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of many types for the comparison with Cycles, built in Blender: interiors, many lamps, skies, glass, fog."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.render.render_cycles import camera, light, new_material, new_object, new_world, plane, sky

DIFFUSE, GLASS, EMISSION = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlass", "ShaderNodeEmission"


def mesh(name: str, corners: Any, faces: Any, material: Any, location: tuple[float, float, float] = (0, 0, 0)) -> Any:
    import bpy

    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(corners, float).tolist(), [], faces)
    data.materials.append(material)
    return new_object(name, data, location)


def box(name: str, low: Any, high: Any, material: Any, *, without: tuple[int, ...] = ()) -> None:
    """A box; ``without``: sides left open (0 to 5: -x, +x, -y, +y, -z, +z)."""
    corners = np.array([[(low, high)[k >> 2 & 1][0], (low, high)[k >> 1 & 1][1], (low, high)[k & 1][2]]
                        for k in range(8)])  # fmt: skip
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh(name, corners, [face for k, face in enumerate(faces) if k not in without], material)


def gray(value: float = 0.6) -> Any:
    return new_material(DIFFUSE, Color=(value, value, value, 1))


def sphere(at: tuple[float, float, float], radius: float, material: Any) -> None:
    import bpy

    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, location=at, radius=radius)
    ball = bpy.context.object
    ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), dtype=bool))
    ball.data.materials.append(material)


def lamp_of(kind: str, energy: float, at: tuple[float, float, float], **values: Any) -> Any:
    import bpy

    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in values.items():
        setattr(data, name, value)
    return new_object(kind, data, at)


def room(*, open_side: tuple[int, ...]) -> None:
    box("room", (-2, -2, 0), (2, 4, 2.6), gray(0.7), without=open_side)
    box("table", (-0.6, 1.2, 0), (0.6, 2.2, 0.7), new_material(DIFFUSE, Color=(0.6, 0.3, 0.15, 1)))
    sphere((0, 1.7, 1.0), 0.3, gray(0.8))


def cornell() -> None:
    """A box with a lamp in its ceiling."""
    room(open_side=(2,))
    lamp_of("AREA", 40, (0, 1.5, 2.55), size=0.8)
    camera((0, -5, 1.3), (1.5708, 0, 0), 50)


def window() -> None:
    """A room that only a window lights."""
    room(open_side=(0, 2))
    lamp_of("AREA", 200, (-2.6, 1.5, 1.6), size=2.0).rotation_euler = (0, -1.5708, 0)
    camera((0, -4, 1.3), (1.5708, 0, 0), 35)


def glass() -> None:
    """Glass balls under a sky."""
    plane(14, 0.6)
    for k in range(3):
        sphere((1.3 * k - 1.3, 0, 0.6), 0.6, new_material(GLASS, Roughness=0.0, IOR=1.45))
    new_world((0.6, 0.7, 0.9))
    lamp_of("AREA", 150, (1.5, -2, 4), size=1.5)
    camera((0, -6, 2.2), (1.3, 0, 0), 50)


def _hall(count: int, radius: float) -> None:
    rng = np.random.default_rng(5)
    side = 12.0
    plane(2.4 * side, 0.5)
    for _ in range(25):
        x, y = rng.uniform(-side * 0.6, side * 0.6, 2)
        height = rng.uniform(0.3, 1.5)
        box("block", (x - 0.4, y - 0.4, 0), (x + 0.4, y + 0.4, height), gray(0.5))
    places = rng.uniform((-side, -side, 0.6), (side, side, 2.5), (count, 3))
    for place in places:
        lamp_of("POINT", 3000.0 / count * float(10 ** rng.uniform(-0.7, 0.7)), tuple(place), shadow_soft_size=radius)
    camera((0, -16, 7), (1.15, 0, 0), 35)


def hundred_lamps() -> None:
    """A hundred balls of light over blocks."""
    _hall(100, 0.1)


def ten_thousand_lamps() -> None:
    """Ten thousand small balls of light."""
    _hall(10_000, 0.02)


def hdri() -> None:
    """Objects under an image of a sky with a bright spot."""
    plane(12, 0.5)
    sphere((-0.8, 0, 0.7), 0.7, gray(0.7))
    sphere((0.9, 0.2, 0.7), 0.7, new_material("ShaderNodeBsdfAnisotropic", Color=(0.8, 0.7, 0.5, 1), Roughness=0.3))
    new_world((1, 1, 1), sky(), 0.5)
    camera((0, -6, 2.2), (1.3, 0, 0), 50)


def sun_and_sky() -> None:
    """Blocks under a sun and an even sky."""
    plane(30, 0.5)
    for k in range(5):
        box("block", (k * 1.5 - 3.6, -0.5, 0), (k * 1.5 - 2.6, 0.5, 0.6 + 0.4 * k), gray(0.6))
    light("SUN", 3, angle=0.01)
    new_world((0.3, 0.45, 0.8))
    camera((0, -9, 3.5), (1.25, 0, 0), 45)


def emissive_meshes() -> None:
    """Rings and balls that emit light, among blocks."""
    import bpy

    plane(14, 0.5)
    for k in range(4):
        glow = new_material(EMISSION, Color=(1, 0.8 - 0.15 * k, 0.3 + 0.2 * k, 1), Strength=6.0)
        if k % 2:
            sphere((2.0 * k - 3, 0.5, 0.9), 0.25, glow)
        else:
            bpy.ops.mesh.primitive_torus_add(location=(2.0 * k - 3, 0.5, 1.0), major_radius=0.5, minor_radius=0.06)
            bpy.context.object.data.materials.append(glow)
        box("block", (2.0 * k - 3.3, -0.8, 0), (2.0 * k - 2.7, -0.2, 0.5), gray(0.6))
    camera((0, -8, 3), (1.25, 0, 0), 45)


def caustics() -> None:
    """A glass ball that focuses the light of a large lamp on the floor."""
    plane(12, 0.7)
    sphere((0, 0, 1), 0.7, new_material(GLASS, Roughness=0.1, IOR=1.5))
    lamp_of("AREA", 200, (0, 0, 5), size=2.0)
    camera((0, -6, 3), (1.15, 0, 0), 50)


def scattering(density: float) -> Any:
    """A material of fog."""
    from blender_addon import compat

    medium = new_material(DIFFUSE)
    tree = compat.use_nodes(medium)
    tree.nodes.clear()
    scatter, output = tree.nodes.new("ShaderNodeVolumeScatter"), tree.nodes.new("ShaderNodeOutputMaterial")
    scatter.inputs["Density"].default_value = density
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    return medium


def fog() -> None:
    """A ball and a lamp in fog."""
    plane(12, 0.5)
    sphere((0, 0, 0.7), 0.6, gray(0.7))
    box("fog", (-4, -3, 0.01), (4, 3, 4), scattering(0.15))
    lamp_of("POINT", 300, (1.5, -0.5, 2.5), shadow_soft_size=0.2)
    camera((0, -7, 2.5), (1.25, 0, 0), 50)


SCENES: dict[str, Callable[[], None]] = {
    "Cornell box": cornell,
    "interior, window": window,
    "glass": glass,
    "100 lamps": hundred_lamps,
    "10,000 lamps": ten_thousand_lamps,
    "HDRI": hdri,
    "sun and sky": sun_and_sky,
    "emissive meshes": emissive_meshes,
    "caustics": caustics,
    "fog": fog,
}
