# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions drawn by tracing a ray through a strand of Huang's model."""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.render.plugins.closures.strands.pierced import Strand
from spectral_core.render.plugins.closures.strands.section import inside, mirrored
from spectral_core.render.plugins.numbers import channel_mean


def traced(at: Strand, seed: Any, place: Any) -> tuple[Any, Any]:
    """A local direction of one of four kinds of light, and its weight; ``place``: across the strand, in [0, 1)."""
    mi, dr, section, wi, alpha = at.mi, at.dr, at.section, at.wi, at.alpha
    draws = [mi.sample_tea_float32(seed, mi.UInt32(n), 4) for n in range(10)]
    inverse = dr.rcp(at.eta)
    gamma = section.angle_at(2.0 * place - 1.0)
    meso, macro = section.normal(at.tilt, gamma), section.normal(0.0, gamma)
    cos_i = dr.dot(wi, meso)
    facet = section.drawn(alpha, wi, meso, draws[0], draws[1])
    met = (cos_i >= 0.0) & (dr.dot(macro, wi) >= 0.0) & section.sees(wi, macro, facet)

    # reflected
    way_r = mirrored(dr, wi, facet)
    wt, passed, _ = inside(mi, dr, wi, facet, at.eta)
    outer = at.scale(cos_i, outside=True)
    lit = at.shares[0] * (1.0 - passed) * outer * section.masked_after(alpha, cos_i, dr.dot(meso, way_r))
    found_r = mi.Spectrum(dr.select(met & section.sees(way_r, macro, facet), lit, 0.0))

    # transmitted
    angle_t = dr.atan2(wt.x, wt.z)
    next_gamma = 2.0 * section.turned(angle_t) - gamma
    next_meso, next_macro = section.normal(-at.tilt, next_gamma), section.normal(0.0, next_gamma)
    next_facet = section.drawn(alpha, -wt, next_meso, draws[2], draws[3])
    cos_next = dr.dot(-wt, next_meso)
    enters = met & (cos_next > 0.0) & section.sees(-wt, macro, facet) & section.sees(-wt, next_macro, next_facet)
    along = dr.rcp(dr.maximum(dr.safe_sqrt(1.0 - dr.square(wt.y)), 1e-4))
    clear = dr.exp(-at.absorption * along * section.chord(gamma, next_gamma + pi))
    way_t, leaves, _ = inside(mi, dr, -wt, next_facet, inverse)
    enter = passed * outer * section.masked_after(alpha, cos_i, dr.dot(meso, -wt)) * at.scale(cos_next, outside=False)
    fits = enters & (leaves > 0.0) & section.sees(-way_t, next_meso, next_facet)
    fits &= section.sees(-way_t, next_macro, next_facet)
    lit = at.shares[1] * enter * leaves * section.masked_after(alpha, cos_next, dr.dot(next_meso, -way_t))
    found_t = dr.select(fits, lit, 0.0) * clear

    # reflected inside
    wr = mirrored(dr, wt, next_facet)
    last_gamma = gamma - 2.0 * (section.turned(angle_t) - section.turned(dr.atan2(wr.x, wr.z))) + pi
    last_meso, last_macro = section.normal(-at.tilt, last_gamma), section.normal(0.0, last_gamma)
    last_facet = section.drawn(alpha, wr, last_meso, draws[4], draws[5])
    cos_last = dr.dot(last_meso, wr)
    turns = enters & (cos_last > 0.0)
    along = dr.rcp(dr.maximum(dr.safe_sqrt(1.0 - dr.square(wr.y)), 1e-4))
    clear_again = dr.exp(-at.absorption * along * section.chord(last_gamma, next_gamma))
    turned = enter * (1.0 - leaves) * at.scale(cos_last, outside=False)
    turned *= section.masked_after(alpha, cos_next, dr.dot(next_meso, -wr))
    way_b, last, _ = inside(mi, dr, wr, last_facet, inverse)
    fits = (
        turns & (last > 0.0) & section.sees(wr, last_macro, last_facet) & section.sees(-way_b, last_macro, last_facet)
    )
    lit = at.shares[2] * turned * last * section.masked_after(alpha, cos_last, dr.dot(last_meso, -way_b))
    found_b = dr.select(fits, lit, 0.0) * (clear * clear_again)

    # and more often
    sine, cosine = wi.y, dr.safe_sqrt(1.0 - dr.square(wi.y))
    u = dr.maximum(draws[6], 1e-5)
    away = dr.clip(1.0 + 4.0 * alpha * dr.log(u + (1.0 - u) * dr.exp(-0.5 / alpha)), -1.0, 1.0)
    up = dr.clip(-away * sine + dr.safe_sqrt(1.0 - away * away) * dr.cos(2 * pi * draws[7]) * cosine, -1.0, 1.0)
    level, (turn_x, turn_z) = dr.safe_sqrt(1.0 - up * up), dr.sincos(2 * pi * draws[8])
    way_m = mi.Vector3f(turn_x * level, up, turn_z * level)
    both, leaving = dr.sqrt(clear * clear_again), dr.maximum(0.5 * (leaves + last), 1e-5)
    lit = turned * (1.0 - last) * section.masked_after(alpha, cos_last, dr.dot(last_meso, mirrored(dr, wr, last_facet)))
    found_m = dr.select(turns, lit, 0.0) * (clear * clear_again) * (both * leaving / (1.0 - both * (1.0 - leaving)))

    found = [mi.Spectrum(part) for part in (found_r, found_t, found_b, found_m)]
    energies = [dr.select(dr.isfinite(channel_mean(dr, part)), channel_mean(dr, part), 0.0) for part in found]
    total = energies[0] + energies[1] + energies[2] + energies[3]
    mark, below = draws[9] * total, mi.Float(0.0)
    way, weight = mi.Vector3f(way_m), found[3] / dr.maximum(energies[3], 1e-20)
    chosen = mi.Bool(False)
    for place_of, part, energy in zip((way_r, way_t, way_b), found, energies, strict=False):
        mine = ~chosen & (mark < below + energy)
        way = dr.select(mine, place_of, way)
        weight = dr.select(mine, part / dr.maximum(energy, 1e-20), weight)
        chosen, below = chosen | mine, below + energy
    return dr.normalize(way), dr.select(total > 0.0, weight * total, 0.0)
