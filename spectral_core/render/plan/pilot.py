# SPDX-License-Identifier: GPL-3.0-or-later
"""A pilot: a hundred thousand paths of a small picture, with the light of each type of path.

The renderer's path integrator traces them (``trace.path.integrator``), in spectra where the picture needs them: a paint
that is black in daylight may reflect all light of a lamp. Beside the picture, they fill bins by pixel, batch and row:
number of bounces of the light in total and by type, caustics, light through transparent surfaces, and light of the
environment. The loss of an effect is the sum of its rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_core.render.lights.scene_lights import SceneLights
from spectral_core.render.mitsuba_scene.rules import Tables
from spectral_core.render.plan.decision import USUAL_BOUNCES, EffectPlan
from spectral_core.render.plan.small_film import small_film
from spectral_core.render.plugins.paints.ray_marks import is_diffuse
from spectral_core.render.trace.path.integrator import scene_path_class
from spectral_core.render.trace.path.settings import PathSettings
from spectral_core.render.trace.path.state import by_reflections
from spectral_core.scene import Rays, Scene
from spectral_core.spectra.color import RGB_FROM_XYZ

LEVELS = 34
"""Numbers of bounces with a row each; the last row holds all larger numbers."""
COUNTS = ("bounces", "diffuse", "glossy", "transmission")
"""Counts of bounces, each with LEVELS rows."""
FLAGS = (
    "reflective_caustics", "refractive_caustics", "transparency", "environment", "emissive_meshes", "clamped",
    "environment_in_view",
)  # fmt: skip
"""Types of light with a row each; ``clamped`` is the light that the clamp of the scene's light paths removes,
``environment_in_view`` that which the camera sees directly.
"""
TOTAL = len(COUNTS) * LEVELS + len(FLAGS)
ROWS = TOTAL + 1
CHANNELS = 4
"""Red, green, blue (in spectral transport X, Y, Z until the paths end), and the number of surfaces that were hit."""
PIXELS, BATCHES, SAMPLES = 576, 8, 192
"""Size of the pilot: pixels, independent parts, samples per pixel."""
PILOT_BOUNCES = USUAL_BOUNCES
HALFWAY, MOST_KEPT = 16, 0.98**16
"""A quarter of the pilot's bounces, and the largest share of light that as many bounces are taken to keep."""


@dataclass(frozen=True, slots=True, eq=False)
class Pilot:
    """Result of the paths.

    ``bins``: (height, width, batches, rows, 4) sums over samples, divided by the samples of a batch. ``samples`` per
    pixel. ``points``: (n, 3) points that the camera sees, in the scene's units.
    """

    bins: NDArray[np.float64]
    samples: int
    points: NDArray[np.float64]

    @property
    def paths(self) -> int:
        """Number of all paths."""
        return self.samples * self.bins.shape[0] * self.bins.shape[1]

    @property
    def picture(self) -> NDArray[np.float64]:
        """(height, width, batches, 3): the small picture of each batch."""
        return self.bins[..., TOTAL, :3]

    @property
    def surfaces_met(self) -> float:
        """Surfaces that all paths hit: the time of a render is proportional to it."""
        return float(self.bins[..., TOTAL, 3].sum())

    @property
    def shows_surfaces(self) -> NDArray[np.bool_]:
        """(height, width): True for pixels in which a path hit a surface."""
        return np.asarray(self.bins[..., TOTAL, 3].sum(axis=2) > 0)

    def beyond(self, count: str, most: int) -> NDArray[np.float64]:
        """(height, width, batches, 4): light of paths with more than ``most`` bounces of a type."""
        first = COUNTS.index(count) * LEVELS
        return np.asarray(self.bins[..., first + min(most + 1, LEVELS) : first + LEVELS, :].sum(axis=-2))

    def after_last_bounce(self, count: str) -> NDArray[np.float64]:
        """(height, width, batches, 4): light beyond the pilot's last bounce, if each bounce keeps the share of light
        that those after the sixteenth keep.
        """
        later = self.beyond(count, 2 * HALFWAY)  # bounces 33 to 64: two times sixteen
        before, after = (float(part[..., :3].sum()) for part in (self.beyond(count, HALFWAY) - later, later))
        if before <= 0 or after <= 0:
            return np.zeros_like(later)
        # of light S in bounces 17 to 32, the next sixteen have S q, those after them S q², and all later ones the rest
        kept = min((np.sqrt(1 + 4 * after / before) - 1) / 2, MOST_KEPT)
        return later * (kept**2 / (1 - kept**2))

    @property
    def clamped_share(self) -> float:
        """Light that the clamp of the scene's light paths removes, over all light without the clamp."""
        removed, kept = (
            float(np.abs(part[..., :3]).sum()) for part in (self.flagged("clamped"), self.bins[..., TOTAL, :])
        )
        return removed / (removed + kept) if removed > 0 else 0.0

    def flagged(self, name: str) -> NDArray[np.float64]:
        """(height, width, batches, 4): light of one type."""
        return np.asarray(self.bins[..., len(COUNTS) * LEVELS + FLAGS.index(name), :])


def run_pilot(scene: Scene, plan: EffectPlan, samples: int = SAMPLES) -> Pilot:
    """Trace the pilot of ``scene``; ``plan``: its effects and transport.

    Raises RenderError if Mitsuba fails and MissingDependencyError if it or LLVM is missing.
    """
    from spectral_core.render.job import RenderJob
    from spectral_core.render.trace.accumulate import Accumulator

    film = small_film(scene.film, PIXELS, SAMPLES)
    settings = replace(scene.settings, variant=None if scene.settings.variant is None else _plain(scene))
    job = RenderJob(replace(scene, film=film, settings=settings), plan)
    tracer = job.traced_scene()
    mi = tracer.mitsuba
    limits = scene.settings.light_paths
    integrator = _pilot_class(mi.variant())(
        PathSettings(PILOT_BOUNCES, True, limits), Tables(mi, tracer.rules), tracer.lights, _source_kinds(mi, tracer)
    )
    width, height = film.size
    integrator.prepare(width * height)
    sums = Accumulator(mi, job.scene.camera, film, job.loaded.wavelengths)
    for _ in sums.add(tracer.first_hit, integrator, samples):
        pass
    shape = (height, width, BATCHES, ROWS, CHANNELS)
    bins = np.array(integrator.bins, dtype=np.float64).reshape(shape) / (samples / BATCHES)
    if plan.is_spectral:
        bins[..., :3] = bins[..., :3] @ RGB_FROM_XYZ.T
    bins[..., :3] *= film.exposure
    points = np.array(integrator.points).reshape(-1, 4)
    seen = points[points[:, 3] > 0, :3].astype(np.float64) / tracer.unit
    return Pilot(bins, samples, seen)


def _plain(scene: Scene) -> str:
    return (scene.settings.variant or "llvm").partition("_")[0]


def _source_kinds(mi: Any, tracer: Any) -> NDArray[np.uint32]:
    """By number of a light: 1 for the environment, 2 for an emissive surface, 0 for a lamp."""
    import drjit as dr

    if isinstance(tracer.lights, SceneLights):
        return tracer.lights.kinds_by_number()
    scene = tracer.scene
    number = lambda emitter: int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(emitter))[0])  # noqa: E731
    kinds = {number(emitter): 1 for emitter in scene.emitters() if emitter.is_environment()}
    for shape in scene.shapes():
        if shape.is_emitter() and shape.bsdf().class_name() != "NullBSDF":  # the body of a lamp
            kinds[number(shape.emitter())] = 2
    table = np.zeros(max(kinds, default=0) + 1, np.uint32)
    table[list(kinds)] = list(kinds.values())
    return table


def _book(
    pilot: Any, light: Any, parts: tuple[Any, ...], counts: Any, when: tuple[Any, Any], reflections: Any, met: float
) -> None:
    """Add light to a pilot's rows; ``parts``: of the environment, of emissive surfaces, removed by the clamp, and of
    the environment in view; ``when``: active lanes, and those after the first surface; ``reflections``: surfaces that
    have reflected the light diffusely.
    """
    import drjit as dr
    import mitsuba as mi

    active, bounced = when
    finite = dr.all(dr.isfinite(light))
    held = [dr.select(finite, part, 0.0) for part in (light, *parts)]
    light, *kinds = (pilot.measured(part, by_reflections(dr, part, reflections)) for part in held)
    first = len(COUNTS) * LEVELS
    signs = ((pilot.flags & 1) != 0, (pilot.flags & 2) != 0, pilot.blocked)
    rows = [(k * LEVELS + dr.minimum(count, LEVELS - 1), bounced, light) for k, count in enumerate(counts)]
    rows += [(mi.UInt32(first + k), active & sign, light) for k, sign in enumerate(signs)]
    rows += [(mi.UInt32(first + len(signs) + k), active, part) for k, part in enumerate(kinds)]
    rows.append((mi.UInt32(TOTAL), active, light))
    for row, wanted, part in rows:
        at = (pilot.cell * ROWS + row) * CHANNELS
        for k in range(3):
            dr.scatter_add(pilot.bins, part[k], at + k, wanted & (part[k] != 0), dr.ReduceMode.NoConflicts)
        if met:
            dr.scatter_add(pilot.bins, met, at + 3, wanted, dr.ReduceMode.NoConflicts)


@cache
def _pilot_class(variant: str) -> Any:
    import drjit as dr
    import mitsuba as mi

    class PilotPath(scene_path_class(variant)):  # type: ignore[misc]
        """The renderer's path integrator, with bins for the light of each type of path."""

        restarts = False
        rows = 1  # of sums that nothing is added to

        def __init__(self, settings: PathSettings, tables: Tables, lights: Any, sources: NDArray[np.uint32]) -> None:
            super().__init__(settings, tables, lights)
            self.sources = mi.UInt32(sources)
            self.flags: Any = None
            self.blocked: Any = None
            self.measured: Any = None
            """Color of radiance with its parts ``by_reflections``."""

        def book_into(self, sums: Any, lane: Any, measured: Any) -> None:
            """Receive the conversion of radiance to color; the bins take the place of the given sums."""
            self.measured = measured

        def prepare(self, pixels: int) -> None:
            """Empty bins for a picture."""
            self.bins = dr.zeros(mi.Float, pixels * BATCHES * ROWS * CHANNELS)
            self.points = dr.zeros(mi.Float, pixels * BATCHES * 4)
            dr.eval(self.bins, self.points)
            self.pixels = dr.arange(mi.UInt32, pixels)

        def trace(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            self.cell = self.pixels * BATCHES + sampler.index % BATCHES
            state = self.begin(ray, active, scene)

            def body(state: Any, sampler: Any, flags: Any) -> Any:
                self.flags = flags
                state, sampler = self.step(scene, state, sampler)
                return state, sampler, self.flags

            start = (state, sampler, mi.UInt32(0))
            state, _, _ = dr.while_loop(
                start, lambda state, *_: state.active, body, labels=("path", "sampler", "flags")
            )
            return state.light, state.seen, state.extra(False)

        def arrived(self, si: Any, path: Any, active: Any) -> Any:
            self.blocked = mi.Bool(False)
            value = super().arrived(si, path, active)
            first = active & (path.depth == 0) & si.is_valid()
            for k in range(3):
                dr.scatter(self.points, si.p[k], self.cell * 4 + k, first)
            dr.scatter(self.points, 1.0, self.cell * 4 + 3, first)
            less = lambda kind: dr.select((path.depth > 0) & ((path.kind & int(kind)) != 0), 1, 0)  # noqa: E731
            counts = (
                path.depth - dr.select(path.depth > 0, 1, 0),
                path.diffuse - less(Rays.DIFFUSE),
                path.glossy - less(Rays.GLOSSY),
                path.transmission - less(Rays.TRANSMISSION),
            )
            light = self.clamped(path.throughput * value, path.depth > 1)
            parts = tuple(
                self.clamped(path.throughput * of, path.depth > 1) for of in (self.met.world, self.met.emissive)
            )
            parts += (path.throughput * value - light, dr.select(path.depth == 0, parts[0], 0.0))
            # light that the camera sees directly is lost at no number of bounces
            _book(self, light, parts, counts, (active, active & (path.depth > 0)), path.diffuse, 0.0)
            return value

        def cut_caustic(self, bsdf: Any, kind: Any) -> Any:
            flags = bsdf.flags()
            plain = mi.has_flag(flags, mi.BSDFFlags.Diffuse) | mi.has_flag(flags, mi.BSDFFlags.Null)
            bends = mi.has_flag(flags, mi.BSDFFlags.Transmission)
            event = ~plain & is_diffuse(kind)
            self.flags |= dr.select(event, dr.select(bends, mi.UInt32(2), 1), 0)
            return super().cut_caustic(bsdf, kind)

        def clear_way(self, scene: Any, way: tuple[Any, Any, Any], light: tuple[Any, ...], active: Any) -> Any:
            self.blocked = scene.ray_test(way[0], active)
            return super().clear_way(scene, way, light, active)

        def direct(self, scene: Any, sampler: Any, hit: tuple[Any, Any, Any], path: Any, active: Any) -> Any:
            value = super().direct(scene, sampler, hit, path, active)
            light = self.clamped(self.carried * value, path.depth > 0)
            counts = (path.depth, path.diffuse, path.glossy, path.transmission)
            kind = dr.gather(mi.UInt32, self.sources, self.asked, active)
            parts = (*(dr.select(kind == of, light, 0.0) for of in (1, 2)), self.carried * value - light)
            _book(self, light, parts, counts, (active, active), path.diffuse + 1, 1.0)
            return value

        def to_string(self) -> str:
            return "PilotPath"

    return PilotPath
