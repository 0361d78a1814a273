# SPDX-License-Identifier: GPL-3.0-or-later
"""``rough_diffuse``: Blender's Diffuse BSDF with roughness."""

from __future__ import annotations

from typing import Any


def oren_nayar(mi: Any, dr: Any, color: Any, roughness: Any, wi: Any, wo: Any) -> Any:
    """Value · cosine of energy-preserving Oren-Nayar (Portsmouth, Kutz and Hill 2024, "EON").

    Fujii's fit of Oren-Nayar (Eq. 4) plus the light that bounced between facets (Eqs. 11 to 17); ``color`` is the
    single-scattering reflectance.
    """
    cosine_i, cosine_o = dr.abs(wi.z), dr.abs(wo.z)
    scale = dr.rcp(1.0 + (0.5 - 2.0 / (3.0 * dr.pi)) * roughness)
    along = dr.dot(wi, wo) - cosine_i * cosine_o
    along /= dr.select(along > 0.0, dr.maximum(cosine_i, cosine_o), 1.0)
    once = color * (scale * (1.0 + roughness * along))
    lost_i = 1.0 - scale * (1.0 + roughness / dr.pi * _albedo_shape(dr, cosine_i))
    lost_o = 1.0 - scale * (1.0 + roughness / dr.pi * _albedo_shape(dr, cosine_o))
    mean = scale * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * dr.pi)) * roughness)
    lost = dr.maximum(1.0 - mean, 1e-7)
    # Cycles tints this part by the color once more than Eq. 17; so do we
    often = color * color * color * mean / (1.0 - color * lost) * (lost_i * lost_o / lost)
    return (once + often) * cosine_o / dr.pi


def _albedo_shape(dr: Any, cosine: Any) -> Any:
    """G of Fujii's model: the directional albedo is A (1 + r G / π)."""
    sine = dr.safe_sqrt(1.0 - cosine * cosine)
    angle = dr.safe_acos(cosine)
    steep = 2.0 / 3.0 * (sine / dr.maximum(cosine, 1e-6)) * (1.0 - sine * sine * sine)
    # towards grazing the tangent cancels; its limit there is cosine itself
    steep = dr.select(cosine < 1e-3, cosine, steep)
    return sine * (angle - sine * cosine) + steep - 2.0 / 3.0 * sine


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDF for the active variant."""

    class RoughDiffuse(mi.BSDF):
        """Energy-preserving Oren-Nayar, both sides alike; ``roughness`` in [0, 1] is a texture."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [int(flags)]
            self.m_flags = int(flags)
            self.color, self.roughness = properties["color"], properties["roughness"]

        def reflect(self, si: Any, wo: Any, active: Any) -> Any:
            color, roughness = self.color.eval(si, active), dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
            reflects = active & (si.wi.z * wo.z > 0.0)
            return dr.select(reflects, oren_nayar(mi, dr, color, roughness, si.wi, wo), 0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))
            bs.pdf, bs.eta = mi.warp.square_to_cosine_hemisphere_pdf(wo), mi.Float(1.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
            usable = active & (bs.pdf > 0.0) & (si.wi.z != 0.0)
            return bs, dr.select(usable, self.reflect(si, bs.wo, usable) / dr.maximum(bs.pdf, 1e-20), 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.reflect(si, wo, active)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return dr.select(active & (si.wi.z * wo.z > 0.0), dr.abs(wo.z) / dr.pi, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def to_string(self) -> str:
            return "RoughDiffuse"

    mi.register_bsdf("rough_diffuse", lambda properties: RoughDiffuse(properties))
