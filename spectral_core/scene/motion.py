# SPDX-License-Identifier: GPL-3.0-or-later
"""What moves while the shutter is open: the scene at several instants, each by what differs from the frame itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.scene.camera import Camera
from spectral_core.scene.geometry import Instance, Mesh


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One instant: its camera, and the instances and meshes (by the frame's names) that are not as in the frame."""

    camera: Camera
    instances: tuple[Instance, ...] = ()
    meshes: tuple[Mesh, ...] = ()


def merged(kept: tuple[Any, ...], changed: tuple[Any, ...]) -> tuple[Any, ...]:
    """Named things with those that changed in place of those of their names."""
    by_name = {item.name: item for item in changed}
    return tuple(by_name.get(item.name, item) for item in kept)


def same_camera(first: Camera, second: Camera) -> bool:
    """Whether two cameras see the same from the same place."""
    if not np.array_equal(first.world_from_camera, second.world_from_camera):
        return False
    numbers = ("field_of_view_rad", "orthographic_scale", "shift", "aperture_radius", "focus_distance")
    return all(getattr(first, name) == getattr(second, name) for name in numbers)


def same_mesh(first: Mesh, second: Mesh) -> bool:
    """Whether two meshes of one shape stand alike; a mesh of another shape cannot follow the first and counts too."""
    if first.positions.shape != second.positions.shape or first.triangles.shape != second.triangles.shape:
        return True
    return bool(np.array_equal(first.positions, second.positions))
