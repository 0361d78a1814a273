# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshes of a scene in Mitsuba with the tree of their triangles, kept for the next scene of equal geometry.

They take most of the time to load a scene of many triangles, and a change of a material does not concern them. One
geometry is kept per process, and no scene uses it while another one does.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.context import Context
from spectral_core.render.mitsuba_scene.emission import is_dark
from spectral_core.render.mitsuba_scene.geometry import Part, split_by_material
from spectral_core.render.mitsuba_scene.lamps.rows import emitted_evenly
from spectral_core.render.same import equal
from spectral_core.scene import Color, DrawnPattern, ImageTexture, Instance, Scene, World
from spectral_core.scene.geometry import Mesh
from spectral_core.spectra.spectrum import Spectrum

MOST_KEPT = 1_000_000
"""Triangles of the largest geometry that is kept without a scene that uses it. A tuft of 3,000 strands has 500,000.
"""
MOST_VALUES = 12_000_000
"""Values of the largest image of an environment that is kept with it: about 100 MB."""

MeshOf = tuple[int, Part, Any]
"""Index of a material, the triangles in the space of the shape, and the shape."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """The data that a geometry is built from."""

    variant: str
    white: Any
    world: World
    meshes: tuple[Mesh, ...]
    instances: tuple[Instance, ...]

    def same_as(self, other: Plan) -> bool:
        """True if both give the same geometry, whatever the numbers of materials and lamps are."""
        if self.variant != other.variant or len(self.instances) != len(other.instances):
            return False
        alike = all(
            mine.mesh == given.mesh
            and mine.materials == given.materials
            and np.array_equal(mine.world_from_object, given.world_from_object)
            for mine, given in zip(self.instances, other.instances, strict=True)
        )
        return alike and equal((self.white, self.world, self.meshes), (other.white, other.world, other.meshes))


@dataclass(slots=True, eq=False, weakref_slot=True)
class Geometry:
    """Objects of Mitsuba that do not depend on numbers of materials and lamps.

    ``parts``: triangles of each mesh by material. ``shared``: for each instance True if it is a copy of a group of
    meshes. By the number of an instance, ``placed``: its meshes, ``copies``: its shape as a copy. ``bsdf``, ``meshes``:
    those of the ``Context``. ``plan``: None if it depends on other data, so that no other scene may use it.
    """

    parts: dict[str, dict[int, Part]]
    shared: tuple[bool, ...]
    plan: Plan | None
    placed: dict[int, list[MeshOf]] = field(default_factory=dict)
    copies: dict[int, Any] = field(default_factory=dict)
    groups: dict[tuple[str, tuple[str, ...]], tuple[Any, list[MeshOf]]] = field(default_factory=dict)
    bsdf: Any = None
    meshes: Any = None
    world: Any = None
    scene: Any = None
    uses: int = 0
    """Number of scenes that have used it."""

    @property
    def triangles(self) -> int:
        """Triangles of all shapes."""
        of_groups = [shapes for _, shapes in self.groups.values()]
        return sum(len(part.triangles) for shapes in (*self.placed.values(), *of_groups) for _, part, _ in shapes)

    def fits(self, plan: Plan | None) -> bool:
        """True if it is what ``plan`` gives."""
        return plan is not None and self.plan is not None and self.plan.same_as(plan)

    def rest(self, use: int) -> None:
        """Free the data of the scene that has ended, the ``use``-th, unless another one has begun."""
        if self.uses == use:
            self.bsdf.surfaces = self.meshes.scene = None


class _Kept:
    """The geometry of the latest scene, and the materials of the scene as long as it exists."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.geometry: Geometry | None = None
        self.user: weakref.ref[Any] | None = None


_kept = _Kept()


def geometry_for(
    context: Context, scene: Scene, shared_of: Callable[[dict[str, dict[int, Part]]], tuple[bool, ...]]
) -> Geometry:
    """The kept geometry if no scene uses it and ``scene`` has the same one, otherwise an empty one."""
    plan = _plan_of(context, scene)
    with _kept.lock:
        found, user = _kept.geometry, _kept.user
        _kept.geometry = _kept.user = None
    is_free = user is None or user() is None
    if found is not None and is_free and found.fits(plan) and found.shared == shared_of(found.parts):
        found.plan = plan
        context.adopt(found.bsdf, found.meshes)
        return found
    del found  # it frees its numbers in Mitsuba's registry, so that kernels are equal to those of a new process
    parts = {mesh.name: split_by_material(mesh) for mesh in scene.meshes}
    return Geometry(parts, shared_of(parts), plan)


def _plan_of(context: Context, scene: Scene) -> Plan | None:
    """What the geometry of a scene is built from; None if it contains objects that depend on other data."""
    if context.movable or context.lights is None or context.switches is not None or scene.world.camera_view is not None:
        return None
    if any(not is_dark(item.surface) and emitted_evenly(item.surface) is None for item in scene.materials):
        return None  # the emitter of a varying emission belongs to its shape
    color = scene.world.color
    if isinstance(color, DrawnPattern):
        return None  # the program of the environment belongs to the tables of its scene
    if not isinstance(color, (Color, Spectrum)) and not (
        isinstance(color, ImageTexture) and color.pixels.size <= MOST_VALUES
    ):
        return None
    variant = f"{context.mitsuba.variant()} {context.spectral}"
    return Plan(variant, context.white, scene.world, scene.meshes, scene.instances)


def keep(context: Context, geometry: Geometry, loaded: Any) -> None:
    """Keep a geometry for the next scene; ``loaded``: Mitsuba's scene of it.

    The tracers of a scene refer to its materials, so it has ended with the last of them. Objects of Mitsuba refer to
    them only weakly from now on.
    """
    geometry.scene, geometry.bsdf, geometry.meshes = loaded, context.bsdf, context.meshes
    if geometry.plan is None or geometry.triangles > MOST_KEPT:
        return
    geometry.uses += 1
    surfaces = context.bsdf.surfaces
    weakref.finalize(surfaces, geometry.rest, geometry.uses).atexit = False
    geometry.bsdf.surfaces = weakref.proxy(surfaces)
    with _kept.lock:
        _kept.geometry, _kept.user = geometry, weakref.ref(surfaces)
