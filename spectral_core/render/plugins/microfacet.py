# SPDX-License-Identifier: GPL-3.0-or-later
"""GGX microfacets over Dr.Jit arrays: what the rough BSDFs here share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.render.plugins import albedo

SMALLEST_ALPHA = 1e-3
"""Below this a rough surface is drawn as this rough: narrower lobes exceed single precision."""


@dataclass
class Microfacets:
    """GGX of Blender's ``roughness`` at some points; ``mi`` and ``dr`` are the modules of the active variant."""

    mi: Any
    dr: Any
    roughness: Any

    def __post_init__(self) -> None:
        self.alpha = self.dr.maximum(self.roughness * self.roughness, SMALLEST_ALPHA)
        self.distribution = self.mi.MicrofacetDistribution(
            self.mi.MicrofacetType.GGX, self.alpha, self.alpha, sample_visible=True
        )

    def smith_lambda(self, cosine: Any) -> Any:
        """Λ of a direction (Heitz 2014, Eq. 72)."""
        squared = self.dr.maximum(cosine * cosine, 1e-9)
        return 0.5 * (self.dr.sqrt(1.0 + self.alpha * self.alpha * (1.0 - squared) / squared) - 1.0)

    def masking(self, wi: Any, wo: Any) -> Any:
        """G2 / G1(wi): what a direction drawn from visible normals weighs."""
        lambda_i, lambda_o = self.smith_lambda(wi.z), self.smith_lambda(wo.z)
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


class AlbedoTable:
    """A table of ``albedo`` on the device, read by roughness and cosine."""

    def __init__(self, mi: Any, table: Any) -> None:
        self._mi = mi
        self._texture = mi.Texture2f(mi.TensorXf(np.ascontiguousarray(table[..., None], dtype=np.float32)))

    def __call__(self, roughness: Any, cosine: Any) -> Any:
        last = albedo.SIZE - 1  # entries stand at texel centers
        place = self._mi.Point2f(cosine * last + 0.5, roughness * last + 0.5) / float(albedo.SIZE)
        return self._texture.eval(place)[0]


class KeptEnergy:
    """Cycles' multiple-scattering GGX: the single bounce is scaled so that a white surface loses nothing.

    ``factor = 1 + Fms (1 - E) / E`` with ``Fms = Fss Eavg / (1 - Fss (1 - Eavg))`` (Turquin 2019, "Practical multiple
    scattering compensation for microfacet models"; Kulla and Conty 2017 for Fms).
    """

    def __init__(self, mi: Any, table: Any) -> None:
        self.single = AlbedoTable(mi, table)
        self.mean = AlbedoTable(mi, np.repeat(albedo.average(table)[:, None], albedo.SIZE, axis=1))

    def __call__(self, roughness: Any, cosine: Any, average_fresnel: Any) -> Any:
        single, mean = self.single(roughness, cosine), self.mean(roughness, 0.5 + 0.0 * cosine)
        many = average_fresnel * mean / (1.0 - average_fresnel * (1.0 - mean))
        return 1.0 + many * (1.0 - single) / single
