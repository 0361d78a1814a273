# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_glossy`` and ``blender_principled``: reflecting BSDFs that follow Cycles' formulas, both sides alike."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import Closure, register_closure
from spectral_core.render.plugins.closures.matt import oren_nayar
from spectral_core.render.plugins.closures.microfacet import Microfacets, f82, kept_energy
from spectral_core.render.plugins.closures.upright import keeps_side, with_valid_normal
from spectral_core.render.plugins.numbers import channel_mean


def register(mi: Any, dr: Any) -> None:
    """Define and register the closures for the active variant."""

    class BothSides(Closure):
        """A reflecting closure that is defined for the upper side; directions of the lower side are mirrored first.

        ``anisotropy``, ``rotation`` and ``tangent`` (world directions): all three, or none. ``single``, ``mean``:
        tables of the energy that facets keep.
        """

        diffuse_alone = False
        """True if only the diffuse part is evaluated."""

        draw: Any
        reflect: Any

        def __init__(self, inputs: Any, *kinds: Any) -> None:
            super().__init__(inputs)
            flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            for kind in kinds:
                flags = flags | kind
            self.m_flags = int(flags)
            self.single, self.mean = inputs["single"], inputs["mean"]
            self.anisotropy = inputs.get("anisotropy", None)
            self.rotation, self.tangent = inputs.get("rotation", None), inputs.get("tangent", None)
            self.keeps_energy = bool(inputs.get("keeps_energy", True))

        def kept(self, roughness: Any, cosine: Any, average_fresnel: Any) -> Any:
            return kept_energy(self.single, self.mean, roughness, cosine, average_fresnel)

        def turned(self, si: Any, direction: Any) -> Any:
            return mi.Vector3f(direction.x, direction.y, dr.mulsign(direction.z, si.wi.z))

        def lobe_axes(self, si: Any, active: Any) -> tuple[Any, Any] | None:
            """Cosine and sine of the lobe's direction in the local frame; None for an isotropic lobe."""
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
            """A direction rotated so that the lobe's is along x, or back."""
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

    class BlenderGlossy(BothSides):
        """``color`` times a rough mirror of ``roughness`` (textures); toward grazing ``edge_tint`` makes it a metal."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.color, self.roughness = inputs["color"], inputs["roughness"]
            self.edge_tint = inputs.get("edge_tint", None)
            self.kind = str(inputs.get("distribution", "ggx"))
            self.keeps_energy &= self.kind == "ggx"  # the table of energy between facets holds for GGX

        def stretch(self, si: Any, active: Any) -> Any:
            """Cycles' Glossy BSDF defines anisotropy differently from its metals, and from -1 to 1."""
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
                color = color * self.kept(facets.roughness, wi.z, average)
            return color * value, density

    class BlenderPrincipled(BothSides):
        """The opaque part of Blender's Principled BSDF: coat over (metal mixed with specular over diffuse).

        ``specular_tint``, ``diffuse_roughness``, what begins with ``coat`` and ``subsurface`` may be absent. ``ior``
        and ``coat_ior`` come with the reflectance seen straight on, its hemispherical mean and the table of the
        directional albedo. As in Cycles a layer takes that albedo at the view direction away from what lies below.
        """

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs, mi.BSDFFlags.DiffuseReflection)
            self.base_color, self.metallic = inputs["base_color"], inputs["metallic"]
            self.roughness, self.ior = inputs["roughness"], inputs["ior"]
            self.ior_fresnel, self.facing_reflectance = inputs["ior_fresnel"], inputs["facing_reflectance"]
            self.specular_albedo = inputs["specular_albedo"]
            self.coat_weight, self.coat_roughness = inputs.get("coat_weight", None), inputs.get("coat_roughness", None)
            if self.coat_weight is not None:
                self.coat_ior, self.coat_fresnel = inputs["coat_ior"], inputs["coat_fresnel"]
                self.coat_albedo = inputs["coat_albedo"]
            self.coat_tint = inputs.get("coat_tint", None)
            self.specular_tint = inputs.get("specular_tint", None)
            self.edge_tint = inputs.get("edge_tint", None)
            self.diffuse_roughness = inputs.get("diffuse_roughness", None)
            self.below = inputs.get("subsurface", None)
            self.below_weight = inputs.get("subsurface_weight", None)

        def tinted(self, si: Any, reflectance: Any, active: Any) -> Any:
            """A dielectric's reflectance with the specular tint at normal incidence."""
            if self.specular_tint is None:
                return reflectance
            facing = self.facing_reflectance.eval_1(si, active)
            grazing = dr.clip((reflectance - facing) / (1.0 - facing), 0.0, 1.0)
            return dr.lerp(self.specular_tint.eval(si, active) * facing, mi.Spectrum(1.0), grazing)

        def layers(self, si: Any, wi: Any, active: Any) -> Any:
            """Values at a point, and the probabilities of drawing coat, metal, specular and diffuse."""
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
                # absorption along the refracted path through the coat (Cycles: tint to the power of 1 / cosine inside)
                inner = dr.safe_sqrt(1.0 - (1.0 - wi.z * wi.z) / dr.square(self.coat_ior.eval_1(si, active)))
                tint = dr.maximum(self.coat_tint.eval(si, active), 1e-6) ** dr.rcp(dr.maximum(inner, 1e-3))
                below_coat *= dr.lerp(mi.Spectrum(1.0), tint, coat_weight)
            specular = mi.Spectrum(self.tinted(si, self.specular_albedo(roughness, wi.z), active))
            brightness, passes = dr.maximum(channel_mean(dr, color), 0.02), channel_mean(dr, below_coat)
            chances = [
                coat,
                passes * metallic * brightness,
                passes * (1.0 - metallic) * channel_mean(dr, specular),
                passes * (1.0 - metallic) * (1.0 - channel_mean(dr, specular)) * brightness,
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
            # the first part of the samples that are drawn as diffuse goes below the surface
            dives = active & (sample1 >= start) & (sample1 - start < chances[3] * share) & (wi.z > 0.0)
            dive, color = self.below.sample(ctx, si, sample1, sample2, dives)
            above = channel_mean(dr, below_coat) * (1.0 - metallic) * (1.0 - dr.max(specular))
            dive.pdf = above / dr.maximum(chances[3], 1e-9)
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
                metal *= self.kept(roughness, wi.z, average)
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
            kept = mi.Float(1.0)
            if self.keeps_energy:
                kept = self.kept(roughness, wi.z, self.tinted(si, self.ior_fresnel.eval_1(si, active), active))
            reflected = mi.fresnel(facing, self.ior.eval_1(si, active))[0]
            value += (1.0 - metallic) * self.tinted(si, reflected, active) * kept * mirror
            value *= below_coat
            density = (chances[1] + chances[2]) * mirror_density + chances[3] * above * lambert
            if self.coat_weight is not None:
                coat, coat_density, facing = Microfacets(mi, dr, coat_roughness).reflection(wi, wo)
                kept = self.kept(coat_roughness, wi.z, self.coat_fresnel.eval_1(si, active))
                value += coat_weight * mi.fresnel(facing, self.coat_ior.eval_1(si, active))[0] * kept * coat
                density += chances[0] * coat_density
            return value, density

    register_closure(mi, "blender_glossy", BlenderGlossy)
    register_closure(mi, "blender_principled", BlenderPrincipled)
