# SPDX-License-Identifier: GPL-3.0-or-later
"""A path integrator that accumulates light by pass: by the first surface's lobe, by the light group, and by direct or
indirect light.

As in Cycles, *direct* is light that reaches the camera over one surface, *indirect* over more. A surface's diffuse part
(with subsurface scattering) is *diffuse*, its other reflections are *glossy*, light through it is *transmission*. Light
that the camera sees directly is *emission* or *environment*.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.rules import Tables
from spectral_core.render.passes import books
from spectral_core.render.passes.books import LIGHT_ROWS
from spectral_core.render.plugins.numbers import table
from spectral_core.render.trace.lobes import drawn_parts
from spectral_core.render.trace.path_settings import PathSettings
from spectral_core.render.trace.scene_path import scene_path_class


def groups_by_light(lights: Any, groups: tuple[str, ...]) -> np.ndarray:
    """Number of each light's group, from 1, by the light's number; 0 for one in none of ``groups``."""
    numbers = {name: number for number, name in enumerate(groups, 1)}
    sources = [] if lights is None else lights.sources
    return np.array([0, *(numbers.get(source.group, 0) for source in sources)], np.uint32)


@cache
def light_pass_class(variant: str) -> Any:
    """The integrator's class under ``variant``, which must be the active one."""
    import drjit as dr
    import mitsuba as mi

    class LightPassPath(scene_path_class(variant)):  # type: ignore[misc]
        """``groups``: light groups, whose rows follow those of the passes; ``groups_by_light``: number of each light's
        group from 1, 0 for none.
        """

        restarts = False
        met: Any
        sums: Any = None
        lane: Any = None
        measured: Any = None
        book_into, book, book_lobes, book_group = books.book_into, books.book, books.book_lobes, books.book_group
        parts_of, complete = books.parts_of, books.complete

        def __init__(
            self, settings: PathSettings, tables: Tables, lights: Any, groups: tuple[str, ...], by_light: np.ndarray
        ) -> None:
            super().__init__(settings, tables, lights)
            self.groups = groups
            self.rows = len(LIGHT_ROWS) + len(groups)
            self.by_light = table(mi.UInt32, by_light)
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
            start = (self.begin(ray, active), sampler, mi.Spectrum(0.0), mi.Spectrum(0.0), mi.Spectrum(0.0))
            labels = ("path", "sampler", "diffuse", "glossy", "transmission")
            state, *_ = dr.while_loop(start, lambda state, *_: state.active, body, labels=labels)
            self.release()
            self.parts = self.here = self.reflections = None
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
                for row, _ in enumerate(self.groups):
                    only = self.lamps_in_fog(si, path, active, lambda number, row=row: self.of_group(number, row))
                    self.book(len(LIGHT_ROWS) + row, self.clamped(only, path.depth > 1), active)
            return floats, place

        def arrived(self, si: Any, path: Any, active: Any, of: Any = None) -> Any:
            value = super().arrived(si, path, active)
            if self.sums is None:
                return value
            indirect, self.reflections = path.depth > 1, path.diffuse
            first = active & (path.depth == 0)
            of = lambda part: self.clamped(path.throughput * part, indirect)  # noqa: E731
            self.book(LIGHT_ROWS["Emission"], of(self.met.lamps + self.met.emissive), first)
            self.book(LIGHT_ROWS["Environment"], of(self.met.world), first)
            self.book_lobes(of(value), "Direct", self.parts, active & (path.depth == 1))
            self.book_lobes(of(value), "Indirect", self.parts, active & indirect)
            for row, _ in enumerate(self.groups):
                only = super().arrived(si, path, active, lambda number, row=row: self.of_group(number, row))
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
