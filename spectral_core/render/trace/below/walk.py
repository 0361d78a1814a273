# SPDX-License-Identifier: GPL-3.0-or-later
"""Random walk below the surface, from the point of entry to the point of exit.

Chiang, Kutz and Burley 2016, "Practical and controllable subsurface scattering for production path tracing".
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.subsurface import NO_RADIUS, Entry
from spectral_core.render.trace.below.guide import Guide
from spectral_core.render.trace.below.medium import medium_of
from spectral_core.render.trace.below.numbers import Numbers

MOST_STEPS = 256
START = 1e-6
"""Depth below the surface at which a walk starts, over the size of its coordinates."""
LEAST_PATH = 16.0
"""Least mean free path over that depth. Of shorter ones a part of the light would leave without having entered."""
LEAST_SHARE = 0.05
"""Share of its first throughput below which a walk may end by Russian roulette."""
DRAWS = 5
"""Random numbers of a step."""
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
    """Follow light from ``start`` (hit, its number, entry, radii per channel, seen color, factor,
    throughput of the path so far, active).

    Returns the ray that hits the surface from inside at the exit, the factor on the throughput, True if the light
    leaves at all, and the sampler.
    """
    si, own, entry, radius, color, above, carried, active = start
    outward, smooth = outward_normals(mi, dr, si)
    direction, enters = entered(mi, dr, entry, smooth, mi.Vector3f(si.dn_du), sampler.next_2d())
    enters &= active & (dr.dot(direction, outward) < 0.0)

    seen = dr.clip(color, 0.0, 1.0)
    extinction, albedo, dimmed = medium_of(dr, entry, seen, radius)
    least = LEAST_PATH * START * (1.0 + dr.max(dr.abs(si.p)))
    extinction = dr.minimum(extinction, dr.rcp(least * (1.0 - entry.anisotropy)))
    here, factor = here_or_below(dr, (above * color, above * dimmed), radius > NO_RADIUS, sampler.next_1d())
    here, enters = here & active, enters & ~here
    # of the same reduced scattering, for the later steps
    reduced = extinction * (1.0 - albedo * entry.anisotropy)
    reduced_albedo = albedo * (1.0 - entry.anisotropy) / dr.maximum(1.0 - albedo * entry.anisotropy, 1e-9)

    first = mi.Ray3f(si.spawn_ray(dr.select(here, outward, direction)))
    first.o = start_below(dr, si, outward)
    guide = Guide.of(mi, dr, (first.o, smooth), (extinction, albedo), entry.anisotropy)
    # numbers of the first step are stratified; over the many others that would change nothing
    begin, numbers = sampler.next_2d(), Numbers.of(mi, sampler.next_2d())
    faint = dr.maximum(LEAST_SHARE * dr.max(factor), 1e-6)
    # One channel draws all distances, and all channels are weighted against the mixture (balance heuristic). It is
    # chosen once, by a stratified number: radii that differ make a walk useful for one channel alone.
    shares = shares_of(dr, mi.Spectrum(factor * carried))
    drawn = lambda values: of_channel(dr, values, shares, begin.x)  # noqa: E731
    thin = drawn(extinction), drawn(reduced)
    guide.follow(drawn)

    def body(
        ray: Any, factor: Any, share: Any, steps: Any, behind: Any, straight: Any, walking: Any, left: Any
    ) -> tuple[Any, ...]:
        late = steps > ALIKE_AFTER
        thick, bright = dr.select(late, reduced, extinction), dr.select(late, reduced_albedo, albedo)
        draw = [numbers.number(steps * DRAWS + k) for k in range(DRAWS)]
        turn = guide.turned((ray, behind), dr.select(late, 0.0, entry.anisotropy), late, draw[:3])
        ray.d = dr.select(walking & ~straight, turn.direction, ray.d)
        is_first = steps == 0
        steep = dr.select(late, thin[1], thin[0]) * dr.select(straight, 1.0, turn.stretch)
        length = -dr.log(1.0 - dr.select(is_first, begin.y, draw[3])) / steep
        # the first ray looks farther, for an opposite side by which light may leave
        ray.maxt = dr.select(is_first, dr.maximum(length, guide.reach), length)
        hit = scene.ray_intersect_preliminary(ray, coherent=False, active=walking)
        met = walking & hit.is_valid()
        wall = met & (tables.shape_number(hit) == own)
        behind = dr.select(is_first & wall, guide.depth(ray.o + ray.d * hit.t), behind)
        met &= hit.t < length
        ends = met & wall
        length = dr.select(met, hit.t, length)
        clear = dr.exp(-thick * length)
        # the density of this very step under the mixture, and each channel's share of it
        likely = share * turn.density((thick, clear), length, met, straight)
        inverse = dr.rcp(dr.maximum(dr.sum(likely), 1e-30))
        scattered = dr.select(met, mi.Spectrum(1.0), thick * bright)
        factor = mi.Spectrum(dr.select(walking, factor * scattered * clear * inverse, factor))
        share = mi.Spectrum(likely * inverse)
        onward = walking & ~ends
        # other objects inside this one are ignored by its walk
        step = dr.select(met, length * (1.0 + 1e-4) + 1e-6, length)
        ray.o = dr.select(onward, ray.o + ray.d * step, ray.o)
        # a walk that carries little ends by Russian roulette
        survival = dr.minimum(dr.max(factor) / faint, 1.0)
        alive = onward & (steps < MOST_STEPS) & (draw[4] < survival)
        factor = dr.select(alive, factor / dr.maximum(survival, 1e-6), factor)
        return ray, factor, share, steps + 1, behind, met, alive, left | ends

    begun = mi.UInt32(0), mi.Float(dr.inf), mi.Bool(True)
    state = (first, mi.Spectrum(factor), mi.Spectrum(shares), *begun, enters, mi.Bool(False))
    labels = ("ray", "factor", "share", "steps", "behind", "straight", "walking", "left")
    ray, factor, *_, left = dr.while_loop(state, lambda r, f, c, n, b, s, walking, e: walking, body, labels=labels)
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


def shares_of(dr: Any, light: Any) -> Any:
    """Probability of each channel: its part of the light. A path that has walked before carries mostly one channel; to
    draw all alike would make one in three walks useful, and one in 3ⁿ paths over n of them.
    """
    sizes = dr.abs(light)
    return sizes / dr.maximum(dr.sum(sizes), 1e-30)


def of_channel(dr: Any, values: Any, share: Any, pick: Any) -> Any:
    """The value of the channel that a number in [0, 1) draws by the shares."""
    chosen, below = values[0], share[0]
    for k in range(1, len(values)):
        chosen = dr.select(pick >= below, values[k], chosen)
        below = below + share[k]
    return chosen
