# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_glass``: smooth or rough, tinted, dispersive where its index of refraction is a spectrum."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures import albedo
from spectral_core.render.plugins.closures.microfacet import KeptEnergy, Microfacets
from spectral_core.render.plugins.closures.upright import keeps_side


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDF for the active variant."""

    class BlenderGlass(mi.BSDF):
        """Fresnel reflection times ``reflection_color`` and refraction times ``transmission_color``.

        ``ior``: texture, read at the first wavelength (under dispersion all wavelengths of a path are equal).
        ``smooth``: a sharp interface; else ``roughness`` (texture) with GGX facets and energy kept for
        ``nominal_ior``; what is transmitted after bouncing between facets is tinted by ``facet_color``. Radiance is
        not scaled by the squared index, as in Cycles: what enters also leaves.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.reflection_color = properties["reflection_color"]
            self.transmission_color = properties["transmission_color"]
            self.ior, self.smooth = properties["ior"], properties["smooth"]
            self.reflects = bool(properties.get("reflects", True))
            self.keeps_energy = bool(properties.get("keeps_energy", True))
            kinds = (
                (mi.BSDFFlags.DeltaReflection, mi.BSDFFlags.DeltaTransmission)
                if self.smooth
                else (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission)
            )
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.kinds = [int(kind) for kind in kinds]
            self.m_components = [int(kind | sides) for kind in kinds]
            self.m_flags = self.m_components[0] | self.m_components[1]
            nominal = round(float(properties["nominal_ior"]), 6)
            if not self.smooth:
                self.roughness, self.facet_color = properties["roughness"], properties["facet_color"]
                self.kept_outside = KeptEnergy(mi, albedo.dielectric(nominal)[1])
                self.kept_inside = KeptEnergy(mi, albedo.dielectric(1 / nominal)[1])

        def relative_ior(self, si: Any, active: Any) -> Any:
            """Index of the far side over that of the near side."""
            value = self.ior.eval(si, active)[0] if mi.is_spectral else self.ior.eval_1(si, active)
            value = dr.maximum(value, 1e-3)
            return dr.select(si.wi.z > 0.0, value, dr.rcp(value))

        def reflectance(self, facing: Any, eta: Any) -> tuple[Any, Any, Any]:
            """Share that is reflected, share that passes, and the cosine inside; Refraction alone reflects nothing."""
            reflected, inner, _, _ = mi.fresnel(facing, eta)
            if self.reflects:
                return reflected, 1.0 - reflected, inner
            return mi.Float(0.0), dr.select(reflected < 1.0, mi.Float(1.0), 0.0), inner

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            eta = self.relative_ior(si, active)
            wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
            normal = mi.Vector3f(0, 0, 1)
            if not self.smooth:
                facets = Microfacets(mi, dr, self.roughness.eval_1(si, active))
                normal = facets.distribution.sample(wi, sample2)[0]
            facing = dr.dot(wi, normal)
            reflected, passes, inner = self.reflectance(facing, eta)
            reflects = (sample1 <= reflected) & (reflected > 0.0)
            refraction = (facing / eta - dr.abs(inner)) * normal - wi / eta
            wo = dr.select(reflects, 2.0 * facing * normal - wi, refraction)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))
            bs.eta = mi.Float(1.0)
            bs.sampled_type = dr.select(reflects, mi.UInt32(self.kinds[0]), mi.UInt32(self.kinds[1]))
            if self.smooth:
                bs.pdf = dr.select(reflects, reflected, passes)
                color = dr.select(
                    reflects, self.reflection_color.eval(si, active), self.transmission_color.eval(si, active)
                )
                return bs, dr.select(active & (bs.pdf > 0.0), color, 0.0)
            value, density = self.eval_pdf(ctx, si, bs.wo, active)
            sane = active & (density > 0.0) & (reflects == (wo.z > 0.0)) & (facing > 0.0)
            bs.pdf = dr.select(sane, density, 0.0)
            return bs, dr.select(sane, value / dr.maximum(density, 1e-20), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if self.smooth:
                return mi.Spectrum(0.0), mi.Float(0.0)
            active = active & keeps_side(mi, dr, si, wo)
            eta = self.relative_ior(si, active)
            roughness = self.roughness.eval_1(si, active)
            facets = Microfacets(mi, dr, roughness)
            wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
            wo = mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))
            mirror, mirror_density, facing = facets.reflection(wi, wo)
            reflected, _, _ = self.reflectance(facing, eta)
            # Walter et al. 2007, Eqs. 16, 17 and 21, with η relative to the side of wi
            half = dr.normalize(wi + wo * eta)
            half = dr.mulsign(half, half.z)
            into, out = dr.dot(wi, half), dr.dot(wo, half)
            crossing = (wo.z < 0.0) & (into > 0.0) & (out < 0.0) & (wi.z > 0.0)
            _, passed, _ = self.reflectance(into, eta)
            stretch = dr.square(eta) * dr.abs(out) / dr.maximum(dr.square(into + eta * out), 1e-12)
            through = dr.select(crossing, facets.distribution.pdf(wi, half) * stretch, 0.0)
            masked = facets.masking(wi, mi.Vector3f(wo.x, wo.y, dr.abs(wo.z)))

            def kept(color: Any) -> Any:
                if not self.keeps_energy:
                    return mi.Float(1.0)
                outside, inside = (keep(roughness, wi.z, color) for keep in (self.kept_outside, self.kept_inside))
                return dr.select(si.wi.z > 0.0, outside, inside)

            mirror_color = self.reflection_color.eval(si, active)
            value = mirror_color * kept(mirror_color) * (reflected * mirror)
            tint = self.transmission_color.eval(si, active)
            value += tint * kept(self.facet_color.eval(si, active)) * (passed * through * masked)
            density = reflected * mirror_density + passed * through
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def to_string(self) -> str:
            return "BlenderGlass"

    mi.register_bsdf("blender_glass", lambda properties: BlenderGlass(properties))
