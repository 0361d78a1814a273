# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits on paths: bounces, caustics, contributions above a clamp, and attenuation by surfaces on a shadow ray."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import ALONE, TURNED
from spectral_core.render.plugins.closures.strands import FIBER
from spectral_core.render.plugins.numbers import channel_mean
from spectral_core.render.plugins.paints.ray_marks import SHARP_DENSITY, TRANSLUCENT, is_diffuse
from spectral_core.render.trace.media import flight as flights
from spectral_core.render.trace.path.settings import ROULETTE_BOUNCES, ROULETTE_SHARE, ROULETTE_SURE, PathSettings
from spectral_core.scene import Rays


def squared_share(pdf: Any, other: Any) -> Any:
    """Weight of one of two sampling methods of a path, by the squares of their densities (power heuristic).

    0 if neither can make the path.
    """
    import drjit as dr

    ratio = other / pdf  # the square of a density above 1e19, such as that of a tiny far lamp, has no float
    weight = 1.0 / (1.0 + ratio * ratio)
    return dr.select(dr.isnan(weight), 0.0, weight)


def share_of(tables: Any, path: Any, worlds: tuple[int, int], of: Any = None) -> Any:
    """``share(number, pdf, active)``: weight of a light that a ray hits, given the density of sampling it.

    ``worlds``: number of an even environment, and of any other; 0 for none. ``of``: predicate of the lights that
    count, by their number; all if None.
    """
    import drjit as dr

    scattered = dr.select(path.depth > 0, path.depth - 1, 0)
    kind = path.kind | dr.select(is_diffuse(path.kind), type(path.kind)(int(Rays.DIFFUSE)), 0)

    def share(number: Any, pdf: Any, on: Any) -> Any:
        lit = on & tables.lights_it(number, kind, scattered, path.before_shape)
        lit = lit if of is None else lit & of(number)
        if tables.only_sampled is not None:
            lit &= tables.look_up(tables.only_sampled, number) == 0
        # Power heuristic; after a mirror no light could have been sampled, so emission counts in full.
        # Where hair on meshes alone draws directions, Cycles samples no lamp.
        own = path.before_delta | (((path.before_alone & ALONE) != 0) & (number != worlds[1]))
        own |= ((path.before_alone & TURNED) != 0) & (number == worlds[0])
        own = dr.select(own, 1.0, squared_share(path.before_pdf, pdf))
        return dr.select(lit, own, 0.0)

    return share


def share_alone(tables: Any, drawn: Any, pdf: Any, share: Any) -> Any:
    """Weight ``share`` of a sampled light, 1 for one that no ray meets; such a light is not in mirrors.

    ``pdf``: density of the surface's own sampling toward the light. A lobe of roughness 0 has some width here, so that
    a sample within it would be a rare and very bright one; in Cycles it has none.
    """
    import drjit as dr

    alone = tables.look_up(tables.only_sampled, drawn.number) != 0
    return dr.select(alone, dr.select(pdf > SHARP_DENSITY, 0.0, 1.0), share)


def cut_caustic(integrator: Any, bsdf: Any, kind: Any) -> Any:
    """True if a diffuse ray hits a mirror or a glass whose caustics are switched off."""
    import mitsuba as mi

    limits = integrator.settings.limits
    cut = mi.Bool(False)
    flags = bsdf.flags()
    diffuse = mi.has_flag(flags, mi.BSDFFlags.Diffuse) | mi.has_flag(flags, mi.BSDFFlags.Null)
    diffuse |= (mi.UInt32(flags) & FIBER) != 0
    bends = mi.has_flag(flags, mi.BSDFFlags.Transmission)
    if not limits.reflective_caustics:
        cut |= ~bends
    if not limits.refractive_caustics:
        cut |= bends
    return cut & ~diffuse & is_diffuse(kind)


def count(limits: Any, path: Any, bs: Any, scatters: Any) -> None:
    """Count a bounce by its type, as in Cycles, and set ``path.last`` at a limit (``limits``: most bounces by type)."""
    import drjit as dr
    import mitsuba as mi

    mirrors = scatters & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Reflection)
    is_diffuse = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Diffuse)
    one = lambda which: dr.select(which, mi.UInt32(1), 0)  # noqa: E731
    path.diffuse += one(mirrors & is_diffuse)
    path.glossy += one(mirrors & ~is_diffuse)
    path.transmission += one(scatters & ~mirrors)
    path.depth += one(scatters)
    if limits.settings.clear_glass:
        path.clear &= ~scatters | (~mirrors & mi.has_flag(bs.sampled_type, mi.BSDFFlags.DeltaTransmission))
    ended = (path.diffuse > limits.diffuse) | (path.glossy > limits.glossy)
    ended |= (path.transmission > limits.transmission) | (path.depth > limits.bounces)
    path.last |= scatters & ended
    reflected = dr.select(is_diffuse, mi.UInt32(int(Rays.DIFFUSE)), int(Rays.GLOSSY))
    passed = int(Rays.TRANSMISSION) | dr.select(is_diffuse, mi.UInt32(TRANSLUCENT), 0)
    kind = dr.select(mirrors, reflected, passed)
    path.kind = dr.select(scatters, kind, path.kind)


def roulette(path: Any, sampler: Any, strongest: Any, bounces: Any) -> Any:
    """Paths that end by Russian roulette; those spared carry more. ``strongest``: largest channel of the throughput;
    ``bounces``: paths that scatter now. A stack of transparent surfaces must not end paths.

    The chance is by the remaining contribution of a path, without the scaling by refraction.
    """
    import drjit as dr

    # Without an end beyond these bounces, paths between white walls would run to the scene's limit.
    most = dr.select(path.depth <= ROULETTE_SURE, 1.0, 0.95)
    survival = dr.minimum(ROULETTE_SHARE * dr.sqrt(strongest) * path.eta, most)
    gambles = bounces & (path.depth >= ROULETTE_BOUNCES)
    dies = gambles & (sampler.next_1d() >= survival)
    spared = path.throughput * dr.rcp(dr.maximum(survival, 1e-8))
    path.throughput = dr.select(gambles & ~dies, spared, path.throughput)
    return dies


def clamps_of(settings: PathSettings) -> tuple[Any, Any] | None:
    """Largest mean of a sample of direct and of indirect light, as numbers that kernels read; None without limits.

    Make them before a launch is recorded.
    """
    import drjit as dr
    import mitsuba as mi

    limits = settings.limits
    if limits.clamp_direct <= 0 and limits.clamp_indirect <= 0:
        return None
    none = float(dr.largest(mi.Float))
    highest = [limit * settings.white if limit > 0 else none for limit in (limits.clamp_direct, limits.clamp_indirect)]
    return dr.opaque(mi.Float, highest[0]), dr.opaque(mi.Float, highest[1])


def clamped(integrator: Any, value: Any, indirect: Any) -> Any:
    """A contribution reduced to the limits on a sample's mean (``clamps_of``)."""
    import drjit as dr

    if integrator.clamps is None:
        return value
    low, high = integrator.clamps
    mean = channel_mean(dr, dr.abs(value))
    most = dr.select(indirect, high, low)
    return value * dr.select(mean > most, most / mean, 1.0)


def clear_way(integrator: Any, scene: Any, way: tuple[Any, Any, Any], light: tuple[Any, ...], active: Any) -> Any:
    """Transmittance of the way from a point of an emitter (number, surfaces passed before, marks, type of ray).

    ``way``: the ray to the point, the medium at its start with the one around that, and the hit at its start with its
    shape, and whether it may lie within a strand.
    """
    import drjit as dr
    import mitsuba as mi

    (ray, media, start), tables, layers = way, integrator.tables, integrator.layers
    if integrator.settings.transparency or tables.blocks_selectively or tables.media is not None:
        return shone_through(tables, layers, (scene, ray, media), light, mi.Bool(active))
    if tables.has_strands:
        return shone_past_strands(tables, layers, (scene, ray, media), light, (*start, mi.Bool(active)))
    return dr.select(scene.ray_test(ray, active), mi.Spectrum(0.0), mi.Spectrum(1.0))


def shone_through(tables: Any, most_layers: Any, way: tuple[Any, Any, Any], light: tuple[Any, ...], active: Any) -> Any:
    """The product of the transmittances of the surfaces on a shadow ray.

    ``way``: scene, ray, the medium at its start and the one around that; ``light``: number of the light, surfaces
    passed before, marks and type of the ray.
    """
    import drjit as dr
    import mitsuba as mi

    scene, ray, media = way
    emitter, passed, marks, kind = light
    fills, is_shadow = tables.media, kind == int(Rays.SHADOW)

    def body(ray: Any, clear: Any, layers: Any, fog: Any, active: Any) -> Any:
        si = tables.intersect_seen(scene, ray, kind, active)
        si.dn_dv = mi.Vector3f(marks.x, marks.y, marks.z + mi.Float(layers - passed))
        met = active & si.is_valid()
        shape = tables.shape_number(si)
        blocks = met & ~tables.passes(shape, kind) & tables.casts_shadow(shape, emitter)
        blocks &= ~tables.from_within(shape, si, ray.d)
        clear = dr.select(blocks, clear * tables.surface(si).eval_null_transmission(si, blocks), clear)
        counts = blocks
        if fills is not None:
            length = dr.select(si.is_valid(), si.t, ray.maxt)
            # a ray that meets nothing more is in the world's medium alone, as in ``in_media.fly``
            lost = ~is_shadow & ~si.is_valid()
            fog = dr.select(lost, fills.around, fog[0]), dr.select(lost, 0, fog[1])
            clear = dr.select(active, clear * flights.clear(fills, fog, length, ray, active, is_shadow), clear)
            fog = fills.crossed(fog, shape, si, (ray.d, ray.d), met)
            counts = blocks & ~fills.is_border(shape, met)
        layers = dr.select(counts, layers + 1, layers)
        origin = mi.Point3f(ray.o)
        ray = dr.select(met, toward_end(si, end, ray.d), ray)
        if tables.counts_lengths:
            ray.time = si.time + dr.norm(ray.o - origin)
        return ray, clear, layers, fog, met & (dr.max(clear) > 0.0) & (layers <= most_layers)

    end = ray.o + ray.d * ray.maxt
    start = (mi.Ray3f(ray), mi.Spectrum(1.0), mi.UInt32(passed), media, active)
    _, clear, layers, _, _ = dr.while_loop(start, lambda _r, _c, _n, _m, active: active, body)
    # a ray that ends at the limit counts as occluded
    return dr.select(layers <= most_layers, clear, 0.0)


def share_past_linked(tables: Any, most_layers: Any, way: tuple[Any, Any], light: tuple[Any, ...], active: Any) -> Any:
    """Weight of a sampled lamp (number, type of the rays that scatter, weight) that shadow linking shows past surfaces.

    ``way``: scene and shadow ray. Rays that scatter toward the lamp end at these surfaces, so that their part of the
    light is the sampled light's; of a surface that is transparent in part they keep the part that passes it.
    """
    import drjit as dr
    import mitsuba as mi

    (scene, ray), (emitter, kind, share) = way, light
    if tables.clear is None:
        return share

    def body(ray: Any, passes: Any, layers: Any, active: Any) -> Any:
        si = tables.intersect_seen(scene, ray, kind, active)
        met, shape = active & si.is_valid(), tables.shape_number(si)
        ends = met & ~tables.passes(shape, kind) & ~tables.casts_shadow(shape, emitter)
        passes = dr.select(ends, passes * tables.surface(si).eval_null_transmission(si, ends), passes)
        ray = dr.select(met, toward_end(si, end, ray.d), ray)
        return ray, passes, layers + 1, met & (dr.max(passes) > 0.0) & (layers <= most_layers)

    end = ray.o + ray.d * ray.maxt
    start = (mi.Ray3f(ray), mi.Spectrum(1.0), mi.UInt32(0), active & tables.is_linked(emitter) & (share < 1.0))
    _, passes, _, _ = dr.while_loop(start, lambda _r, _p, _n, active: active, body)
    # the lamp counts ``share`` times when sampled and the rest where scattered rays arrive: together once
    return 1.0 - (1.0 - share) * passes


def toward_end(si: Any, end: Any, direction: Any) -> Any:
    """A shadow ray's rest behind a hit, to its ``end``; of length 0 if that is past.

    It aims at the end anew, because it starts above the surface by the rounding error of its position: moved by that,
    the ray could end behind the emissive surface that it leads to.
    """
    import drjit as dr

    ray = si.spawn_ray(direction)
    away = end - ray.o
    length, ahead = dr.norm(away), dr.dot(away, direction) > 0.0
    ray.d = dr.select(ahead, away / length, direction)
    ray.maxt = dr.select(ahead, length, 0.0)
    return ray


def shone_past_strands(
    tables: Any, most_layers: Any, way: tuple[Any, Any, Any], light: tuple[Any, ...], start: tuple[Any, ...]
) -> Any:
    """``shone_through`` if all but the far walls of strands are obstacles; ``start``: the hit that the ray comes from,
    its shape, whether it may lie within another strand, and True for the rays to trace.

    From outside all strands, a ray enters one only through a wall that occludes it: past the wall of its own strand
    any hit will do, which takes less time than the nearest. Rays from within others take the long way.
    """
    import drjit as dr
    import mitsuba as mi

    scene, ray, media = way
    si, shape, within, active = start
    short = active & ~within
    beyond, blocked = tables.out_of_strand(scene, (si, shape), ray, short)
    clear = short & ~blocked
    clear &= ~scene.ray_test(beyond, clear)
    long = shone_through(tables, most_layers, (scene, ray, media), light, active & within)
    return dr.select(within, long, dr.select(clear, mi.Spectrum(1.0), mi.Spectrum(0.0)))
