# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of a path in media: free flight to the next surface, scattering, and direct light there."""

from __future__ import annotations

from typing import Any

from spectral_core.render.trace.media import Flight, Media
from spectral_core.scene import Rays


def fly(media: Media, of: tuple[Any, Any], sampler: Any, active: Any) -> tuple[Flight, Any]:
    """Flight of a path (``of``: the next hit, the path), and the point for direct light."""
    import drjit as dr
    import mitsuba as mi

    si, path = of
    flight = media.fly(path, dr.select(si.is_valid(), si.t, dr.inf), sampler, active)
    place = mi.SurfaceInteraction3f(si)
    place.p = dr.select(flight.scatters, path.ray.o + path.ray.d * flight.distance, si.p)
    # A point in a medium has no normal: lights are chosen by distance alone, not by a cosine.
    place.n = dr.select(flight.scatters, mi.Normal3f(0.0), si.n)
    place.t = dr.select(flight.scatters, flight.distance, si.t)
    return flight, place


def scatter(media: Media, of: tuple[Any, Any], draws: tuple[Any, Any], floats: Any, limits: tuple[Any, Any]) -> Any:
    """Change the direction of paths (``of``: point, path) that scatter in a medium; returns those that continue.

    ``draws``: one random number and two; ``limits``: bounces in media, and in all.
    """
    import drjit as dr
    import mitsuba as mi

    place, path = of
    turns = floats & ~path.last
    way, density, factor = media.turned(path.medium, path.ray.d, draws, turns)
    path.throughput = dr.select(turns, path.throughput * factor, path.throughput)
    path.depth = dr.select(turns, path.depth + 1, path.depth)
    path.volume = dr.select(turns, path.volume + 1, path.volume)
    path.last |= turns & ((path.volume > limits[0]) | (path.depth > limits[1]))
    path.kind = dr.select(turns, int(Rays.VOLUME), path.kind)
    # A light that the ray hits next could have been sampled here; its weight needs the point and the density.
    path.before = dr.select(turns, mi.Interaction3f(place), path.before)
    path.before_pdf = dr.select(turns, density, path.before_pdf)
    path.before_delta &= ~turns
    path.before_both |= turns
    # Shape 0: light linking is defined for surfaces only.
    path.before_shape = dr.select(turns, 0, path.before_shape)
    onward = mi.Ray3f(path.ray)
    onward.o, onward.d, onward.maxt = place.p, way, dr.largest(mi.Float)
    path.ray = dr.select(turns, onward, path.ray)
    return turns


def toward(
    media: Media, hits: tuple[Any, Any, Any], ways: tuple[Any, Any], fog: tuple[Any, Any], active: Any
) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Phase function and its density toward a light, and the medium (and the one around it) at the start of the ray.

    ``hits``: interaction, number of its shape, path; ``ways``: directions of the path and to the light; ``fog``: True
    if the path scatters in a medium here, and the medium.
    """
    import drjit as dr

    si, shape, path = hits
    floats, medium = fog
    phase = media.phase(medium, dr.dot(*ways), active & floats)
    return phase, media.crossed((path.medium, path.outer), shape, si, ways, active & ~floats)
