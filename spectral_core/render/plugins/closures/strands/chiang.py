# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_hair``: Principled Hair BSDF by Chiang et al. 2016.

It is defined about a strand's tangent, over all directions. A direction leads through the strand where it points into
it: the back of a tube's walls is no obstacle (``mitsuba_scene.rules.STRAND``).
"""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.render.plugins.closures.facets.microfacet import least_alpha
from spectral_core.render.plugins.closures.facets.upright import is_sampled
from spectral_core.render.plugins.closures.lobe import Closure, register_closure
from spectral_core.render.plugins.closures.strands.fiber import (
    FIBER,
    LEAST,
    MOST,
    absorption_of_fur,
    as_sample,
    cumulative,
    fiber_at,
    logistic_scale,
    longitudinal,
    shares_of_lobes,
    trimmed_logistic,
    wrapped,
)
from spectral_core.render.plugins.numbers import lightness


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

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
            v = [dr.maximum(variance(dr, amount), least) for amount in (first, rough)]
            variances = [v[0], 0.25 * v[1], 4.0 * v[1], 4.0 * v[1]]
            radial = dr.clip(raw, LEAST, MOST)
            scale = dr.maximum(logistic_scale(dr, radial), least)
            sine = dr.clip(dr.dot(fiber.toward, fiber.along), -1.0, 1.0)
            cosine = dr.safe_sqrt(1.0 - sine * sine)
            inner = sine / ior
            inner_cosine = dr.safe_sqrt(1.0 - inner * inner)
            h = fiber.height
            h_inside = dr.clip(h * cosine / dr.safe_sqrt(dr.square(ior) - sine * sine), -1.0, 1.0)
            depth = 2.0 * dr.safe_sqrt(1.0 - h_inside * h_inside) / dr.maximum(inner_cosine, 1e-6)
            passed = mi.Spectrum(dr.exp(-self.absorption(si, raw, active) * depth))
            reflected = mi.fresnel(cosine * dr.safe_sqrt(1.0 - h * h), ior)[0]
            shares = [mi.Spectrum(reflected), *shares_of_lobes(dr, reflected, passed)]
            weights = [lightness(mi, dr, share, si.wavelengths) for share in shares]
            total = dr.maximum(sum(weights), 1e-20)
            tilt = self.number("offset_rad", si, active)
            tilted = [turned(dr, (sine, cosine), angle) for angle in (2.0 * tilt, -tilt, -4.0 * tilt)]
            azimuths = [2.0 * p * dr.asin(h_inside) - 2.0 * dr.asin(h) + p * pi for p in range(3)]
            lobes = list(zip(shares, [w / total for w in weights], [*tilted, (sine, cosine)], variances, strict=True))
            return fiber, lobes, scale, azimuths

        def absorption(self, si: Any, radial: Any, active: Any) -> Any:
            """Absorption coefficient per radius of the fiber."""
            depth = -dr.log(dr.clip(mi.Spectrum(self.inputs["color"].eval(si, active)), 1e-8, 1.0))
            if not self.is_fur:
                return depth * self.number("depth", si, active)
            return absorption_of_fur(dr, depth, radial)

        def value(self, prepared: Any, light: tuple[Any, Any], phi: Any, sampled: Any) -> tuple[Any, Any]:
            """Value · cosine and density of a direction by its inclination, and its azimuth from the viewer's.

            Cycles draws the first reflection with the full roughness, but weighs it as if drawn with that of the coat:
            light that it does not sample itself comes from other directions than the value without that tells.
            """
            _, lobes, scale, azimuths = prepared
            value, density, told = mi.Spectrum(0.0), mi.Float(0.0), mi.Float(0.0)
            for p, (share, weight, view, v) in enumerate(lobes):
                around = trimmed_logistic(dr, wrapped(dr, phi - azimuths[p]), scale) if p < 3 else 0.5 / pi
                amount = longitudinal(dr, light, view, v) * around
                value, told = value + share * amount, told + weight * amount
                drawn = amount if p else longitudinal(dr, light, view, 0.25 * lobes[3][3]) * around
                density += weight * drawn
            return value * dr.select(sampled, 1.0, density / dr.maximum(told, 1e-20)), density

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            prepared = self.prepared(si, active)
            fiber, outward = prepared[0], si.to_world(wo)
            sine = dr.clip(dr.dot(outward, fiber.along), -1.0, 1.0)
            place = dr.dot(outward, fiber.across), dr.dot(outward, fiber.away)
            # the viewer's own azimuth is that of -away
            phi = dr.atan2(place[1], place[0]) + 0.5 * pi
            level = dr.safe_sqrt(1.0 - sine * sine)
            value, density = self.value(prepared, (sine, level), phi, is_sampled(si))
            # as in Cycles, a light that it samples on a mesh counts on one side of the plane through hair and viewer
            normal = mi.Vector3f(si.sh_frame.n)
            side = dr.dot(normal, outward) * dr.dot(normal, fiber.across) * place[0]
            value = dr.select(is_sampled(si) & ~fiber.is_strand & (side < 0.0), 0.0, value)
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
                v = dr.select(mine, lobes[p][3] if p else 0.25 * lobes[3][3], v)
                azimuth = dr.select(mine, azimuths[p], azimuth)
                below = below + lobes[p][1]
            place = dr.clip((u - start) / dr.maximum(width, 1e-12), 1e-5, 1.0 - 1e-6)
            away = dr.clip(1.0 + v * dr.log(place + (1.0 - place) * dr.exp(-2.0 / v)), -1.0, 1.0)
            sine = -away * sine + dr.safe_sqrt(1.0 - away * away) * dr.cos(2 * pi * sample2.y) * cosine
            sine = dr.clip(sine, -1.0, 1.0)
            cosine = dr.safe_sqrt(1.0 - sine * sine)
            low = cumulative(dr, -pi, scale)
            drawn = -scale * dr.log(dr.maximum(dr.rcp(sample2.x * (1.0 - 2.0 * low) + low) - 1.0, 1e-30))
            phi = dr.select(chosen < 3, azimuth + dr.clip(drawn, -pi, pi), 2 * pi * sample2.x)
            value, density = self.value(prepared, (sine, cosine), phi, False)
            outward = fiber.along * sine + cosine * (fiber.across * dr.sin(phi) - fiber.away * dr.cos(phi))
            return as_sample(mi, dr, si, outward, chosen == 0, (value, density), active)

    register_closure(mi, "blender_hair", BlenderHair)


def variance(dr: Any, roughness: Any) -> Any:
    """Variance of inclinations by the roughness along a strand (Chiang et al. 2016, equation 7)."""
    return dr.square(0.726 * roughness + 0.812 * dr.square(roughness) + 3.7 * roughness**20)


def turned(dr: Any, inclination: tuple[Any, Any], angle: Any) -> tuple[Any, Any]:
    """Sine and cosine of an inclination plus an angle; the cosine without its sign."""
    (sine, cosine), (s, c) = inclination, dr.sincos(angle)
    return sine * c + cosine * s, dr.abs(cosine * c - sine * s)
