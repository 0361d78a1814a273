# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender_glossy``, and the code that it shares with ``blender_principled``: reflection as in Cycles, both sides
alike.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.facets.film import film_of, metal_reflectance
from spectral_core.render.plugins.closures.facets.microfacet import Microfacets, kept_energy, least_alpha
from spectral_core.render.plugins.closures.facets.phong import Phong
from spectral_core.render.plugins.closures.facets.upright import keeps_side, sees_facets, with_valid_normal
from spectral_core.render.plugins.closures.lobe import OWN, TURNED, Closure, register_closure


def both_sides(mi: Any, dr: Any) -> Any:
    """Class of closures that reflect, for the active variant."""

    class BothSides(Closure):
        """A reflecting closure that is defined for the upper side; directions of the lower side are mirrored first.

        ``anisotropy``, ``rotation`` and ``tangent`` (world directions): all three, or none. ``single``, ``mean``:
        tables of the energy that facets keep.
        """

        diffuse_alone = False
        """True if only the diffuse part is evaluated."""

        drawn_matt: Any = None
        """True where the direction that was drawn last belongs to a diffuse part; None without one."""

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
            wo = self.draw(hit, si, wi, (sample1, sample2), active)
            value, density = self.reflect(hit, si, wi, wo, active)
            valid = active & (density > 0.0) & (wi.z > 0.0)
            bs = dr.zeros(mi.BSDFSample3f)
            outward = self.turned(si, self.aligned(axes, wo, back=True))
            bs.wo, bs.eta = hit.to_local(si.to_world(outward)), mi.Float(1.0)
            bs.pdf = dr.select(valid, density, 0.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
            if self.drawn_matt is not None:  # the type of ray is that of the part that has drawn it
                bs.sampled_type = dr.select(
                    self.drawn_matt, mi.UInt32(int(mi.BSDFFlags.DiffuseReflection)), bs.sampled_type
                )
                self.drawn_matt = None
            return bs, dr.select(valid, value / dr.maximum(density, 1e-20), 0.0)

        def eval_pdf(self, ctx: Any, hit: Any, wo: Any, active: Any = True) -> Any:
            si = with_valid_normal(mi, dr, hit)
            wo = si.to_local(hit.to_world(wo))
            active = active & keeps_side(mi, dr, si, wo)
            axes = self.lobe_axes(si, active)
            wi, wo = (self.aligned(axes, self.turned(si, direction)) for direction in (si.wi, wo))
            self.diffuse_alone = ctx.type_mask == int(mi.BSDFFlags.Diffuse)
            value, density = self.reflect(hit, si, wi, wo, active)
            self.diffuse_alone = False
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

    return BothSides


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""
    reflecting: Any = both_sides(mi, dr)

    class BlenderGlossy(reflecting):
        """``color`` times a rough mirror of ``roughness`` (textures); ``edge_tint`` makes it a metal.

        ``physical``: one by Fresnel's equations. A metal may have a thin film.
        """

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.color, self.roughness = inputs["color"], inputs["roughness"]
            self.edge_tint, self.edge_scale = inputs.get("edge_tint", None), float(inputs.get("edge_scale", 1.0))
            self.physical, self.film = bool(inputs.get("physical", False)), film_of(inputs)
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
            roughness = dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
            stretch, least = self.stretch(si, active), least_alpha(si)
            if self.kind == "ashikhmin":
                return Phong(mi, dr, roughness, stretch, least)
            return Microfacets(mi, dr, roughness, stretch, self.kind, least)

        def sample(self, ctx: Any, hit: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs, weight = super().sample(ctx, hit, sample1, sample2, active)
            if self.kind == "ashikhmin":  # value and density are those of the direction as drawn, as in Cycles
                size = dr.norm(bs.wo)
                bs.sampled_type |= dr.select(size > 1.0 + 1e-5, mi.UInt32(OWN | TURNED), 0)
                bs.wo /= size
            return bs, weight

        def draw(self, hit: Any, si: Any, wi: Any, samples: Any, active: Any) -> Any:
            return self.facets(si, active).mirrored(wi, samples[1])[0]

        def reflect(self, hit: Any, si: Any, wi: Any, wo: Any, active: Any) -> Any:
            color, facets = self.color.eval(si, active), self.facets(si, active)
            value, density, facing = facets.reflection(wi, wo)
            seen = sees_facets(mi, dr, si)
            value, density = dr.select(seen, value, 0.0), dr.select(seen, density, 0.0)
            average = dr.minimum(color, 1.0)
            if self.edge_tint is not None:
                film = None if self.film is None else self.film.at(mi, dr, si, active)
                colors = color, self.edge_tint.eval(si, active) * self.edge_scale
                color, average = metal_reflectance(mi, dr, colors, facing, film, physical=self.physical)
            if self.keeps_energy:
                color = color * self.kept(facets.mean_roughness, wi.z, average)
            return color * value, density

    register_closure(mi, "blender_glossy", BlenderGlossy)
