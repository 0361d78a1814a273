# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and placements that scenes of benchmarks are built from."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import Mesh


def at(x: float = 0, y: float = 0, z: float = 0, scale: Any = 1.0, turn: tuple[str, float] | None = None) -> np.ndarray:
    """World from object: scale, a rotation in degrees about an axis, a translation."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(np.broadcast_to(scale, 3).astype(float))
    if turn:
        angle = np.radians(turn[1])
        c, s = np.cos(angle), np.sin(angle)
        about = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
        about["z"] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
        matrix[:3, :3] = np.array(about[turn[0]]) @ matrix[:3, :3]
    matrix[:3, 3] = (x, y, z)
    return matrix


def square() -> Mesh:
    """A square in z = 0 that faces up, UVs from 0 to 1."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    return Mesh("square", corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uvs=(corners[:, :2] + 1) / 2)


def box() -> Mesh:
    """A cube from -1 to 1."""
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float32)
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    triangles = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
    return Mesh("box", corners, np.array(triangles, np.uint32))


def sphere(rings: int = 32) -> Mesh:
    """A smooth unit sphere."""
    latitude, longitude = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1))
    points = np.stack(
        [np.sin(latitude) * np.cos(longitude), np.sin(latitude) * np.sin(longitude), np.cos(latitude)], axis=-1
    )
    points = points.reshape(-1, 3).astype(np.float32)
    first = (np.arange(2 * rings)[:, None] * (rings + 1) + np.arange(rings)).ravel()
    lower = np.stack([first, first + 1, first + rings + 1], axis=1)
    upper = np.stack([first + 1, first + rings + 2, first + rings + 1], axis=1)
    return Mesh("sphere", points, np.concatenate([lower, upper]).astype(np.uint32), normals=points)


def wedge() -> Mesh:
    """A prism over a triangle, along y."""
    corners = np.array([[x, y, z] for y in (-1, 1) for x, z in ((-1, 0), (1, 0), (0, 1.6))], np.float32)
    triangles = [(0, 1, 2), (3, 5, 4), (0, 3, 1), (1, 3, 4), (1, 4, 2), (2, 4, 5), (2, 5, 0), (0, 5, 3)]
    return Mesh("wedge", corners, np.array(triangles, np.uint32))
