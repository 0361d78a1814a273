# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes with pictures in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_core.scene import (
    Camera,
    Diffuse,
    Film,
    Instance,
    Light,
    Material,
    Mesh,
    RenderSettings,
    Scene,
    Surface,
    gray,
)


def matrix(translation: tuple[float, float, float] = (0, 0, 0), scale: float = 1.0) -> np.ndarray:
    """World from object: a uniform scale, then a translation."""
    result = np.diag([scale, scale, scale, 1.0])
    result[:3, 3] = translation
    return result


def plane(half: float = 50.0, name: str = "plane") -> Mesh:
    """A square in z = 0 that faces up, UVs from 0 to 1."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return Mesh(name, corners * half, triangles, uvs=(corners[:, :2] + 1) / 2)


def sphere_mesh(rings: int = 48, name: str = "sphere") -> Mesh:
    """A smooth unit sphere."""
    latitude, longitude = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1))
    x, y, z = np.sin(latitude) * np.cos(longitude), np.sin(latitude) * np.sin(longitude), np.cos(latitude)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    columns = rings + 1
    corner = (np.arange(2 * rings)[:, None] * columns + np.arange(rings)).ravel()
    triangles = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + columns], axis=1),
            np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1),
        ]
    )
    return Mesh(name, points, triangles.astype(np.uint32), normals=points)


def looking_down(height: float = 2.0, field_of_view_rad: float = 0.05) -> Camera:
    """A camera above the origin that looks down, +y up in the picture."""
    return Camera(world_from_camera=matrix((0, 0, height)), field_of_view_rad=field_of_view_rad)


def lit_plane(*lights: Light, surface: Surface | None = None, transport: str = "rgb", **rest: Any) -> Scene:
    """A gray plane (reflectance 0.5) under lights, seen from above over its middle."""
    film = rest.pop("film", Film(8, 8, samples=64))
    return Scene(
        camera=rest.pop("camera", looking_down()),
        film=film,
        meshes=(plane(),),
        materials=(Material("paper", Diffuse(gray(0.5)) if surface is None else surface),),
        instances=(Instance("table", "plane", np.eye(4), ("paper",)),),
        lights=lights,
        settings=rest.pop("settings", RenderSettings(transport=transport)),  # type: ignore[arg-type]
        **rest,
    )
