# SPDX-License-Identifier: GPL-3.0-or-later
"""Random walk below the surface, from the point of entry to the point of exit.

Chiang, Kutz and Burley 2016, "Practical and controllable subsurface scattering for production path tracing".
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.subsurface import NO_RADIUS, Entry
from spectral_core.render.trace.below.medium import medium_of

MOST_STEPS = 256
START = 1e-6
"""Depth below the surface at which a walk starts, over the size of its coordinates."""
ALIKE_AFTER = 9
"""Steps of a walk with the given anisotropy; the rest scatters evenly in a medium that diffuses light alike (Cycles).
"""


def outward_normals(mi: Any, dr: Any, si: Any) -> tuple[Any, Any]:
    """Geometric and shading normal on the viewer's side."""
    toward = mi.Vector3f(si.dn_du)
    outward = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, toward)))
    return outward, mi.Vector3f(dr.mulsign(si.sh_frame.n, dr.dot(si.sh_frame.n, outward)))


def start_below(dr: Any, si: Any, outward: Any) -> Any:
    """A point below the surface, nearer to it than other rays start: paths may be shorter than that offset."""
    return si.p - outward * ((1.0 + dr.max(dr.abs(si.p))) * START)


def entered(mi: Any, dr: Any, entry: Entry, normal: Any, toward: Any, sample: Any) -> tuple[Any, Any]:
    """Direction below the surface, and True if light enters.

    As in Cycles, the facets refract all light; half of what enters skin is diffuse instead.
    """
    even = entry.is_skin & (sample.x < 0.5)
    x = dr.select(entry.is_skin, 2.0 * sample.x - dr.select(even, 0.0, 1.0), sample.x)
    place = mi.Point2f(dr.clip(x, 0.0, 1.0 - 1e-6), sample.y)
    frame = mi.Frame3f(normal)
    local = frame.to_local(toward)
    alpha = dr.maximum(entry.alpha, 1e-4)
    facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, alpha, sample_visible=True)
    half, _ = facets.sample(local, place)
    cosine, inverse = dr.dot(half, local), dr.rcp(entry.ior)
    bent = dr.safe_sqrt(1.0 - inverse * inverse * (1.0 - cosine * cosine))
    refracted = (inverse * cosine - bent) * half - inverse * local
    inward = dr.select(even, -mi.warp.square_to_cosine_hemisphere(place), refracted)
    return frame.to_world(inward), even | (local.z > 0.0)


def walk(mi: Any, dr: Any, scene: Any, tables: Any, start: Any, sampler: Any) -> tuple[Any, Any, Any, Any]:
    """Follow light from ``start`` (hit, its number, entry, radii per channel, seen color, factor, active).

    Returns the ray that hits the surface from inside at the exit, the factor on the throughput, True if the light
    leaves at all, and the sampler.
    """
    si, own, entry, radius, color, above, active = start
    outward, smooth = outward_normals(mi, dr, si)
    direction, enters = entered(mi, dr, entry, smooth, mi.Vector3f(si.dn_du), sampler.next_2d())
    enters &= active & (dr.dot(direction, outward) < 0.0)

    seen = dr.clip(color, 0.0, 1.0)
    extinction, albedo, dimmed = medium_of(dr, entry, seen, radius)
    here, factor = here_or_below(dr, (above * color, above * dimmed), radius > NO_RADIUS, sampler.next_1d())
    here, enters = here & active, enters & ~here
    # of the same reduced scattering, for the later steps
    reduced = extinction * (1.0 - albedo * entry.anisotropy)
    reduced_albedo = albedo * (1.0 - entry.anisotropy) / dr.maximum(1.0 - albedo * entry.anisotropy, 1e-9)

    def body(ray: Any, factor: Any, steps: Any, walking: Any, left: Any, sampler: Any) -> tuple[Any, ...]:
        late = steps > ALIKE_AFTER
        thick, bright = dr.select(late, reduced, extinction), dr.select(late, reduced_albedo, albedo)
        # One channel draws the distance, chosen by its throughput; all channels are weighted against the mixture.
        share = dr.abs(factor * bright)
        total = dr.sum(share)
        share = dr.select(total > 0.0, share / dr.maximum(total, 1e-30), 1.0 / dr.size_v(mi.Spectrum))
        ray.maxt = -dr.log(1.0 - sampler.next_1d()) / of_channel(dr, thick, share, sampler.next_1d())
        hit = scene.ray_intersect_preliminary(ray, coherent=False, active=walking)
        met = walking & hit.is_valid()
        ends = met & (tables.shape_number(hit) == own)
        length = dr.select(met, hit.t, ray.maxt)
        clear = dr.exp(-thick * length)
        # The density of this very step under the mixture of channels (one-sample balance heuristic).
        density = dr.sum(share * dr.select(met, mi.Spectrum(1.0), thick) * clear)
        scattered = dr.select(met, mi.Spectrum(1.0), thick * bright)
        gained = dr.select(density > 0.0, scattered * clear / dr.maximum(density, 1e-30), 0.0)
        factor = mi.Spectrum(dr.select(walking, factor * gained, factor))
        onward = walking & ~ends
        g = dr.select(steps >= ALIKE_AFTER, 0.0, entry.anisotropy)
        turned = mi.Frame3f(ray.d).to_world(scattering(mi, dr, g, sampler.next_2d()))
        # other objects inside this one are ignored by its walk
        step = dr.select(met, length * (1.0 + 1e-4) + 1e-6, length)
        ray.o = dr.select(onward, ray.o + ray.d * step, ray.o)
        ray.d = dr.select(onward & ~met, turned, ray.d)
        # A walk with a throughput below a millionth adds nothing visible.
        alive = onward & (steps < MOST_STEPS) & (dr.max(factor) > 1e-6)
        return ray, factor, steps + 1, alive, left | ends, sampler

    first = mi.Ray3f(si.spawn_ray(dr.select(here, outward, direction)))
    first.o = start_below(dr, si, outward)
    state = (first, mi.Spectrum(factor), mi.UInt32(0), enters, mi.Bool(False), sampler)
    labels = ("ray", "factor", "steps", "walking", "left", "sampler")
    ray, factor, _, _, left, sampler = dr.while_loop(state, lambda r, f, s, walking, e, m: walking, body, labels=labels)
    # The walk's last distance must not limit the ray that continues from here.
    ray.maxt = dr.largest(mi.Float)
    return ray, factor, left | here, sampler


def here_or_below(dr: Any, values: tuple[Any, Any], below: Any, pick: Any) -> tuple[Any, Any]:
    """Channels without a radius leave where they entered: True if these are drawn, and the factor on the throughput.

    ``values``: the factors of light that leaves here, and of light that goes ``below``.
    """
    shown = dr.abs(values[0])
    chance = dr.sum(dr.select(below, 0.0, shown)) / dr.maximum(dr.sum(shown), 1e-30)
    here = pick < chance
    inverse = dr.rcp(dr.maximum(dr.select(here, chance, 1.0 - chance), 1e-6))
    return here, dr.select(here, dr.select(below, 0.0, values[0]), dr.select(below, values[1], 0.0)) * inverse


def of_channel(dr: Any, values: Any, share: Any, pick: Any) -> Any:
    """The value of the channel that a number in [0, 1) draws by the shares."""
    chosen, below = values[0], share[0]
    for k in range(1, len(values)):
        chosen = dr.select(pick >= below, values[k], chosen)
        below = below + share[k]
    return chosen


def scattering(mi: Any, dr: Any, g: Any, sample: Any) -> Any:
    """Direction about +z by Henyey and Greenstein."""
    square = dr.square((1.0 - g * g) / (1.0 - g + 2.0 * g * sample.x))
    cosine = dr.select(
        dr.abs(g) < 1e-3, 1.0 - 2.0 * sample.x, (1.0 + g * g - square) / (2.0 * dr.select(g == 0.0, 1.0, g))
    )
    sine = dr.safe_sqrt(1.0 - cosine * cosine)
    around_y, around_x = dr.sincos(2.0 * dr.pi * sample.y)
    return mi.Vector3f(sine * around_x, sine * around_y, cosine)
