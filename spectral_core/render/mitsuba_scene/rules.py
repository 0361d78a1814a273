# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of shapes and lights to types of rays: tables that the path integrator reads by registry number.

A table has one row per registered object, 0 for no rule. A scene without rules has no tables and no cost.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spectral_core.render.plugins.numbers import Rows, table
from spectral_core.render.plugins.surfaces.at_hit import SurfaceAt
from spectral_core.render.trace.media.table import HIDDEN, IN_MEDIUM, Media, MediaAround, MediumRow
from spectral_core.scene import Rays

MOST_LINKED_LIGHTS = 32
"""Most lights with light or shadow linking: one bit each."""
HOLDOUT = 1 << 8
"""Bit of a holdout's shape; above the bits of the types of rays."""
STRAND = 1 << 9
"""Bit of the shape of hair: no ray meets its walls from within, because its closures lead light through it."""


@dataclass
class RayRules:
    """Exceptions from "every ray hits everything", by Mitsuba object.

    ``shapes``: bits of ``Rays`` that pass through a shape, ``HOLDOUT``, ``STRAND``. ``lights``: bits of ``Rays`` that
    an emitter does not illuminate. ``light_bounces``: largest number of bounces at which an emitter illuminates.
    ``shadowless``: emitters whose sampled light nothing occludes. ``only_sampled``: emitters that no ray meets.
    ``links``: emitter to its number among the linked lights; ``unlit``, ``clear``: by shape the linked lights that do
    not illuminate it, and those for which it casts no shadow.
    ``camera_world``: the emitter that the camera sees in place of the environment.
    """

    shapes: list[tuple[Any, int]] = field(default_factory=list)
    lights: list[tuple[Any, int]] = field(default_factory=list)
    light_bounces: list[tuple[Any, int]] = field(default_factory=list)
    shadowless: list[Any] = field(default_factory=list)
    only_sampled: list[Any] = field(default_factory=list)
    links: list[tuple[Any, int]] = field(default_factory=list)
    unlit: list[tuple[Any, int]] = field(default_factory=list)
    clear: list[tuple[Any, int]] = field(default_factory=list)
    camera_world: Any | None = None
    subsurface: bool = False
    """True if a surface has subsurface scattering."""
    disks: bool = False
    """True if some of it is by the profile of Christensen and Burley."""
    surfaces: Any = None
    """``SurfaceTables`` of the scene."""
    meshes: Any = None
    """``MeshTables`` of the scene."""
    media: list[MediumRow] = field(default_factory=list)
    """The media of shapes and of the world, by number from 1."""
    unlit_media: list[tuple[int, int]] = field(default_factory=list)
    """By medium the linked lights that do not illuminate it."""
    inside: list[tuple[Any, int]] = field(default_factory=list)
    """By shape the number of its medium, with the bits of ``trace.media.table`` above it."""
    around: MediaAround = field(default_factory=MediaAround)
    """Numbers of the media of the world and at the camera."""
    made_media: Media | None = None
    """The media as tables of the renderer, which all tracers of the scene share."""
    holdouts: bool = False
    """True if parts of some surface are holdouts."""
    reradiation: Any | None = None
    """Tables of fluorescent surfaces (``trace.reradiation``), None without any."""

    def add_shapes(self, shapes: Iterable[Any], bits: int, unlit: int = 0, clear: int = 0) -> None:
        """Add the rules of one object, which may consist of several shapes."""
        for shape in shapes:
            for rows, value in ((self.shapes, bits), (self.unlit, unlit), (self.clear, clear)):
                if value:
                    rows.append((shape, value))


class Tables:
    """The rules as arrays of the active variant; ``None`` for a rule that does not occur."""

    def __init__(self, mitsuba: Any, rules: RayRules) -> None:
        self._mi = mitsuba
        shape, emitter = mitsuba.ShapePtr, mitsuba.EmitterPtr
        self.shapes = self._table(shape, rules.shapes)
        self.lights = self._table(emitter, rules.lights)
        self.light_bounces = self._table(emitter, [(item, count + 1) for item, count in rules.light_bounces])
        self.shadowless = self._table(emitter, [(item, 1) for item in rules.shadowless])
        self.only_sampled = self._table(emitter, [(item, 1) for item in rules.only_sampled])
        self.links = self._table(emitter, [(item, number + 1) for item, number in rules.links])
        self.unlit = self._table(shape, rules.unlit)
        self.unlit_media = self._table(shape, rules.unlit_media)
        self.clear = self._table(shape, rules.clear)
        self.camera_world, self.subsurface, self.disks = rules.camera_world, rules.subsurface, rules.disks
        self.surfaces, self.meshes = rules.surfaces, rules.meshes
        self.media: Any = None
        self.has_holdout_surfaces = rules.holdouts
        self.has_holdout_shapes = any(bits & HOLDOUT for _, bits in rules.shapes)
        self.cuts_holes = rules.holdouts or self.has_holdout_shapes
        if rules.media:
            if rules.made_media is None:
                inside = self._table(shape, rules.inside)
                hides = any(bits >> HIDDEN for _, bits in rules.inside)
                rules.made_media = Media(mitsuba, rules.media, inside, rules.around, hides=hides)
            self.media = rules.made_media
        self.reradiation = rules.reradiation
        self.has_even_lobes = rules.subsurface or rules.reradiation is not None
        self.has_strands = any(bits & STRAND for _, bits in rules.shapes)
        unseen = int(Rays.ALL & ~Rays.CAMERA)
        self.blocks_selectively = self.clear is not None or any(bits & unseen for _, bits in rules.shapes)

    def _table(self, pointer: Any, rows: list[tuple[Any, int]]) -> Rows | None:
        if not rows:
            return None
        # lights of our tables have their own numbers, Mitsuba's objects those of its registry
        numbers = [item if isinstance(item, int) else int(self.number(pointer(item))[0]) for item, _ in rows]
        found = np.zeros(max(numbers) + 1, np.uint32)
        found[numbers] = [value for _, value in rows]
        return Rows.of(table(self._mi.UInt32, found))

    def number(self, pointer: Any) -> Any:
        """Registry number of a Mitsuba pointer, 0 for none."""
        import drjit as dr

        return dr.reinterpret_array(self._mi.UInt32, pointer)

    def look_up(self, table: Rows | None, number: Any, missing: int = 0) -> Any:
        """Row of a table; ``missing`` for objects without a row."""
        return self._mi.UInt32(missing) if table is None else table.look_up(number, missing)

    def intersect(self, scene: Any, ray: Any, active: Any, coherent: Any = False) -> Any:
        """The nearest hit of a ray in the scene."""
        return self.meshes.intersect(scene, ray, coherent, active)

    def intersect_seen(self, scene: Any, ray: Any, kind: Any, active: Any, coherent: Any = False) -> Any:
        """The nearest hit of a ray of a type. If rays may start in media that they do not see, it is behind the shapes
        that the ray passes: as in Cycles, such a medium has no effect if the ray meets nothing else.
        """
        import drjit as dr

        first = self.intersect(scene, ray, active, coherent)
        if self.media is None or not self.media.hides:
            return first

        def passed(si: Any, on: Any) -> Any:
            return on & si.is_valid() & self.passes(self.shape_number(si), kind)

        def onward(si: Any, walking: Any) -> tuple[Any, Any]:
            rest = si.spawn_ray(ray.d)
            rest.time, rest.wavelengths, rest.maxt = ray.time, ray.wavelengths, ray.maxt - si.t
            beyond = self.intersect(scene, rest, walking)
            beyond.t += si.t
            return dr.select(walking, beyond, si), passed(beyond, walking)

        found, _ = dr.while_loop((first, passed(first, active)), lambda _, walking: walking, onward)
        return found

    @property
    def counts_lengths(self) -> bool:
        """True if the lengths of rays from their last bounce are kept, because a program reads them, or because lamps
        have bodies: from behind another surface or lamp, a ray tells by its length which place receives their light.
        """
        scene = self.meshes.scene
        return bool(scene.reads_lengths or scene.has_bodies)

    def at_bounce(self, si: Any) -> Any:
        """The hit as the start of rays whose length counts from it."""
        if not self.counts_lengths:
            return si
        place = self._mi.SurfaceInteraction3f(si)
        place.time = self._mi.Float(0.0)
        return place

    def surface(self, si: Any) -> SurfaceAt:
        """The BSDF of the surface at a hit."""
        return SurfaceAt(self.surfaces, si)

    def shape_number(self, si: Any) -> Any:
        """Number of the hit object: that of its instance if the shape is shared."""
        import drjit as dr

        placed, own = self.number(si.instance), self.number(si.shape)
        return dr.select(placed != 0, placed, own)

    def passes(self, shape: Any, kind: Any) -> Any:
        """True if rays of a type pass through a shape."""
        if self.shapes is None:
            return self._mi.Bool(False)
        return (self.look_up(self.shapes, shape) & kind) != 0

    def from_within(self, shape: Any, si: Any, direction: Any) -> Any:
        """True if a ray hits the wall of a strand from within."""
        import drjit as dr

        if not self.has_strands:
            return self._mi.Bool(False)
        return ((self.look_up(self.shapes, shape) & STRAND) != 0) & (dr.dot(si.n, direction) > 0.0)

    def out_of_strand(self, scene: Any, start: tuple[Any, Any], ray: Any, active: Any) -> tuple[Any, Any]:
        """A ray from a hit (its interaction and shape), past the far wall of the strand if it leads into one, and
        whether it meets another surface within that strand.

        Otherwise the wall, which is no obstacle, would cost the path another step; in media it does.
        """
        import drjit as dr

        if not self.has_strands or self.media is not None:
            return ray, self._mi.Bool(False)
        si, shape = start
        enters = active & ((self.look_up(self.shapes, shape) & STRAND) != 0) & (dr.dot(si.n, ray.d) < 0.0)
        wall = self.intersect(scene, ray, enters)
        meets = enters & wall.is_valid()
        leaves = meets & self.from_within(self.shape_number(wall), wall, ray.d)
        beyond = wall.spawn_ray(ray.d)
        beyond.maxt = ray.maxt - wall.t
        return dr.select(leaves, beyond, ray), meets & ~leaves

    def lights_it(self, emitter: Any, kind: Any, bounces: Any, receiver: Any) -> Any:
        """True if an emitter illuminates a receiver (a shape's number, or ``in_media.receiver``) along a type of ray,
        after a number of bounces.
        """
        mi = self._mi
        lit = mi.Bool(True)
        if self.lights is not None:
            lit &= (self.look_up(self.lights, emitter) & kind) == 0
        if self.light_bounces is not None:
            most = self.look_up(self.light_bounces, emitter)
            lit &= (most == 0) | (bounces < most)
        unlit = self.unlit_by(receiver)
        if unlit is not None:
            lit &= (unlit & self._bit(emitter)) == 0
        return lit

    def unlit_by(self, receiver: Any) -> Any:
        """Bits of the linked lights that do not illuminate a receiver; None without linking."""
        if self.links is None or (self.unlit is None and self.unlit_media is None):
            return None
        found = self.look_up(self.unlit, receiver)
        if self.unlit_media is not None:
            # without the bit, the number of a shape becomes one that no medium has
            found |= self.look_up(self.unlit_media, receiver ^ self._mi.UInt32(IN_MEDIUM))
        return found

    def casts_shadow(self, shape: Any, emitter: Any) -> Any:
        """True if a shape that a shadow ray sees occludes the light of an emitter."""
        if self.clear is None:
            return self._mi.Bool(True)
        return (self.look_up(self.clear, shape) & self._bit(emitter)) == 0

    def is_linked(self, emitter: Any) -> Any:
        """True for a light of light or shadow linking."""
        return self._bit(emitter) != 0

    def _bit(self, emitter: Any) -> Any:
        """Bit of a linked light, 0 for other lights."""
        import drjit as dr

        mi = self._mi
        number = self.look_up(self.links, emitter)
        return dr.select(number > 0, mi.UInt32(1) << (dr.maximum(number, 1) - 1), 0)
