# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields lit by a scene, with gradient shading and shadows between fields and surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from spectral_core.volume.march.loop import Shade, Shown, march
from spectral_core.volume.march.path import Placed, WorldRay, path_through
from spectral_core.volume.mitsuba_integrator.settings import VolumeSettings


def transmittance(volumes: list[Placed], ray: WorldRay) -> Any:
    """Transmittance of fields between the ray's origin and its end; 1 without a field."""
    return type(ray.end)(1.0) if not volumes else march(path_through(volumes, ray)).transmittance


def way_to(lamp: Any) -> Any:
    """Length of the way to a sampled point of an emitter, in which fields take light; without end to sun and sky.

    Mitsuba sets these at the border of the scene's surfaces, among which fields do not count.
    """
    import drjit as dr
    import mitsuba as mi

    is_far = mi.has_flag(lamp.emitter.flags(), mi.EmitterFlags.Infinite)
    return dr.select(is_far, 1e30, dr.minimum(lamp.dist, 1e30))


@dataclass(frozen=True)
class Lit:
    """Shading of lit materials by the scene's emitters: Lambert on both sides of the isosurface through a sample.

    Where the gradient vanishes there is no surface, and light scatters evenly in all directions. One emitter is sampled
    per step; ``shadows``: True to test for surfaces, or ``occluders`` among the fields, in between. ``colors`` and
    ``lit`` are per material.
    """

    scene: Any
    volumes: list[Placed]
    occluders: list[Placed]
    colors: list[Any]
    lit: list[bool]
    settings: VolumeSettings

    def shade(self, line: WorldRay, ray: Any) -> Shade:
        """The function that the march calls in each step; ``ray`` is Mitsuba's, for its time and wavelengths."""
        import drjit as dr
        import mitsuba as mi

        def shade(light: Any, sampler: Any, shown: Shown) -> tuple[Any, Any]:
            point = line.at(shown.distance)
            place = dr.zeros(mi.Interaction3f)
            place.t, place.time, place.wavelengths = shown.distance, ray.time, ray.wavelengths
            place.p = mi.Point3f(point)
            active = shown.gain * sum(shown.source[1:], shown.source[0]) > 0
            surfaces = [Surface.at(volume, point) for volume in self.volumes]
            arriving = self._arriving(place, sampler.next_2d(active), surfaces, active)
            start = 0
            for volume, lit in zip(self.volumes, arriving, strict=True):
                for k in range(start, start + volume.data.materials):
                    radiance = lit if self.lit[k] else mi.Spectrum(1.0)
                    light = light + dr.select(active, shown.gain * shown.source[k], 0.0) * self.colors[k] * radiance
                start += volume.data.materials
            return light, sampler

        return shade

    def _arriving(self, place: Any, draw: Any, surfaces: list[Surface], active: Any) -> list[Any]:
        """Light on each of the ``surfaces`` at a ``place`` from the emitter that the random numbers choose."""
        toward, weight = self.incoming(place, draw, active)
        return [weight * surface.facing(toward) for surface in surfaces]

    def incoming(self, place: Any, draw: Any, active: Any) -> tuple[Any, Any]:
        """(direction, light over its density) of an emitter at a ``place``."""
        import drjit as dr

        found, weight = self.scene.sample_emitter_direction(place, draw, self.settings.shadows, active)
        if self.settings.shadows:
            toward = WorldRay(place.p, found.d, dr.select(active & (found.pdf > 0), way_to(found), 0.0))
            weight *= transmittance(self.occluders, toward)
        return found.d, weight


@dataclass(frozen=True)
class Surface:
    """The isosurface of a field through a point: its ``normal`` of any length, Array3f64, and whether there is one."""

    normal: Any
    length: Any
    is_there: Any
    types: Any

    @classmethod
    def at(cls, volume: Placed, point: Any) -> Surface:
        """The surface of ``volume`` through a world ``point``; its normal is the field's gradient."""
        import drjit as dr

        field, vector = volume.data.volume, volume.data.volume.types.Array3f
        at = vector(volume.index_point(vector(point)))
        # Central differences over one voxel, in index space; the gradient of the world follows as a covector.
        slopes, scale = [], 0.0
        for axis in range(3):
            half = vector(*(0.5 * (axis == a) for a in range(3)))
            ahead, back = field.value(at + half), field.value(at - half)
            slopes.append(ahead - back)
            scale = scale + dr.abs(ahead) + dr.abs(back)
        gradient = vector(*slopes)
        normal = volume.world_covector(gradient)
        # Differences as small as float32's rounding belong to a level field.
        is_there = dr.dot(gradient, gradient) > (1e-6 * scale) ** 2
        return cls(normal, dr.sqrt(dr.dot(normal, normal)), is_there, field.types)

    def facing(self, toward: Any) -> Any:
        """|n·l|/π with l the direction ``toward`` a light, or 1/4π if there is no surface."""
        import drjit as dr

        along = dr.abs(dr.dot(self.normal, self.types.Array3f64(self.types.Array3f(toward))))
        share = self.types.Float(along / dr.select(self.length > 0.0, self.length, 1.0))
        return dr.select(self.is_there, share / math.pi, 0.25 / math.pi)


def surface_light(
    scene: Any,
    sampler: Any,
    ray: Any,
    volumes: list[Placed],
    occluders: list[Placed],
    active: Any,
    max_depth: int,
) -> tuple[Any, Any]:
    """(light, True if a surface or the environment is there) along ``ray``, with attenuation of every later segment by
    the fields ``volumes``, and of the way to a lamp by ``occluders``.

    A path tracer with light sampling and BSDF sampling joined by the balance heuristic. The first segment is the
    caller's, which has marched it already. Later segments lose light in the fields and gain none of theirs.
    """
    import drjit as dr
    import mitsuba as mi

    context = mi.BSDFContext()

    def going(ray: Any, throughput: Any, light: Any, depth: Any, active: Any, *_: Any) -> Any:
        return active

    def bounce(
        ray: Any, throughput: Any, light: Any, depth: Any, active: Any, there: Any, known: Any, pdf: Any, sampler: Any
    ) -> Any:
        hit = scene.ray_intersect(ray, mi.RayFlags.All, depth == 0, active)
        line = WorldRay(ray.o, ray.d, dr.select((depth > 0) & active, dr.minimum(hit.t, 1e30), 0.0))
        throughput = throughput * transmittance(volumes, line)
        emitter = hit.emitter(scene)
        there = there | (active & (depth == 0) & (hit.is_valid() | (emitter != None)))  # noqa: E711 (lane by lane)
        found = mi.DirectionSample3f(scene, hit, known)
        by_light = scene.pdf_emitter_direction(known, found, pdf > 0)
        share = dr.select(pdf > 0, pdf / dr.maximum(pdf + by_light, 1e-30), 1.0)
        shines = active & (emitter != None)  # noqa: E711
        light = light + dr.select(shines, throughput * share * emitter.eval(hit, shines), 0.0)
        active = active & hit.is_valid() & (depth + 1 < max_depth)

        bsdf = hit.bsdf(ray)
        smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        lamp, weight = scene.sample_emitter_direction(hit, sampler.next_2d(smooth), True, smooth)
        smooth = smooth & (lamp.pdf > 0)
        shadow = WorldRay(hit.p, lamp.d, dr.select(smooth, way_to(lamp), 0.0))
        value, chance = bsdf.eval_pdf(context, hit, hit.to_local(lamp.d), smooth)
        chance = dr.select(lamp.delta, 0.0, chance)
        share = lamp.pdf / dr.maximum(lamp.pdf + chance, 1e-30)
        gained = throughput * value * weight * share * transmittance(occluders, shadow)
        light = light + dr.select(smooth, gained, 0.0)

        pick, weight = bsdf.sample(context, hit, sampler.next_1d(active), sampler.next_2d(active), active)
        ray = hit.spawn_ray(hit.to_world(pick.wo))
        throughput = throughput * weight
        delta = mi.has_flag(pick.sampled_type, mi.BSDFFlags.Delta)
        pdf = dr.select(delta, -1.0, pick.pdf)
        active = active & (dr.max(throughput) > 0.0)  # however dim: the lamp at the end may be a sun
        known = dr.detach(hit)
        return ray, throughput, light, depth + 1, active, there, mi.Interaction3f(known), pdf, sampler

    state = (
        mi.Ray3f(ray),
        mi.Spectrum(1.0),
        mi.Spectrum(0.0),
        mi.UInt32(0),
        mi.Bool(active),
        mi.Bool(False),
        dr.zeros(mi.Interaction3f),
        mi.Float(-1.0),
        sampler,
    )
    ended = dr.while_loop(state, going, bounce)
    return ended[2], ended[5]
