# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of a path in media: free flight to the next surface, scattering, and direct light there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from spectral_core.render.lights.choice import Chosen, Receiver
from spectral_core.render.lights.stretch import Stretch
from spectral_core.render.trace.media import flight as flights
from spectral_core.render.trace.media.flight import Flight
from spectral_core.render.trace.media.table import IN_MEDIUM, NUMBER, Media
from spectral_core.scene import Rays

BY_ANGLE = 0.5
"""Probability of equiangular sampling on a segment where the path scatters; else the scattering point is used."""
AT_POINT = 1e-3
"""Length of the segment that stands for a point, relative to its distance."""
DEEPEST = 4.0
"""Optical depth up to which equiangular sampling is used; light from deeper is dim."""


def fly(media: Media, of: tuple[Any, Any], sampler: Any, active: Any) -> tuple[Flight, Any]:
    """Flight of a path (``of``: the next hit, the path), and the point for direct light."""
    import drjit as dr
    import mitsuba as mi

    si, path = of
    # As in Cycles, a ray that meets nothing more is in the world's medium alone: it left the others through a mesh that
    # is not closed.
    lost = active & ~si.is_valid()
    path.medium = dr.select(lost, mi.UInt32(media.around), path.medium)
    path.outer = dr.select(lost, mi.UInt32(0), path.outer)
    flight = flights.fly(media, path, dr.select(si.is_valid(), si.t, dr.inf), sampler, active)
    place = mi.SurfaceInteraction3f(si)
    place.p = dr.select(flight.scatters, path.ray.o + path.ray.d * flight.distance, si.p)
    # A point in a medium has no normal: lights are chosen by distance alone, not by a cosine.
    place.n = dr.select(flight.scatters, mi.Normal3f(0.0), si.n)
    place.t = dr.select(flight.scatters, flight.distance, si.t)
    return flight, place


def clear_along(media: Media, flight: Flight, path: Any) -> Callable[[Any, Any], Any]:
    """Transmittance from the start of a path's segment up to a distance, where a mask is True."""
    import drjit as dr

    if media.grids is None:
        return lambda distance, _: dr.exp(-flight.extinction * distance)
    return lambda distance, on: flights.clear(media, (path.medium, path.outer), distance, path.ray, on)


def stretch_of(flight: Flight, ray: Any) -> Stretch:
    """Part of a segment that lights are sampled along."""
    import drjit as dr

    deepest = DEEPEST * dr.rcp(dr.maximum(dr.min(flight.extinction), 1e-30))
    # where the medium varies, a short piece at the scattering point
    origin = dr.select(flight.varies, ray.o + ray.d * flight.distance, ray.o)
    length = dr.select(flight.varies, AT_POINT * dr.maximum(flight.distance, 1e-6), dr.minimum(flight.reach, deepest))
    return Stretch(origin, ray.d, length)


def asks_light(flight: Flight, ends: Any, lights: Any) -> Any:
    """True for paths that sample a light on their segment: they scatter on it, or it ends at no surface (``ends``)."""
    flight.ends = ends
    along = flight.inside & ~ends & ~flight.varies
    return flight.scatters | along if lights.asked_along_ways else flight.scatters


def ask_along(flight: Flight, at: tuple[Any, Any], of: tuple[Receiver, Chosen], sampler: Any, active: Any) -> Any:
    """Point on a segment (``at``: hit, ray) to sample a light from, and the throughput there.

    Equiangular sampling follows the squared distance to a lamp, the scattering point the optical depth; both are
    combined by the one-sample balance heuristic. On a segment that ends at a surface only paths that scatter sample a
    light, and densities are conditional on that.
    """
    import drjit as dr
    import mitsuba as mi

    (si, ray), (to, chosen) = at, of
    assert to.stretch is not None
    view = to.stretch.seen_from(chosen.center, chosen.radius)
    sample = sampler.next_2d()
    by_angle = dr.select(chosen.far, 0.0, mi.Float(BY_ANGLE))
    angular = ~chosen.far & (~flight.scatters | (sample.x < by_angle))
    distance = dr.select(angular, view.draw(sample.y), flight.distance)
    depth = flight.scattering * flight.reach
    # 1 - exp(-x), by its series if that cancels
    scattered = dr.sum(flight.share * dr.select(depth > 1e-3, 1.0 - dr.exp(-depth), depth * (1.0 - 0.5 * depth)))
    by_depth = dr.sum(flight.share * flight.scattering * dr.exp(-flight.scattering * distance))
    often = dr.select(flight.ends | chosen.far, by_angle * scattered, 1.0 - (1.0 - by_angle) * scattered)
    density = often * view.density(distance) + (1.0 - by_angle) * by_depth
    arrives = flight.scattering * dr.exp(-flight.extinction * distance)
    asks = active & (density > 0.0) & (flight.scatters | angular) & ~flight.varies
    distance = dr.select(flight.varies, flight.distance, distance)
    place = mi.SurfaceInteraction3f(si)  # the path itself continues from its scattering point
    place.p = dr.select(active, ray.o + ray.d * distance, si.p)
    place.n = dr.select(active, mi.Normal3f(0.0), si.n)
    along = dr.select(asks, flight.carried * arrives / dr.maximum(density, 1e-30), 0.0)
    at_point = dr.select(active & flight.scatters, flight.carried * flight.weight, 0.0)
    return place, dr.select(flight.varies, at_point, along)


def receiver(path: Any) -> Any:
    """Number of a path's medium as a receiver of light. Where media overlap the innermost one counts, as in Cycles."""
    return (path.medium & NUMBER) | type(path.medium)(IN_MEDIUM)


def scatter(
    media: Media, of: tuple[Any, Any, Flight], draws: tuple[Any, Any], floats: Any, limits: tuple[Any, Any]
) -> Any:
    """Change the direction of paths (``of``: point, path, flight) that scatter; returns those that continue.

    ``draws``: one random number and two; ``limits``: bounces in media, and in all.
    """
    import drjit as dr
    import mitsuba as mi

    place, path, flight = of
    turns = floats & ~path.last
    way, density, factor = media.turned(flight.parts, path.ray.d, draws, turns)
    path.throughput = dr.select(turns, path.throughput * factor, path.throughput)
    path.depth = dr.select(turns, path.depth + 1, path.depth)
    path.volume = dr.select(turns, path.volume + 1, path.volume)
    path.last |= turns & ((path.volume > limits[0]) | (path.depth > limits[1]))
    path.kind = dr.select(turns, int(Rays.VOLUME), path.kind)
    path.clear &= ~turns
    # A light that the ray hits next could have been sampled here; its weight needs the point and the density.
    path.before = dr.select(turns, mi.Interaction3f(place), path.before)
    path.before_pdf = dr.select(turns, density, path.before_pdf)
    path.spread(density, turns)
    path.before_delta &= ~turns
    path.before_alone = dr.select(turns, 0, path.before_alone)
    path.before_both |= turns
    path.before_kinds = dr.select(turns, int(Rays.VOLUME), path.before_kinds)
    path.before_shape = dr.select(turns, receiver(path), path.before_shape)
    onward = mi.Ray3f(path.ray)
    onward.o, onward.d, onward.maxt = place.p, way, dr.largest(mi.Float)
    path.ray = dr.select(turns, onward, path.ray)
    return turns


def toward(
    media: Media, hits: tuple[Any, Any, Any], ways: tuple[Any, Any], fog: tuple[Any, Any], active: Any
) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Phase function and its density toward a light, and the medium (and the one around it) at the start of the ray.

    ``hits``: interaction, number of its shape, path; ``ways``: directions of the path and to the light; ``fog``: True
    if the path scatters in media here, and these.
    """
    import drjit as dr

    si, shape, path = hits
    floats, parts = fog
    phase = media.phase(parts, dr.dot(*ways), active & floats)
    return phase, media.crossed((path.medium, path.outer), shape, si, ways, active & ~floats)
