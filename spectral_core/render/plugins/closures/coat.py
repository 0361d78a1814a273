# SPDX-License-Identifier: GPL-3.0-or-later
"""The coat of the Principled BSDF, a dielectric layer that may have a tint and a normal of its own, and
``under_coat``: a closure of which it takes its share.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spectral_core.render.plugins.closures.facets.microfacet import Microfacets, kept_energy, least_alpha
from spectral_core.render.plugins.closures.facets.upright import sees_facets, toward_viewer, with_valid_normal
from spectral_core.render.plugins.closures.lobe import Closure, register_closure


class Coat:
    """Inputs whose names begin with ``coat``; ``coat_tint`` and ``coat_normal`` may be absent.

    ``coat_ior`` comes with the hemispherical mean of its reflectance and the table of the directional albedo. Without
    a normal the coat has that of what lies below it.
    """

    def __init__(self, inputs: dict[str, Any]) -> None:
        self.weight, self.roughness = inputs["coat_weight"], inputs["coat_roughness"]
        self.ior, self.fresnel, self.albedo = inputs["coat_ior"], inputs["coat_fresnel"], inputs["coat_albedo"]
        self.single, self.mean = inputs["single"], inputs["mean"]
        self.tint = inputs.get("coat_tint")
        self.normal: Any = inputs.get("coat_normal")

    def at(self, mi: Any, dr: Any, si: Any, active: Any) -> CoatAt:
        """The coat at a hit ``si`` with the valid normal of what lies below it."""
        place = si if self.normal is None else self._about(mi, dr, si, active)
        wi = mi.Vector3f(place.wi.x, place.wi.y, dr.abs(place.wi.z))
        weight = dr.clip(self.weight.eval_1(si, active), 0.0, 1.0)
        roughness = dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
        share = weight * self.albedo(roughness, wi.z)
        below = mi.Spectrum(1.0 - share)
        if self.tint is not None:
            # absorption along the refracted path through the coat (Cycles: tint to the power of 1 / cosine inside)
            inner = dr.safe_sqrt(1.0 - (1.0 - wi.z * wi.z) / dr.square(self.ior.eval_1(si, active)))
            tint = dr.maximum(self.tint.eval(si, active), 1e-6) ** dr.rcp(dr.maximum(inner, 1e-3))
            below *= dr.lerp(mi.Spectrum(1.0), tint, weight)
        return CoatAt(self, place, wi, weight, roughness, share, below)

    def _about(self, mi: Any, dr: Any, si: Any, active: Any) -> Any:
        """The hit in the frame of the coat's own normal, turned until it mirrors the viewer outward."""
        normal = mi.Vector3f(mi.Color3f(self.normal.eval_3(si, active)))
        size = dr.norm(normal)
        given = dr.mulsign(normal / dr.maximum(size, 1e-6), si.wi.z)
        frame = dr.select(size > 1e-6, given, mi.Vector3f(si.sh_frame.n))
        place = mi.SurfaceInteraction3f(si)
        place.sh_frame.n = mi.Normal3f(frame)
        place.sh_frame.s, place.sh_frame.t = mi.coordinate_system(frame)
        local = place.to_local(toward_viewer(mi, dr, si))
        place.wi = mi.Vector3f(local.x, local.y, dr.mulsign(dr.abs(local.z), si.wi.z))
        return with_valid_normal(mi, dr, place)


@dataclass
class CoatAt:
    """A ``coat`` at a hit: the hit about its normal and the viewer's direction there, its numbers, the share of light
    that it reflects, and the share that reaches what lies below it.
    """

    coat: Coat
    place: Any
    wi: Any
    weight: Any
    roughness: Any
    share: Any
    below: Any

    @property
    def is_turned(self) -> bool:
        """True if it has a normal of its own."""
        return self.coat.normal is not None

    def drawn(self, mi: Any, dr: Any, sample: Any) -> Any:
        """World direction that mirrors the viewer at a drawn facet."""
        facets = Microfacets(mi, dr, self.roughness, least=least_alpha(self.place))
        way = facets.mirrored(self.wi, sample)[0]
        return self.place.to_world(mi.Vector3f(way.x, way.y, dr.mulsign(way.z, self.place.wi.z)))

    def reflection(self, mi: Any, dr: Any, outward: Any, active: Any) -> tuple[Any, Any]:
        """Value · cosine and density of a world direction."""
        coat, place = self.coat, self.place
        facets = Microfacets(mi, dr, self.roughness, least=least_alpha(place))
        wo = place.to_local(outward)
        wo = mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, place.wi.z))
        value, density, facing = facets.reflection(self.wi, wo)
        kept = kept_energy(coat.single, coat.mean, self.roughness, self.wi.z, coat.fresnel.eval_1(place, active))
        value *= self.weight * mi.fresnel(facing, coat.ior.eval_1(place, active))[0] * kept
        seen = sees_facets(mi, dr, place)
        return dr.select(seen, value, 0.0), dr.select(seen, density, 0.0)


def register(mi: Any, dr: Any) -> None:
    """Define and register the closure for the active variant."""

    class UnderCoat(Closure):
        """``closure`` times the light that the coat of the other inputs transmits; the coat itself is another leaf."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.child, self.coat = inputs["closure"], Coat(inputs)
            self.m_flags, self.turns_normal = self.child.flags(), self.child.turns_normal

        def passed(self, si: Any, active: Any) -> Any:
            return self.coat.at(mi, dr, with_valid_normal(mi, dr, si), active).below

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs, weight = self.child.sample(ctx, si, sample1, sample2, active)
            return bs, mi.Spectrum(weight) * self.passed(si, active)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value, density = self.child.eval_pdf(ctx, si, wo, active)
            return mi.Spectrum(value) * self.passed(si, active), density

    register_closure(mi, "under_coat", UnderCoat)
