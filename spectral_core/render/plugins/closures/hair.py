# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_hair``: Principled Hair BSDF (Chiang et al. 2016), and ``blender_hairlobe``: the two lobes of Hair BSDF.

Both are defined about a strand's tangent, over all directions. A direction leads through the strand where it points
into it: the back of a tube's walls is no obstacle (``mitsuba_scene.rules.STRAND``).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, factorial, log, pi
from typing import Any

from spectral_core.render.plugins.closures.lobe import Closure, register_closure
from spectral_core.render.plugins.closures.microfacet import least_alpha
from spectral_core.render.plugins.closures.upright import toward_viewer
from spectral_core.scene.hair import STRAND_SIDES

FIBER = 0x1000
"""Mitsuba's flag ``Anisotropic``, which marks strands: no direction is on the wrong side of them."""
LEAST, MOST = 1e-3, 1.0
"""Range of roughnesses."""


@dataclass
class Fiber:
    """Axes of a strand at a hit, in the world: ``along`` it, ``across`` it and the view, ``away`` from the viewer.

    ``height``: place of the ray across the strand, -1 to 1. ``toward``: direction to the viewer. ``is_strand``: False
    on meshes.
    """

    along: Any
    across: Any
    away: Any
    height: Any
    toward: Any
    is_strand: Any


def fiber_at(mi: Any, dr: Any, si: Any, tangent: Any, edge: Any) -> Fiber:
    """The strand at a hit; a mesh has them along an edge of the triangle, as in Cycles."""
    toward = toward_viewer(mi, dr, si)
    is_strand = dr.squared_norm(tangent) > 1e-12
    along = dr.select(is_strand, tangent, dr.mulsign(edge, dr.dot(si.n, toward)))
    size = dr.norm(along)
    along = dr.select(size > 1e-12, along / dr.maximum(size, 1e-12), mi.coordinate_system(si.n)[0])
    across = dr.cross(along, toward)
    size = dr.norm(across)
    across = dr.select(size > 1e-6, across / dr.maximum(size, 1e-6), mi.coordinate_system(along)[0])
    away = dr.cross(along, across)

    def angle(normal: Any) -> Any:
        return dr.atan2(dr.dot(normal, across), -dr.dot(normal, away))

    outer = mi.Vector3f(dr.mulsign(si.n, dr.dot(si.n, toward)))
    smooth, flat = angle(mi.Vector3f(si.sh_frame.n)), angle(mi.Vector3f(si.n))
    # the walls of a tube are flat: the place of a hit across it, over its half width from here
    sector = 2 * pi / STRAND_SIDES
    turned = flat - sector * dr.floor(flat / sector + 0.5)
    apothem = cos(sector / 2)
    place = dr.sin(smooth) * apothem / dr.maximum(dr.cos(smooth - flat) * dr.cos(turned), 0.1)
    height = -dr.clip(dr.select(is_strand, place, dr.dot(outer, across)), -1.0, 1.0)
    return Fiber(along, across, away, height, toward, is_strand)


def log_bessel(dr: Any, x: Any) -> Any:
    """Logarithm of the modified Bessel function I₀ of a positive number."""
    small, quarter = dr.minimum(x, 12.0), 0.25 * dr.square(dr.minimum(x, 12.0))
    series = 0.0 * small
    for k in range(18, -1, -1):  # Horner's rule; the coefficients are 1 / (k!)²
        series = series * quarter + 1.0 / float(factorial(k)) ** 2
    large = x + 0.5 * (1.0 / (8.0 * dr.maximum(x, 1.0)) - log(2 * pi) - dr.log(dr.maximum(x, 1.0)))
    return dr.select(x > 12.0, large, dr.log(series))


def longitudinal(dr: Any, light: tuple[Any, Any], view: tuple[Any, Any], v: Any) -> Any:
    """Density over inclinations, given by their sine and cosine, of variance ``v`` (d'Eon et al. 2011)."""
    inverse = dr.rcp(v)
    exponent = log_bessel(dr, light[1] * view[1] * inverse) - light[0] * view[0] * inverse
    # over 2 v sinh(1 / v), without overflow
    return dr.exp(exponent - inverse) / ((1.0 - dr.exp(-2.0 * inverse)) * v)


def wrapped(dr: Any, angle: Any) -> Any:
    """An angle in -π to π."""
    return angle - 2 * pi * dr.floor(angle / (2 * pi) + 0.5)


def cumulative(dr: Any, x: Any, s: Any) -> Any:
    """Share of the logistic distribution of scale ``s`` below ``x``."""
    return dr.rcp(1.0 + dr.exp(dr.minimum(-x / s, 80.0)))


def trimmed_logistic(dr: Any, x: Any, s: Any) -> Any:
    """Logistic density of scale ``s``, limited to -π to π."""
    tail = dr.exp(-dr.abs(x) / s)
    return tail / (s * dr.square(1.0 + tail)) / (1.0 - 2.0 * cumulative(dr, -pi, s))


def register(mi: Any, dr: Any) -> None:
    """Define and register the closures for the active variant."""

    class BlenderHair(Closure):
        """A fiber with the inputs of ``scene.hair.Hair``."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            both = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.GlossyTransmission
            self.m_flags = int(both | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide) | FIBER
            self.inputs, self.is_fur = inputs, bool(inputs["is_fur"])

        def number(self, name: str, si: Any, active: Any) -> Any:
            return self.inputs[name].eval_1(si, active)

        def prepared(self, si: Any, active: Any) -> Any:
            """The strand, the lobes' inclinations and variances, shares and probabilities; the scale and azimuths."""
            ways = (mi.Vector3f(mi.Color3f(self.inputs[name].eval_3(si, active))) for name in ("tangent", "edge"))
            fiber = fiber_at(mi, dr, si, *ways)
            ior, raw = (
                dr.maximum(self.number("ior", si, active), 1.0 + 1e-4),
                self.number("radial_roughness", si, active),
            )
            rough = dr.clip(self.number("roughness", si, active), LEAST, MOST)
            first = dr.clip(rough * (1.0 - dr.clip(self.number("coat", si, active), 0.0, 1.0)), LEAST, MOST)
            least = least_alpha(si)  # as in Cycles, Filter Glossy bounds the variances
            v = [dr.maximum(_variance(dr, amount), least) for amount in (first, rough)]
            variances = [v[0], 0.25 * v[1], 4.0 * v[1], 4.0 * v[1]]
            radial = dr.clip(raw, LEAST, MOST)
            scale = (0.265 * radial + 1.194 * dr.square(radial) + 5.372 * radial**22) * (pi / 8) ** 0.5
            scale = dr.maximum(scale, least)
            sine = dr.clip(dr.dot(fiber.toward, fiber.along), -1.0, 1.0)
            cosine = dr.safe_sqrt(1.0 - sine * sine)
            inner = sine / ior
            inner_cosine = dr.safe_sqrt(1.0 - inner * inner)
            h = fiber.height
            h_inside = dr.clip(h * cosine / dr.safe_sqrt(dr.square(ior) - sine * sine), -1.0, 1.0)
            depth = 2.0 * dr.safe_sqrt(1.0 - h_inside * h_inside) / dr.maximum(inner_cosine, 1e-6)
            passed = mi.Spectrum(dr.exp(-self.absorption(si, raw, active) * depth))
            reflected = mi.fresnel(cosine * dr.safe_sqrt(1.0 - h * h), ior)[0]
            once = dr.square(1.0 - reflected) * passed
            twice = once * passed * reflected
            rest = twice * passed * reflected / dr.maximum(1.0 - passed * reflected, 1e-6)
            shares = [mi.Spectrum(reflected), once, twice, rest]
            weights = [dr.mean(share) for share in shares]
            total = dr.maximum(sum(weights), 1e-20)
            tilt = self.number("offset_rad", si, active)
            tilted = [_turned(dr, (sine, cosine), angle) for angle in (2.0 * tilt, -tilt, -4.0 * tilt)]
            azimuths = [2.0 * p * dr.asin(h_inside) - 2.0 * dr.asin(h) + p * pi for p in range(3)]
            lobes = list(zip(shares, [w / total for w in weights], [*tilted, (sine, cosine)], variances, strict=True))
            return fiber, lobes, scale, azimuths

        def absorption(self, si: Any, radial: Any, active: Any) -> Any:
            """Absorption coefficient per radius of the fiber."""
            depth = -dr.log(dr.clip(mi.Spectrum(self.inputs["color"].eval(si, active)), 1e-8, 1.0))
            if not self.is_fur:
                return depth * self.number("depth", si, active)
            x = radial
            fit = ((((0.245 * x + 5.574) * x - 10.73) * x + 2.532) * x - 0.215) * x + 5.969
            return dr.square(depth / fit)

        def value(self, prepared: Any, light: tuple[Any, Any], phi: Any) -> tuple[Any, Any]:
            """Value · cosine and density of a direction by its inclination, and its azimuth from the viewer's."""
            _, lobes, scale, azimuths = prepared
            value, density = mi.Spectrum(0.0), mi.Float(0.0)
            for p, (share, weight, view, v) in enumerate(lobes):
                around = trimmed_logistic(dr, wrapped(dr, phi - azimuths[p]), scale) if p < 3 else 0.5 / pi
                amount = longitudinal(dr, light, view, v) * around
                value, density = value + share * amount, density + weight * amount
            return value, density

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            prepared = self.prepared(si, active)
            fiber, outward = prepared[0], si.to_world(wo)
            sine = dr.clip(dr.dot(outward, fiber.along), -1.0, 1.0)
            place = dr.dot(outward, fiber.across), dr.dot(outward, fiber.away)
            # the viewer's own azimuth is that of -away
            phi = dr.atan2(place[1], place[0]) + 0.5 * pi
            value, density = self.value(prepared, (sine, dr.safe_sqrt(1.0 - sine * sine)), phi)
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            prepared = self.prepared(si, active)
            fiber, lobes, scale, azimuths = prepared
            u, chosen = mi.Float(sample1), mi.UInt32(3)
            (sine, cosine), v, azimuth = lobes[3][2], lobes[3][3], mi.Float(0.0)
            width, below = mi.Float(lobes[3][1]), mi.Float(0.0)
            start = lobes[0][1] + lobes[1][1] + lobes[2][1]
            for p in range(3):
                mine = (chosen == 3) & (u < below + lobes[p][1])
                chosen = dr.select(mine, p, chosen)
                start, width = dr.select(mine, below, start), dr.select(mine, lobes[p][1], width)
                sine, cosine = (dr.select(mine, lobes[p][2][k], old) for k, old in enumerate((sine, cosine)))
                v, azimuth = dr.select(mine, lobes[p][3], v), dr.select(mine, azimuths[p], azimuth)
                below = below + lobes[p][1]
            place = dr.clip((u - start) / dr.maximum(width, 1e-12), 1e-5, 1.0 - 1e-6)
            away = dr.clip(1.0 + v * dr.log(place + (1.0 - place) * dr.exp(-2.0 / v)), -1.0, 1.0)
            sine = -away * sine + dr.safe_sqrt(1.0 - away * away) * dr.cos(2 * pi * sample2.y) * cosine
            sine = dr.clip(sine, -1.0, 1.0)
            cosine = dr.safe_sqrt(1.0 - sine * sine)
            low = cumulative(dr, -pi, scale)
            drawn = -scale * dr.log(dr.maximum(dr.rcp(sample2.x * (1.0 - 2.0 * low) + low) - 1.0, 1e-30))
            phi = dr.select(chosen < 3, azimuth + dr.clip(drawn, -pi, pi), 2 * pi * sample2.x)
            value, density = self.value(prepared, (sine, cosine), phi)
            outward = fiber.along * sine + cosine * (fiber.across * dr.sin(phi) - fiber.away * dr.cos(phi))
            return _drawn(mi, dr, si, outward, chosen == 0, (value, density), active)

    class BlenderHairLobe(Closure):
        """One lobe with the inputs of ``scene.hair.HairLobe``."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.inputs, self.transmits = inputs, bool(inputs["transmits"])
            own = mi.BSDFFlags.GlossyTransmission if self.transmits else mi.BSDFFlags.GlossyReflection
            self.m_flags = int(own | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide) | FIBER

        def prepared(self, si: Any, active: Any) -> Any:
            """The strand, roughnesses, offset, the viewer's inclination, and the range of half inclinations."""
            number = lambda name: self.inputs[name].eval_1(si, active)  # noqa: E731
            ways = (mi.Vector3f(mi.Color3f(self.inputs[name].eval_3(si, active))) for name in ("tangent", "edge"))
            fiber = fiber_at(mi, dr, si, *ways)
            along, around = (dr.clip(number(f"roughness_{way}"), LEAST, MOST) for way in ("along", "around"))
            offset = dr.select(fiber.is_strand, -number("offset_rad"), 0.0)
            view = dr.safe_asin(dr.dot(fiber.toward, fiber.along))
            ends = [dr.atan(((0.5 * (side * pi / 2 + view)) - offset) / along) for side in (-1.0, 1.0)]
            return fiber, along, around, offset, view, ends

        def density(self, prepared: Any, si: Any, outward: Any, *, is_drawn: bool = False) -> Any:
            """Density of a direction; as in Cycles, one that is not drawn is on the lobe's own side of the normal."""
            fiber, along, around, offset, view, ends = prepared
            light = dr.safe_asin(dr.dot(outward, fiber.along))
            level = [w - fiber.along * dr.dot(w, fiber.along) for w in (outward, fiber.toward)]
            cosine = dr.dot(level[0], level[1]) * dr.rsqrt(
                dr.maximum(dr.squared_norm(level[0]) * dr.squared_norm(level[1]), 1e-20)
            )
            phi, t = dr.safe_acos(cosine), 0.5 * (light + view) - offset
            inclination = along / (
                2.0 * (t * t + along * along) * dr.maximum(ends[1] - ends[0], 1e-9) * dr.maximum(dr.cos(light), 1e-6)
            )
            side = dr.dot(outward, mi.Vector3f(si.sh_frame.n)) * dr.dot(fiber.toward, mi.Vector3f(si.n)) > 0.0
            if self.transmits:
                p = pi - phi
                azimuth = around / (2.0 * dr.atan(pi / 2 / around) * (p * p + around * around))
                valid = is_drawn | ~side
            else:
                azimuth = dr.cos(0.5 * dr.minimum(phi / around, pi)) * 0.25 / around
                valid = is_drawn | (side & (cosine >= 0.0))
            return dr.select(valid & (pi / 2 - dr.abs(light) > 1e-3), inclination * azimuth, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            density = self.density(self.prepared(si, active), si, si.to_world(wo))
            density = dr.select(active, density, 0.0)
            return self.inputs["color"].eval(si, active) * density, density

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            prepared = self.prepared(si, active)
            fiber, along, around, offset, view, ends = prepared
            t = along * dr.tan(sample2.x * (ends[1] - ends[0]) + ends[0])
            light = 2.0 * (t + offset) - view
            if self.transmits:
                phi = pi + around * dr.tan(2.0 * dr.atan(pi / 2 / around) * (sample2.y - 0.5))
            else:
                phi = 2.0 * dr.safe_asin(1.0 - 2.0 * sample2.y) * around
            (sine, cosine), turn = dr.sincos(light), dr.sincos(phi)
            outward = fiber.along * sine + cosine * (fiber.across * turn[0] - fiber.away * turn[1])
            density = self.density(prepared, si, outward, is_drawn=True)
            value = self.inputs["color"].eval(si, active) * density
            return _drawn(mi, dr, si, outward, mi.Bool(not self.transmits), (value, density), active)

    register_closure(mi, "blender_hair", BlenderHair)
    register_closure(mi, "blender_hairlobe", BlenderHairLobe)


def _variance(dr: Any, roughness: Any) -> Any:
    return dr.square(0.726 * roughness + 0.812 * dr.square(roughness) + 3.7 * roughness**20)


def _turned(dr: Any, inclination: tuple[Any, Any], angle: Any) -> tuple[Any, Any]:
    """Sine and cosine of an inclination plus an angle; the cosine without its sign."""
    (sine, cosine), (s, c) = inclination, dr.sincos(angle)
    return sine * c + cosine * s, dr.abs(cosine * c - sine * s)


def _drawn(mi: Any, dr: Any, si: Any, outward: Any, reflects: Any, found: tuple[Any, Any], active: Any) -> Any:
    value, density = found
    valid = active & (density > 1e-12) & dr.isfinite(density)
    bs = dr.zeros(mi.BSDFSample3f)
    bs.wo, bs.eta, bs.pdf = si.to_local(outward), mi.Float(1.0), dr.select(valid, density, 0.0)
    kinds = (int(kind) | FIBER for kind in (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission))
    bs.sampled_type = dr.select(reflects, *(mi.UInt32(kind) for kind in kinds))
    return bs, dr.select(valid, value / dr.maximum(density, 1e-12), 0.0)
