# SPDX-License-Identifier: GPL-3.0-or-later
"""Subsurface scattering: a random walk inside the object, from the point of entry to the point of exit.

Chiang, Kutz and Burley 2016, "Practical and controllable subsurface scattering for production path tracing"; the
single-scattering albedo from the visible color by d'Eon, "A Hitchhiker's Guide to Multiple Scattering", Eq. 53.7.
"""

from __future__ import annotations

from typing import Any

MOST_STEPS = 256
START = 1e-6
"""Depth below the surface at which a walk starts, over the size of its coordinates."""
LEAST_ALBEDO = 0.2
"""Least albedo of a walk; for darker media the result is dimmed."""
SCALE = 0.25 / 3.14159265358979
"""Mean free path over Blender's radius, so that the walk resembles Blender's older models."""
PEAKS_NM = (610.0, 550.0, 465.0)
"""Wavelengths of the radii of red, green and blue; in between, the radii are interpolated."""


def per_wavelength(mi: Any, dr: Any, rgb: Any, wavelengths: Any) -> Any:
    """Three radii as one per channel of the transport."""
    if not mi.is_spectral:
        return mi.Color3f(rgb)
    red, green, blue = PEAKS_NM
    to_red = dr.clip((wavelengths - green) / (red - green), 0.0, 1.0)
    to_blue = dr.clip((green - wavelengths) / (green - blue), 0.0, 1.0)
    return rgb.y + (rgb.x - rgb.y) * to_red + (rgb.z - rgb.y) * to_blue


def walk(mi: Any, dr: Any, scene: Any, tables: Any, start: Any, sampler: Any) -> tuple[Any, Any, Any, Any]:
    """Follow light from ``start`` (hit, its number, drawn sample, seen color, active).

    Returns the ray that hits the surface from inside at the exit, the factor on the throughput, True if the light
    leaves at all, and the sampler.
    """
    si, own, bs, color, active = start
    toward = mi.Vector3f(si.dn_du)
    outward = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, toward)))
    smooth = mi.Vector3f(dr.mulsign(si.sh_frame.n, dr.dot(si.sh_frame.n, outward)))
    direction = mi.Frame3f(-smooth).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
    enters = mi.Bool(active) & (dr.dot(direction, outward) < 0.0)

    # The closure passes its parameters in fields of the sample that a walk does not use otherwise.
    g = bs.eta
    radius = dr.maximum(per_wavelength(mi, dr, bs.wo, si.wavelengths) * SCALE, 1e-9)
    seen = dr.clip(color, 0.0, 0.9999)
    # d'Eon's fit, inverted: the single-scattering albedo whose multiple scattering shows the wanted color.
    root = dr.safe_sqrt(9.59217 + 41.6808 * seen + 17.7126 * seen * seen)
    square = dr.square(4.20863 * seen - root + 4.09712)
    albedo = dr.clip((1.0 - square) / (1.0 - g * square), 0.0, 0.999999)
    extinction = dr.rcp(radius)
    # Walks in dark media end almost at once, and their color would be noise: a brighter walk is dimmed instead.
    dimmed = dr.minimum(albedo / LEAST_ALBEDO, 1.0)
    albedo = dr.maximum(albedo, LEAST_ALBEDO)
    factor = mi.Spectrum(bs.pdf) * dimmed
    channels = dr.size_v(mi.Spectrum)

    def body(ray: Any, factor: Any, steps: Any, walking: Any, left: Any, sampler: Any) -> tuple[Any, ...]:
        # One channel draws the distance, chosen by its throughput; all channels are weighted against the mixture.
        share = dr.abs(factor * albedo)
        share = dr.select(dr.sum(share) > 0.0, share / dr.maximum(dr.sum(share), 1e-30), 1.0 / channels)
        pick, place = sampler.next_1d(), sampler.next_1d()
        chosen, below = extinction[0], share[0]
        for k in range(1, channels):
            chosen = dr.select(pick >= below, extinction[k], chosen)
            below = below + share[k]
        ray.maxt = -dr.log(1.0 - place) / chosen
        hit = scene.ray_intersect_preliminary(ray, coherent=False, active=walking)
        met = walking & hit.is_valid()
        ends = met & (tables.shape_number(hit) == own)
        length = dr.select(met, hit.t, ray.maxt)
        clear = dr.exp(-extinction * length)
        collides = dr.select(met, mi.Spectrum(1.0), extinction)
        # The density of this very step under the mixture of channels (one-sample balance heuristic).
        density = dr.sum(share * collides * clear)
        scattered = dr.select(met, mi.Spectrum(1.0), extinction * albedo)
        gained = dr.select(density > 0.0, scattered * clear / dr.maximum(density, 1e-30), 0.0)
        factor = dr.select(walking, factor * gained, factor)
        onward = walking & ~ends
        turned = mi.Frame3f(ray.d).to_world(scattering(mi, dr, g, sampler.next_2d()))
        # other objects inside this one are ignored by its walk
        step = dr.select(met, length * (1.0 + 1e-4) + 1e-6, length)
        ray.o = dr.select(onward, ray.o + ray.d * step, ray.o)
        ray.d = dr.select(onward & ~met, turned, ray.d)
        # A walk with a throughput below a millionth adds nothing visible.
        alive = onward & (steps < MOST_STEPS) & (dr.max(factor) > 1e-6)
        return ray, factor, steps + 1, alive, left | ends, sampler

    first = mi.Ray3f(si.spawn_ray(direction))
    # nearer to the surface than other rays start, because paths may be shorter than that offset
    first.o = si.p - outward * ((1.0 + dr.max(dr.abs(si.p))) * START)
    state = (first, factor, mi.UInt32(0), enters, mi.Bool(False), sampler)
    labels = ("ray", "factor", "steps", "walking", "left", "sampler")
    ray, factor, _, _, left, sampler = dr.while_loop(state, lambda r, f, s, walking, e, m: walking, body, labels=labels)
    # The walk's last distance must not limit the ray that continues from here.
    ray.maxt = dr.largest(mi.Float)
    return ray, factor, left, sampler


def leaving(mi: Any, dr: Any, si: Any, along: Any, sample: Any) -> tuple[Any, Any]:
    """Diffuse emission from a surface, on the side of ``along``: a BSDF's sample and a direction."""
    bs = dr.zeros(mi.BSDFSample3f)
    local = mi.warp.square_to_cosine_hemisphere(sample)
    outward = mi.Frame3f(_out(mi, dr, si, along)).to_world(local)
    bs.wo, bs.eta = si.to_local(outward), mi.Float(1.0)
    bs.pdf = dr.select(cosine_out(mi, dr, si, along, outward) > 0.0, local.z / dr.pi, 0.0)
    bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
    return bs, outward


def cosine_out(mi: Any, dr: Any, si: Any, along: Any, direction: Any) -> Any:
    """Cosine of a direction to the side of a surface that ``along`` points to; 0 for one to the other side."""
    same_side = dr.dot(si.n, along) * dr.dot(si.n, direction) > 0.0
    return dr.select(same_side, dr.maximum(dr.dot(_out(mi, dr, si, along), direction), 0.0), 0.0)


def _out(mi: Any, dr: Any, si: Any, along: Any) -> Any:
    """The shading normal on the side that ``along`` points to."""
    geometric = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, along)))
    return mi.Vector3f(dr.mulsign(si.sh_frame.n, dr.dot(si.sh_frame.n, geometric)))


def scattering(mi: Any, dr: Any, g: Any, sample: Any) -> Any:
    """Direction about +z by Henyey and Greenstein."""
    square = dr.square((1.0 - g * g) / (1.0 - g + 2.0 * g * sample.x))
    cosine = dr.select(
        dr.abs(g) < 1e-3, 1.0 - 2.0 * sample.x, (1.0 + g * g - square) / (2.0 * dr.select(g == 0.0, 1.0, g))
    )
    sine = dr.safe_sqrt(1.0 - cosine * cosine)
    around_y, around_x = dr.sincos(2.0 * dr.pi * sample.y)
    return mi.Vector3f(sine * around_x, sine * around_y, cosine)
