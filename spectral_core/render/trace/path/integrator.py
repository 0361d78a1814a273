# SPDX-License-Identifier: GPL-3.0-or-later
"""The path integrator for Blender's scenes, in which rays have types.

Unidirectional path tracing with multiple importance sampling (Veach 1997, power heuristic), as in Mitsuba's ``path``,
with visibility by type of ray, linking, transparent shadows, limits of bounces, clamping, and geometric sides.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.mitsuba_scene.rules import RayRules, Tables
from spectral_core.render.plugins.closures.facets import microfacet
from spectral_core.render.trace import clear_glass, hit_sides, reradiation
from spectral_core.render.trace.media import in_media, starts
from spectral_core.render.trace.path import bounce, hit
from spectral_core.render.trace.path import direct as direct_light
from spectral_core.render.trace.path import limits as path_limits
from spectral_core.render.trace.path.settings import MOST_LAYERS, PathSettings
from spectral_core.render.trace.path.state import path_state_class
from spectral_core.scene import Rays


def scene_path(mitsuba: Any, settings: PathSettings, rules: RayRules, lights: Any, sampled: Any = None) -> Any:
    """The integrator under the active variant; ``lights``: our light tables or Mitsuba's emitters; ``sampled``: the
    ``SampledVolumes`` between surfaces, None for none.
    """
    return scene_path_class(mitsuba.variant())(settings, Tables(mitsuba, rules), lights, sampled)


@cache
def scene_path_class(variant: str) -> Any:
    """The integrator's class under ``variant``, which must be the active one; the plan's pilot extends it."""
    import drjit as dr
    import mitsuba as mi

    PathState = path_state_class(variant)

    class ScenePath(mi.SamplingIntegrator):
        """Radiance along camera rays."""

        State, tells_reflections = PathState, mi.is_spectral
        restarts = True  # ``begin`` and ``step`` are all that a path consists of: its caller may loop over rays
        upright, keeps_side, leaves_as_drawn = hit_sides.upright, hit_sides.keeps_side, hit_sides.leaves_as_drawn
        shadow_ray = hit_sides.shadow_ray
        even_lobe, is_hole, clear_way = reradiation.even_lobe, clear_glass.is_hole, path_limits.clear_way
        count, cut_caustic, clamped = path_limits.count, path_limits.cut_caustic, path_limits.clamped
        seen_side, sides_of, kind_of = hit_sides.seen_side, hit_sides.sides_of, hit_sides.kind_of
        # one step of a path, in this order
        meet, gather, direct = hit.meet, hit.gather, direct_light.direct
        draw, leave, enter = bounce.draw, bounce.leave, bounce.enter

        def __init__(self, settings: PathSettings, tables: Tables, lights: Any, sampled: Any = None) -> None:
            super().__init__(mi.Properties())
            self.tables, self.settings, self.lights, self.sampled = tables, settings, lights, sampled
            # volumes keep a phase of each path, and the start of each ray is searched by a loop
            if sampled is not None or (tables.media is not None and tables.media.eye is not None):
                self.restarts = False
            limits, self.clamps = settings.limits, path_limits.clamps_of(settings)
            count = lambda value: dr.opaque(mi.UInt32, int(value))  # noqa: E731
            # opaque: kernels read the numbers, so that another limit needs no new kernel
            self.bounces, self.layers = count(settings.bounces), count(min(limits.transparent, MOST_LAYERS))
            self.diffuse, self.glossy = count(limits.diffuse), count(limits.glossy)
            self.transmission, self.volume = count(limits.transmission), count(limits.volume)
            self.filter_glossy = microfacet.strength_of(limits)
            self.met: Any = None
            """Light along the ray, by its origin."""
            self.asked: Any = None
            """Number of the light that was sampled at the last surface."""
            self.asked_way: Any = None
            """Local direction to that light, and the surface's scattering from there."""
            self.fog: Any = None
            """True if the path samples a light from within media now, and these."""
            self.flight: Any = None
            """The segment in that medium."""
            self.carried: Any = None
            """Throughput at the point that the last light was sampled from."""

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            return self.trace(scene, sampler, mi.Ray3f(ray), mi.Bool(active))

        def trace(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            state = self.begin(ray, active, scene)
            state, _ = dr.while_loop(
                (state, sampler),
                lambda state, _: state.active,
                lambda state, sampler: self.step(scene, state, sampler),
                labels=("path", "sampler"),
            )
            self.release()
            return state.light, state.seen, state.extra(self.settings.clear_glass)

        def release(self) -> None:
            """Forget what belongs to a loop: a recorded launch reads every member of the integrator after it."""
            self.met = self.asked = self.asked_way = self.fog = self.flight = self.carried = None

        def begin(self, ray: Any, active: Any, scene: Any = None) -> Any:
            """A path at the camera; in the media at its place without ``scene``."""
            state = PathState(ray, active)
            if self.tables.media is not None:
                state.medium, state.outer = starts.at_start(self.tables, scene, ray, active)
            return state

        def step(self, scene: Any, path: Any, sampler: Any) -> tuple[Any, Any]:
            """One ray to the next hit: emission along it, direct light at the hit, and the continuation of the path."""
            met = self.meet(scene, path, sampler)
            surface = self.gather(scene, path, sampler, met)
            drawn = self.draw(path, sampler, met, surface)
            onward, bounces = self.leave(scene, path, met, surface, drawn)
            path.leaves &= met.unseen
            if self.tables.subsurface:
                dives, sampler = self.enter(scene, path, sampler, (met, surface, drawn))
                onward |= dives

            strongest = dr.max(path.throughput)
            dies = path_limits.roulette(path, sampler, strongest, bounces)
            path.active = onward & ~dies & (strongest > 0.0) & (path.passed <= dr.maximum(self.layers, 1))
            return path, sampler

        def fly(self, si: Any, path: Any, sampler: Any, active: Any) -> tuple[Any, Any]:
            """Through a medium to the next surface: True if the path scatters before it, and the point."""
            flight, place = in_media.fly(self.tables.media, (si, path), sampler, active)
            self.flight = flight
            # lamps inside fog shine on rays that scatter before them too
            emission = dr.select(active, path.throughput * flight.emission, 0.0) + self.lamps_in_fog(si, path, active)
            path.add(mi.Spectrum(self.clamped(mi.Spectrum(emission), path.depth > 1)), path.diffuse)
            path.throughput *= dr.select(active, flight.weight, 1.0)
            return flight.scatters, place

        def lamps_in_fog(self, si: Any, path: Any, active: Any, of: Any = None) -> Any:
            """Light of lamps on the way through a medium, whether the path scatters before them or not."""
            if self.lights.bodies is None:
                return mi.Spectrum(0.0)
            flight, share = self.flight, self.share_of(path, of)
            clear = in_media.clear_along(self.tables.media, flight, path)
            return flight.carried * self.lights.met_in_fog(si, path, share, self.tables, active & flight.inside, clear)

        def arrived(self, si: Any, path: Any, active: Any, of: Any = None) -> Any:
            """Light that a ray hits: of lamps, an emissive surface or the environment, weighted against sampling.

            ``of``: predicate of the lights that count, by their number; all if None.
            """
            seen = mi.Bool(False)
            if self.tables.camera_world is not None:
                seen = active & ~si.is_valid() & ((path.kind & int(Rays.CAMERA)) != 0)
            self.met = self.lights.met(si, path, self.share_of(path, of), self.tables, active, ~seen)
            if self.tables.camera_world is not None and of is None:
                self.seen_world = dr.select(seen, self.tables.camera_world.eval(si, seen), 0.0)
                self.met.world += self.seen_world
            if self.settings.clear_glass:
                clear_glass.through_glass(self.met, si, path, active, counts=of is None)
            return dr.select(active, self.met.lamps + self.met.emissive + self.met.world, 0.0)

        def share_of(self, path: Any, of: Any = None) -> Any:
            """Weight of a light that a ray hits, against sampling it; a function of its number and density."""
            return path_limits.share_of(self.tables, path, (self.lights.even_world, self.lights.varied_world), of)

        def to_string(self) -> str:
            return "ScenePath"

    return ScenePath
