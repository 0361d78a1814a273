# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, cameras and lights that the scenes share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from examples.two_paintings.gallery import box, looking
from spectral_core.scene import (
    Camera,
    Film,
    Instance,
    Light,
    LightPaths,
    Material,
    Mesh,
    RenderSettings,
    Scene,
    Surface,
    World,
    gray,
)

__all__ = ["body", "box", "divided", "looking", "scene_of", "sheet", "wheel"]


def body(name: str = "body", columns: int = 96, rows: int = 48) -> Mesh:
    """A smooth car-like body: a superellipsoid with a cabin, 4 m long, standing on z = 0."""
    u, v = np.meshgrid(np.linspace(-np.pi, np.pi, columns), np.linspace(-np.pi / 2, np.pi / 2, rows))

    def power(values: NDArray[np.float64], exponent: float) -> NDArray[np.float64]:
        return np.asarray(np.sign(values) * np.abs(values) ** exponent)

    x = 2.0 * power(np.cos(v), 0.5) * power(np.cos(u), 0.55)
    y = 0.85 * power(np.cos(v), 0.5) * power(np.sin(u), 0.55)
    z = 0.42 * power(np.sin(v), 0.7)
    cabin = 0.55 * np.exp(-((x + 0.25) ** 2) / 0.9) * np.clip(z / 0.42, 0, 1) ** 0.6
    points = np.stack([x, y * (1 - 0.25 * cabin), z + cabin + 0.45], axis=-1).reshape(-1, 3).astype(np.float32)
    index = np.arange(columns * rows).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]).astype(np.uint32)
    return Mesh(name, points, triangles, normals=_normals(points, triangles))


def _normals(points: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Smooth normals at the vertices, weighted by area."""
    corners = points[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faces)
    # The seam and the poles have their vertices twice: they share one normal.
    _, same = np.unique(points.round(5), axis=0, return_inverse=True)
    joined = np.zeros((same.max() + 1, 3), np.float32)
    np.add.at(joined, same.ravel(), normals)
    normals = joined[same.ravel()]
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9), dtype=np.float32)


def divided(mesh: Mesh, inside: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> tuple[Mesh, Mesh]:
    """The mesh without and with the part where ``inside`` of a point is positive, cut along its zero."""
    assert mesh.normals is not None, "only meshes with normals are cut"
    height = inside(mesh.positions.astype(np.float64))
    points, normals = [mesh.positions], [mesh.normals]
    rest: list[NDArray[np.uint32]] = []
    part: list[NDArray[np.uint32]] = []
    count = len(mesh.positions)
    for side, alone, others in ((height > 0, part, rest), (height <= 0, rest, part)):
        kept = side[mesh.triangles]
        alone.append(mesh.triangles[kept.all(axis=1)])
        # One corner lies on this side: its tip is cut off, and four corners stay on the other side.
        cut = mesh.triangles[kept.sum(axis=1) == 1]
        order = (kept[kept.sum(axis=1) == 1].argmax(axis=1)[:, None] + np.arange(3)) % 3
        tip, left, right = np.take_along_axis(cut, order, axis=1).T
        edge = []
        for end in (left, right):
            share = (height[tip] / (height[tip] - height[end]))[:, None].astype(np.float32)
            for values in (points, normals):
                values.append(values[0][tip] * (1 - share) + values[0][end] * share)
            edge.append(np.arange(count, count + len(tip), dtype=np.uint32))
            count += len(tip)
        alone.append(np.stack([tip, *edge], axis=-1))
        others += [np.stack([edge[0], left, right], axis=-1), np.stack([edge[0], right, edge[1]], axis=-1)]
    joined, leaning = np.concatenate(points), np.concatenate(normals)
    return (
        Mesh(mesh.name, joined, np.concatenate(rest), normals=leaning),
        Mesh(f"{mesh.name} part", joined, np.concatenate(part), normals=leaning),
    )


def wheel(name: str, center: tuple[float, float, float], radius: float, width: float, count: int = 48) -> Mesh:
    """A flat cylinder whose axis is y."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([radius * np.cos(angle), np.zeros(count), radius * np.sin(angle)], axis=-1)
    half = np.array([0.0, width / 2, 0.0])
    points = np.concatenate([ring - half, ring + half, [-half, half]]) + center
    a = np.arange(count)
    b = (a + 1) % count
    first, last = np.full(count, 2 * count), np.full(count, 2 * count + 1)
    sides = [(a, b, b + count), (a, b + count, a + count), (a, b, first), (b + count, a + count, last)]
    triangles = np.concatenate([np.stack(side, axis=-1) for side in sides]).astype(np.uint32)
    return Mesh(name, points.astype(np.float32), triangles)


def sheet(name: str, width: float, height: float, z: float = 0.0) -> Mesh:
    """A flat rectangle on the table at height z, facing up, with UVs from 0 to 1."""
    x, y = width / 2, height / 2
    corners = np.array([(-x, -y, z), (x, -y, z), (x, y, z), (-x, y, z)], np.float32)
    uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    return Mesh(name, corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uvs=uvs)


def scene_of(
    parts: Sequence[tuple[Mesh, Surface]], lights: Sequence[Light], view: tuple[NDArray[np.float64], float], film: Film
) -> Scene:
    """A spectral scene of meshes with a surface each; ``view``: world from camera, and the field of view."""
    return Scene(
        camera=Camera(world_from_camera=view[0], field_of_view_rad=view[1]),
        film=film,
        meshes=tuple(mesh for mesh, _ in parts),
        materials=tuple(Material(mesh.name, surface) for mesh, surface in parts),
        instances=tuple(Instance(mesh.name, mesh.name, np.eye(4), (mesh.name,)) for mesh, _ in parts),
        lights=tuple(lights),
        world=World(gray(0.02)),
        # The caustics of the lacquer are a few bright dots on the floor; they are not needed.
        settings=RenderSettings(transport="spectral", max_bounces=4, light_paths=LightPaths(clamp_indirect=1.0)),
    )
