# SPDX-License-Identifier: GPL-3.0-or-later
"""GGX microfacets over Dr.Jit arrays, shared by the rough closures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

LARGEST_ALPHA = 0.5
"""Alpha that Filter Glossy gives behind a bounce in every direction.

After a bounce that scatters widely, a path finds a mirror, and behind it a small light, by chance only; a blurred lobe
trades the sharp caustic for a smooth one. The path integrator stores the least alpha of a hit in ``duv_dx``, which
nothing else reads.
"""
SMALLEST_ALPHA = 1e-3
"""Least alpha of a lobe: narrower lobes exceed single precision."""


@dataclass
class Microfacets:
    """Facets of Blender's ``roughness`` at some points; ``mi`` and ``dr`` are the modules of the active variant.

    ``stretch``: alpha along the tangent over alpha across it, as two factors; None if both are alike. ``least``: alpha
    that Filter Glossy gives to narrower lobes.
    """

    mi: Any
    dr: Any
    roughness: Any
    stretch: tuple[Any, Any] | None = None
    kind: str = "ggx"
    least: Any = 0.0

    def __post_init__(self) -> None:
        alpha = self.roughness * self.roughness
        along, across = (alpha, alpha) if self.stretch is None else (alpha * s for s in self.stretch)
        least = self.dr.maximum(self.least, SMALLEST_ALPHA)
        self.along, self.across = (self.dr.clip(a, least, 1.0) for a in (along, across))
        kind = self.mi.MicrofacetType.Beckmann if self.kind == "beckmann" else self.mi.MicrofacetType.GGX
        self.distribution = self.mi.MicrofacetDistribution(kind, self.along, self.across, sample_visible=True)

    @property
    def mean_roughness(self) -> Any:
        """Roughness of a lobe that is as wide in all directions."""
        return self.roughness if self.stretch is None else self.dr.sqrt(self.dr.sqrt(self.along * self.across))

    def smith_lambda(self, direction: Any) -> Any:
        """Λ of a direction (Heitz 2014, Eq. 72; Beckmann by Walter et al. 2007)."""
        dr = self.dr
        squared = dr.maximum(direction.z * direction.z, 1e-9)
        slope = (dr.square(self.along * direction.x) + dr.square(self.across * direction.y)) / squared
        if self.kind != "beckmann":
            return 0.5 * (dr.sqrt(1.0 + slope) - 1.0)
        a = dr.rsqrt(dr.maximum(slope, 1e-12))
        return dr.select(a > 1.6, 0.0, ((0.396 * a - 1.259) * a + 1.0) / ((2.181 * a + 3.535) * a))

    def masking(self, wi: Any, wo: Any) -> Any:
        """G2 / G1(wi): weight of a direction drawn from visible normals."""
        lambda_i, lambda_o = self.smith_lambda(wi), self.smith_lambda(wo)
        return (1.0 + lambda_i) / (1.0 + lambda_i + lambda_o)

    def mirrored(self, wi: Any, sample: Any) -> Any:
        """Direction drawn by visible normals, and the cosine to its facet."""
        normal, _ = self.distribution.sample(wi, sample)
        facing = self.dr.dot(wi, normal)
        return 2.0 * facing * normal - wi, facing

    def reflection(self, wi: Any, wo: Any) -> tuple[Any, Any, Any]:
        """Value · cosine and density of a white mirror, 0 below the surface, and the cosine to the facet."""
        dr = self.dr
        above = (wi.z > 0.0) & (wo.z > 0.0)
        half = dr.normalize(wi + wo)
        facing = dr.dot(wi, half)
        density = self.distribution.pdf(wi, half) / (4.0 * dr.maximum(facing, 1e-9))
        density = dr.select(above & (facing > 0.0), density, 0.0)
        return density * self.masking(wi, wo), density, facing


def kept_energy(single_table: Any, mean_table: Any, roughness: Any, cosine: Any, average_fresnel: Any) -> Any:
    """Cycles' multiple-scattering GGX: the single bounce is scaled so that a white surface loses nothing.

    ``factor = 1 + Fms (1 - E) / E`` with ``Fms = Fss Eavg / (1 - Fss (1 - Eavg))`` (Turquin 2019, "Practical multiple
    scattering compensation for microfacet models"; Kulla and Conty 2017 for Fms). The tables: E, and its mean over the
    hemisphere at every cosine.
    """
    return kept_of(single_table(roughness, cosine), mean_table(roughness, 0.5 + 0.0 * cosine), average_fresnel)


def kept_of(single: Any, mean: Any, average_fresnel: Any) -> Any:
    """``kept_energy`` where E and its mean are known."""
    many = average_fresnel * mean / (1.0 - average_fresnel * (1.0 - mean))
    return 1.0 + many * (1.0 - single) / single


def f82(dr: Any, color: Any, edge_tint: Any, facing: Any) -> tuple[Any, Any]:
    """Reflectance of a metal and its hemispherical mean (Kutz, Hasan and Edmondson 2021, "Novel aspects of the Adobe
    Standard Material", Eq. 3).
    """
    grazing = dr.clip(1.0 - facing, 0.0, 1.0)
    # b is set so that at a cosine of 1 / 7 the reflectance is Schlick's times the tint
    sixth = 6.0 / 7.0
    b = (color + (1.0 - color) * sixth**5) * (7.0 / sixth**6) * (1.0 - edge_tint)
    reflectance = color + (1.0 - color) * grazing**5 - b * facing * grazing**6
    mean = color + (1.0 - color) / 21.0 - b / 126.0
    return dr.clip(reflectance, 0.0, 1.0), dr.clip(mean, 0.0, 1.0)


def least_alpha(si: Any) -> Any:
    """Alpha that narrower lobes at a hit get; 0 for camera rays and without Filter Glossy."""
    return si.duv_dx.x


def strength_of(limits: Any) -> Any:
    """Strength of Filter Glossy, which kernels read from memory; None if it is off."""
    import drjit as dr
    import mitsuba as mi

    return dr.opaque(mi.Float, float(limits.filter_glossy)) if limits.filter_glossy > 0 else None


def blur(si: Any, strength: Any, least_density: Any) -> None:
    """Store the alpha for a path whose bounces had at least ``least_density``; ``strength``: of Filter Glossy, None if
    it is off.

    Cycles: α = √(1 - p / strength) / 2, with the least density p.
    """
    import drjit as dr
    import mitsuba as mi

    if strength is None:
        return
    alpha = LARGEST_ALPHA * dr.safe_sqrt(1.0 - least_density / strength)
    si.duv_dx = mi.Vector2f(alpha, 0.0)
