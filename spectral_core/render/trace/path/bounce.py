# SPDX-License-Identifier: GPL-3.0-or-later
"""The continuation of a path from a hit: a direction is drawn, and the ray goes on, into a medium or below a surface.

The functions are methods of the path integrator; see ``integrator``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.trace import clear_glass, portals
from spectral_core.render.trace.below.dive import dive
from spectral_core.render.trace.below.leaving import leaving
from spectral_core.render.trace.media import in_media
from spectral_core.render.trace.path.hit import Hit, Surface


@dataclass(frozen=True, eq=False)
class Bounce:
    """A drawn continuation.

    ``bs``, ``weight``: the surface's sample; ``outward``: its direction in the scene; ``numbers``: the two random
    numbers that it was drawn by; ``straight``: true if the ray passes the surface without a turn; ``scatters``: true
    if it takes the direction ``outward``; ``dives``: true if it goes below the surface.
    """

    bs: Any
    weight: Any
    outward: Any
    numbers: tuple[Any, Any]
    straight: Any
    scatters: Any
    dives: Any


def draw(integrator: Any, path: Any, sampler: Any, hit: Hit, surface: Surface) -> Bounce:
    """Draw the direction in which the path leaves the surface."""
    import drjit as dr
    import mitsuba as mi

    si, on, matt = hit.si, surface.on, surface.matt
    pick, direction = sampler.next_1d(), sampler.next_2d()
    bs, weight = surface.bsdf.sample(mi.BSDFContext(), si, pick, direction, on & ~matt)
    dives = on & ~matt & ~path.last & ((bs.sampled_type & DIVES) != 0)
    outward = si.to_world(bs.wo)
    drawn_well = integrator.leaves_as_drawn(si, bs, outward)
    if integrator.tables.has_even_lobes:
        left, through = leaving(mi, dr, si, surface.along, direction)
        bs, weight = dr.select(matt, left, bs), dr.select(matt, mi.Spectrum(1.0), weight)
        outward, drawn_well = dr.select(matt, through, outward), drawn_well | matt
    straight = on & mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
    scatters = on & ~straight & ~path.last & ~dives & drawn_well
    return Bounce(bs, weight, outward, (pick, direction), straight, scatters, dives)


def leave(integrator: Any, scene: Any, path: Any, hit: Hit, surface: Surface, bounce: Bounce) -> tuple[Any, Any]:
    """Send the ray on from a surface or from a point in a medium: true if it goes on, and if it scatters now."""
    import drjit as dr
    import mitsuba as mi

    tables, media = integrator.tables, integrator.tables.media
    si, shape, bs, scatters = hit.si, hit.shape, bounce.bs, bounce.scatters
    onward, border = hit.unseen | bounce.straight | scatters | surface.hole, mi.Bool(False)
    if media is not None:
        ways = path.ray.d, dr.select(scatters, bounce.outward, path.ray.d)
        path.medium, path.outer = media.crossed((path.medium, path.outer), shape, si, ways, onward & si.is_valid())
        border = media.is_border(shape, surface.on)
    clear_glass.cut_holes(integrator, si, surface.bsdf, path, (surface.on, surface.hole))
    path.throughput = dr.select(surface.on & ~bounce.dives, path.throughput * bounce.weight, path.throughput)
    # a factor, not a choice between products: Dr.Jit records a loop twice, and where each factor is a literal 1, the
    # choice would be of one value the first time and of two the second time, which is an error
    path.eta = path.eta * dr.select(scatters, bs.eta, 1.0)
    path.passed = dr.select((bounce.straight & ~border) | surface.hole, path.passed + 1, path.passed)
    integrator.count(path, bs, scatters)
    path.remember(si, bs, shape, scatters, integrator.sides_of(surface.bsdf, hit.leaves))
    path.go_on(si, bounce.outward, onward, scatters, tables.counts_lengths)
    path.ray, stays = tables.out_of_strand(scene, (si, shape), path.ray, scatters)
    path.within += dr.select(stays, mi.UInt32(1), 0)
    portals.send_on(tables, (si, surface.bsdf, bs), path, bounce.numbers[0], bounce.straight)
    if media is None:
        return onward, scatters
    limits, of = (integrator.volume, integrator.bounces), (hit.place, path, integrator.flight)
    turns = in_media.scatter(media, of, bounce.numbers, hit.floats, limits)
    return onward | turns, scatters | turns


def enter(integrator: Any, scene: Any, path: Any, sampler: Any, at: tuple[Hit, Surface, Bounce]) -> tuple[Any, Any]:
    """Walk below the surface to the point where the path leaves it: true where it does, and the sampler."""
    import drjit as dr
    import mitsuba as mi

    hit, surface, bounce = at
    pick, dives = bounce.numbers[0], bounce.dives
    start = (hit.si, hit.shape, bounce.bs, bounce.weight, path.throughput, dives)
    below, factor, surfaces, sampler = dive(
        mi, dr, scene, integrator.tables, (*start, path.diffuse > 0, surface.bsdf, pick), sampler
    )
    dives &= surfaces
    path.ray = dr.select(dives, below, path.ray)
    path.throughput = dr.select(dives, path.throughput * factor, path.throughput)
    path.leaves |= dives
    return dives, sampler
