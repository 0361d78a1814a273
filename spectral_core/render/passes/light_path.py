# SPDX-License-Identifier: GPL-3.0-or-later
"""The renderer's paths, which book the light they bring by pass: what the first surface does with it, from which
group of lights it comes, and whether it was reflected before.

As in Cycles: *direct* is light that reaches the camera over one surface, *indirect* over more; a surface's diffuse
part (matt, also what lies below it) is *diffuse*, what else it mirrors is *glossy*, what passes it *transmission*.
Light that the camera sees itself is *emission* or *environment*.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from spectral_core.render.mitsuba_scene.rules import Tables
from spectral_core.render.passes.lobes import drawn_parts, parts_of
from spectral_core.render.trace.path_settings import PathSettings
from spectral_core.render.trace.scene_path import scene_path_class
from spectral_core.scene.passes import GROUP_PREFIX, LIGHT_PASSES, LOBES

LIGHT_ROWS = {name: row for row, name in enumerate(LIGHT_PASSES)}
"""Row of each pass among a pixel's sums; light groups follow."""


def light_group_names(groups: tuple[str, ...]) -> dict[str, int]:
    """Row of each light group, by the name of its pass."""
    return {GROUP_PREFIX + group: len(LIGHT_ROWS) + number for number, group in enumerate(groups)}


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
        """``groups``: light groups that have rows after those of the passes; ``groups_by_light``: each light's group
        from 1, 0 for one without, by its number.
        """

        def __init__(
            self, settings: PathSettings, tables: Tables, lights: Any, groups: tuple[str, ...], by_light: np.ndarray
        ) -> None:
            super().__init__(settings, tables, lights)
            self.groups = groups
            self.rows = len(LIGHT_ROWS) + len(groups)
            self.by_light = mi.UInt32(by_light.astype(np.uint32))
            self.parts: Any = None
            """Shares of the path's light that the first surface's diffuse lobes send on, and its other mirroring ones."""
            self.here: Any = None
            """The hit that the path is at."""
            self.begin(None, None, None)

        def begin(self, sums: Any, lane: Any, measured: Any) -> None:
            """Where light goes: sums (pixels · rows · 3), each lane's pixel, and the color of radiance."""
            self.sums, self.lane, self.measured = sums, lane, measured

        def trace(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            if self.sums is None:
                return super().trace(scene, sampler, ray, active)
            state = self.State(ray, active)

            def body(state: Any, sampler: Any, diffuse: Any, glossy: Any) -> Any:
                self.parts = (diffuse, glossy)
                state, sampler = self.step(scene, state, sampler)
                return state, sampler, *self.parts

            start = (state, sampler, mi.Spectrum(0.0), mi.Spectrum(0.0))
            state, _, _, _ = dr.while_loop(
                start, lambda state, *_: state.active, body, labels=("path", "sampler", "diffuse", "glossy")
            )
            self.met = self.asked = self.asked_way = self.parts = self.here = None
            return state.light, state.seen, []

        def book(self, row: int | Any, light: Any, active: Any) -> None:
            """Add light to a row of the pixel."""
            finite = dr.all(dr.isfinite(light))
            color = self.measured(dr.select(finite, light, 0.0))
            at = (self.lane * self.rows + row) * 3
            for k in range(3):
                wanted = active & (color[k] != 0.0)
                dr.scatter_add(self.sums, color[k], at + k, wanted, dr.ReduceMode.NoConflicts)

        def book_lobes(self, light: Any, order: str, parts: tuple[Any, Any], active: Any) -> None:
            """Add light to the passes of the first surface's lobes, by the parts of diffuse and glossy ones."""
            diffuse, glossy = parts
            for lobe, part in zip(LOBES, (diffuse, glossy, 1.0 - diffuse - glossy), strict=True):
                self.book(LIGHT_ROWS[f"{lobe} {order}"], light * part, active)

        def book_group(self, light: Any, number: Any, active: Any) -> None:
            """Add light to the row of the group of a light."""
            if not self.groups:
                return
            group = dr.gather(mi.UInt32, self.by_light, number, active)
            self.book(len(LIGHT_ROWS) + dr.maximum(group, 1) - 1, light, active & (group > 0))

        def arrived(self, si: Any, path: Any, active: Any, of: Any = None) -> Any:
            value = super().arrived(si, path, active)
            if self.sums is None:
                return value
            indirect = path.depth > 1
            first = active & (path.depth == 0)
            of = lambda part: self.clamped(path.throughput * part, indirect)  # noqa: E731
            self.book(LIGHT_ROWS["Emission"], of(self.met.lamps + self.met.glows), first)
            self.book(LIGHT_ROWS["Environment"], of(self.met.world), first)
            self.book_lobes(of(value), "Direct", self.parts, active & (path.depth == 1))
            self.book_lobes(of(value), "Indirect", self.parts, active & indirect)
            for row, _ in enumerate(self.groups):
                only = super().arrived(si, path, active, lambda number, row=row: self.of_group(number, row))
                self.book(len(LIGHT_ROWS) + row, of(only), active)
            return value

        def of_group(self, number: Any, row: int) -> Any:
            """Whether a light is in a group."""
            return dr.gather(mi.UInt32, self.by_light, number) == row + 1

        def direct(self, scene: Any, sampler: Any, hit: tuple[Any, ...], path: Any, active: Any) -> Any:
            value = super().direct(scene, sampler, hit, path, active)
            self.here = hit
            if self.asked_way is None or self.sums is None:
                return value
            light = self.clamped(path.throughput * value, path.depth > 0)
            wo, reflected = self.asked_way
            first = active & (path.depth == 0)
            self.book_lobes(light, "Direct", self.parts_of(hit, wo, reflected, first), first)
            self.book_lobes(light, "Indirect", self.parts, active & (path.depth > 0))
            self.book_group(light, self.asked, active)
            return value

        def parts_of(self, hit: tuple[Any, ...], wo: Any, value: Any, active: Any) -> tuple[Any, Any]:
            """Shares of what a surface sends to ``wo`` that are diffuse, and that are mirrored otherwise."""
            si, bsdf, _, (even, _) = hit
            diffuse, glossy = parts_of(mi, dr, si, bsdf, wo, value, active & ~even)
            return dr.select(even, mi.Spectrum(1.0), diffuse), dr.select(even, 0.0, glossy)

        def count(self, path: Any, bs: Any, scatters: Any) -> None:
            if self.sums is None:
                super().count(path, bs, scatters)
                return
            first = scatters & (path.depth == 0)
            si, bsdf, _, (even, _) = self.here
            diffuse, glossy = drawn_parts(mi, dr, si, bsdf, bs, first & ~even)
            diffuse, glossy = dr.select(even, mi.Spectrum(1.0), diffuse), dr.select(even, 0.0, glossy)
            self.parts = tuple(
                mi.Spectrum(dr.select(first, new, old)) for new, old in zip((diffuse, glossy), self.parts, strict=True)
            )
            super().count(path, bs, scatters)

        def to_string(self) -> str:
            return "LightPassPath"

    return LightPassPath
