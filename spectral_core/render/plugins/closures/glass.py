# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_glass``: smooth or rough, tinted, dispersive where its index of refraction is a spectrum."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.facets.albedo import HIGHEST
from spectral_core.render.plugins.closures.facets.film import facing_of, film_of
from spectral_core.render.plugins.closures.facets.microfacet import Microfacets, kept_of, least_alpha
from spectral_core.render.plugins.closures.facets.upright import is_sampled, keeps_side, sees_facets, with_valid_normal
from spectral_core.render.plugins.closures.lobe import Closure, register_closure
from spectral_core.render.plugins.numbers import channel_mean

LEAST_BEND = 1e-4
"""Least difference of a rough interface's index of refraction from 1."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class BlenderGlass(Closure):
        """Fresnel reflection times ``reflection_color`` and refraction times ``transmission_color``.

        ``ior``: a number or, with ``disperses``, a spectrum that is read at the first wavelength (all wavelengths of
        such a path are equal). ``smooth``: a sharp interface; else ``roughness`` with GGX facets, whose energy is kept
        by ``outside`` and ``inside`` (tables, or
        stacks of ``layers`` of them by the index) and their means. ``halves``: each of two surfaces takes half of the
        transmission's color. Radiance is not scaled by the squared index, as in Cycles: what enters also leaves. It may
        have a thin film.
        """

        turns_normal = True

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.reflection_color, self.transmission = inputs["reflection_color"], inputs["transmission_color"]
            self.ior, self.smooth = inputs["ior"], inputs["smooth"]
            self.disperses, self.halves = inputs["disperses"], inputs["halves"]
            self.reflects, self.keeps_energy = inputs["reflects"], inputs["keeps_energy"]
            self.film, self.specular_tint = film_of(inputs), inputs.get("specular_tint", None)
            self.kind = str(inputs.get("distribution", "ggx"))
            self.is_colored = self.film is not None or self.specular_tint is not None
            kinds = (
                (mi.BSDFFlags.DeltaReflection, mi.BSDFFlags.DeltaTransmission)
                if self.smooth
                else (mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission)
            )
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.kinds = [int(kind) for kind in kinds]
            self.m_flags = int(kinds[0] | kinds[1] | sides)
            if not self.smooth:
                self.roughness = inputs["roughness"]
                self.layers = inputs.get("layers", 0)
                self.first_place, self.per_place = inputs.get("first_place", None), inputs.get("per_place", None)
                if self.keeps_energy:
                    self.tables = [(inputs[side], inputs[f"{side}_mean"]) for side in ("outside", "inside")]
                if self.film is not None or (self.is_colored and self.keeps_energy):
                    self.mirror, self.facing = inputs["single"], facing_of(inputs)

        def relative_ior(self, si: Any, active: Any) -> Any:
            """Index of the far side over that of the near side."""
            value = self.ior.eval(si, active)[0] if self.disperses else self.ior.eval_1(si, active)
            value = dr.maximum(value, 1e-3)
            if not self.smooth:
                # facets that bend no light send it all in one direction, of which they have no density
                value = dr.select(dr.abs(value - 1.0) < LEAST_BEND, 1.0 + dr.copysign(LEAST_BEND, value - 1.0), value)
            return dr.select(si.wi.z > 0.0, value, dr.rcp(value))

        def roughness_at(self, si: Any, active: Any) -> Any:
            """From 0 to 1; that of Refraction alone counts by its size, as in Cycles."""
            value = self.roughness.eval_1(si, active)
            return dr.clip(value if self.reflects else dr.abs(value), 0.0, 1.0)

        def transmission_color(self, si: Any, active: Any) -> Any:
            color = self.transmission.eval(si, active)
            return dr.sqrt(dr.clip(color, 0.0, 1.0)) if self.halves else color

        def reflectance(self, si: Any, facing: Any, eta: Any, active: Any) -> tuple[Any, Any, Any]:
            """Share that is reflected, share that passes, and the cosine inside; Refraction alone reflects nothing."""
            reflected, inner, _, _ = mi.fresnel(facing, eta)
            if self.film is not None:
                # seen from within, the film lies between glass and air
                film, outer = self.film.at(mi, dr, si, active), si.wi.z > 0.0
                before, behind = dr.select(outer, 1.0, dr.rcp(eta)), dr.select(outer, eta, 1.0)
                reflected = dr.select(reflected < 1.0, film.on_dielectric(facing, before, behind), 1.0)
            if self.specular_tint is not None:
                # the tint colors the more, the less is reflected (Cycles: F0 is tinted, F90 is white)
                facing = dr.square((eta - 1.0) / (eta + 1.0))
                share = dr.clip((1.0 - reflected) / dr.maximum(1.0 - facing, 1e-6), 0.0, 1.0)
                tint = self.specular_tint.eval(si, active)
                plain = facing * tint * share + (1.0 - share)
                reflected = plain if self.film is None else reflected * dr.lerp(mi.Spectrum(1.0), tint, share)
            if self.reflects:
                return reflected, 1.0 - reflected, inner
            return mi.Float(0.0), dr.select(reflected < 1.0, mi.Float(1.0), 0.0), inner

        def chance(self, share: Any) -> Any:
            """Probability of drawing a share of light: itself, or its mean if a film or a tint colors it."""
            return channel_mean(dr, share) if self.is_colored else share

        def under_color(self, si: Any, roughness: Any, cosine: Any, single: Any, active: Any) -> Any:
            """Energy of one bounce with a film or a tint, from that without: the light that these transmit in place of
            reflecting is masked by facets in another way. Fresnel factors are taken at equal parts of the facets.
            """
            eta = self.relative_ior(si, active)
            facing = [part(roughness, cosine) for part in self.facing]
            bare = sum(mi.fresnel(place, eta)[0] for place in facing) / len(facing)
            colored = sum(self.reflectance(si, place, eta, active)[0] for place in facing) / len(facing)
            mirror = self.mirror(roughness, cosine)
            changed = single + (bare - colored) * (single - mirror) / dr.maximum(1.0 - bare, 1e-3)
            return dr.clip(changed, 0.05, 1.0)

        def energy(self, si: Any, eta: Any, roughness: Any, cosine: Any) -> tuple[Any, Any]:
            """Energy of one bounce between facets, and its mean over the hemisphere."""
            place, outer = None, si.wi.z > 0.0
            if self.layers:
                place, outer = dr.sqrt(dr.abs(eta - 1.0) / (eta + 1.0)) / HIGHEST, eta > 1.0
            if self.first_place is not None:
                place = (place - self.first_place.eval_1(si)) * self.per_place.eval_1(si)
            read = lambda table: (  # noqa: E731
                table(roughness, cosine) if place is None else table.layer(place, roughness, cosine, self.layers)
            )
            single, mean = (dr.select(outer, read(a), read(b)) for a, b in zip(*self.tables, strict=True))
            return single, mean

        def sample(self, ctx: Any, hit: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            si = with_valid_normal(mi, dr, hit)
            active = active & sees_facets(mi, dr, si)
            eta = self.relative_ior(si, active)
            wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
            normal = mi.Vector3f(0, 0, 1)
            if not self.smooth:
                roughness = self.roughness_at(si, active)
                facets = Microfacets(mi, dr, roughness, kind=self.kind, least=least_alpha(si))
                normal = facets.distribution.sample(wi, sample2)[0]
            facing = dr.dot(wi, normal)
            reflected, passes, inner = self.reflectance(si, facing, eta, active)
            likely = self.chance(reflected)
            reflects = (sample1 <= likely) & (likely > 0.0)
            refraction = (facing / eta - dr.abs(inner)) * normal - wi / eta
            wo = dr.select(reflects, 2.0 * facing * normal - wi, refraction)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = hit.to_local(si.to_world(mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))))
            bs.eta = mi.Float(1.0)
            bs.sampled_type = dr.select(reflects, mi.UInt32(self.kinds[0]), mi.UInt32(self.kinds[1]))
            if self.smooth:
                bs.pdf = dr.select(reflects, likely, self.chance(passes))
                color = dr.select(reflects, self.reflection_color.eval(si, active), self.transmission_color(si, active))
                if self.is_colored:
                    color *= dr.select(reflects, reflected, passes) / dr.maximum(bs.pdf, 1e-6)
                return bs, dr.select(active & (bs.pdf > 0.0), color, 0.0)
            value, density = self.eval_pdf(ctx, hit, bs.wo, active)
            sane = active & (density > 0.0) & (reflects == (wo.z > 0.0)) & (facing > 0.0)
            bs.pdf = dr.select(sane, density, 0.0)
            return bs, dr.select(sane, value / dr.maximum(density, 1e-20), 0.0)

        def eval_pdf(self, ctx: Any, hit: Any, wo: Any, active: Any = True) -> Any:
            if self.smooth:
                return mi.Spectrum(0.0), mi.Float(0.0)
            si = with_valid_normal(mi, dr, hit)
            wo = si.to_local(hit.to_world(wo))
            active = active & keeps_side(mi, dr, si, wo) & sees_facets(mi, dr, si)
            eta = self.relative_ior(si, active)
            roughness = self.roughness_at(si, active)
            facets = Microfacets(mi, dr, roughness, kind=self.kind, least=least_alpha(si))
            wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
            wo = mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))
            mirror, mirror_density, facing = facets.reflection(wi, wo)
            reflected, _, _ = self.reflectance(si, facing, eta, active)
            # Walter et al. 2007, Eqs. 16, 17 and 21, with η relative to the side of wi
            half = wi + wo * eta
            size = dr.maximum(dr.squared_norm(half), 1e-12)
            half = dr.mulsign(half * dr.rsqrt(size), half.z)
            into, out = dr.dot(wi, half), dr.dot(wo, half)
            # Cycles also counts facets that light from a lamp meets from behind, which no drawn direction has
            crossing = (wo.z < 0.0) & (wi.z > 0.0) & (((into > 0.0) & (out < 0.0)) | is_sampled(si))
            into = dr.abs(into)
            _, passed, _ = self.reflectance(si, into, eta, active)
            stretch = dr.square(eta) * dr.abs(out) / size
            seen = facets.distribution.eval(half) * into / (wi.z * (1.0 + facets.smith_lambda(wi)))
            through = dr.select(crossing, seen * stretch, 0.0)
            masked = facets.masking(wi, mi.Vector3f(wo.x, wo.y, dr.abs(wo.z)))

            def kept(color: Any) -> Any:
                if not self.keeps_energy:
                    return mi.Float(1.0)
                single, mean = self.energy(si, eta, roughness, wi.z)
                if self.is_colored:
                    single = self.under_color(si, roughness, wi.z, single, active)
                return kept_of(single, mean, color)

            # as in Cycles, light between facets has the color of the transmission, also where it is reflected
            tint = self.transmission_color(si, active)
            value = self.reflection_color.eval(si, active) * (reflected * mirror) + tint * (passed * through * masked)
            value *= kept(dr.minimum(tint, 1.0))
            density = self.chance(reflected) * mirror_density + self.chance(passed) * through
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

    register_closure(mi, "blender_glass", BlenderGlass)
