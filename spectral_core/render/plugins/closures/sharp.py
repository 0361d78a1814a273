# SPDX-License-Identifier: GPL-3.0-or-later
"""``mirror``; ``filtered``, a mirror or glass that Filter Glossy blurs; ``clear`` and ``tinted_clear``: Blender's
Transparent, without and with a color; ``blender_rayportal``.
"""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.facets.microfacet import least_alpha
from spectral_core.render.plugins.closures.facets.upright import sees_facets, toward_viewer, with_valid_normal
from spectral_core.render.plugins.closures.lobe import Closure, register_closure

PORTAL = 0x4000
"""Mitsuba's flag ``NonSymmetric``, which marks rays that go on elsewhere."""


def register(mi: Any, dr: Any) -> None:
    """Define and register the closures for the active variant."""

    class Mirror(Closure):
        """Reflects ``color`` times the light of the mirrored direction, on both sides."""

        turns_normal = True

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.color = inputs["color"]

        def sample(self, ctx: Any, hit: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            si = with_valid_normal(mi, dr, hit)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = hit.to_local(si.to_world(mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z)))
            bs.eta = mi.Float(1.0)
            bs.pdf, bs.sampled_type = mi.Float(1.0), mi.UInt32(int(mi.BSDFFlags.DeltaReflection))
            usable = active & (si.wi.z != 0.0) & sees_facets(mi, dr, si)
            bs.pdf = dr.select(usable, bs.pdf, 0.0)
            return bs, dr.select(usable, self.color.eval(si, active), 0.0)

    class Clear(Closure):
        """Transmits all light without refraction."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags = int(mi.BSDFFlags.Null | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)

        def share(self, si: Any, active: Any) -> Any:
            return mi.Spectrum(1.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta, bs.pdf = -si.wi, mi.Float(1.0), mi.Float(1.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.Null))
            return bs, dr.select(active, self.share(si, active), 0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return self.share(si, active)

    class RayPortal(Clear):
        """Rays go on at ``position`` along ``direction``, straight on where that is 0; shadow rays end here, as in
        Cycles.
        """

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.m_flags |= PORTAL
            self.color, self.position, self.direction = inputs["color"], inputs["position"], inputs["direction"]

        def share(self, si: Any, active: Any) -> Any:
            return self.color.eval(si, active)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs, value = super().sample(ctx, si, sample1, sample2, active)
            given = mi.Vector3f(mi.Color3f(self.direction.eval_3(si, active)))
            size = dr.norm(given)
            way = dr.select(size > 0.0, given / dr.maximum(size, 1e-30), -toward_viewer(mi, dr, si))
            bs.wo = si.to_local(way)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.Null) | PORTAL)
            return bs, value

        def exit_of(self, si: Any, active: Any) -> Any:
            return mi.Vector3f(mi.Color3f(self.position.eval_3(si, active)))

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

    class TintedClear(Clear):
        """Transmits light without refraction, times ``color``."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.color = inputs["color"]

        def share(self, si: Any, active: Any) -> Any:
            return self.color.eval(si, active)

    class Filtered(Closure):
        """A closure of discrete directions, ``sharp``; where Filter Glossy applies, ``rough``, which has facets."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.sharp, self.rough = inputs["sharp"], inputs["rough"]
            self.turns_normal = self.sharp.turns_normal
            self.m_flags = self.sharp.flags() | self.rough.flags()

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            blurs = least_alpha(si) > 0.0
            sharp, weight = self.sharp.sample(ctx, si, sample1, sample2, active & ~blurs)
            rough, value = self.rough.sample(ctx, si, sample1, sample2, active & blurs)
            return dr.select(blurs, rough, sharp), dr.select(blurs, mi.Spectrum(value), mi.Spectrum(weight))

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            blurs = least_alpha(si) > 0.0
            value, density = self.rough.eval_pdf(ctx, si, wo, active & blurs)
            return dr.select(blurs, mi.Spectrum(value), 0.0), dr.select(blurs, mi.Float(density), 0.0)

    register_closure(mi, "filtered", Filtered)
    register_closure(mi, "mirror", Mirror)
    register_closure(mi, "clear", Clear)
    register_closure(mi, "blender_rayportal", RayPortal)
    register_closure(mi, "tinted_clear", TintedClear)
