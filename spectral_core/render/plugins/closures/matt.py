# SPDX-License-Identifier: GPL-3.0-or-later
"""``diffuse``, and ``rough_diffuse``: Blender's Diffuse BSDF with roughness."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.lobe import Closure, register_closure


def oren_nayar(mi: Any, dr: Any, color: Any, roughness: Any, wi: Any, wo: Any) -> Any:
    """Value · cosine of energy-preserving Oren-Nayar (Portsmouth, Kutz and Hill 2024, "EON").

    Fujii's fit of Oren-Nayar (Eq. 4) plus the light that bounced between facets (Eqs. 11 to 17); ``color`` is the
    single-scattering reflectance. One above 1 counts as 1 in what facets reflect to each other, as in Cycles: each such
    reflection would add light, without an end.
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
    # as in Cycles, this part is tinted by the color once more than in Eq. 17
    between = dr.minimum(color, 1.0)
    often = color * between * between * mean / (1.0 - between * lost) * (lost_i * lost_o / lost)
    return (once + often) * cosine_o / dr.pi


def _albedo_shape(dr: Any, cosine: Any) -> Any:
    """G of Fujii's model: the directional albedo is A (1 + r G / π)."""
    sine = dr.safe_sqrt(1.0 - cosine * cosine)
    angle = dr.safe_acos(cosine)
    steep = 2.0 / 3.0 * (sine / dr.maximum(cosine, 1e-6)) * (1.0 - sine * sine * sine)
    # toward grazing angles the tangent cancels; its limit is the cosine
    steep = dr.select(cosine < 1e-3, cosine, steep)
    return sine * (angle - sine * cosine) + steep - 2.0 / 3.0 * sine


def register(mi: Any, dr: Any) -> None:
    """Define and register the closures for the active variant."""

    class Lambert(Closure):
        """Reflects ``color`` evenly, the same on both sides."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.color = inputs["color"]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            wo = mi.warp.square_to_cosine_hemisphere(sample2)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))
            bs.pdf, bs.eta = mi.warp.square_to_cosine_hemisphere_pdf(wo), mi.Float(1.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
            usable = active & (bs.pdf > 0.0) & (si.wi.z != 0.0)
            return bs, dr.select(usable, self.weight(si, bs, usable), 0.0)

        def weight(self, si: Any, bs: Any, active: Any) -> Any:
            return self.color.eval(si, active)

        def value(self, si: Any, wo: Any, active: Any) -> Any:
            return self.color.eval(si, active) * (dr.abs(wo.z) / dr.pi)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            reflects = active & (si.wi.z * wo.z > 0.0)
            density = dr.abs(wo.z) / dr.pi
            return dr.select(reflects, self.value(si, wo, active), 0.0), dr.select(reflects, density, 0.0)

    class RoughDiffuse(Lambert):
        """Energy-preserving Oren-Nayar; ``roughness`` in [0, 1]."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.roughness = inputs["roughness"]

        def weight(self, si: Any, bs: Any, active: Any) -> Any:
            return self.value(si, bs.wo, active) / dr.maximum(bs.pdf, 1e-20)

        def value(self, si: Any, wo: Any, active: Any) -> Any:
            roughness = dr.clip(self.roughness.eval_1(si, active), 0.0, 1.0)
            return oren_nayar(mi, dr, self.color.eval(si, active), roughness, si.wi, wo)

    register_closure(mi, "diffuse", Lambert)
    register_closure(mi, "rough_diffuse", RoughDiffuse)
