# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_hairlobe``: the two lobes of Hair BSDF."""

from __future__ import annotations

from math import pi
from typing import Any

from spectral_core.render.plugins.closures.lobe import ALONE, OWN, Closure, register_closure
from spectral_core.render.plugins.closures.strands.fiber import FIBER, LEAST, MOST, as_sample, fiber_at


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

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
            bs, weight = as_sample(mi, dr, si, outward, mi.Bool(not self.transmits), (value, density), active)
            unseen = self.density(prepared, si, outward) == 0.0
            bs.sampled_type |= dr.select(unseen, mi.UInt32(OWN), 0)
            if not self.transmits:
                bs.sampled_type |= dr.select(unseen & ~fiber.is_strand, mi.UInt32(ALONE), 0)
            return bs, weight

    register_closure(mi, "blender_hairlobe", BlenderHairLobe)
