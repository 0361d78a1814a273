# SPDX-License-Identifier: GPL-3.0-or-later
"""Free flight of rays in media to the next surface, and what is left of a shadow ray.

Media that overlap add up. Distances are drawn by scattering alone, and absorption is a factor along the ray, so that
nothing is lost in a medium that only absorbs. A distance is weighted by its density over all wavelengths (Wilkie et al.
2014, "Hero wavelength spectral sampling").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.trace.media import tracking
from spectral_core.render.trace.media.grids import Way
from spectral_core.render.trace.media.table import FARTHEST, Media, Part


@dataclass(slots=True, eq=False)
class Flight:
    """Rays on their way to the next surface: True if they scatter before it, the distance, the factor on their light,
    and the emission along the whole way.

    ``carried``: throughput before the flight; ``reach``: length of the segment; ``share``: probability of each
    wavelength to draw the distance; ``scattering`` and ``extinction`` coefficients; ``inside``: True in a medium;
    ``ends``: True if the segment ends at a surface, which samples lights itself; ``varies``: True in a medium that
    varies, where lights are sampled from the scattering point alone; ``parts``: the media there.
    """

    scatters: Any
    distance: Any
    weight: Any
    emission: Any
    carried: Any
    reach: Any
    share: Any
    scattering: Any
    extinction: Any
    inside: Any
    parts: list[Part]
    ends: Any = True
    varies: Any = False


def fly(media: Media, path: Any, reach: Any, sampler: Any, active: Any) -> Flight:
    """Flight of a path's ray to its hit at a distance ``reach``."""
    import drjit as dr
    import mitsuba as mi

    numbers = media.present((path.medium, path.outer))
    inside = active & (path.medium != 0)
    reach = dr.minimum(reach, FARTHEST)
    of_media = [media.coefficients(number, path.ray.wavelengths, inside) for number in numbers]
    varying = [inside & media.varies(number, inside) for number in numbers]
    scatters, absorbs, emission = _even(of_media, varying)
    # A wavelength is chosen by its remaining contribution: the brightest one draws the distance most often.
    share = dr.abs(path.throughput * scatters)
    total = dr.sum(share)
    channels = dr.size_v(mi.Spectrum)
    share = dr.select(total > 0.0, share / dr.maximum(total, 1e-30), 1.0 / channels)
    pick, place = sampler.next_1d(), sampler.next_1d()
    chosen, below = scatters[0], share[0]
    for k in range(1, channels):
        chosen = dr.select(pick >= below, scatters[k], chosen)
        below = below + share[k]
    # A wavelength that does not scatter never collides; its distance is beyond everything.
    drawn = dr.select(chosen > 0.0, -dr.log(1.0 - place) / dr.maximum(chosen, 1e-30), FARTHEST)
    collides = inside & (drawn < reach)
    distance = dr.minimum(drawn, reach)
    event = dr.select(collides, scatters, mi.Spectrum(1.0))
    # Balance heuristic over wavelengths: the density with which any of them would have drawn this event.
    density = dr.sum(share * event * dr.exp(-scatters * distance))
    extinction = scatters + absorbs
    gained = event * dr.exp(-extinction * distance) / dr.maximum(density, 1e-30)
    weight = dr.select(inside, dr.select(density > 0.0, gained, 0.0), 1.0)
    brought = mi.Spectrum(0.0)
    if media.emits:
        # Emission is integrated along the whole way, scattered or not, so it adds no noise.
        depth = extinction * reach
        # (1 - exp(-x)) / x, by its series if that cancels
        mean = dr.select(depth > 1e-3, (1.0 - dr.exp(-depth)) / dr.maximum(depth, 1e-9), 1.0 - 0.5 * depth)
        brought = dr.select(inside, emission * reach * mean, 0.0)
    parts = [Part(number, each[0]) for number, each in zip(numbers, of_media, strict=True)]
    carried = mi.Spectrum(path.throughput)
    flight = Flight(collides, distance, weight, brought, carried, reach, share, scatters, extinction, inside, parts)
    flight.varies = mi.Bool(False)
    if media.grids is not None:
        _track(media, flight, path, (of_media, varying), tracking.seed_of(pick, place))
    return flight


def clear(media: Media, of: tuple[Any, Any], length: Any, ray: Any, active: Any, is_shadow: Any = False) -> Any:
    """Transmittance of a ray through the media ``of`` its origin (the innermost, the one around that), up to a
    distance; estimated where they vary. ``is_shadow``: True for shadow rays.
    """
    import drjit as dr
    import mitsuba as mi

    numbers = media.present(of, is_shadow)
    length = dr.minimum(length, FARTHEST)
    active = active & (of[0] != 0)
    of_media = [media.coefficients(number, ray.wavelengths, active) for number in numbers]
    varying = [active & media.varies(number, active) for number in numbers]
    scatters, absorbs, _ = _even(of_media, varying)
    passes = mi.Spectrum(dr.exp(-(scatters + absorbs) * length))
    if media.grids is not None:
        tints = media.tints(ray.wavelengths, active)
        # Transmittances of media that overlap are factors of each other, and independent estimates may be multiplied.
        for k, (number, on) in enumerate(zip(numbers, varying, strict=True)):
            way = _way(media, number, ray, tints, on)
            tracked = tracking.transmittance(media.grids, way, length, of_media[k][:2], k, on)
            passes *= dr.select(on, tracked, 1.0)
    return dr.select(active, passes, 1.0)


def _even(of_media: list[tuple[Any, Any, Any]], varying: list[Any]) -> tuple[Any, ...]:
    """Sums of scattering, absorption and emission of the media that do not vary."""
    import drjit as dr
    import mitsuba as mi

    sums = [mi.Spectrum(0.0)] * 3
    for found, on in zip(of_media, varying, strict=True):
        sums = [total + dr.select(on, 0.0, one) for total, one in zip(sums, found, strict=True)]
    return tuple(sums)


def _way(media: Media, number: Any, ray: Any, tints: Any, on: Any) -> Way:
    """The way of a ray through a grid; other rays do not meet it."""
    import drjit as dr

    assert media.grids is not None
    way = media.grids.way(number, ray, on)
    # an empty range: the medium of another slot may vary where this one does not
    way.first, way.last = dr.select(on, way.first, dr.inf), dr.select(on, way.last, -dr.inf)
    way.tints = tints
    return way


def _track(media: Media, flight: Flight, path: Any, of: tuple[list[Any], list[Any]], seed: Any) -> None:
    """Fly through media that vary; ``of``: coefficients of the media here, and which of them vary."""
    import drjit as dr
    import mitsuba as mi

    of_media, varying = of
    assert media.grids is not None
    varies = mi.Bool(False)
    for on in varying:
        varies |= on
    tints = media.tints(path.ray.wavelengths, varies)
    ways = [_way(media, part.medium, path.ray, tints, on) for part, on in zip(flight.parts, varying, strict=True)]
    filled = tracking.Filled(
        media.grids, list(zip(ways, of_media, strict=True)), _even(of_media, varying) if len(ways) > 1 else None
    )
    # the closed forms stay where no medium varies: they have less noise
    found = tracking.fly(filled, flight.reach, path.throughput, seed, varies)
    names = ("scatters", "distance", "weight", "emission")
    for name, value in zip(names, found, strict=True):
        setattr(flight, name, dr.select(varies, value, getattr(flight, name)))
    flight.varies = varies
    if len(ways) > 1:
        # The phase function at the point mixes those of the media by their scattering there.
        there = varies & flight.scatters
        for part, way, on in zip(flight.parts, ways, varying, strict=True):
            by = filled.factors(way, flight.distance, there & on)[0]
            part.scattering = dr.select(there & on, part.scattering * by, part.scattering)
