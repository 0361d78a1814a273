# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_glossy`` and ``blender_principled``: reflecting BSDFs that follow Cycles' formulas, both sides alike."""

from __future__ import annotations

from functools import partial
from typing import Any

from spectral_core.render.plugins import albedo, opaque_number
from spectral_core.render.plugins.matt import oren_nayar
from spectral_core.render.plugins.microfacet import AlbedoTable, KeptEnergy, Microfacets


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDFs for the active variant."""
    number = partial(opaque_number, mi, dr)

    class BothSides(mi.BSDF):
        """A reflecting BSDF that only knows its upper side: everything is turned there first."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [int(flags)]
            self.m_flags = int(flags)
            self.kept_energy = KeptEnergy(mi, albedo.conductor())

        def turned(self, si: Any, direction: Any) -> Any:
            return mi.Vector3f(direction.x, direction.y, dr.mulsign(direction.z, si.wi.z))

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wi = self.turned(si, si.wi)
            wo = self.draw(si, wi, (sample1, sample2), active)
            value, density = self.reflect(si, wi, wo, active)
            valid = active & (density > 0.0) & (wi.z > 0.0)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta = self.turned(si, wo), mi.Float(1.0)
            bs.pdf = dr.select(valid, density, 0.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
            return bs, dr.select(valid, value / dr.maximum(density, 1e-20), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value, density = self.reflect(si, self.turned(si, si.wi), self.turned(si, wo), active)
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def to_string(self) -> str:
            return type(self).__name__

    class BlenderGlossy(BothSides):
        """``color`` times a rough mirror of ``roughness`` (a texture), energy kept."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.color, self.roughness = properties["color"], properties["roughness"]
            self.keeps_energy = bool(properties.get("keeps_energy", True))

        def draw(self, si: Any, wi: Any, samples: Any, active: Any) -> Any:
            facets = Microfacets(mi, dr, self.roughness.eval_1(si, active))
            return facets.mirrored(wi, samples[1])[0]

        def reflect(self, si: Any, wi: Any, wo: Any, active: Any) -> Any:
            roughness, color = self.roughness.eval_1(si, active), self.color.eval(si, active)
            value, density, _ = Microfacets(mi, dr, roughness).reflection(wi, wo)
            if self.keeps_energy:
                color = color * self.kept_energy(roughness, wi.z, color)
            return color * value, density

    class BlenderPrincipled(BothSides):
        """The opaque part of Blender's Principled BSDF: coat over (metal mixed with specular over diffuse).

        ``base_color``, ``metallic``, ``roughness``: textures; ``ior``, ``coat_weight``, ``coat_roughness``: numbers.
        As in Cycles a layer takes its directional albedo at the view direction away from what lies below.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.DiffuseReflection
            flags = flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [int(flags)]
            self.m_flags = int(flags)
            self.base_color, self.metallic = properties["base_color"], properties["metallic"]
            self.roughness, ior = properties["roughness"], float(properties["ior"])
            self.ior, self.ior_fresnel = number(ior), number(self.average_fresnel(ior))
            self.has_coat, self.has_specular = properties["coat_weight"] > 0, abs(ior - 1.0) > 1e-4
            self.coat_weight = number(properties["coat_weight"])
            self.coat_roughness = number(properties["coat_roughness"])
            coat_ior = float(properties["coat_ior"])
            self.coat_ior, self.coat_fresnel = number(coat_ior), number(self.average_fresnel(coat_ior))
            self.coat_tint = properties.get("coat_tint", None)
            self.diffuse_roughness = properties.get("diffuse_roughness", None)
            self.keeps_energy = bool(properties["keeps_energy"])
            self.specular_albedo = self.layer_albedo(ior, self.keeps_energy)
            self.coat_albedo = self.layer_albedo(coat_ior, True)

        def layer_albedo(self, ior: float, keeps_energy: bool) -> Any:
            """Directional albedo of a rough dielectric's reflection, the energy between facets included if kept."""
            reflected, _ = albedo.dielectric(round(ior, 6))
            single = albedo.conductor()
            if not keeps_energy:
                # Cycles layers by the facets' mean Fresnel factor, as if none of the light were lost between them
                return AlbedoTable(mi, reflected / single)
            mean, average_fresnel = albedo.average(single)[:, None], self.average_fresnel(ior)
            many = average_fresnel * mean / (1 - average_fresnel * (1 - mean))
            return AlbedoTable(mi, reflected * (1 + many * (1 - single) / single))

        @staticmethod
        def average_fresnel(ior: float) -> float:
            """2 ∫ F(μ) μ dμ of a dielectric."""
            import numpy as np

            cosine = (np.arange(256) + 0.5) / 256
            return float((albedo.fresnel_dielectric(cosine, ior) * cosine).mean() * 2)

        def lobes(self, si: Any, wi: Any, active: Any) -> Any:
            """Values at a point, and the chance of drawing coat, metal, specular and diffuse."""
            color = self.base_color.eval(si, active)
            metallic = dr.clip(self.metallic.eval_1(si, active), 0.0, 1.0)
            roughness = dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
            coat = self.coat_weight * self.coat_albedo(mi.Float(self.coat_roughness), wi.z)
            below_coat = mi.Spectrum(1.0 - coat)
            if self.coat_tint is not None:
                # absorption on the refracted way through the coat (Cycles: tint to the power of 1 / cosine inside)
                inner = dr.safe_sqrt(1.0 - (1.0 - wi.z * wi.z) / (self.coat_ior * self.coat_ior))
                tint = dr.maximum(self.coat_tint.eval(si, active), 1e-6) ** dr.rcp(dr.maximum(inner, 1e-3))
                below_coat *= dr.lerp(mi.Spectrum(1.0), tint, self.coat_weight)
            specular = self.specular_albedo(roughness, wi.z) if self.has_specular else mi.Float(0.0)
            brightness, passes = dr.maximum(dr.mean(color), 0.02), dr.mean(below_coat)
            chances = [
                coat,
                passes * metallic * brightness,
                passes * (1.0 - metallic) * specular,
                passes * (1.0 - metallic) * (1.0 - specular) * brightness,
            ]
            total = sum(chances[1:], chances[0])
            return color, metallic, roughness, below_coat, specular, [chance / total for chance in chances]

        def draw(self, si: Any, wi: Any, samples: Any, active: Any) -> Any:
            _, _, roughness, _, _, chances = self.lobes(si, wi, active)
            sample1, sample2 = samples
            in_coat = sample1 < chances[0]
            in_facets = sample1 < chances[0] + chances[1] + chances[2]
            facets = Microfacets(mi, dr, dr.select(in_coat, self.coat_roughness, roughness))
            mirrored, _ = facets.mirrored(wi, sample2)
            return dr.select(in_facets, mirrored, mi.warp.square_to_cosine_hemisphere(sample2))

        def reflect(self, si: Any, wi: Any, wo: Any, active: Any) -> Any:
            color, metallic, roughness, below_coat, specular, chances = self.lobes(si, wi, active)
            lambert = dr.select((wi.z > 0.0) & (wo.z > 0.0), wo.z / dr.pi, 0.0)
            mirror, mirror_density, facing = Microfacets(mi, dr, roughness).reflection(wi, wo)
            # Schlick with F82 = 1, the default tint (Kutz, Hasan and Edmondson 2021, Eq. 3, without their b term)
            grazing = dr.clip(1.0 - facing, 0.0, 1.0) ** 5
            metal = color + (1.0 - color) * grazing
            if self.keeps_energy:
                metal *= self.kept_energy(roughness, wi.z, color + (1.0 - color) / 21.0)
            value = metallic * metal * mirror
            diffuse = color * lambert
            if self.diffuse_roughness is not None:
                rough = dr.clip(self.diffuse_roughness.eval_1(si, active), 0.0, 1.0)
                diffuse = dr.select(lambert > 0.0, oren_nayar(mi, dr, color, rough, wi, wo), 0.0)
            value += (1.0 - metallic) * (1.0 - specular) * diffuse
            if self.has_specular:
                kept = mi.Float(1.0)
                if self.keeps_energy:
                    kept = self.kept_energy(roughness, wi.z, mi.Float(self.ior_fresnel))
                value += (1.0 - metallic) * mi.fresnel(facing, self.ior)[0] * kept * mirror
            value *= below_coat
            density = (chances[1] + chances[2]) * mirror_density + chances[3] * lambert
            if self.has_coat:
                coat_roughness = mi.Float(self.coat_roughness)
                coat, coat_density, facing = Microfacets(mi, dr, coat_roughness).reflection(wi, wo)
                kept = self.kept_energy(coat_roughness, wi.z, mi.Float(self.coat_fresnel))
                value += self.coat_weight * mi.fresnel(facing, self.coat_ior)[0] * kept * coat
                density += chances[0] * coat_density
            return value, density

    mi.register_bsdf("blender_glossy", lambda properties: BlenderGlossy(properties))
    mi.register_bsdf("blender_principled", lambda properties: BlenderPrincipled(properties))
