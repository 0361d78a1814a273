# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_ellipsehair``: Principled Hair BSDF by Huang, Hullin and Hanika 2022, "A microfacet-based hair scattering
model", averaged over the width of a strand.

Local axes: x along the major axis of the cross-section, or across the view of a circular one; y along the strand.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.facets.microfacet import least_alpha
from spectral_core.render.plugins.closures.facets.upright import drawn_elsewhere
from spectral_core.render.plugins.closures.lobe import OWN, Closure, register_closure
from spectral_core.render.plugins.closures.strands.fiber import FIBER, LEAST, MOST, absorption_of_fur, fiber_at
from spectral_core.render.plugins.closures.strands.pierced import Strand
from spectral_core.render.plugins.closures.strands.proposal import Proposal
from spectral_core.render.plugins.closures.strands.section import Section
from spectral_core.render.plugins.closures.strands.traced import traced


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class BlenderEllipseHair(Closure):
        """A fiber with the inputs of ``scene.hair.EllipseHair``."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            kinds = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.Null
            self.m_flags = int(kinds | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide) | FIBER
            self.inputs, self.is_fur, self.layered = inputs, bool(inputs["is_fur"]), bool(inputs.get("layers", 0))

        def number(self, name: str, si: Any, active: Any) -> Any:
            return self.inputs[name].eval_1(si, active)

        def prepared(self, si: Any, active: Any) -> Strand:
            """The strand at a hit."""
            vector = lambda name: mi.Vector3f(mi.Color3f(self.inputs[name].eval_3(si, active)))  # noqa: E731
            fiber = fiber_at(mi, dr, si, vector("tangent"), vector("edge"))
            aspect = dr.maximum(self.number("aspect_ratio", si, active), 1e-3)
            aspect = dr.select(aspect > 1.0, dr.rcp(aspect), aspect)
            major = vector("major_axis")
            major -= fiber.along * dr.dot(fiber.along, major)
            size, is_round = dr.norm(major), (aspect == 1.0) | ~fiber.is_strand
            other = mi.coordinate_system(fiber.along)[0]
            major = dr.select(size > 1e-6, major / dr.maximum(size, 1e-6), other)
            x = dr.select(is_round, fiber.across, major)
            axes = x, fiber.along, dr.cross(x, fiber.along)
            wi = mi.Vector3f(*(dr.dot(axis, fiber.toward) for axis in axes))
            section = Section(mi, dr, aspect, wi)
            radius = dr.select(aspect == 1.0, 1.0, section.radius)
            alpha = dr.maximum(dr.clip(self.number("roughness", si, active), LEAST, MOST), least_alpha(si))
            eta = dr.maximum(self.number("ior", si, active), 1.0 + 1e-4)
            absorption = self.absorption(si, active)
            names = ("reflection", "transmission", "secondary_reflection")
            shares = tuple(dr.maximum(self.number(name, si, active), 0.0) for name in names)
            tilt = -self.number("offset_rad", si, active)
            proposal = Proposal(mi, dr, fiber, (alpha, eta, absorption, -tilt))
            beside = dr.abs(fiber.height) >= radius
            tables = self.inputs["outside"], self.inputs["inside"]
            given = (alpha, tilt, eta, absorption, shares, proposal, tables, self.layered)
            return Strand(mi, dr, axes, wi, section, beside, *given)

        def absorption(self, si: Any, active: Any) -> Any:
            """Absorption coefficient per major half axis."""
            depth = -dr.log(dr.clip(mi.Spectrum(self.inputs["color"].eval(si, active)), 1e-8, 1.0))
            if not self.is_fur:
                return depth * self.number("depth", si, active)
            return absorption_of_fur(dr, depth, self.number("roughness", si, active))

        def seed_of(self, si: Any, wo: Any) -> Any:
            parts = [dr.reinterpret_array(mi.UInt32, part) for part in (wo.x, wo.y, si.p.x, si.p.y)]
            return parts[0] * 747796405 + parts[1] * 2891336453 + parts[2] * 277803737 + parts[3]

        def measured(self, at: Strand, si: Any, outward: Any, active: Any) -> tuple[Any, Any]:
            """Value and density of a world direction."""
            wo = mi.Vector3f(*(dr.dot(axis, outward) for axis in at.axes))
            active &= ~drawn_elsewhere(si)  # what others draw counts for them alone, as this closure's own directions
            value = at.value(wo, self.seed_of(si, wo), active & ~at.is_beside)
            return value, dr.select(active & ~at.is_beside, at.proposal.density(outward), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value, density = self.measured(self.prepared(si, active), si, si.to_world(wo), active)
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            at = self.prepared(si, active)
            way, weight = traced(at, self.seed_of(si, sample2) ^ dr.reinterpret_array(mi.UInt32, sample1), sample2.x)
            outward = at.axes[0] * way.x + at.axes[1] * way.y + at.axes[2] * way.z
            # the weight is that of the drawn path; the density weighs it against samples of lights
            density = at.proposal.density(outward)
            valid = active & dr.isfinite(density) & dr.all(dr.isfinite(weight)) & dr.any(weight > 0.0)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.eta, bs.pdf = mi.Float(1.0), dr.select(valid, density, 0.0)
            bs.wo = si.to_local(dr.select(valid, outward, si.sh_frame.n))
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection) | FIBER | OWN)
            # beside the ellipse rays pass
            bs.wo, bs.pdf = dr.select(at.is_beside, -si.wi, bs.wo), dr.select(at.is_beside, 1.0, bs.pdf)
            bs.sampled_type = dr.select(at.is_beside, mi.UInt32(int(mi.BSDFFlags.Null)), bs.sampled_type)
            weight = dr.select(valid, weight, 0.0)
            return bs, dr.select(active & at.is_beside, mi.Spectrum(1.0), weight)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return dr.select(self.prepared(si, active).is_beside, mi.Spectrum(1.0), 0.0)

    register_closure(mi, "blender_ellipsehair", BlenderEllipseHair)
