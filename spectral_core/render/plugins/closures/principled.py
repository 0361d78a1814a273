# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_principled``: the opaque part of Blender's Principled BSDF."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.coat import Coat
from spectral_core.render.plugins.closures.facets.albedo import HIGHEST
from spectral_core.render.plugins.closures.facets.film import facing_of, film_of, metal_reflectance
from spectral_core.render.plugins.closures.facets.microfacet import Microfacets, least_alpha
from spectral_core.render.plugins.closures.facets.upright import sees_facets, softening, with_valid_normal
from spectral_core.render.plugins.closures.lobe import register_closure
from spectral_core.render.plugins.closures.matt import oren_nayar
from spectral_core.render.plugins.closures.rough import both_sides
from spectral_core.render.plugins.numbers import channel_mean

MOST_FACING = 0.99
"""Highest reflectance at normal incidence that a specular level gives (Cycles)."""


class SpecularLayer:
    """Inputs ``ior``, ``facing_reflectance``, ``ior_fresnel`` (mean over the hemisphere) and ``specular_albedo``."""

    def __init__(self, inputs: dict[str, Any]) -> None:
        self.ior, self.inputs = inputs["ior"], inputs

    def index(self, si: Any, active: Any) -> Any:
        """Index of refraction."""
        return self.ior.eval_1(si, active)

    def facing(self, si: Any, active: Any) -> Any:
        """Reflectance at normal incidence."""
        return self.inputs["facing_reflectance"].eval_1(si, active)

    def average(self, si: Any, active: Any) -> Any:
        """Reflectance as a mean over the hemisphere."""
        return self.inputs["ior_fresnel"].eval_1(si, active)

    def albedo(self, si: Any, roughness: Any, cosine: Any, active: Any) -> Any:
        """Directional albedo."""
        return self.inputs["specular_albedo"](roughness, cosine)


def varying_layer(mi: Any, dr: Any) -> Any:
    """Class of layers whose inputs ``ior`` and ``specular_level`` vary; ``specular_layers``: albedos by the index."""

    class VaryingLayer(SpecularLayer):
        """As Cycles computes them at a hit."""

        def index(self, si: Any, active: Any) -> Any:
            ior = dr.maximum(self.ior.eval_1(si, active), 1e-3)
            level = dr.maximum(self.inputs["specular_level"].eval_1(si, active), 0.0)
            facing = dr.clip(dr.square((ior - 1.0) / (ior + 1.0)) * 2.0 * level, 0.0, MOST_FACING)
            root = dr.sqrt(facing)
            raised = (1.0 + root) / (1.0 - root)
            return dr.select(ior < 1.0, dr.rcp(raised), raised)

        def facing(self, si: Any, active: Any) -> Any:
            ior = self.index(si, active)
            return dr.square((ior - 1.0) / (ior + 1.0))

        def average(self, si: Any, active: Any) -> Any:
            # fits of d'Eon 2021, "An analytic BRDF for materials with spherical Lambertian scatterers"
            ior = self.index(si, active)
            above = (ior - 1.0) / (4.08567 + 1.00071 * ior)
            below = 0.997118 + ior * (0.1014 - ior * (0.965241 + ior * 0.130607))
            return dr.select(ior < 1.0, below, above)

        def albedo(self, si: Any, roughness: Any, cosine: Any, active: Any) -> Any:
            ior = self.index(si, active)
            place = dr.sqrt(dr.abs(ior - 1.0) / (ior + 1.0)) / HIGHEST
            return self.inputs["specular_layers"].layer(place, roughness, cosine)

    return VaryingLayer


def specular_layer(mi: Any, dr: Any, inputs: dict[str, Any]) -> Any:
    """The layer of a closure's inputs."""
    return (varying_layer(mi, dr) if "specular_layers" in inputs else SpecularLayer)(inputs)


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""
    reflecting: Any = both_sides(mi, dr)

    class BlenderPrincipled(reflecting):
        """Coat over (metal mixed with specular over diffuse).

        ``specular_tint``, ``diffuse_roughness``, and inputs whose names begin with ``coat`` and ``subsurface`` may be
        absent; the layer below the coat comes with the inputs of ``specular_layer``. As in Cycles a layer subtracts its
        albedo at the view direction from the light of the layers below.
        """

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs, mi.BSDFFlags.DiffuseReflection)
            self.base_color, self.metallic = inputs["base_color"], inputs["metallic"]
            self.roughness, self.specular = inputs["roughness"], specular_layer(mi, dr, inputs)
            self.coat = Coat(inputs) if "coat_weight" in inputs else None
            self.specular_tint = inputs.get("specular_tint", None)
            self.edge_tint = inputs.get("edge_tint", None)
            self.diffuse_roughness = inputs.get("diffuse_roughness", None)
            self.below = inputs.get("subsurface", None)
            self.below_weight = inputs.get("subsurface_weight", None)
            self.dives, self.film = self.below is not None, film_of(inputs)
            self.tints_below = self.dives and "coat_tint" in inputs
            if self.film is not None:
                self.facing = facing_of(inputs)

        def tinted(self, si: Any, reflectance: Any, active: Any) -> Any:
            """A dielectric's reflectance with the specular tint at normal incidence."""
            if self.specular_tint is None:
                return reflectance
            facing = self.specular.facing(si, active)
            grazing = dr.clip((reflectance - facing) / (1.0 - facing), 0.0, 1.0)
            return dr.lerp(self.specular_tint.eval(si, active) * facing, mi.Spectrum(1.0), grazing)

        def film_at(self, si: Any, active: Any) -> Any:
            """The thin film at a hit, None without one."""
            return None if self.film is None else self.film.at(mi, dr, si, active)

        def on_film(self, si: Any, film: Any, cosine: Any, active: Any) -> Any:
            """Reflectance of a dielectric under a thin film; the specular tint colors it more where it is low."""
            reflected = film.on_dielectric(cosine, mi.Float(1.0), self.specular.index(si, active))
            if self.specular_tint is None:
                return reflected
            facing = self.specular.facing(si, active)
            share = dr.clip((1.0 - reflected) / dr.maximum(1.0 - facing, 1e-6), 0.0, 1.0)
            return reflected * dr.lerp(mi.Spectrum(1.0), self.specular_tint.eval(si, active), share)

        def film_albedo(self, si: Any, roughness: Any, cosine: Any, active: Any) -> Any:
            """Directional albedo of the specular layer under a thin film.

            The facets reflect on average as a smooth surface does, as in Cycles, or as parts of them if that is
            more: energy stays below 1. Light between facets is counted if it is kept.
            """
            film = self.film_at(si, active)
            single = self.single(roughness, cosine)
            facets = [self.on_film(si, film, part(roughness, cosine), active) for part in self.facing]
            rough = sum(facets) / len(facets)
            smooth = self.on_film(si, film, cosine, active)
            if not self.keeps_energy:
                return dr.clip(dr.maximum(smooth, single * rough), 0.0, 1.0)
            kept = self.kept(roughness, cosine, self.specular.average(si, active))
            return dr.clip(single * kept * dr.maximum(smooth, rough), 0.0, 1.0)

        def layers(self, si: Any, wi: Any, active: Any) -> Any:
            """Values at a point, and the probabilities of drawing coat, metal, specular and diffuse."""
            color = self.base_color.eval(si, active)
            metallic = dr.clip(self.metallic.eval_1(si, active), 0.0, 1.0)
            roughness = dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
            coat = None if self.coat is None else self.coat.at(mi, dr, si, active)
            below_coat = mi.Spectrum(1.0) if coat is None else coat.below
            if self.film is None:
                specular = mi.Spectrum(self.tinted(si, self.specular.albedo(si, roughness, wi.z, active), active))
            else:
                specular = self.film_albedo(si, roughness, wi.z, active)
            brightness, passes = dr.maximum(channel_mean(dr, color), 0.02), channel_mean(dr, below_coat)
            chances = [
                mi.Float(0.0) if coat is None else coat.share,
                passes * metallic * brightness,
                passes * (1.0 - metallic) * channel_mean(dr, specular),
                passes * (1.0 - metallic) * dr.maximum(1.0 - channel_mean(dr, specular), 0.0) * brightness,
            ]
            total = sum(chances[1:], chances[0])
            chances = [chance / total for chance in chances]
            return color, metallic, roughness, below_coat, specular, chances, coat

        def sample(self, ctx: Any, hit: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs, value = super().sample(ctx, hit, sample1, sample2, active)
            if self.below is None:
                return bs, value
            si = with_valid_normal(mi, dr, hit)
            wi = self.aligned(self.lobe_axes(si, active), self.turned(si, si.wi))
            _, metallic, _, below_coat, specular, chances, _ = self.layers(si, wi, active)
            start = chances[0] + chances[1] + chances[2]
            share = self.share_below(si, active)
            # the first part of the samples that are drawn as diffuse goes below the surface
            dives = active & (sample1 >= start) & (sample1 - start < chances[3] * share) & (wi.z > 0.0)
            dive, color = self.below.sample(ctx, si, sample1, sample2, dives)
            above = channel_mean(dr, below_coat) * (1.0 - metallic) * dr.maximum(1.0 - dr.max(specular), 0.0)
            dive.pdf = above / dr.maximum(chances[3], 1e-9)
            return dr.select(dives, dive, bs), dr.select(dives, color, value)

        def normal_below(self, si: Any, active: Any) -> Any:
            if self.below is None:
                return mi.Vector3f(0.0)
            return self.below.normal_below(si, active) * self.share_below(si, active)

        def tint_below(self, si: Any, active: Any) -> Any:
            if self.coat is None:
                return mi.Spectrum(1.0)
            below_coat = self.coat.at(mi, dr, si, active).below
            return below_coat / dr.maximum(channel_mean(dr, below_coat), 1e-9)

        def share_below(self, si: Any, active: Any) -> Any:
            """Share of the diffuse light that goes below the surface."""
            return dr.clip(self.below_weight.eval_1(si, active), 0.0, 1.0)

        def draw(self, hit: Any, si: Any, wi: Any, samples: Any, active: Any) -> Any:
            _, _, roughness, _, _, chances, coat = self.layers(si, wi, active)
            sample1, sample2 = samples
            in_facets = sample1 < chances[0] + chances[1] + chances[2]
            self.drawn_matt = ~in_facets
            stretch = self.stretch(si, active)
            in_coat = sample1 < chances[0]
            if coat is not None and not coat.is_turned:
                roughness = dr.select(in_coat, coat.roughness, roughness)
                if stretch is not None:
                    stretch = tuple(dr.select(in_coat, 1.0, part) for part in stretch)
            facets = Microfacets(mi, dr, roughness, stretch, least=least_alpha(si))
            mirrored, _ = facets.mirrored(wi, sample2)
            if coat is not None and coat.is_turned:
                own = self.turned(si, si.to_local(coat.drawn(mi, dr, sample2)))
                mirrored = dr.select(in_coat, self.aligned(self.lobe_axes(si, active), own), mirrored)
            even = self.turned(hit, mi.warp.square_to_cosine_hemisphere(sample2))
            even = self.aligned(self.lobe_axes(si, active), self.turned(si, si.to_local(hit.to_world(even))))
            return dr.select(in_facets, mirrored, even)

        def plain(self, hit: Any, si: Any, way: Any, active: Any) -> Any:
            """A direction about the given normal, of one about the valid normal: diffuse light knows no mirror image
            that could lie below the surface.
            """
            outward = self.turned(si, self.aligned(self.lobe_axes(si, active), way, back=True))
            return self.turned(hit, hit.to_local(si.to_world(outward)))

        def softened(self, hit: Any, si: Any, way: Any, active: Any) -> Any:
            """Share of the light from a direction that the diffuse part of a bent surface scatters."""
            outward = si.to_world(self.turned(si, self.aligned(self.lobe_axes(si, active), way, back=True)))
            smooth, bent = mi.Vector3f(hit.dp_dv), mi.Vector3f(hit.sh_frame.n)
            return softening(dr, dr.dot(smooth, outward), dr.dot(bent, outward), dr.dot(smooth, bent))

        def reflect(self, hit: Any, si: Any, wi: Any, wo: Any, active: Any) -> Any:
            found = self.layers(si, wi, active)
            color, metallic, roughness, below_coat, specular, chances, coat = found
            toward, away = self.plain(hit, si, wi, active), self.plain(hit, si, wo, active)
            lambert = dr.maximum(away.z, 0.0) / dr.pi
            facets = Microfacets(mi, dr, roughness, self.stretch(si, active), least=least_alpha(si))
            mirror, mirror_density, facing = facets.reflection(wi, wo)
            seen = sees_facets(mi, dr, si)
            mirror, mirror_density = dr.select(seen, mirror, 0.0), dr.select(seen, mirror_density, 0.0)
            edge = mi.Spectrum(1.0) if self.edge_tint is None else dr.minimum(self.edge_tint.eval(si, active), 1.0)
            film = self.film_at(si, active)
            metal, average = metal_reflectance(mi, dr, (dr.minimum(color, 1.0), edge), facing, film)
            if self.keeps_energy:
                metal *= self.kept(facets.mean_roughness, wi.z, average)
            value = metallic * metal * mirror
            diffuse = color * lambert
            if self.diffuse_roughness is not None:
                rough = dr.clip(self.diffuse_roughness.eval_1(si, active), 0.0, 1.0)
                diffuse = dr.select(lambert > 0.0, oren_nayar(mi, dr, color, rough, toward, away), 0.0)
            above = mi.Float(1.0)
            if self.below is not None:
                above = 1.0 - self.share_below(si, active)
            diffuse *= (1.0 - metallic) * dr.maximum(1.0 - dr.max(specular), 0.0) * above
            if self.is_bent:
                diffuse *= self.softened(hit, si, wo, active)
            if self.diffuse_alone:
                return diffuse * below_coat, mi.Float(0.0)
            value += diffuse
            kept = mi.Float(1.0)
            if self.keeps_energy:
                kept = self.kept(
                    facets.mean_roughness, wi.z, self.tinted(si, self.specular.average(si, active), active)
                )
            if film is None:
                reflected = self.tinted(si, mi.fresnel(facing, self.specular.index(si, active))[0], active)
            else:
                reflected = self.on_film(si, film, facing, active)
            value += (1.0 - metallic) * reflected * kept * mirror
            value *= below_coat
            density = (chances[1] + chances[2]) * mirror_density + chances[3] * above * lambert
            if coat is not None:
                outward = si.to_world(self.turned(si, self.aligned(self.lobe_axes(si, active), wo, back=True)))
                mirror, mirror_density = coat.reflection(mi, dr, outward, active)
                value += mirror
                density += chances[0] * mirror_density
            return value, density

    register_closure(mi, "blender_principled", BlenderPrincipled)
