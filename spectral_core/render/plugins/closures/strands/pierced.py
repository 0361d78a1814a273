# SPDX-License-Identifier: GPL-3.0-or-later
"""Light through a strand of Huang's model in a given direction, by rays at random places across it."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

from spectral_core.render.plugins.closures.strands.proposal import Proposal
from spectral_core.render.plugins.closures.strands.section import Section, inside, mirrored

FEWEST, STEPS, HIGHEST = 6.0, 2.0, 48.0
"""Rays through the strand that estimate a value: the fewest, their number times the roughness, and the most."""


@dataclass
class Strand:
    """A strand of Huang's model at a hit.

    ``axes``: of the cross-section, in the world; ``wi``: direction to the viewer along them; ``is_beside``: True where
    the ray misses the ellipse; ``shares``: factors on the first reflection, the transmission, the second reflection;
    ``proposal``: density of drawn directions; ``tables``: energy of one bounce from outside and from inside.
    """

    mi: Any
    dr: Any
    axes: tuple[Any, Any, Any]
    wi: Any
    section: Section
    is_beside: Any
    alpha: Any
    tilt: Any
    eta: Any
    absorption: Any
    shares: tuple[Any, Any, Any]
    proposal: Proposal
    tables: tuple[Any, Any]
    layered: bool

    def scale(self, cosine: Any, *, outside: bool) -> Any:
        """Factor on one bounce that keeps the energy of facets, as for glass."""
        table, roughness, dr = self.tables[0 if outside else 1], self.dr.sqrt(self.alpha), self.dr
        if not self.layered:
            return dr.rcp(dr.maximum(table(roughness, cosine), 0.05))
        place = dr.sqrt((self.eta - 1.0) / (self.eta + 1.0)) / 0.95
        return dr.rcp(dr.maximum(table.layer(place, roughness, cosine), 0.05))

    def value(self, wo: Any, seed: Any, active: Any) -> Any:
        """Value · cosine of a local direction, by rays at random places across the strand."""
        mi, dr = self.mi, self.dr
        wi, section = self.wi, self.section
        slope = dr.tan(self.tilt)
        cosines = [dr.safe_sqrt(dr.square(w.x) + dr.square(w.z)) for w in (wi, wo)]
        tangents = [w.y / dr.maximum(cosine, 1e-6) for w, cosine in zip((wi, wo), cosines, strict=True)]
        span = dr.maximum(-slope * tangents[0], 0.0)
        valid = active & (slope * tangents[1] >= -1.0) & (span <= 1.0)
        low, high = section.heights(dr.safe_acos(span))
        low, high = (dr.clip(end / section.radius, -0.999, 0.999) for end in (low, high))
        count = dr.clip(dr.ceil(STEPS / self.alpha), FEWEST, HIGHEST)

        def body(k: Any, total: Any) -> tuple[Any, Any]:
            draws = [mi.sample_tea_float32(seed, mi.UInt32(k) * 8 + n, 4) for n in range(7)]
            height = low + (high - low) * (k + draws[0]) / count
            return k + 1.0, total + self.through(wo, height, draws[1:])

        _, total = dr.while_loop((mi.Float(0.0), mi.Spectrum(0.0)), lambda k, _: valid & (k < count), body)
        area = 2.0 * dr.maximum(cosines[0], 1e-6)
        found = total * dr.maximum(high - low, 0.0) / (count * area)
        return dr.select(valid & dr.all(dr.isfinite(found)), found, 0.0)

    def through(self, wo: Any, height: Any, draws: list[Any]) -> Any:
        """Light of a ray that meets the strand at a height: reflected, transmitted, reflected inside once, more."""
        mi, dr = self.mi, self.dr
        section, wi, alpha, eta = self.section, self.wi, self.alpha, self.eta
        inverse = dr.rcp(eta)
        gamma = section.angle_at(height)
        meso, macro = section.normal(self.tilt, gamma), section.normal(0.0, gamma)
        stretch = section.angle_per_height(gamma)
        cos_i = dr.dot(wi, meso)
        outer = self.scale(cos_i, outside=True)

        half = dr.normalize(wi + wo)
        seen = section.sees(wi, macro, half) & section.sees(wo, macro, half)
        lit = section.facets(alpha, dr.dot(meso, half)) * section.masked(alpha, cos_i, dr.dot(meso, wo))
        fresnel = mi.fresnel(dr.dot(wi, half), eta)[0]
        first = 0.25 * self.shares[0] * fresnel * lit * section.arc(gamma) * outer
        total = mi.Spectrum(dr.select(seen, first * stretch, 0.0))

        facet = section.drawn(alpha, wi, meso, draws[0], draws[1])
        entry = inside(mi, dr, wi, facet, eta)
        wt, passed, facing = entry
        angle_t = dr.atan2(wt.x, wt.z)
        next_gamma = 2.0 * section.turned(angle_t) - gamma
        next_meso, next_macro = section.normal(-self.tilt, next_gamma), section.normal(0.0, next_gamma)
        cos_o, cos_next = dr.dot(-wt, meso), dr.dot(-wt, next_meso)
        enters = (facing > 0.0) & section.sees(wi, meso, facet) & section.sees(wi, macro, facet)
        enters &= section.sees(-wt, meso, facet) & section.sees(-wt, macro, facet)
        along = dr.rcp(dr.maximum(dr.safe_sqrt(1.0 - dr.square(wt.y)), 1e-4))
        clear = dr.exp(-self.absorption * along * section.chord(gamma, next_gamma + pi))
        inner = self.scale(cos_next, outside=False)
        shadow = section.masked_after(alpha, cos_i, cos_o)

        # out at the second wall
        out = -wt + inverse * wo
        size = dr.rcp(dr.maximum(dr.norm(out), 1e-9))
        out *= size
        leaves = 1.0 - mi.fresnel(dr.dot(-wt, out), inverse)[0]
        density = section.facets(alpha, dr.dot(next_meso, out)) * section.masked(
            alpha, cos_next, dr.dot(-wo, next_meso)
        )
        second = passed * outer * leaves * inner * density * shadow * cos_i / dr.maximum(cos_o, 1e-6)
        second *= dr.dot(-wt, out) * dr.dot(-wo, out) * dr.square(size) * section.arc(next_gamma)
        fits = enters & (dr.dot(wo, wt) >= inverse - 1e-5) & (dr.dot(next_meso, out) >= 0.0) & (second > 0.0)
        total += dr.select(fits, self.shares[1] * second * stretch * dr.square(inverse), 0.0) * clear

        # reflected there, and out at the third
        facet = section.drawn(alpha, -wt, next_meso, draws[2], draws[3])
        facing = dr.dot(-wt, facet)
        bounced = mi.fresnel(facing, inverse)[0]
        wr = mirrored(dr, wt, facet)
        turns = enters & (facing > 0.0)
        in_sight = section.sees(-wt, next_macro, facet) & (cos_next > 0.0)
        misses = dr.dot(-wr, wo) < inverse - 1e-5
        stays = section.sees(-wt, next_meso, facet) & section.sees(-wr, next_meso, facet)
        stays &= section.sees(-wt, next_macro, facet) & section.sees(-wr, next_macro, facet)
        last_gamma = gamma - 2.0 * (section.turned(angle_t) - section.turned(dr.atan2(wr.x, wr.z))) + pi
        last_meso, last_macro = section.normal(-self.tilt, last_gamma), section.normal(0.0, last_gamma)
        out = wr + inverse * wo
        size = dr.rcp(dr.maximum(dr.norm(out), 1e-9))
        out *= size
        cos_last, cos_after = dr.dot(last_meso, wr), dr.dot(next_meso, -wr)
        along = dr.rcp(dr.maximum(dr.safe_sqrt(1.0 - dr.square(wr.y)), 1e-4))
        clear_again = dr.exp(-self.absorption * along * section.chord(last_gamma, next_gamma))
        leaves = 1.0 - mi.fresnel(dr.dot(wr, out), inverse)[0]
        density = section.facets(alpha, dr.dot(last_meso, out)) * section.masked(
            alpha, cos_last, dr.dot(last_meso, -wo)
        )
        third = passed * outer * bounced * inner * leaves * self.scale(cos_last, outside=False) * density
        third *= shadow * section.masked_after(alpha, cos_next, cos_after) * cos_i * cos_next
        third *= dr.dot(out, wr) * dr.dot(out, -wo) * dr.square(size) * section.arc(last_gamma)
        third /= dr.maximum(cos_o, 1e-6) * dr.maximum(cos_after, 1e-6)
        fits = turns & ~misses & stays & (dr.dot(last_meso, out) >= 0.0) & (third > 0.0)
        for normal in (last_meso, last_macro):
            fits &= section.sees(wr, normal, out) & section.sees(-wo, normal, out)
        total += dr.select(fits, self.shares[2] * third * stretch * dr.square(inverse), 0.0) * (clear * clear_again)

        # the rest as a geometric series, even around the strand: the energy that ``traced`` draws, where Cycles
        # approximates it by the second wall alone and gives back up to 1.2 of the light
        facet = section.drawn(alpha, wr, last_meso, draws[4], draws[5])
        kept = mi.fresnel(dr.dot(wr, facet), inverse)[0]
        more = passed * outer * shadow * bounced * inner * section.masked_after(alpha, cos_next, cos_after) * kept
        more *= self.scale(cos_last, outside=False)
        more *= section.masked_after(alpha, cos_last, dr.dot(last_meso, mirrored(dr, wr, facet)))
        both, leaving = dr.sqrt(clear * clear_again), dr.maximum(0.5 * (2.0 - bounced - kept), 1e-5)
        series = clear * clear_again * both * leaving / (1.0 - both * (1.0 - leaving))
        even = self.proposal.inclined(wo.y, 4.0 * alpha) * (0.5 / pi)
        total += dr.select(turns & in_sight & (cos_last > 0.0), more * even, 0.0) * series
        return total
