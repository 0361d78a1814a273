# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at a hit of a path, from one light that is drawn there.

The functions are methods of the path integrator; see ``integrator``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.lights.choice import Receiver
from spectral_core.render.plugins.paints.ray_marks import shadow_marks
from spectral_core.render.trace import hit_sides, lobes
from spectral_core.render.trace.below.leaving import cosine_out
from spectral_core.render.trace.media import in_media
from spectral_core.render.trace.path import limits as path_limits
from spectral_core.scene import Rays


@dataclass(frozen=True, eq=False)
class Asked:
    """A drawn light, and the point that asks for it.

    ``si``: the point, on the surface or in a medium; ``drawn``: the light's sample; ``wo``: the local direction to
    it; ``kind``: type of ray along which the point is lit.
    """

    si: Any
    drawn: Any
    wo: Any
    kind: Any


def direct(integrator: Any, scene: Any, sampler: Any, hit: tuple[Any, ...], path: Any, active: Any) -> Any:
    """Direct light of one drawn emitter at a hit (interaction, BSDF, number, even lobe) and what covers it."""
    import drjit as dr
    import mitsuba as mi

    integrator.asked, integrator.carried = mi.UInt32(0), path.throughput
    if integrator.lights.is_empty:
        return mi.Spectrum(0.0)
    tables, (_, bsdf, shape, (matt, _)) = integrator.tables, hit
    floats, parts = (mi.Bool(False), []) if integrator.fog is None else integrator.fog
    wanted = active & (mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth) | floats)
    asked, wanted = _ask(integrator, sampler, hit, path, floats, wanted)
    si, drawn, wo = asked.si, asked.drawn, asked.wo
    kept = integrator.keeps_side(si, wo, drawn.direction, bsdf)
    ray, lifted = integrator.shadow_ray(si, drawn, -path.ray.d, bsdf)
    wanted &= kept | matt | floats | lifted
    media, fog = (mi.UInt32(0), mi.UInt32(0)), None
    if tables.media is not None:
        hits, ways = (si, shape, path), (path.ray.d, drawn.direction)
        fog, media = in_media.toward(tables.media, hits, ways, (floats, parts), wanted)
    value, share = _scattered(integrator, hit, asked, (lifted, floats, fog), wanted)
    integrator.asked_way = (wo, value)
    shadowless = mi.Bool(False)
    if tables.shadowless is not None:
        shadowless = tables.look_up(tables.shadowless, drawn.number) != 0
    wanted &= dr.any(value * drawn.value != 0.0)
    ray = dr.select(floats, si.spawn_ray_to(drawn.point), ray)
    ray.time = mi.Float(0.0)  # its length counts from here
    start = si, shape, (path.within > 0) | path.leaves
    by = drawn.number, asked.kind, share
    share = path_limits.share_past_linked(tables, integrator.layers, (scene, ray), by, wanted & ~shadowless)
    # in Cycles scattered rays alone meet an even environment, and pass what they do not see
    kind = dr.select(drawn.number == integrator.lights.even_world, asked.kind, int(Rays.SHADOW))
    light = drawn.number, path.passed, shadow_marks(mi, si.dn_dv), kind
    clear = integrator.clear_way(scene, (ray, media, start), light, wanted & ~shadowless)
    if integrator.sampled is not None:
        # between all surfaces on the way at once, whatever these let pass
        clear = clear * integrator.sampled.clear(ray, drawn.number, wanted & ~shadowless)
    return dr.select(wanted, value * drawn.value * share * dr.select(shadowless, 1.0, clear), 0.0)


def _ask(integrator: Any, sampler: Any, hit: tuple[Any, ...], path: Any, floats: Any, wanted: Any) -> tuple[Asked, Any]:
    """Draw a light for a hit, or for a point in a medium before it (``floats``); true where one was found."""
    import drjit as dr

    tables, lights, flight = integrator.tables, integrator.lights, integrator.flight
    si, bsdf, shape, (matt, _) = hit
    both, kinds = integrator.sides_of(bsdf, path.leaves)
    to = Receiver(si.p, integrator.seen_side(si, path.ray.d), both | floats)
    receiver = shape if flight is None else dr.select(floats, in_media.receiver(path), shape)
    to.kinds, to.unlit = dr.select(floats, int(Rays.VOLUME), kinds), tables.unlit_by(receiver)
    if flight is not None:
        to.floats, to.stretch = floats, in_media.stretch_of(flight, path.ray)
    chosen = lights.choose(to, sampler, wanted)
    if chosen.center is not None:
        si, carried = in_media.ask_along(flight, (si, path.ray), (to, chosen), sampler, wanted & floats)
        integrator.carried = dr.select(floats, carried, path.throughput)
    drawn = lights.draw(tables.at_bounce(si), to, chosen, sampler, tables, wanted)
    wanted &= drawn.pdf != 0.0
    integrator.asked = drawn.number
    wo = si.to_local(drawn.direction)
    # on a surface, only closures that see the light count; see ``lobes``
    kind = dr.select(floats, int(Rays.VOLUME), integrator.kind_of(bsdf, si, wo, path.leaves))
    wanted &= tables.lights_it(drawn.number, dr.select(floats | matt, kind, 0), path.depth, receiver)
    return Asked(si, drawn, wo, kind), wanted


def _scattered(
    integrator: Any, hit: tuple[Any, ...], asked: Asked, at: tuple[Any, Any, Any], wanted: Any
) -> tuple[Any, Any]:
    """What the surface or the medium scatters of a light, and the light's weight against the surface's own sampling.

    ``at``: true where the shadow ray starts above the surface, true in a medium, and what that medium scatters.
    """
    import drjit as dr
    import mitsuba as mi

    tables, (_, bsdf, _, (matt, along)) = integrator.tables, hit
    si, drawn, wo, (lifted, floats, fog) = asked.si, asked.drawn, asked.wo, at
    place = hit_sides.lifted_place(si, lifted, drawn.number != integrator.lights.even_world)
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), place, wo, wanted & ~matt & ~floats)
    if fog is not None:
        value, pdf = dr.select(floats, mi.Spectrum(fog[0]), value), dr.select(floats, fog[1], pdf)
    if tables.has_even_lobes:
        out = cosine_out(mi, dr, si, along, drawn.direction) / dr.pi
        value, pdf = dr.select(matt, mi.Spectrum(out), value), dr.select(matt, out, pdf)
    if tables.lights is not None:
        hidden = tables.look_up(tables.lights, drawn.number)
        value *= lobes.visible_share(hidden, (place, bsdf), wo, value, wanted & ~matt & ~floats)
    share = dr.select(drawn.delta, 1.0, path_limits.squared_share(drawn.pdf, pdf))
    if tables.only_sampled is not None:
        share = path_limits.share_alone(tables, drawn, pdf, share)
    return value, share
