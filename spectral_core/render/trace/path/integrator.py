# SPDX-License-Identifier: GPL-3.0-or-later
"""The path integrator for Blender's scenes, in which rays have types.

Unidirectional path tracing with multiple importance sampling (Veach 1997, power heuristic), as in Mitsuba's ``path``,
with visibility by type of ray, linking, transparent shadows, limits of bounces, clamping, and geometric sides.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.lights.choice import Receiver
from spectral_core.render.mitsuba_scene.rules import RayRules, Tables
from spectral_core.render.plugins.closures.facets import microfacet
from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.plugins.paints.ray_marks import ray_marks, shadow_marks
from spectral_core.render.trace import clear_glass, hit_sides, lobes, portals, reradiation
from spectral_core.render.trace.below.dive import dive
from spectral_core.render.trace.below.leaving import cosine_out, leaving
from spectral_core.render.trace.media import in_media, starts
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
            kind = dr.select(path.leaves, 0, path.kind)
            si = self.tables.intersect_seen(scene, path.ray, kind, path.active, path.depth == 0)
            shape = self.tables.shape_number(si)
            from_within = self.tables.from_within(shape, si, path.ray.d)
            unseen = path.active & si.is_valid() & (self.tables.passes(shape, path.kind) | from_within)
            path.within -= dr.select(unseen & from_within, dr.minimum(path.within, 1), 0)
            si.dn_du = -path.ray.d  # the viewer's direction for closures, see plugins.closures.facets.upright
            si.dn_dv = ray_marks(mi, dr, path)
            microfacet.blur(si, self.filter_glossy, path.least_density)
            si.wi = self.upright(si)
            leaves = path.leaves & path.active
            if self.sampled is not None:
                # before the light of the hit, which reaches the path through them
                gained = self.sampled.cross(self, scene, si, path, sampler)
                path.add(self.clamped(gained, path.depth > 0), path.diffuse)
            unseen &= ~leaves
            floats, place = mi.Bool(False), si
            if self.tables.media is not None:
                ends = path.active & si.is_valid() & ~unseen & ~self.tables.media.is_border(shape, path.active)
                floats, place = self.fly(si, path, sampler, path.active & ~leaves)
                self.fog = in_media.asks_light(self.flight, ends, self.lights), self.flight.parts
                unseen &= ~floats
            arrived = self.arrived(si, path, path.active & ~unseen & ~leaves & ~floats)
            path.add(mi.Spectrum(self.clamped(path.throughput * arrived, path.depth > 1)), path.diffuse)

            hit = path.active & si.is_valid() & ~unseen & ~floats
            hole = hit & self.is_hole(shape, path)
            hit &= ~hole
            path.seen |= hit | floats
            bsdf = self.tables.surface(si)
            # as many transparent surfaces as the scene allows, and one more segment behind the last, as in Cycles
            hit &= (~self.cut_caustic(bsdf, path.kind) | leaves) & (path.passed < dr.maximum(self.layers, 1))
            bsdf.compute(si, hit | hole)
            matt, along = self.even_lobe(si, path, sampler, hit & ~path.last)
            place.wavelengths = si.wavelengths  # a dye may have changed them
            lit = (place, bsdf, shape, (matt, along))
            asks = hit if self.fog is None else hit | self.fog[0]
            direct = self.direct(scene, sampler, lit, path, asks & ~path.last)
            path.add(mi.Spectrum(self.clamped(self.carried * direct, path.depth > 0)), path.diffuse + 1)
            pick, direction = sampler.next_1d(), sampler.next_2d()
            bs, weight = bsdf.sample(mi.BSDFContext(), si, pick, direction, hit & ~matt)
            dives = hit & ~matt & ~path.last & ((bs.sampled_type & DIVES) != 0)
            outward = si.to_world(bs.wo)
            drawn_well = self.leaves_as_drawn(si, bs, outward)
            if self.tables.has_even_lobes:
                left, through = leaving(mi, dr, si, along, direction)
                bs, weight = dr.select(matt, left, bs), dr.select(matt, mi.Spectrum(1.0), weight)
                outward, drawn_well = dr.select(matt, through, outward), drawn_well | matt
            straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            scatters = hit & ~straight & ~path.last & ~dives & drawn_well
            onward = unseen | (hit & straight) | scatters | hole
            border = mi.Bool(False)
            if self.tables.media is not None:
                ways = path.ray.d, dr.select(scatters, outward, path.ray.d)
                path.medium, path.outer = self.tables.media.crossed(
                    (path.medium, path.outer), shape, si, ways, onward & si.is_valid()
                )
                border = self.tables.media.is_border(shape, hit)
            clear_glass.cut_holes(self, si, bsdf, path, (hit, hole))
            path.throughput = dr.select(hit & ~dives, path.throughput * weight, path.throughput)
            path.eta = dr.select(scatters, path.eta * bs.eta, path.eta)
            path.passed = dr.select((hit & straight & ~border) | hole, path.passed + 1, path.passed)
            self.count(path, bs, scatters)
            path.remember(si, bs, shape, scatters, self.sides_of(bsdf, leaves))
            path.go_on(si, outward, onward, scatters, self.tables.counts_lengths)
            path.ray, stays = self.tables.out_of_strand(scene, (si, shape), path.ray, scatters)
            path.within += dr.select(stays, mi.UInt32(1), 0)
            portals.send_on(self.tables, (si, bsdf, bs), path, pick, hit & straight)
            bounces = scatters
            if self.tables.media is not None:
                limits, of = (self.volume, self.bounces), (place, path, self.flight)
                turns = in_media.scatter(self.tables.media, of, (pick, direction), floats, limits)
                onward, bounces = onward | turns, scatters | turns
            path.leaves &= unseen
            if self.tables.subsurface:
                start = (si, shape, bs, weight, path.throughput, dives, path.diffuse > 0, bsdf, pick)
                below, factor, surfaces, sampler = dive(mi, dr, scene, self.tables, start, sampler)
                dives &= surfaces
                path.ray = dr.select(dives, below, path.ray)
                path.throughput = dr.select(dives, path.throughput * factor, path.throughput)
                path.leaves |= dives
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

        def direct(self, scene: Any, sampler: Any, hit: tuple[Any, ...], path: Any, active: Any) -> Any:
            """Direct light of one drawn emitter at a hit (interaction, BSDF, number, even lobe) and what covers it."""
            self.asked, self.carried = mi.UInt32(0), path.throughput
            if self.lights.is_empty:
                return mi.Spectrum(0.0)
            si, bsdf, shape, (matt, along) = hit
            floats, parts = (mi.Bool(False), []) if self.fog is None else self.fog
            wanted = active & (mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth) | floats)
            both, kinds = self.sides_of(bsdf, path.leaves)
            to = Receiver(si.p, self.seen_side(si, path.ray.d), both | floats)
            receiver = shape if self.flight is None else dr.select(floats, in_media.receiver(path), shape)
            to.kinds, to.unlit = dr.select(floats, int(Rays.VOLUME), kinds), self.tables.unlit_by(receiver)
            if self.flight is not None:
                to.floats, to.stretch = floats, in_media.stretch_of(self.flight, path.ray)
            chosen = self.lights.choose(to, sampler, wanted)
            if chosen.center is not None:
                si, carried = in_media.ask_along(self.flight, (si, path.ray), (to, chosen), sampler, wanted & floats)
                self.carried = dr.select(floats, carried, path.throughput)
            drawn = self.lights.draw(self.tables.at_bounce(si), to, chosen, sampler, self.tables, wanted)
            wanted &= drawn.pdf != 0.0
            self.asked = drawn.number
            wo = si.to_local(drawn.direction)
            # on a surface, only closures that see the light count; see ``lobes``
            kind = dr.select(floats, int(Rays.VOLUME), self.kind_of(bsdf, si, wo, path.leaves))
            wanted &= self.tables.lights_it(drawn.number, dr.select(floats | matt, kind, 0), path.depth, receiver)
            kept = self.keeps_side(si, wo, drawn.direction, bsdf)
            ray, lifted = self.shadow_ray(si, drawn, -path.ray.d, bsdf)
            wanted &= kept | matt | floats | lifted
            place = hit_sides.lifted_place(si, lifted, drawn.number != self.lights.even_world)
            value, pdf = bsdf.eval_pdf(mi.BSDFContext(), place, wo, wanted & ~matt & ~floats)
            media = mi.UInt32(0), mi.UInt32(0)
            if self.tables.media is not None:
                hits, ways = (si, shape, path), (path.ray.d, drawn.direction)
                fog, media = in_media.toward(self.tables.media, hits, ways, (floats, parts), wanted)
                value, pdf = dr.select(floats, mi.Spectrum(fog[0]), value), dr.select(floats, fog[1], pdf)
            if self.tables.has_even_lobes:
                out = cosine_out(mi, dr, si, along, drawn.direction) / dr.pi
                value, pdf = dr.select(matt, mi.Spectrum(out), value), dr.select(matt, out, pdf)
            if self.tables.lights is not None:
                hidden = self.tables.look_up(self.tables.lights, drawn.number)
                value *= lobes.visible_share(hidden, (place, bsdf), wo, value, wanted & ~matt & ~floats)
            self.asked_way = (wo, value)
            share = dr.select(drawn.delta, 1.0, path_limits.squared_share(drawn.pdf, pdf))
            shadowless = mi.Bool(False)
            if self.tables.shadowless is not None:
                shadowless = self.tables.look_up(self.tables.shadowless, drawn.number) != 0
            if self.tables.only_sampled is not None:
                share = path_limits.share_alone(self.tables, drawn, pdf, share)
            wanted &= dr.any(value * drawn.value != 0.0)
            ray = dr.select(floats, si.spawn_ray_to(drawn.point), ray)
            ray.time = mi.Float(0.0)  # its length counts from here
            start = si, shape, (path.within > 0) | path.leaves
            by = drawn.number, kind, share
            share = path_limits.share_past_linked(self.tables, self.layers, (scene, ray), by, wanted & ~shadowless)
            # in Cycles scattered rays alone meet an even environment, and pass what they do not see
            kind = dr.select(drawn.number == self.lights.even_world, kind, int(Rays.SHADOW))
            light = drawn.number, path.passed, shadow_marks(mi, si.dn_dv), kind
            clear = self.clear_way(scene, (ray, media, start), light, wanted & ~shadowless)
            if self.sampled is not None:
                # between all surfaces on the way at once, whatever these let pass
                clear = clear * self.sampled.clear(ray, drawn.number, wanted & ~shadowless)
            return dr.select(wanted, value * drawn.value * share * dr.select(shadowless, 1.0, clear), 0.0)

        def to_string(self) -> str:
            return "ScenePath"

    return ScenePath
