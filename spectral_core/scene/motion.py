# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion while the shutter is open: the scene at several instants, each stored as its differences from the frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.checks import read_only_when_copied
from spectral_core.scene.camera import Camera
from spectral_core.scene.geometry import Instance, Mesh, VolumeObject, affine


@read_only_when_copied
@dataclass(frozen=True, slots=True, eq=False)
class MovedVolume:
    """Where a volume of the frame is at another instant. ``world_from_index``: (4, 4), as that of a VolumeObject."""

    name: str
    world_from_index: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_index", affine(f"volume {self.name!r}", self.world_from_index))


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One instant: its camera, and the instances, meshes and volumes (by the frame's names) that differ from the
    frame.
    """

    camera: Camera
    instances: tuple[Instance, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    volumes: tuple[MovedVolume, ...] = ()


def merged(kept: tuple[Any, ...], changed: tuple[Any, ...]) -> tuple[Any, ...]:
    """Named items, with changed ones in place of those of equal names."""
    by_name = {item.name: item for item in changed}
    return tuple(by_name.get(item.name, item) for item in kept)


def displaced(volumes: tuple[VolumeObject, ...], moved: tuple[MovedVolume, ...]) -> tuple[VolumeObject, ...]:
    """Volumes of the frame, with those of equal names at the places of ``moved``."""
    places = {item.name: item.world_from_index for item in moved}
    return tuple(replace(item, world_from_index=places[item.name]) if item.name in places else item for item in volumes)


def following(moments: Iterable[Moment], instances: Iterable[Instance]) -> tuple[Moment, ...]:
    """Moments whose objects have the materials and the light groups of the frame's ``instances`` of equal names."""
    found = {item.name: item for item in instances}

    def followed(item: Instance) -> Instance:
        frame = found.get(item.name, item)
        return replace(item, materials=frame.materials, group=frame.group)

    return tuple(replace(moment, instances=tuple(map(followed, moment.instances))) for moment in moments)


def same_camera(first: Camera, second: Camera) -> bool:
    """True if two cameras have the same position and settings."""
    if not np.array_equal(first.world_from_camera, second.world_from_camera):
        return False
    numbers = ("field_of_view_rad", "orthographic_scale", "shift", "aperture_radius", "focus_distance")
    return all(getattr(first, name) == getattr(second, name) for name in numbers)


def same_mesh(first: Mesh, second: Mesh) -> bool:
    """True if two meshes of equal topology have equal vertices; a mesh of other topology cannot follow the first and
    counts as equal.
    """
    if first.positions.shape != second.positions.shape or first.triangles.shape != second.triangles.shape:
        return True
    return bool(np.array_equal(first.positions, second.positions))
