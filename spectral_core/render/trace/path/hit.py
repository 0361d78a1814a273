# SPDX-License-Identifier: GPL-3.0-or-later
"""The next hit of a path: the light that arrives along the ray, and the direct light there.

The functions are methods of the path integrator; see ``integrator``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.closures.facets import microfacet
from spectral_core.render.plugins.paints.ray_marks import ray_marks
from spectral_core.render.trace.media import in_media


@dataclass(frozen=True, eq=False)
class Hit:
    """Next hit of each path.

    ``si``, ``shape``: the surface, and its number; ``place``: where the path samples a light, on the surface or in a
    medium before it; ``floats``: true if the path scatters in that medium; ``unseen``: true if the ray passes the
    surface as if it were not there; ``leaves``: true if the ray comes from below the surface.
    """

    si: Any
    shape: Any
    place: Any
    floats: Any
    unseen: Any
    leaves: Any


@dataclass(frozen=True, eq=False)
class Surface:
    """What scatters light at a hit.

    ``on``: true if the path scatters on the surface; ``hole``: true on a holdout; ``matt``, ``along``: true if the
    path scatters by the even lobe of a dye, and the side that this lobe is on.
    """

    bsdf: Any
    on: Any
    hole: Any
    matt: Any
    along: Any


def meet(integrator: Any, scene: Any, path: Any, sampler: Any) -> Hit:
    """Follow a ray to the next hit, and add the light that arrives along it to the path."""
    import drjit as dr
    import mitsuba as mi

    tables = integrator.tables
    kind = dr.select(path.leaves, 0, path.kind)
    si = tables.intersect_seen(scene, path.ray, kind, path.active, path.depth == 0)
    shape = tables.shape_number(si)
    from_within = tables.from_within(shape, si, path.ray.d)
    unseen = path.active & si.is_valid() & (tables.passes(shape, path.kind) | from_within)
    path.within -= dr.select(unseen & from_within, dr.minimum(path.within, 1), 0)
    si.dn_du = -path.ray.d  # the viewer's direction for closures, see plugins.closures.facets.upright
    si.dn_dv = ray_marks(mi, dr, path)
    microfacet.blur(si, integrator.filter_glossy, path.least_density)
    si.wi = integrator.upright(si)
    leaves = path.leaves & path.active
    if integrator.sampled is not None:
        # before the light of the hit, which reaches the path through them
        gained = integrator.sampled.cross(integrator, scene, si, path, sampler)
        path.add(integrator.clamped(gained, path.depth > 0), path.diffuse)
    unseen &= ~leaves
    floats, place = mi.Bool(False), si
    if tables.media is not None:
        ends = path.active & si.is_valid() & ~unseen & ~tables.media.is_border(shape, path.active)
        floats, place = integrator.fly(si, path, sampler, path.active & ~leaves)
        integrator.fog = in_media.asks_light(integrator.flight, ends, integrator.lights), integrator.flight.parts
        unseen &= ~floats
    arrived = integrator.arrived(si, path, path.active & ~unseen & ~leaves & ~floats)
    path.add(mi.Spectrum(integrator.clamped(path.throughput * arrived, path.depth > 1)), path.diffuse)
    return Hit(si, shape, place, floats, unseen, leaves)


def gather(integrator: Any, scene: Any, path: Any, sampler: Any, hit: Hit) -> Surface:
    """Find what scatters light at a hit, and add the direct light there to the path."""
    import drjit as dr
    import mitsuba as mi

    tables, si = integrator.tables, hit.si
    on = path.active & si.is_valid() & ~hit.unseen & ~hit.floats
    hole = on & integrator.is_hole(hit.shape, path)
    on &= ~hole
    path.seen |= on | hit.floats
    bsdf = tables.surface(si)
    # as many transparent surfaces as the scene allows, and one more segment behind the last, as in Cycles
    on &= (~integrator.cut_caustic(bsdf, path.kind) | hit.leaves) & (path.passed < dr.maximum(integrator.layers, 1))
    bsdf.compute(si, on | hole)
    matt, along = integrator.even_lobe(si, path, sampler, on & ~path.last)
    hit.place.wavelengths = si.wavelengths  # a dye may have changed them
    asks = on if integrator.fog is None else on | integrator.fog[0]
    lit = (hit.place, bsdf, hit.shape, (matt, along))
    direct = integrator.direct(scene, sampler, lit, path, asks & ~path.last)
    light = integrator.clamped(integrator.carried * direct, path.depth > 0)
    path.add(mi.Spectrum(light), path.diffuse + 1)
    return Surface(bsdf, on, hole, matt, along)
