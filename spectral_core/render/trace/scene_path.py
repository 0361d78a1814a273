# SPDX-License-Identifier: GPL-3.0-or-later
"""The path integrator: light as Blender's scenes ask for it, in which rays know what kind they are.

Unidirectional path tracing with multiple importance sampling (Veach 1997, balance of squares), as Mitsuba's own
``path`` does it, and beyond it: objects and lights that only some rays meet, light and shadow linking, transparent
surfaces in shadows, limits by kind of bounce, clamping, and hits whose side is the geometric normal's.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from spectral_core.render.mitsuba_scene.rules import HOLDOUT, RayRules, Tables
from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.plugins.paints.ray_marks import ray_marks, shadow_marks
from spectral_core.render.trace.path_settings import MOST_LAYERS, ROULETTE_BOUNCES, PathSettings
from spectral_core.render.trace.path_state import path_state_class
from spectral_core.render.trace.subsurface import cosine_out, leaving, walk
from spectral_core.scene import Rays


def scene_path(mitsuba: Any, settings: PathSettings, rules: RayRules) -> Any:
    """The integrator under the active variant."""
    return scene_path_class(mitsuba.variant())(settings, Tables(mitsuba, rules))


@cache
def scene_path_class(variant: str) -> Any:
    """The integrator's class under ``variant``, which must be the active one; the plan's pilot extends it."""
    import drjit as dr
    import mitsuba as mi

    def squared_share(pdf: Any, other: Any) -> Any:
        """Weight of one of two ways to sample a path, by the squares of their densities (power heuristic)."""
        square = pdf * pdf
        weight = square / (square + other * other)
        return dr.select(dr.isfinite(weight), weight, 0.0)

    PathState = path_state_class(variant)

    class ScenePath(mi.SamplingIntegrator):
        """Radiance along camera rays."""

        State = PathState

        def __init__(self, settings: PathSettings, tables: Tables) -> None:
            super().__init__(mi.Properties())
            self.tables, self.settings = tables, settings
            limits = settings.limits
            count = lambda value: dr.opaque(mi.UInt32, int(value))  # noqa: E731
            # opaque: kernels read the numbers, so that another limit compiles nothing
            self.bounces, self.layers = count(settings.bounces), count(min(limits.transparent, MOST_LAYERS))
            self.diffuse, self.glossy = count(limits.diffuse), count(limits.glossy)
            self.transmission = count(limits.transmission)

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            return self.trace(scene, sampler, mi.Ray3f(ray), mi.Bool(active))

        def trace(self, scene: Any, sampler: Any, ray: Any, active: Any) -> Any:
            state = PathState(ray, active)
            state, _ = dr.while_loop(
                (state, sampler),
                lambda state, _: state.active,
                lambda state, sampler: self.step(scene, state, sampler),
                labels=("path", "sampler"),
            )
            return state.light, state.seen, []

        def step(self, scene: Any, path: Any, sampler: Any) -> tuple[Any, Any]:
            """One ray to the next hit: what it brings, what is sampled there, and how the path goes on."""
            si = scene.ray_intersect(path.ray, mi.RayFlags.All, path.depth == 0, path.active)
            shape = self.tables.shape_number(si)
            unseen = path.active & si.is_valid() & self.tables.passes(shape, path.kind)
            si.dn_du = -path.ray.d  # what closures know the viewer by, see plugins.closures.upright
            si.dn_dv = ray_marks(mi, dr, path)
            si.wi = self.upright(si)
            leaves = path.leaves & path.active
            unseen &= ~leaves
            arrived = self.arrived(scene, si, path, path.active & ~unseen & ~leaves)
            path.light += self.clamped(path.throughput * arrived, path.depth > 1)

            hit = path.active & si.is_valid() & ~unseen & ~self.is_hole(shape, path.kind)
            path.seen |= hit
            bsdf = si.bsdf()
            # as many transparent surfaces as the scene allows, and one more way to what lies behind the last
            hit &= (~self.cut_caustic(bsdf, path.kind) | leaves) & (path.passed <= self.layers)
            direct = self.direct(scene, sampler, (si, bsdf, shape), path, hit & ~path.last)
            path.light += self.clamped(path.throughput * direct, path.depth > 0)

            pick, direction = sampler.next_1d(), sampler.next_2d()
            bs, weight = bsdf.sample(mi.BSDFContext(), si, pick, direction, hit & ~leaves)
            dives = hit & ~leaves & ~path.last & ((bs.sampled_type & DIVES) != 0)
            outward = si.to_world(bs.wo)
            drawn_well = self.leaves_as_drawn(si, bs, outward)
            if self.tables.subsurface:
                left, through = leaving(mi, dr, si, direction)
                bs, weight = dr.select(leaves, left, bs), dr.select(leaves, mi.Spectrum(1.0), weight)
                outward, drawn_well = dr.select(leaves, through, outward), drawn_well | leaves
            straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            scatters = hit & ~straight & ~path.last & ~dives & drawn_well
            onward = unseen | (hit & straight) | scatters
            path.throughput = dr.select(hit & ~dives, path.throughput * weight, path.throughput)
            path.eta = dr.select(scatters, path.eta * bs.eta, path.eta)
            path.passed = dr.select(hit & straight, path.passed + 1, path.passed)
            self.count(path, bs, scatters)
            path.remember(si, bs, shape, scatters)

            rest = path.ray.maxt - si.t
            path.ray = dr.select(onward, si.spawn_ray(dr.select(scatters, outward, path.ray.d)), path.ray)
            path.ray.maxt = dr.select(scatters, dr.largest(mi.Float), rest)
            path.leaves &= unseen
            if self.tables.subsurface:
                below, factor, surfaces, sampler = walk(
                    mi, dr, scene, self.tables, (si, shape, bs, weight, dives), sampler
                )
                dives &= surfaces
                path.ray = dr.select(dives, below, path.ray)
                path.throughput = dr.select(dives, path.throughput * factor, path.throughput)
                path.leaves |= dives
                onward |= dives

            # Russian roulette by the light that a path can still bring, freed of what refraction spread it by
            strongest = dr.max(path.throughput)
            survival = dr.minimum(strongest * dr.square(path.eta), 0.95)
            gamble = scatters & (path.depth >= ROULETTE_BOUNCES)
            dies = gamble & (sampler.next_1d() >= survival)
            spared = path.throughput * dr.rcp(dr.maximum(survival, 1e-8))
            path.throughput = dr.select(gamble & ~dies, spared, path.throughput)
            path.active = onward & ~dies & (strongest > 0.0) & (path.passed <= self.layers + 1)
            return path, sampler

        def count(self, path: Any, bs: Any, scatters: Any) -> None:
            """Count a bounce by its kind, as Cycles does, and see whether it was the last."""
            mirrors = scatters & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection)
            is_diffuse = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Diffuse)
            one = lambda which: dr.select(which, mi.UInt32(1), 0)  # noqa: E731
            path.diffuse += one(mirrors & is_diffuse)
            path.glossy += one(mirrors & ~is_diffuse)
            path.transmission += one(scatters & ~mirrors)
            path.depth += one(scatters)
            ended = (path.diffuse > self.diffuse) | (path.glossy > self.glossy)
            ended |= (path.transmission > self.transmission) | (path.depth > self.bounces)
            path.last |= scatters & ended
            reflected = dr.select(is_diffuse, mi.UInt32(int(Rays.DIFFUSE)), int(Rays.GLOSSY))
            kind = dr.select(mirrors, reflected, int(Rays.TRANSMISSION))
            path.kind = dr.select(scatters, kind, path.kind)

        def upright(self, si: Any) -> Any:
            """Direction to the viewer on the side of the surface that the geometry has, as in Cycles.

            Where interpolated normals lean away from the viewer it would lie below the surface that is seen, and the
            surface would be lit from behind; mirrored at the surface it keeps its angle and its side.
            """
            outside = dr.dot(si.n, si.to_world(si.wi)) > 0.0
            faces = dr.dot(si.n, si.sh_frame.n) > 0.0
            above = (si.wi.z > 0.0) == (outside == faces)
            return mi.Vector3f(si.wi.x, si.wi.y, dr.select(above | ~si.is_valid(), si.wi.z, -si.wi.z))

        def keeps_side(self, si: Any, wo: Any, outward: Any) -> Any:
            """Whether a direction leaves on the side of the geometry that it leaves the shading on: no leaks."""
            outside = dr.dot(si.n, outward) * dr.dot(si.n, si.sh_frame.n) > 0.0
            return (wo.z > 0.0) == outside

        def leaves_as_drawn(self, si: Any, bs: Any, outward: Any) -> Any:
            """Whether a drawn direction reflects off, or passes through, the geometry as it does the shading."""
            same_side = dr.dot(si.n, outward) * dr.dot(si.n, mi.Vector3f(si.dn_du)) > 0.0
            return same_side == mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection)

        def arrived(self, scene: Any, si: Any, path: Any, active: Any) -> Any:
            """Light that a ray meets: from a glowing surface or the surroundings, weighed against sampling it."""
            emitter = si.emitter(scene)
            number = self.tables.number(emitter)
            scattered = dr.select(path.depth > 0, path.depth - 1, 0)
            lit = active & self.tables.lights_it(number, path.kind, scattered, path.before_shape)
            ds = mi.DirectionSample3f(scene, si, path.before)
            ds.n = dr.select(si.is_valid(), si.n, ds.n)  # the density is one of the geometry, not of its shading
            sampled = scene.pdf_emitter_direction(path.before, ds, lit & ~path.before_delta)
            if self.tables.shadowless is not None:
                # what nothing blocks is sampled only: a ray may be blocked on its way there
                lit &= (self.tables.look_up(self.tables.shadowless, number) == 0) | path.before_delta
            share = dr.select(path.before_delta, 1.0, squared_share(path.before_pdf, sampled))
            value = emitter.eval(si, lit)
            if self.tables.camera_world is not None:
                seen = active & ~si.is_valid() & ((path.kind & int(Rays.CAMERA)) != 0)
                value = dr.select(seen, self.tables.camera_world.eval(si, seen), value)
                lit |= seen
            return dr.select(lit, value * share, 0.0)

        def direct(self, scene: Any, sampler: Any, hit: tuple[Any, Any, Any], path: Any, active: Any) -> Any:
            """Light of one emitter drawn for a hit (interaction, BSDF, number), through what it shines through."""
            si, bsdf, shape = hit
            wanted = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            ds, light = scene.sample_emitter_direction(si, sampler.next_2d(), False, wanted)
            wanted &= ds.pdf != 0.0
            number = self.tables.number(ds.emitter)
            wo = si.to_local(ds.d)
            wanted &= self.tables.lights_it(number, self.kind_of(bsdf, si, wo), path.depth, shape)
            # lobes that mirror look at the geometry themselves, about a normal that may differ from the hit's
            kept = self.keeps_side(si, wo, ds.d) | mi.has_flag(bsdf.flags(), mi.BSDFFlags.Glossy)
            wanted &= kept | path.leaves
            value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo, wanted & ~path.leaves)
            if self.tables.subsurface:
                out = cosine_out(mi, dr, si, ds.d) / dr.pi
                value, pdf = dr.select(path.leaves, mi.Spectrum(out), value), dr.select(path.leaves, out, pdf)
            share = dr.select(ds.delta, 1.0, squared_share(ds.pdf, pdf))
            shadowless = mi.Bool(False)
            if self.tables.shadowless is not None:
                shadowless = self.tables.look_up(self.tables.shadowless, number) != 0
                share = dr.select(shadowless, 1.0, share)
            wanted &= dr.any(value * light != 0.0)
            marks = shadow_marks(mi, si.dn_dv)
            clear = self.clear_way(scene, si.spawn_ray_to(ds.p), (number, path.passed, marks), wanted & ~shadowless)
            return dr.select(wanted, value * light * share * dr.select(shadowless, 1.0, clear), 0.0)

        def kind_of(self, bsdf: Any, si: Any, wo: Any) -> Any:
            """Kind of ray that a direction is for a surface: a mixed one counts as diffuse on its own side."""
            same_side = si.wi.z * wo.z > 0.0
            diffuse = mi.has_flag(bsdf.flags(), mi.BSDFFlags.DiffuseReflection)
            own = dr.select(diffuse, mi.UInt32(int(Rays.DIFFUSE)), int(Rays.GLOSSY))
            return dr.select(same_side, own, int(Rays.TRANSMISSION))

        def clear_way(self, scene: Any, ray: Any, light: tuple[Any, Any, Any], active: Any) -> Any:
            """Share of light that comes through from a point of an emitter (number, surfaces passed before, marks)."""
            if not (self.settings.transparency or self.tables.blocks_selectively):
                return dr.select(scene.ray_test(ray, active), mi.Spectrum(0.0), mi.Spectrum(1.0))
            return self.through(scene, ray, light, mi.Bool(active))

        def through(self, scene: Any, ray: Any, light: tuple[Any, Any, Any], active: Any) -> Any:
            """The product of what the surfaces on a shadow ray let through."""
            emitter, passed, marks = light

            def body(ray: Any, clear: Any, layers: Any, active: Any) -> Any:
                si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
                si.dn_dv = marks
                met = active & si.is_valid()
                blocks = met & self.tables.casts_shadow(self.tables.shape_number(si), emitter)
                clear = dr.select(blocks, clear * si.bsdf().eval_null_transmission(si, blocks), clear)
                layers = dr.select(blocks, layers + 1, layers)
                rest = ray.maxt - si.t
                ray = dr.select(met, si.spawn_ray(ray.d), ray)
                ray.maxt = rest
                return ray, clear, layers, met & (dr.max(clear) > 0.0) & (layers <= self.layers)

            start = (mi.Ray3f(ray), mi.Spectrum(1.0), mi.UInt32(passed), active)
            _, clear, layers, _ = dr.while_loop(start, lambda _r, _c, _n, active: active, body)
            # a way that was cut off in the middle is blocked
            return dr.select(layers <= self.layers, clear, 0.0)

        def is_hole(self, shape: Any, kind: Any) -> Any:
            """Whether a ray of the camera meets a holdout, which shows nothing."""
            if self.tables.shapes is None:
                return mi.Bool(False)
            bits = self.tables.look_up(self.tables.shapes, shape)
            return ((bits & HOLDOUT) != 0) & ((kind & int(Rays.CAMERA)) != 0)

        def cut_caustic(self, bsdf: Any, kind: Any) -> Any:
            """Whether a diffuse ray meets a mirror or a glass that caustics are switched off for."""
            limits = self.settings.limits
            cut = mi.Bool(False)
            flags = bsdf.flags()
            diffuse = mi.has_flag(flags, mi.BSDFFlags.Diffuse) | mi.has_flag(flags, mi.BSDFFlags.Null)
            bends = mi.has_flag(flags, mi.BSDFFlags.Transmission)
            if not limits.reflective_caustics:
                cut |= ~bends
            if not limits.refractive_caustics:
                cut |= bends
            return cut & ~diffuse & (kind == int(Rays.DIFFUSE))

        def clamped(self, value: Any, indirect: Any) -> Any:
            """A contribution brought down to the limits on a sample's mean."""
            limits = self.settings.limits
            if limits.clamp_direct <= 0 and limits.clamp_indirect <= 0:
                return value
            none = float(dr.largest(mi.Float))
            highest = [limit * self.settings.white if limit > 0 else none
                       for limit in (limits.clamp_direct, limits.clamp_indirect)]  # fmt: skip
            low, high = (dr.opaque(mi.Float, limit) for limit in highest)
            mean = dr.mean(dr.abs(value))
            most = dr.select(indirect, high, low)
            return value * dr.select(mean > most, most / mean, 1.0)

        def to_string(self) -> str:
            return "ScenePath"

    return ScenePath
