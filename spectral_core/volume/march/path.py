# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through one field or several: the coordinate along which the march advances.

Through one field the coordinate t counts voxels from the ray's entry, so that float32 is exact enough wherever the
field is in the world. Through several it counts world units from the first entry, and each field stores its own entry.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from spectral_core.volume.march.arithmetic import larger, smaller
from spectral_core.volume.march.march_input import MarchInput, Rays, clip_to_box

NEVER = 1e30
# A rest of a field shorter than this many voxels may vanish in the rounding of a shared t, and is left out.
_REST = 1e-4


@dataclass(frozen=True)
class WorldRay:
    """Ray through the scene: ``origin`` and unit ``direction`` (Array3f), ended by a surface at ``end``."""

    origin: Any
    direction: Any
    end: Any

    def at(self, distance: Any) -> Any:
        """World point at a distance."""
        import drjit as dr

        return dr.fma(self.direction, distance, self.origin)


@dataclass(frozen=True)
class Placed:
    """A field ready to march and ``index_from_world``: rows of its linear part, and its offset, all Array3f64.

    Rays of a scene have single precision. All that is made of them until they begin beside the field is in double
    precision: the field may be far away, or its voxels far longer along one axis.
    """

    data: MarchInput
    rows: tuple[Any, Any, Any]
    offset: Any

    def index_vector(self, world: Any) -> Any:
        """A world vector (Array3f or Array3f64) in index space, Array3f64."""
        import drjit as dr

        doubles = self.data.volume.types.Array3f64
        return doubles(*(dr.dot(row, doubles(world)) for row in self.rows))

    def index_point(self, world: Any) -> Any:
        """A world point in index space, as ``index_vector``."""
        return self.index_vector(world) + self.offset

    def world_covector(self, index: Any) -> Any:
        """A gradient over index space as one over world space: ∂f/∂world_a = Σ_b ∂f/∂index_b · ∂index_b/∂world_a."""
        doubles = self.data.volume.types.Array3f64(index)
        return self.rows[0] * doubles.x + self.rows[1] * doubles.y + self.rows[2] * doubles.z

    def rays(self, ray: WorldRay) -> tuple[Rays, Any]:
        """(the ray inside this field, world distance at which that begins)."""
        import drjit as dr

        volume = self.data.volume
        types = volume.types
        # In index space bricks are unit cells, whatever shear or scale the placement has.
        point, along = self.index_point(types.Array3f(ray.origin)), self.index_vector(types.Array3f(ray.direction))
        speed = dr.sqrt(dr.dot(along, along))
        along /= speed
        last = types.Array3f64(volume.last)
        to_middle = 0.5 * last - point
        # A ray that begins in the field or near it may begin on a face, and is not moved.
        is_near = dr.all(dr.abs(to_middle) <= last + 1.0)
        ahead = dr.select(is_near, 0.0, dr.dot(to_middle, along))
        start = types.Array3f(dr.fma(along, ahead, point))
        along, world = types.Array3f(along), types.Float(dr.rcp(speed))
        inside = clip_to_box(self.data.grid, start, along, world, types.Float(-ahead))
        begin = types.Float((ahead + dr.dot(inside.origin - start, along)) / speed)
        # A surface in front of the field's end cuts the march short.
        length = dr.clip((ray.end - begin) * types.Float(speed), 0.0, inside.length)
        return Rays(inside.origin, inside.direction, length, world, inside.line), begin


@dataclass(frozen=True)
class FieldPath:
    """One field along the path. ``begin`` is t at its entry, ``voxel`` the length of a voxel in units of t; both None
    if t counts this field's own voxels.
    """

    data: MarchInput
    rays: Rays
    begin: Any = None
    voxel: Any = None

    def local(self, t: Any) -> Any:
        """Voxels from this field's entry."""
        return t if self.begin is None else (t - self.begin) / self.voxel

    def along(self, voxels: Any) -> Any:
        """A length in voxels, in units of t."""
        return voxels if self.voxel is None else voxels * self.voxel

    def inside(self, t: Any) -> Any:
        """True if t lies in this field (the Python True if there is no other field)."""
        if self.begin is None:
            return True
        local = self.local(t)
        # A margin at the entry keeps rounding of a shared t from losing the first brick; at the exit it would add a
        # step of no length.
        return (local > -10.0 * _REST) & (local < self.rays.length - _REST)

    def until_entry(self, t: Any) -> Any:
        """Distance in t until the ray enters; NEVER if it is past the entry or never enters."""
        import drjit as dr

        # The complement of ``inside`` at the entry: a ray in neither state would not advance.
        waits = (self.local(t) <= -10.0 * _REST) & (self.rays.length > _REST)
        return dr.select(waits, self.begin - t, NEVER)


@dataclass(frozen=True)
class Path:
    """The path of a march: ``fields``, the ``length`` in units of t, and the ``world`` length of one unit.

    ``start`` is the world distance along the ray at t = 0, for callers that need world distances. ``phase``: share, in
    (0, 1], of a step that the first midpoint step in each visible part takes; None for 1. Neighboring rays of different
    phases have different errors, which look like grain, not like bands.
    """

    fields: tuple[FieldPath, ...]
    length: Any
    world: Any
    start: Any = None
    phase: Any = None

    @property
    def types(self) -> Any:
        """The Dr.Jit array module."""
        return self.fields[0].data.volume.types

    @property
    def is_shared(self) -> bool:
        """True if t is common to several fields."""
        return len(self.fields) > 1

    def distance(self, t: Any) -> Any:
        """World distance along the ray."""
        import drjit as dr

        return dr.fma(t, self.world, self.start)


def path_through(fields: list[Placed], ray: WorldRay, phase: Any = None, passed: list[Any] | None = None) -> Path:
    """The path of a world ray through ``fields``; ``phase`` as in ``Path``.

    ``passed``: for each field True for the rays that pass through it as if it were not there; None for none.
    """
    import drjit as dr

    lines = [ray] * len(fields)
    if passed is not None:
        lines = [replace(ray, end=dr.select(each, 0.0, ray.end)) for each in passed]
    parts = [field.rays(line) for field, line in zip(fields, lines, strict=True)]
    # One field counts its own voxels: no other has to agree on the unit.
    if len(fields) == 1:
        rays, begin = parts[0]
        return Path((FieldPath(fields[0].data, rays),), rays.length, rays.world, begin, phase)
    first: Any = NEVER
    last: Any = -NEVER
    for rays, begin in parts:
        first = smaller(dr.select(rays.length > 0, begin, NEVER), first)
        last = larger(dr.select(rays.length > 0, begin + rays.length * rays.world, -NEVER), last)
    # A ray that meets no field has first = NEVER; it gets a path of length 0.
    met = last > first
    first = dr.select(met, first, 0.0)
    paths = tuple(
        FieldPath(field.data, rays, begin - first, rays.world)
        for field, (rays, begin) in zip(fields, parts, strict=True)
    )
    one = ray.end * 0.0 + 1.0
    return Path(paths, dr.select(met, last - first, 0.0), one, first, phase)
