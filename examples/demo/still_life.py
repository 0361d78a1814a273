# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the demo's set with bpy: a vase with a branch of olives, lemons in a bowl, a table before a lime-washed wall.

Everything is a plain Blender object with plain Blender materials; spectra are given to it afterward.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import drawing
from .materials import Materials

VASE_PROFILE = [  # (radius, height) in meters, from the foot to the lip
    (0.058, 0.000), (0.062, 0.006), (0.088, 0.050), (0.116, 0.110), (0.124, 0.165), (0.112, 0.220),
    (0.078, 0.268), (0.046, 0.298), (0.036, 0.322), (0.040, 0.345), (0.050, 0.356),
]  # fmt: skip
KEY_POWER_W, WORLD_STRENGTH = 68.0, 0.2
"""Of the window, and of the room around it, for a picture in daylight."""

BOWL_PROFILE = [(0.045, 0.0), (0.050, 0.004), (0.085, 0.020), (0.115, 0.048), (0.128, 0.078), (0.130, 0.082)]


def build(bpy: Any) -> None:
    """Fills the current, empty scene with the set, the light named Key and the camera."""
    mesh = Builder(bpy)
    mesh.vase()
    mesh.olive_branches()
    mesh.bowl_of_lemons()
    mesh.room()
    _light(bpy)
    _camera(bpy)


class Builder:
    """The set's objects; holds bpy so that importing this module needs none."""

    def __init__(self, bpy: Any) -> None:
        self.bpy = bpy
        self.materials = Materials(bpy)

    def vase(self) -> None:
        vase = self.turned("Vase", VASE_PROFILE, wall=0.006, segments=192, rings=160)
        vase.data.materials.append(self.materials.glaze())
        vase.location = (0.055, 0.02, 0.0)
        vase.rotation_euler = (0, 0, np.radians(90 - 6))

    def turned(
        self, name: str, profile: Sequence[tuple[float, float]], *, wall: float, segments: int, rings: int
    ) -> Any:
        """A vessel turned on a wheel: a smooth curve through the profile, and an inner wall by Solidify.

        UV: u once around, v by arc length from foot to lip.
        """
        points = _smooth(np.array(profile), rings)
        angles = np.linspace(0, 2 * np.pi, segments + 1)
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        grid = np.concatenate(
            [points[:, None, :1] * ring[None], np.broadcast_to(points[:, None, 1:], (rings, segments + 1, 1))], axis=2
        )
        length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        uv = np.stack(np.broadcast_arrays(angles[None] / (2 * np.pi), (length / length[-1])[:, None]), axis=2)
        vessel = self.grid_mesh(name, grid, uv)
        inner = vessel.modifiers.new("Wall", "SOLIDIFY")
        inner.thickness, inner.offset = wall, -1.0
        self.disk(f"{name} foot", vessel, profile[0][0])
        return vessel

    def disk(self, name: str, parent: Any, radius: float) -> None:
        self.bpy.ops.mesh.primitive_circle_add(radius=radius, vertices=96, fill_type="NGON", location=(0, 0, 0.001))
        foot = self.bpy.context.object
        foot.name, foot.parent = name, parent
        foot.data.materials.append(self.materials.plain(f"{name} clay", (0.25, 0.2, 0.16)))

    def grid_mesh(self, name: str, grid: NDArray[np.float64], uv: NDArray[np.float64]) -> Any:
        """A smooth mesh over a (rows, columns, 3) grid of points with UVs (rows, columns, 2)."""
        rows, columns = grid.shape[:2]
        index = np.arange(rows * columns).reshape(rows, columns)
        quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
        data = self.bpy.data.meshes.new(name)
        data.vertices.add(grid.shape[0] * grid.shape[1])
        data.vertices.foreach_set("co", grid.astype(np.float32).ravel())
        data.loops.add(quads.size)
        data.loops.foreach_set("vertex_index", quads.ravel().astype(np.int32))
        data.polygons.add(len(quads))
        data.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
        data.update(calc_edges=True)
        layer = data.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", uv.reshape(-1, 2)[quads.ravel()].astype(np.float32).ravel())
        data.polygons.foreach_set("use_smooth", np.ones(len(quads), bool))
        return self.link(name, data)

    def link(self, name: str, data: Any) -> Any:
        thing = self.bpy.data.objects.new(name, data)
        self.bpy.context.scene.collection.objects.link(thing)
        return thing

    def olive_branches(self) -> None:
        """Three stems from the vase's mouth, with leaves as instances of one mesh and a few olives."""
        rng = np.random.default_rng(11)
        leaf, olive = self.leaf_mesh(), self.ball_mesh("Olive", 0.0085, 1.35, (0.055, 0.075, 0.03), 0.3)
        bark = self.materials.plain("Bark", (0.16, 0.12, 0.085), 0.8)
        for number, (lean, turn, reach) in enumerate(((0.55, 2.75, 0.34), (0.25, 1.1, 0.38), (0.62, -0.15, 0.30))):
            path = _stem(lean, turn, reach)
            curve = self.bpy.data.curves.new(f"Stem {number}", "CURVE")
            curve.dimensions, curve.bevel_depth, curve.bevel_resolution = "3D", 0.0028, 3
            spline = curve.splines.new("POLY")
            spline.points.add(len(path) - 1)
            spline.points.foreach_set("co", np.hstack([path, np.ones((len(path), 1))]).ravel())
            spline.points.foreach_set("radius", np.linspace(1.2, 0.35, len(path)))
            stem = self.link(f"Stem {number}", curve)
            stem.location = (0.055, 0.02, 0.33)
            curve.materials.append(bark)
            for place in range(5, len(path) - 1):
                self.leaf_pair(leaf, path, place, stem, rng)
            for place in rng.choice(np.arange(10, len(path) - 3), 3, replace=False):
                berry = self.link("Olive", olive)
                berry.parent, berry.location = stem, path[place] + rng.normal(0, 0.006, 3) - [0, 0, 0.012]

    def leaf_pair(self, leaf: Any, path: NDArray[np.float64], place: int, stem: Any, rng: np.random.Generator) -> None:
        forward = path[place + 1] - path[place - 1]
        heading = np.arctan2(forward[1], forward[0])
        for side in (-1.0, 1.0):
            one = self.link("Leaf", leaf)
            one.parent, one.location = stem, path[place]
            size = rng.uniform(0.75, 1.15) * (1.1 - 0.35 * place / len(path))
            one.scale = (size, size, size)
            one.rotation_euler = (rng.normal(0, 0.35), rng.uniform(-0.9, 0.1), heading + side * rng.uniform(0.5, 0.95))

    def leaf_mesh(self) -> Any:
        along = np.linspace(0, 1, 17)
        half = 0.0075 * np.sin(np.pi * along**0.85)
        side = np.linspace(-1, 1, 7)[:, None]
        bend = 0.004 * np.sin(np.pi * along) + 0.0025 * np.abs(side) - 0.012 * along**2
        grid = np.stack(np.broadcast_arrays(0.062 * along, side * half, bend), axis=2)
        uv = np.stack(np.meshgrid(along, np.linspace(0, 1, 7)), axis=2)
        thing = self.grid_mesh("Leaf pattern", grid, uv)
        data = thing.data
        data.materials.append(self.materials.plain("Olive leaf", (0.115, 0.17, 0.085), 0.45))
        self.bpy.data.objects.remove(thing)
        return data

    def ball_mesh(
        self, name: str, radius: float, stretch: float, color: tuple[float, float, float], rough: float
    ) -> Any:
        """A fruit: a sphere drawn out along z, with the tip of a lemon where ``stretch`` is over 1.2."""
        polar, around = np.linspace(0, np.pi, 49), np.linspace(0, 2 * np.pi, 65)
        tip = 1 + 0.22 * np.exp(-((polar / 0.28) ** 2)) + 0.12 * np.exp(-(((np.pi - polar) / 0.22) ** 2))
        z = -radius * stretch * np.cos(polar) * tip
        ring = radius * np.sin(polar) * (1 + 0.02 * np.cos(3 * polar))
        grid = np.stack([ring[:, None] * np.cos(around), ring[:, None] * np.sin(around),
                         np.broadcast_to(z[:, None], (49, 65))], axis=2)  # fmt: skip
        uv = np.stack(np.broadcast_arrays(around[None] / (2 * np.pi), polar[:, None] / np.pi), axis=2)
        thing = self.grid_mesh(f"{name} pattern", grid, uv)
        data = thing.data
        data.materials.append(self.materials.plain(name, color, rough))
        self.bpy.data.objects.remove(thing)
        return data

    def bowl_of_lemons(self) -> None:
        bowl = self.turned("Bowl", BOWL_PROFILE, wall=0.005, segments=128, rings=60)
        bowl.data.materials.append(self.materials.plain("Bowl glaze", (0.075, 0.12, 0.155), 0.25))
        bowl.location = (-0.245, -0.085, 0.0)
        lemon = self.ball_mesh("Lemon", 0.031, 1.22, (0.72, 0.52, 0.045), 0.4)
        places = [  # location in meters, rotation in radians
            ((-0.285, -0.105, 0.050), (1.35, 0.3, 0.5)), ((-0.215, -0.110, 0.050), (1.45, -0.2, 2.1)),
            ((-0.245, -0.045, 0.052), (1.5, 0.1, 3.4)), ((-0.250, -0.090, 0.098), (1.25, 0.25, 1.2)),
            ((-0.115, -0.205, 0.030), (1.57, 0.0, 2.55)),
        ]  # fmt: skip
        for location, rotation in places:
            one = self.link("Lemon", lemon)
            one.location, one.rotation_euler = location, rotation

    def room(self) -> None:
        self.plane(
            "Table",
            (2.4, 1.3),
            self.materials.pictured("Planks", drawing.wood(), 0.38),
            lambda x, y: (x, y - 0.08, 0 * x),
        )
        self.plane(
            "Wall",
            (3.2, 2.2),
            self.materials.pictured("Lime wash", drawing.plaster(), 0.9),
            lambda x, y: (x, 0 * x + 0.55, y + 0.9),
        )

    def plane(self, name: str, size: tuple[float, float], material: Any, place: Callable[..., Any]) -> None:
        u = np.linspace(0, 1, 3)
        x, y = np.meshgrid((u - 0.5) * size[0], (u - 0.5) * size[1])
        flat = self.grid_mesh(
            name, np.stack(np.broadcast_arrays(*place(x, y)), axis=2), np.stack(np.meshgrid(u, u), axis=2)
        )
        flat.data.materials.append(material)


def _smooth(profile: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """``count`` points on a smooth curve through the profile, evenly spread along it."""
    from scipy.interpolate import PchipInterpolator

    length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(profile, axis=0).T))])
    curve = PchipInterpolator(length / length[-1], profile)
    return curve(np.linspace(0, 1, count))


def _stem(lean: float, turn: float, reach: float) -> NDArray[np.float64]:
    """Points (26, 3) of a stem that rises from the origin and leans over under its weight."""
    along = np.linspace(0, 1, 26)
    out = reach * lean * along**1.4
    up = reach * (along - 0.28 * lean * along**2.2)
    sway = 0.02 * np.sin(4 * along + turn)
    direction, aside = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    return np.column_stack([out[:, None] * direction + (sway * along)[:, None] * aside, up])


def _light(bpy: Any) -> None:
    """A tall window to the left, and little else: the wall fades to the right."""
    key = bpy.data.lights.new("Key", "AREA")
    key.shape, key.size, key.size_y, key.energy = "RECTANGLE", 0.9, 1.3, KEY_POWER_W
    window = bpy.data.objects.new("Key", key)
    window.location = (-1.35, -0.75, 1.05)
    _look_at(window, (0.0, 0.05, 0.16))
    bpy.context.scene.collection.objects.link(window)
    world = bpy.data.worlds.get("World") or bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = WORLD_STRENGTH


def _camera(bpy: Any) -> None:
    data = bpy.data.cameras.new("Camera")
    data.lens = 54.0
    data.dof.use_dof, data.dof.focus_distance, data.dof.aperture_fstop = True, 1.36, 5.6
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (-0.02, -1.42, 0.42)
    _look_at(camera, (-0.03, 0.0, 0.292))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def _look_at(thing: Any, target: tuple[float, float, float]) -> None:
    from mathutils import Vector

    thing.rotation_euler = (Vector(target) - thing.location).to_track_quat("-Z", "Y").to_euler()
