# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_glossy`` and ``blender_principled``: reflecting BSDFs that follow Cycles' formulas, both sides alike."""

from __future__ import annotations

from functools import partial
from typing import Any

from spectral_core.render.plugins.closures import albedo
from spectral_core.render.plugins.closures.matt import oren_nayar
from spectral_core.render.plugins.closures.microfacet import AlbedoTable, KeptEnergy, Microfacets, f82
from spectral_core.render.plugins.closures.upright import keeps_side, with_valid_normal
from spectral_core.render.plugins.numbers import opaque_number


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDFs for the active variant."""
    number = partial(opaque_number, mi, dr)

    class BothSides(mi.BSDF):
        """A reflecting BSDF that only knows its upper side: everything is turned there first.

        ``anisotropy``, ``rotation`` (textures) and ``tangent`` (a texture of world directions): all three, or none.
        """

        diffuse_alone = False
        """Whether only what is diffuse is asked for."""

        def __init__(self, properties: Any, *kinds: Any) -> None:
            super().__init__(properties)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            for kind in kinds:
                flags = flags | kind
            self.m_components = [int(flags)]
            self.m_flags = int(flags)
            self.kept_energy = KeptEnergy(mi, albedo.conductor())
            self.anisotropy = properties.get("anisotropy", None)
            self.rotation, self.tangent = properties.get("rotation", None), properties.get("tangent", None)
            self.keeps_energy = bool(properties.get("keeps_energy", True))

        def turned(self, si: Any, direction: Any) -> Any:
            return mi.Vector3f(direction.x, direction.y, dr.mulsign(direction.z, si.wi.z))

        def lobe_axes(self, si: Any, active: Any) -> tuple[Any, Any] | None:
            """Cosine and sine of the lobe's direction in the local frame; None where there is no direction."""
            if self.anisotropy is None:
                return None
            along = si.to_local(mi.Vector3f(mi.Color3f(self.tangent.eval_3(si, active))))
            size = dr.rsqrt(dr.maximum(along.x * along.x + along.y * along.y, 1e-20))
            turn = 2.0 * dr.pi * self.rotation.eval_1(si, active)
            sine, cosine = dr.sincos(turn)
            x, y = along.x * size, along.y * size
            return x * cosine - y * sine, y * cosine + x * sine

        @staticmethod
        def aligned(axes: Any, direction: Any, back: bool = False) -> Any:
            """A direction with the lobe's along x, or back again."""
            if axes is None:
                return direction
            cosine, sine = axes[0], -axes[1] if back else axes[1]
            x, y = direction.x * cosine + direction.y * sine, direction.y * cosine - direction.x * sine
            return mi.Vector3f(x, y, direction.z)

        def stretch(self, si: Any, active: Any) -> Any:
            """Factors on alpha along and across the lobe's direction (Cycles' Principled and Metallic BSDF)."""
            if self.anisotropy is None:
                return None
            aspect = dr.sqrt(1.0 - 0.9 * dr.clip(self.anisotropy.eval_1(si, active), 0.0, 1.0))
            return dr.rcp(aspect), aspect

        def sample(self, ctx: Any, hit: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            si = with_valid_normal(mi, dr, hit)
            axes = self.lobe_axes(si, active)
            wi = self.aligned(axes, self.turned(si, si.wi))
            wo = self.draw(si, wi, (sample1, sample2), active)
            value, density = self.reflect(si, wi, wo, active)
            valid = active & (density > 0.0) & (wi.z > 0.0)
            bs = dr.zeros(mi.BSDFSample3f)
            outward = self.turned(si, self.aligned(axes, wo, back=True))
            bs.wo, bs.eta = hit.to_local(si.to_world(outward)), mi.Float(1.0)
            bs.pdf = dr.select(valid, density, 0.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
            return bs, dr.select(valid, value / dr.maximum(density, 1e-20), 0.0)

        def eval_pdf(self, ctx: Any, hit: Any, wo: Any, active: Any = True) -> Any:
            si = with_valid_normal(mi, dr, hit)
            wo = si.to_local(hit.to_world(wo))
            active = active & keeps_side(mi, dr, si, wo)
            axes = self.lobe_axes(si, active)
            wi, wo = (self.aligned(axes, self.turned(si, direction)) for direction in (si.wi, wo))
            self.diffuse_alone = ctx.type_mask == int(mi.BSDFFlags.Diffuse)
            value, density = self.reflect(si, wi, wo, active)
            self.diffuse_alone = False
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
        """``color`` times a rough mirror of ``roughness`` (textures); toward grazing ``edge_tint`` makes it a metal."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.color, self.roughness = properties["color"], properties["roughness"]
            self.edge_tint = properties.get("edge_tint", None)
            self.kind = str(properties.get("distribution", "ggx"))
            self.keeps_energy &= self.kind == "ggx"  # the table of what is lost between facets is GGX's

        def stretch(self, si: Any, active: Any) -> Any:
            """Cycles' Glossy BSDF counts anisotropy in another way than its metals do, and from -1 to 1."""
            if self.anisotropy is None or self.edge_tint is not None:
                return super().stretch(si, active)
            amount = dr.clip(self.anisotropy.eval_1(si, active), -0.99, 0.99)
            return dr.select(amount < 0.0, dr.rcp(1.0 + amount), 1.0 - amount), dr.select(
                amount < 0.0, 1.0 + amount, dr.rcp(1.0 - amount)
            )

        def facets(self, si: Any, active: Any) -> Any:
            return Microfacets(mi, dr, self.roughness.eval_1(si, active), self.stretch(si, active), self.kind)

        def draw(self, si: Any, wi: Any, samples: Any, active: Any) -> Any:
            return self.facets(si, active).mirrored(wi, samples[1])[0]

        def reflect(self, si: Any, wi: Any, wo: Any, active: Any) -> Any:
            color, facets = self.color.eval(si, active), self.facets(si, active)
            value, density, facing = facets.reflection(wi, wo)
            average = color
            if self.edge_tint is not None:
                color, average = f82(dr, color, self.edge_tint.eval(si, active), facing)
            if self.keeps_energy:
                color = color * self.kept_energy(facets.roughness, wi.z, average)
            return color * value, density

    class BlenderPrincipled(BothSides):
        """The opaque part of Blender's Principled BSDF: coat over (metal mixed with specular over diffuse).

        ``base_color``, ``metallic``, ``roughness``, ``coat_weight``, ``coat_roughness``: textures; ``specular_tint``,
        ``coat_tint``, ``diffuse_roughness``: textures or absent; ``ior``, ``coat_ior``: numbers. As in Cycles a layer
        takes its directional albedo at the view direction away from what lies below.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties, mi.BSDFFlags.DiffuseReflection)
            self.base_color, self.metallic = properties["base_color"], properties["metallic"]
            self.roughness, ior = properties["roughness"], float(properties["ior"])
            self.ior, self.ior_fresnel = number(ior), number(self.average_fresnel(ior))
            self.facing_reflectance = number(((ior - 1.0) / (ior + 1.0)) ** 2)
            self.has_specular = abs(ior - 1.0) > 1e-4
            self.coat_weight, self.coat_roughness = properties.get("coat_weight", None), properties["coat_roughness"]
            coat_ior = float(properties["coat_ior"])
            self.coat_ior, self.coat_fresnel = number(coat_ior), number(self.average_fresnel(coat_ior))
            self.coat_tint = properties.get("coat_tint", None)
            self.specular_tint = properties.get("specular_tint", None)
            self.edge_tint = properties.get("edge_tint", None)
            self.diffuse_roughness = properties.get("diffuse_roughness", None)
            self.below = properties.get("subsurface", None)
            self.below_weight = properties.get("subsurface_weight", None)
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

        def tinted(self, si: Any, reflectance: Any, active: Any) -> Any:
            """A dielectric's reflectance with the specular tint on what it reflects when seen straight on."""
            if self.specular_tint is None:
                return reflectance
            facing = self.facing_reflectance
            grazing = dr.clip((reflectance - facing) / (1.0 - facing), 0.0, 1.0)
            return dr.lerp(self.specular_tint.eval(si, active) * facing, mi.Spectrum(1.0), grazing)

        def layers(self, si: Any, wi: Any, active: Any) -> Any:
            """Values at a point, and the chance of drawing coat, metal, specular and diffuse."""
            color = self.base_color.eval(si, active)
            metallic = dr.clip(self.metallic.eval_1(si, active), 0.0, 1.0)
            roughness = dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
            below_coat, coat = mi.Spectrum(1.0), mi.Float(0.0)
            coat_weight, coat_roughness = mi.Float(0.0), mi.Float(0.0)
            if self.coat_weight is not None:
                coat_weight = dr.clip(self.coat_weight.eval_1(si, active), 0.0, 1.0)
                coat_roughness = dr.clip(self.coat_roughness.eval_1(si, active), 0.0, 1.0)
                coat = coat_weight * self.coat_albedo(coat_roughness, wi.z)
                below_coat = mi.Spectrum(1.0 - coat)
            if self.coat_weight is not None and self.coat_tint is not None:
                # absorption on the refracted way through the coat (Cycles: tint to the power of 1 / cosine inside)
                inner = dr.safe_sqrt(1.0 - (1.0 - wi.z * wi.z) / (self.coat_ior * self.coat_ior))
                tint = dr.maximum(self.coat_tint.eval(si, active), 1e-6) ** dr.rcp(dr.maximum(inner, 1e-3))
                below_coat *= dr.lerp(mi.Spectrum(1.0), tint, coat_weight)
            specular = mi.Spectrum(0.0)
            if self.has_specular:
                specular = mi.Spectrum(self.tinted(si, self.specular_albedo(roughness, wi.z), active))
            brightness, passes = dr.maximum(dr.mean(color), 0.02), dr.mean(below_coat)
            chances = [
                coat,
                passes * metallic * brightness,
                passes * (1.0 - metallic) * dr.mean(specular),
                passes * (1.0 - metallic) * (1.0 - dr.mean(specular)) * brightness,
            ]
            total = sum(chances[1:], chances[0])
            chances = [chance / total for chance in chances]
            return color, metallic, roughness, below_coat, specular, chances, coat_weight, coat_roughness

        def sample(self, ctx: Any, hit: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs, value = super().sample(ctx, hit, sample1, sample2, active)
            if self.below is None:
                return bs, value
            si = with_valid_normal(mi, dr, hit)
            wi = self.aligned(self.lobe_axes(si, active), self.turned(si, si.wi))
            _, metallic, _, below_coat, specular, chances, _, _ = self.layers(si, wi, active)
            start = chances[0] + chances[1] + chances[2]
            share = self.share_below(si, active)
            # of what is drawn as diffuse the first part goes below the surface
            dives = active & (sample1 >= start) & (sample1 - start < chances[3] * share) & (wi.z > 0.0)
            dive, color = self.below.sample(ctx, si, sample1, sample2, dives)
            dive.pdf = dr.mean(below_coat) * (1.0 - metallic) * (1.0 - dr.max(specular)) / dr.maximum(chances[3], 1e-9)
            return dr.select(dives, dive, bs), dr.select(dives, color, value)

        def share_below(self, si: Any, active: Any) -> Any:
            """Share of the diffuse light that goes below the surface."""
            return dr.clip(self.below_weight.eval_1(si, active), 0.0, 1.0)

        def draw(self, si: Any, wi: Any, samples: Any, active: Any) -> Any:
            _, _, roughness, _, _, chances, _, coat_roughness = self.layers(si, wi, active)
            sample1, sample2 = samples
            in_facets = sample1 < chances[0] + chances[1] + chances[2]
            stretch = self.stretch(si, active)
            if self.coat_weight is not None:
                in_coat = sample1 < chances[0]
                roughness = dr.select(in_coat, coat_roughness, roughness)
                if stretch is not None:
                    stretch = tuple(dr.select(in_coat, 1.0, part) for part in stretch)
            facets = Microfacets(mi, dr, roughness, stretch)
            mirrored, _ = facets.mirrored(wi, sample2)
            return dr.select(in_facets, mirrored, mi.warp.square_to_cosine_hemisphere(sample2))

        def reflect(self, si: Any, wi: Any, wo: Any, active: Any) -> Any:
            found = self.layers(si, wi, active)
            color, metallic, roughness, below_coat, specular, chances, coat_weight, coat_roughness = found
            lambert = dr.select((wi.z > 0.0) & (wo.z > 0.0), wo.z / dr.pi, 0.0)
            facets = Microfacets(mi, dr, roughness, self.stretch(si, active))
            mirror, mirror_density, facing = facets.reflection(wi, wo)
            edge = mi.Spectrum(1.0) if self.edge_tint is None else self.edge_tint.eval(si, active)
            metal, average = f82(dr, color, edge, facing)
            if self.keeps_energy:
                metal *= self.kept_energy(roughness, wi.z, average)
            value = metallic * metal * mirror
            diffuse = color * lambert
            if self.diffuse_roughness is not None:
                rough = dr.clip(self.diffuse_roughness.eval_1(si, active), 0.0, 1.0)
                diffuse = dr.select(lambert > 0.0, oren_nayar(mi, dr, color, rough, wi, wo), 0.0)
            above = mi.Float(1.0)
            if self.below is not None:
                above = 1.0 - self.share_below(si, active)
            diffuse *= (1.0 - metallic) * (1.0 - dr.max(specular)) * above
            if self.diffuse_alone:
                return diffuse * below_coat, mi.Float(0.0)
            value += diffuse
            if self.has_specular:
                kept = mi.Float(1.0)
                if self.keeps_energy:
                    kept = self.kept_energy(roughness, wi.z, self.tinted(si, mi.Float(self.ior_fresnel), active))
                value += (1.0 - metallic) * self.tinted(si, mi.fresnel(facing, self.ior)[0], active) * kept * mirror
            value *= below_coat
            density = (chances[1] + chances[2]) * mirror_density + chances[3] * above * lambert
            if self.coat_weight is not None:
                coat, coat_density, facing = Microfacets(mi, dr, coat_roughness).reflection(wi, wo)
                kept = self.kept_energy(coat_roughness, wi.z, mi.Float(self.coat_fresnel))
                value += coat_weight * mi.fresnel(facing, self.coat_ior)[0] * kept * coat
                density += chances[0] * coat_density
            return value, density

    mi.register_bsdf("blender_glossy", lambda properties: BlenderGlossy(properties))
    mi.register_bsdf("blender_principled", lambda properties: BlenderPrincipled(properties))
