# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns of lamps: their textures, and their means, by which the renderer chooses among lights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.scene import AreaLight, Light, SunLight

Array = NDArray[np.float64]

DIRECTIONS = 256
"""Directions, or points of a panel, over which a pattern's mean is taken."""
USUAL_DISTANCE = 3.0
"""Distance of the receivers, in units of the scene."""
LEAST = 0.05
"""Least mean of an emission that varies: where it is dark in the mean, it may be bright at a place."""


def pattern_texture(context: Any, light: Light) -> Any:
    """Texture of the factor by which a lamp's emission varies, made in a ``Context``; None if it is even."""
    if light.pattern is None:
        return None
    return context.computed(light.pattern.program, context.constant(1.0))


def pattern_mean(light: Light) -> float:
    """Mean magnitude of a lamp's factor over directions and points; 1 without a pattern.

    It steers the choice of lights only: no light depends on it in the mean.
    """
    if light.pattern is None:
        return 1.0
    point, normal, incoming = _places(light)
    distance = np.full(len(point), 3e38 if isinstance(light, SunLight) else USUAL_DISTANCE)
    vectors = {"position": point, "normal": normal, "true_normal": normal, "incoming": incoming}

    def read(name: str, shift: int) -> Any:
        if name in vectors:
            return tuple(vectors[name].T)
        if name == "ray:Ray Length":
            return distance
        return 0.0 * distance if name.startswith("ray:") else (0.0 * distance,) * 3

    def transform(vector: Any, *_: Any) -> Any:
        return vector

    found = np.nan_to_num(light.pattern.program.evaluate(read, transform=transform), posinf=0.0, neginf=0.0)
    return float(np.clip(np.abs(found).mean(), LEAST, 1e6))


def _places(light: Light) -> tuple[Array, Array, Array]:
    """Points of a lamp (n, 3), their normals, and directions toward receivers, spread evenly."""
    number = np.arange(DIRECTIONS) + 0.5
    height, turn = 1.0 - 2.0 * number / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * number
    flat = np.sqrt(1.0 - height**2)
    sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1)
    center, axes = light.world_from_light[:3, 3], light.world_from_light[:3, :3]
    if isinstance(light, SunLight):
        travels = np.broadcast_to(-axes[:, 2] / max(float(np.linalg.norm(axes[:, 2])), 1e-30), sphere.shape)
        return travels, travels, travels
    if isinstance(light, AreaLight):
        side = round(DIRECTIONS**0.5)
        x, y = (c.ravel() for c in np.meshgrid(*((((np.arange(side) + 0.5) / side) - 0.5,) * 2)))
        points = center + np.outer(x * light.size[0], axes[:, 0]) + np.outer(y * light.size[1], axes[:, 1])
        toward = np.broadcast_to(-axes[:, 2], points.shape)
        return points, toward, toward
    front = sphere * np.where(sphere @ -axes[:, 2] < 0, -1.0, 1.0)[:, None] if hasattr(light, "blend") else sphere
    return center + front * getattr(light, "radius", 0.0), front, front
