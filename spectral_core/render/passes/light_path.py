# SPDX-License-Identifier: GPL-3.0-or-later
"""A path integrator that accumulates light by pass: by the first surface's lobe, by the light group, and by direct or
indirect light.

As in Cycles, *direct* is light that reaches the camera over one surface, *indirect* over more. A surface's diffuse part
(with subsurface scattering) is *diffuse*, its other reflections are *glossy*, light through it is *transmission*. Light
that the camera sees directly is *emission* or *environment*.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.rules import Tables
from spectral_core.render.passes import books
from spectral_core.render.passes.books import LIGHT_ROWS
from spectral_core.render.plugins.numbers import table
from spectral_core.render.trace.lobes import drawn_parts
from spectral_core.render.trace.path.integrator import scene_path_class
from spectral_core.render.trace.path.settings import PathSettings
from spectral_core.scene import Scene


@dataclass(frozen=True, eq=False)
class Groups:
    """Light groups with a pass. ``by_light``, ``by_medium``: number of the group of each light and of each medium's
    emission, from 1; 0 for none of ``names``. ``of_world``: that of the world, of which the camera sees nothing if
    ``hides_world``.
    """

    names: tuple[str, ...]
    by_light: np.ndarray
    by_medium: np.ndarray
    of_world: int
    hides_world: bool

    @classmethod
    def of(cls, names: tuple[str, ...], scene: Scene, lights: Any, media: list[Any]) -> Groups:
        """The groups ``names`` of a scene with these tables of lights (None for none) and media."""
        numbers = {name: number for number, name in enumerate(names, 1)}

        def by_number(items: list[Any]) -> np.ndarray:
            return np.array([0, *(numbers.get(item.group, 0) for item in items)], np.uint32)

        sources = [] if lights is None else lights.sources
        of_world = numbers.get(scene.world.group, 0)
        return cls(names, by_number(sources), by_number(media), of_world, scene.film.transparent)


@cache
def light_pass_class(variant: str) -> Any:
    """The integrator's class under ``variant``, which must be the active one."""
    import drjit as dr
    import mitsuba as mi

    class LightPassPath(scene_path_class(variant)):  # type: ignore[misc]
        """``groups``: light groups, whose rows follow those of the passes."""

        restarts = False
        met: Any
        sums: Any = None
        lane: Any = None
        measured: Any = None
        book_into, book, book_lobes, book_group = books.book_into, books.book, books.book_lobes, books.book_group
        parts_of, complete = books.parts_of, books.complete

        def __init__(self, settings: PathSettings, tables: Tables, lights: Any, groups: Groups) -> None:
            super().__init__(settings, tables, lights)
            self.groups, self.of_world, self.hides_world = groups.names, groups.of_world, groups.hides_world
            self.rows = len(LIGHT_ROWS) + len(groups.names)
            self.by_light, self.by_medium = (table(mi.UInt32, each) for each in (groups.by_light, groups.by_medium))
            self.parts: Any = None
            """Diffuse, glossy and transmitted shares of the path's light at the first surface."""
            self.here: Any = None
            """The current hit of the path."""
            self.reflections: Any = None
            """Number of surfaces that have reflected the light diffusely that is booked."""

        def trace(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            if self.sums is None:
                return super().trace(scene, sampler, ray, active)

            def body(state: Any, sampler: Any, *parts: Any) -> Any:
                self.parts = parts
                state, sampler = self.step(scene, state, sampler)
                return state, sampler, *self.parts

            # no lobe yet: paths that scatter in a medium first belong to none
            start = (self.begin(ray, active, scene), sampler, mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Spectrum(0.0))
            labels = ("path", "sampler", "diffuse", "glossy", "transmission")
            state, *_ = dr.while_loop(start, lambda state, *_: state.active, body, labels=labels)
            self.release()
            self.parts = self.here = self.reflections = self.seen_world = None
            return state.light, state.seen, state.extra(self.settings.clear_glass)

        def fly(self, si: Any, path: Any, sampler: Any, active: Any) -> tuple[Any, Any]:
            before = mi.Spectrum(path.light)
            floats, place = super().fly(si, path, sampler, active)
            if self.sums is not None:
                emitted = path.light - before
                self.reflections = path.diffuse
                self.book(LIGHT_ROWS["Emission"], emitted, active & (path.depth == 0))
                self.book_lobes(emitted, "Direct", self.parts, active & (path.depth == 1))
                self.book_lobes(emitted, "Indirect", self.parts, active & (path.depth > 1))
                media = self.media_here(path, active)
                for row, _ in enumerate(self.groups):
                    only = self.lamps_in_fog(si, path, active, lambda number, row=row: self.of_group(number, row))
                    only += self.emitted_by_media(media, row, active)
                    self.book(len(LIGHT_ROWS) + row, self.clamped(only, path.depth > 1), active)
            return floats, place

        def media_here(self, path: Any, active: Any) -> list[tuple[Any, Any]]:
            """Number of the group of each medium at the path's place, and the medium's emission."""
            media = self.tables.media
            if not (self.groups and media.emits):
                return []
            numbers = [part.medium for part in self.flight.parts]
            groups = [dr.gather(mi.UInt32, self.by_medium, number, active) for number in numbers]
            emitted = [media.coefficients(number, path.ray.wavelengths, active)[2] for number in numbers]
            return list(zip(groups, emitted, strict=True))

        def emitted_by_media(self, media: list[tuple[Any, Any]], row: int, active: Any) -> Any:
            """Light that the media of a group emit on the flight; where media that vary overlap, by their maxima."""
            total, mine = mi.Spectrum(0.0), mi.Spectrum(0.0)
            for group, emitted in media:
                total += emitted
                mine += dr.select(group == row + 1, emitted, 0.0)
            share = dr.select(total > 0.0, mine / dr.maximum(total, 1e-30), 0.0)
            return dr.select(active, self.flight.carried * self.flight.emission * share, 0.0)

        def arrived(self, si: Any, path: Any, active: Any, of: Any = None) -> Any:
            value = super().arrived(si, path, active)
            if self.sums is None:
                return value
            indirect, self.reflections = path.depth > 1, path.diffuse
            first = active & (path.depth == 0)
            of = lambda part: self.clamped(path.throughput * part, indirect)  # noqa: E731
            self.book(LIGHT_ROWS["Emission"], of(self.met.lamps + self.met.emissive), first)
            self.book(LIGHT_ROWS["Environment"], of(self.met.world), first)
            if self.met.behind_glass is not None:  # what the picture omits there, as in front of glass
                self.book(LIGHT_ROWS["Environment"], of(self.met.behind_glass), active & (path.depth > 0))
            self.book_lobes(of(value), "Direct", self.parts, active & (path.depth == 1))
            self.book_lobes(of(value), "Indirect", self.parts, active & indirect)
            for row, _ in enumerate(self.groups):
                only = super().arrived(si, path, active, lambda number, row=row: self.of_group(number, row))
                if row + 1 == self.of_world and self.hides_world:
                    only -= dr.select(first, self.met.world, 0.0)
                elif row + 1 == self.of_world and self.tables.camera_world is not None:
                    only += self.seen_world
                self.book(len(LIGHT_ROWS) + row, of(only), active)
            return value

        def of_group(self, number: Any, row: int) -> Any:
            """True if a light belongs to a group."""
            return dr.gather(mi.UInt32, self.by_light, number) == row + 1

        def direct(self, scene: Any, sampler: Any, hit: tuple[Any, ...], path: Any, active: Any) -> Any:
            value = super().direct(scene, sampler, hit, path, active)
            self.here = hit
            if self.asked_way is None or self.sums is None:
                return value
            light = self.clamped(self.carried * value, path.depth > 0)
            self.reflections = path.diffuse + 1
            wo, reflected = self.asked_way
            first = active & (path.depth == 0)
            self.book_lobes(light, "Direct", self.parts_of(hit, wo, reflected, first), first)
            self.book_lobes(light, "Indirect", self.parts, active & (path.depth > 0))
            self.book_group(light, self.asked, active)
            return value

        def count(self, path: Any, bs: Any, scatters: Any) -> None:
            if self.sums is None:
                super().count(path, bs, scatters)
                return
            first = scatters & (path.depth == 0)
            si, bsdf, _, (even, _) = self.here
            drawn = self.complete(drawn_parts(mi, dr, si, bsdf, bs, first & ~even), even, mi.Bool(False))
            self.parts = tuple(
                mi.Spectrum(dr.select(first, new, old)) for new, old in zip(drawn, self.parts, strict=True)
            )
            super().count(path, bs, scatters)

        def to_string(self) -> str:
            return "LightPassPath"

    return LightPassPath
