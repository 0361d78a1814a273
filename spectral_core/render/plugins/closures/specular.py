# SPDX-License-Identifier: GPL-3.0-or-later
"""The dielectric layer of Principled over its diffuse part: reflectances of a fixed or varying index."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.albedo import HIGHEST

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
