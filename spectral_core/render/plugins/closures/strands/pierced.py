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


@dataclass(frozen=True, eq=False)
class Wall:
    """The first wall of a strand, where a ray meets it.

    ``gamma``: angle around the strand; ``meso``, ``macro``: normals with and without the tilt of its scales;
    ``cos_i``: cosine of the ray; ``stretch``: angle per height; ``outer``: factor that keeps the energy of facets.
    """

    gamma: Any
    meso: Any
    macro: Any
    cos_i: Any
    stretch: Any
    outer: Any


@dataclass(frozen=True, eq=False)
class Entry:
    """A ray from the first wall to the second.

    ``wt``: its direction; ``angle``: that around the strand; ``gamma``, ``meso``, ``macro``: the second wall;
    ``cos_o``, ``cos_next``: cosines of the ray at both walls; ``enters``: true if there is such a ray; ``clear``:
    transmittance of the strand along it; ``light``: share of the light that it carries, without absorption.
    """

    wt: Any
    angle: Any
    gamma: Any
    meso: Any
    macro: Any
    cos_o: Any
    cos_next: Any
    enters: Any
    clear: Any
    light: Any


@dataclass(frozen=True, eq=False)
class Turn:
    """A ray from the second wall to the third; members as those of ``Entry``.

    ``cos_last``, ``cos_after``: cosines at the third and the second wall; ``turns``: true if there is such a ray;
    ``stays``: true if the facet and the walls see both ends; ``in_sight``: true if the facet sees the ray before it;
    ``bounced``: share that the second wall reflects.
    """

    wr: Any
    gamma: Any
    meso: Any
    macro: Any
    cos_last: Any
    cos_after: Any
    turns: Any
    stays: Any
    in_sight: Any
    bounced: Any
    clear: Any
    light: Any


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
        mi, wall = self.mi, self.first_wall(height)
        entry = self.enter(wall, draws)
        turn = self.turn(wall, entry, draws)
        total = mi.Spectrum(self.reflected(wo, wall))
        total += self.transmitted(wo, wall, entry) * entry.clear
        total += self.reflected_inside(wo, wall, entry, turn) * (entry.clear * turn.clear)
        return total + self.rest(wo, wall, entry, turn, draws)

    def first_wall(self, height: Any) -> Wall:
        """The wall of the strand that a ray meets at a height."""
        section = self.section
        gamma = section.angle_at(height)
        meso, macro = section.normal(self.tilt, gamma), section.normal(0.0, gamma)
        cos_i = self.dr.dot(self.wi, meso)
        return Wall(gamma, meso, macro, cos_i, section.angle_per_height(gamma), self.scale(cos_i, outside=True))

    def reflected(self, wo: Any, wall: Wall) -> Any:
        """Light that the first wall reflects."""
        mi, dr, section, wi, alpha = self.mi, self.dr, self.section, self.wi, self.alpha
        half = dr.normalize(wi + wo)
        seen = section.sees(wi, wall.macro, half) & section.sees(wo, wall.macro, half)
        masked = section.masked(alpha, wall.cos_i, dr.dot(wall.meso, wo))
        lit = section.facets(alpha, dr.dot(wall.meso, half)) * masked
        fresnel = mi.fresnel(dr.dot(wi, half), self.eta)[0]
        first = 0.25 * self.shares[0] * fresnel * lit * section.arc(wall.gamma) * wall.outer
        return dr.select(seen, first * wall.stretch, 0.0)

    def enter(self, wall: Wall, draws: list[Any]) -> Entry:
        """The ray inside, from the first wall to the second."""
        mi, dr, section, wi, alpha = self.mi, self.dr, self.section, self.wi, self.alpha
        facet = section.drawn(alpha, wi, wall.meso, draws[0], draws[1])
        wt, passed, facing = inside(mi, dr, wi, facet, self.eta)
        angle = dr.atan2(wt.x, wt.z)
        gamma = 2.0 * section.turned(angle) - wall.gamma
        meso, macro = section.normal(-self.tilt, gamma), section.normal(0.0, gamma)
        cos_o, cos_next = dr.dot(-wt, wall.meso), dr.dot(-wt, meso)
        enters = (facing > 0.0) & section.sees(wi, wall.meso, facet) & section.sees(wi, wall.macro, facet)
        enters &= section.sees(-wt, wall.meso, facet) & section.sees(-wt, wall.macro, facet)
        clear = self.clear_along(wt, wall.gamma, gamma + pi)
        light = passed * wall.outer * section.masked_after(alpha, wall.cos_i, cos_o)
        light *= self.scale(cos_next, outside=False)
        return Entry(wt, angle, gamma, meso, macro, cos_o, cos_next, enters, clear, light)

    def transmitted(self, wo: Any, wall: Wall, entry: Entry) -> Any:
        """Light that leaves through the second wall, without absorption."""
        mi, dr, section, wt = self.mi, self.dr, self.section, entry.wt
        inverse = dr.rcp(self.eta)
        out, size = self.facet_of(-wt, wo)
        leaves = 1.0 - mi.fresnel(dr.dot(-wt, out), inverse)[0]
        facing = dr.dot(entry.meso, out)
        masked = section.masked(self.alpha, entry.cos_next, dr.dot(-wo, entry.meso))
        second = entry.light * leaves * section.facets(self.alpha, facing) * masked
        second *= wall.cos_i / dr.maximum(entry.cos_o, 1e-6)
        second *= dr.dot(-wt, out) * dr.dot(-wo, out) * dr.square(size) * section.arc(entry.gamma)
        fits = entry.enters & (dr.dot(wo, wt) >= inverse - 1e-5) & (facing >= 0.0) & (second > 0.0)
        return dr.select(fits, self.shares[1] * second * wall.stretch * dr.square(inverse), 0.0)

    def turn(self, wall: Wall, entry: Entry, draws: list[Any]) -> Turn:
        """The ray that the second wall reflects, from there to the third."""
        mi, dr, section, alpha, wt = self.mi, self.dr, self.section, self.alpha, entry.wt
        facet = section.drawn(alpha, -wt, entry.meso, draws[2], draws[3])
        facing = dr.dot(-wt, facet)
        wr = mirrored(dr, wt, facet)
        stays = section.sees(-wt, entry.meso, facet) & section.sees(-wr, entry.meso, facet)
        stays &= section.sees(-wt, entry.macro, facet) & section.sees(-wr, entry.macro, facet)
        in_sight = section.sees(-wt, entry.macro, facet) & (entry.cos_next > 0.0)
        gamma = wall.gamma - 2.0 * (section.turned(entry.angle) - section.turned(dr.atan2(wr.x, wr.z))) + pi
        meso, macro = section.normal(-self.tilt, gamma), section.normal(0.0, gamma)
        cos_last, cos_after = dr.dot(meso, wr), dr.dot(entry.meso, -wr)
        bounced = mi.fresnel(facing, dr.rcp(self.eta))[0]
        light = entry.light * bounced * section.masked_after(alpha, entry.cos_next, cos_after)
        light *= self.scale(cos_last, outside=False)
        turns, clear = entry.enters & (facing > 0.0), self.clear_along(wr, gamma, entry.gamma)
        return Turn(wr, gamma, meso, macro, cos_last, cos_after, turns, stays, in_sight, bounced, clear, light)

    def reflected_inside(self, wo: Any, wall: Wall, entry: Entry, turn: Turn) -> Any:
        """Light that leaves through the third wall, without absorption."""
        mi, dr, section, wr = self.mi, self.dr, self.section, turn.wr
        inverse = dr.rcp(self.eta)
        out, size = self.facet_of(wr, wo)
        leaves = 1.0 - mi.fresnel(dr.dot(wr, out), inverse)[0]
        facing = dr.dot(turn.meso, out)
        masked = section.masked(self.alpha, turn.cos_last, dr.dot(turn.meso, -wo))
        third = turn.light * leaves * section.facets(self.alpha, facing) * masked * wall.cos_i * entry.cos_next
        third *= dr.dot(out, wr) * dr.dot(out, -wo) * dr.square(size) * section.arc(turn.gamma)
        third /= dr.maximum(entry.cos_o, 1e-6) * dr.maximum(turn.cos_after, 1e-6)
        misses = dr.dot(-wr, wo) < inverse - 1e-5
        fits = turn.turns & ~misses & turn.stays & (facing >= 0.0) & (third > 0.0)
        for normal in (turn.meso, turn.macro):
            fits &= section.sees(wr, normal, out) & section.sees(-wo, normal, out)
        return dr.select(fits, self.shares[2] * third * wall.stretch * dr.square(inverse), 0.0)

    def rest(self, wo: Any, wall: Wall, entry: Entry, turn: Turn, draws: list[Any]) -> Any:
        """Light after more reflections, as a geometric series, even around the strand: the energy that ``traced``
        draws, where Cycles approximates it by the second wall alone and gives back up to 1.2 of the light.
        """
        mi, dr, section, alpha, wr = self.mi, self.dr, self.section, self.alpha, turn.wr
        facet = section.drawn(alpha, wr, turn.meso, draws[4], draws[5])
        kept = mi.fresnel(dr.dot(wr, facet), dr.rcp(self.eta))[0]
        more = turn.light * kept
        more *= section.masked_after(alpha, turn.cos_last, dr.dot(turn.meso, mirrored(dr, wr, facet)))
        through = entry.clear * turn.clear
        both, leaving = dr.sqrt(through), dr.maximum(0.5 * (2.0 - turn.bounced - kept), 1e-5)
        series = through * both * leaving / (1.0 - both * (1.0 - leaving))
        even = self.proposal.inclined(wo.y, 4.0 * alpha) * (0.5 / pi)
        return dr.select(turn.turns & turn.in_sight & (turn.cos_last > 0.0), more * even, 0.0) * series

    def facet_of(self, way: Any, wo: Any) -> tuple[Any, Any]:
        """Normal of the facet that refracts a direction inside to one outside, and the factor that normalized it."""
        dr = self.dr
        out = way + dr.rcp(self.eta) * wo
        size = dr.rcp(dr.maximum(dr.norm(out), 1e-9))
        return out * size, size

    def clear_along(self, way: Any, start: Any, end: Any) -> Any:
        """Transmittance of the strand along a direction, between two angles around it."""
        dr = self.dr
        along = dr.rcp(dr.maximum(dr.safe_sqrt(1.0 - dr.square(way.y)), 1e-4))
        return dr.exp(-self.absorption * along * self.section.chord(start, end))
