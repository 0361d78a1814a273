# SPDX-License-Identifier: GPL-3.0-or-later
"""Exit of light by the profile of Christensen and Burley: a point of the surface around the point of entry.

King et al. 2013, "BSSRDF importance sampling": a probe through a disk about one of three axes; Christensen and Burley
2015, "Approximate reflectance profiles for efficient subsurface scattering".
"""

from __future__ import annotations

from math import exp, pi
from typing import Any

from spectral_core.render.plugins.closures.subsurface import NO_RADIUS
from spectral_core.render.plugins.numbers import channel_mean
from spectral_core.render.trace.below.medium import SCALE
from spectral_core.render.trace.below.walk import START, here_or_below, of_channel, outward_normals, shares_of

REACH = 16.0
"""Radius of the disk over that of the profile (Cycles)."""
WITHIN = 1.0 - 0.25 * exp(-REACH) - 0.75 * exp(-REACH / 3.0)
"""Share of the profile within its reach."""
MOST_HITS = 16
"""Most crossings of a probe with the surface."""


def profile(dr: Any, width: Any, distance: Any) -> Any:
    """Density over the distance (not the area) from the entry."""
    third = dr.exp(-distance / (3.0 * dr.maximum(width, 1e-12)))
    density = (third + third * third * third) / (4.0 * WITHIN * dr.maximum(width, 1e-12))
    return dr.select((width > 0.0) & (distance < REACH * width), density, 0.0)


def drawn_distance(dr: Any, sample: Any) -> Any:
    """Distance in widths by the profile: a quarter of y³ plus three quarters of y is the share beyond, y = e^(-r/3)."""
    u = 2.0 * (1.0 - sample * WITHIN)
    root = dr.sqrt(u * u + 1.0)
    y = dr.cbrt(u + root) - dr.cbrt(root - u)
    return dr.clip(-3.0 * dr.log(dr.maximum(y, 1e-6)), 0.0, REACH)


def across(mi: Any, dr: Any, scene: Any, tables: Any, start: Any, sampler: Any) -> tuple[Any, Any, Any, Any]:
    """Move light from ``start`` to an exit; arguments and results as of ``walk``."""
    si, own, _, radius, color, above, carried, active = start
    outward, _ = outward_normals(mi, dr, si)
    widths = mi.Spectrum(radius * SCALE)
    moves = radius > NO_RADIUS
    here, factor = here_or_below(dr, (above * color, above * color), moves, sampler.next_1d())
    here &= active
    probes = active & ~here

    share = shares_of(dr, mi.Spectrum(dr.select(moves, factor * carried, 0.0)))
    width = dr.maximum(of_channel(dr, widths, share, sampler.next_1d()), 1e-12)
    place = sampler.next_2d()
    distance = drawn_distance(dr, place.x) * width
    height = dr.safe_sqrt(dr.square(REACH * width) - distance * distance)
    # half of the probes go along the normal, a quarter along each tangent
    first, second = (mi.Vector3f(axis) for axis in mi.coordinate_system(outward))
    pick, turned = sampler.next_1d(), dr.sincos(2.0 * pi * place.y)
    by_first, by_second = (pick >= 0.5) & (pick < 0.75), pick >= 0.75
    axis = dr.select(by_first, first, dr.select(by_second, second, outward))
    along = dr.select(by_first, outward, first)
    other = dr.select(by_second, outward, second)
    quarter = lambda is_normal: dr.select(is_normal, mi.Float(0.5), 0.25)  # noqa: E731
    axes = ((axis, quarter(pick < 0.5)), (along, quarter(by_first)), (other, quarter(by_second)))

    def body(ray: Any, found: Any, hits: Any, probing: Any) -> tuple[Any, ...]:
        hit = tables.intersect(scene, ray, probing)
        met = probing & hit.is_valid()
        mine = met & (tables.shape_number(hit) == own)
        densities = [part * dr.abs(dr.dot(way, hit.n)) for way, part in axes]
        total = dr.square(densities[0]) + dr.square(densities[1]) + dr.square(densities[2])
        balance = densities[0] / dr.maximum(total, 1e-20)
        value = profile(dr, widths, dr.norm(hit.p - si.p)) * (balance / dr.maximum(mean, 1e-20))
        amount = channel_mean(dr, value)
        taken = mine & (amount > 0.0)
        point, normal, kept, total_amount, seed = found
        # one of the crossings stays, by its share of the sum so far
        chance = amount / dr.maximum(total_amount + amount, 1e-20)
        stays = taken & (seed < chance)
        again = dr.select(
            seed < chance, seed / dr.maximum(chance, 1e-9), (seed - chance) / dr.maximum(1.0 - chance, 1e-9)
        )
        found = (
            dr.select(stays, hit.p, point), dr.select(stays, mi.Vector3f(hit.n), normal),
            mi.Spectrum(dr.select(stays, value / dr.maximum(amount, 1e-20), kept)),
            dr.select(taken, total_amount + amount, total_amount), dr.select(taken, dr.clip(again, 0.0, 1.0), seed),
        )  # fmt: skip
        rest = ray.maxt - hit.t
        ray = dr.select(met, hit.spawn_ray(ray.d), ray)
        ray.maxt = dr.select(met, rest, ray.maxt)
        return ray, found, hits + 1, met & (hits < MOST_HITS) & (rest > 0.0)

    # the density of the drawn distance, as a mean over the channels that move
    mean = dr.sum(dr.select(moves, profile(dr, widths, distance), 0.0) * share)
    probe = mi.Ray3f(si.spawn_ray(-axis))
    probe.o = si.p + axis * height + distance * (along * turned[1] + other * turned[0])
    probe.maxt = 2.0 * height
    nothing = mi.Vector3f(0.0), mi.Spectrum(0.0), mi.Float(0.0)
    found = (mi.Point3f(si.p), nothing[0], nothing[1], nothing[2], sampler.next_1d())
    labels = ("ray", "found", "hits", "probing")
    state = (probe, found, mi.UInt32(0), probes)
    _, found, _, _ = dr.while_loop(state, lambda r, f, h, probing: probing, body, labels=labels)
    point, normal, kept, amount, _ = found
    left = probes & (amount > 0.0)
    # Cycles takes the normal as the shape has it, turned where the entry was at its back
    out = dr.select(here, outward, normal * dr.mulsign(mi.Float(1.0), dr.dot(si.n, outward)))
    ray = mi.Ray3f(si.spawn_ray(out))
    exit_at = dr.select(here, mi.Point3f(si.p), point)
    ray.o = exit_at - out * ((1.0 + dr.max(dr.abs(exit_at))) * START)
    ray.maxt = dr.largest(mi.Float)
    return ray, mi.Spectrum(dr.select(here, factor, factor * kept * amount)), left | here, sampler
