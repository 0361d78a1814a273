# SPDX-License-Identifier: GPL-3.0-or-later
"""``bent``: a BSDF about another normal (bump and normal maps); ``translucent`` and ``toon`` as Blender has them."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.facets.upright import is_drawn, softening, toward_viewer, with_valid_normal
from spectral_core.render.plugins.closures.lobe import RAISED, Closure, register_closure
from spectral_core.render.plugins.closures.subsurface import DIVES


def register(mi: Any, dr: Any) -> None:
    """Define and register the closures for the active variant."""

    class Bent(Closure):
        """``closure`` about ``normal``, world directions that face the viewer.

        ``softens``: True if light fades toward the horizon of the smooth surface, as in Cycles for diffuse scattering.
        A closure that is diffuse in part does that itself if its light ``fades``. The normal of a displaced surface,
        whose light does not, replaces the smooth one: the side of a direction is then that of the triangle.
        """

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.child, self.normal = inputs["closure"], inputs["normal"]
            self.softens = bool(inputs["softens"])
            self.child.is_bent = self.fades = bool(inputs["fades"])
            self.m_flags, self.dives = self.child.flags() | (0 if self.fades else RAISED), self.child.dives
            self.bends_below = self.dives
            glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.GlossyTransmission
            glossy = glossy | mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.DeltaTransmission
            # reflecting and refracting lobes turn the normal, and check sides by that
            self.corrects = bool(self.m_flags & int(glossy)) or self.child.turns_normal

        def about(self, si: Any, active: Any) -> Any:
            """The hit in the frame of the bent normal."""
            toward = toward_viewer(mi, dr, si)
            normal = mi.Vector3f(mi.Color3f(self.normal.eval_3(si, active)))
            smooth = dr.mulsign(mi.Vector3f(si.sh_frame.n), dr.dot(si.sh_frame.n, toward))
            size = dr.norm(normal)
            normal = dr.select(size > 1e-6, normal / dr.maximum(size, 1e-6), smooth)
            bent = mi.SurfaceInteraction3f(si)
            frame = dr.mulsign(normal, si.wi.z)
            along = si.dp_du - frame * dr.dot(frame, si.dp_du)
            other = mi.Vector3f(mi.coordinate_system(frame)[0])
            along = dr.select(dr.squared_norm(along) > 1e-20, dr.normalize(along), other)
            bent.sh_frame.n, bent.sh_frame.s = mi.Normal3f(frame), along
            bent.sh_frame.t = dr.cross(frame, along)
            bent.duv_dy = mi.Vector2f(si.duv_dy.x, 0.0)  # facets of a bumpy glass face the light, as measured
            bent.dp_dv = mi.Vector3f(si.sh_frame.n)  # for ``softening``; programs have read the UV map's axes before
            # seen from behind the bent normal, the side stays that of the surface; reflecting lobes correct the normal
            # further
            local = bent.to_local(toward)
            bent.wi = mi.Vector3f(local.x, local.y, dr.mulsign(dr.abs(local.z), si.wi.z))
            return with_valid_normal(mi, dr, bent) if self.child.turns_normal else bent

        def same_side(self, si: Any, inner: Any, wo: Any) -> Any:
            """True if ``wo`` is on the same side of the surface as it is about the bent normal, ``inner``."""
            if self.fades:
                return inner.z * wo.z > 0.0
            height = dr.dot(si.n, si.to_world(wo)) * dr.dot(si.n, toward_viewer(mi, dr, si))
            return inner.z * dr.mulsign(height, si.wi.z) > 0.0

        def softened(self, si: Any, bent: Any, inner: Any, wo: Any) -> Any:
            """Share of the light that reaches the facets of the bent surface."""
            if not self.softens:
                return mi.Float(1.0)
            return softening(dr, wo.z, inner.z, dr.dot(si.sh_frame.n, bent.sh_frame.n))

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bent = self.about(si, active)
            bs, weight = self.child.sample(ctx, bent, sample1, sample2, active)
            inner = mi.Vector3f(bs.wo)
            bs.wo = si.to_local(bent.to_world(inner))
            straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null)
            dives = (bs.sampled_type & DIVES) != 0
            bs.wo = dr.select(dives, inner, bs.wo)
            valid = active & (self.same_side(si, inner, bs.wo) | straight | dives | self.corrects)
            bs.pdf = dr.select(valid, bs.pdf, 0.0)
            # as in Cycles, transmitted light fades where a lamp is sampled, not where its direction is drawn
            plain = dives | mi.has_flag(bs.sampled_type, mi.BSDFFlags.Transmission)
            softened = dr.select(plain, 1.0, self.softened(si, bent, inner, bs.wo))
            return bs, dr.select(valid, weight * softened, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            bent = self.about(si, active)
            inner = bent.to_local(si.to_world(wo))
            valid = active & (self.same_side(si, inner, wo) | self.corrects)
            value, density = self.child.eval_pdf(ctx, bent, inner, valid)
            plain = is_drawn(si) & (wo.z * si.wi.z < 0.0)
            value *= dr.select(plain, 1.0, self.softened(si, bent, inner, wo))
            return dr.select(valid, value, 0.0), dr.select(valid, density, 0.0)

        def normal_below(self, si: Any, active: Any) -> Any:
            return self.child.normal_below(self.about(si, active), active)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return self.child.eval_null_transmission(si, active)

    class Simple(Closure):
        """One lobe of light per direction, ``color`` times a factor; subclasses implement ``draw`` and ``measure``."""

        kind = mi.BSDFFlags.DiffuseReflection
        draw: Any
        measure: Any

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            flags = int(self.kind | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide)
            self.m_flags = flags
            self.color = inputs["color"]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta = self.draw(si, sample2, active), mi.Float(1.0)
            value, density = self.eval_pdf(ctx, si, bs.wo, active)
            valid = active & (density > 0.0)
            bs.pdf = dr.select(valid, density, 0.0)
            bs.sampled_type = mi.UInt32(int(self.kind))
            return bs, dr.select(valid, value / dr.maximum(density, 1e-20), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            value, density = self.measure(si, wo, active)
            return dr.select(active, self.color.eval(si, active) * value, 0.0), dr.select(active, density, 0.0)

    class Translucent(Simple):
        """Lambertian transmission, about a normal that mirrors the viewer to the outer side (Cycles)."""

        kind, turns_normal = mi.BSDFFlags.DiffuseTransmission, True

        def draw(self, si: Any, sample: Any, active: Any) -> Any:
            wo, valid = mi.warp.square_to_cosine_hemisphere(sample), with_valid_normal(mi, dr, si)
            return si.to_local(valid.to_world(mi.Vector3f(wo.x, wo.y, -dr.mulsign(wo.z, si.wi.z))))

        def measure(self, si: Any, wo: Any, active: Any) -> Any:
            height = with_valid_normal(mi, dr, si).to_local(si.to_world(wo)).z
            density = dr.select(si.wi.z * height < 0.0, dr.abs(height) / dr.pi, 0.0)
            return density, density

    class Toon(Simple):
        """Cycles' toon lobes: constant within ``size`` · 90°, fading over ``smooth`` · 90°."""

        def __init__(self, inputs: Any) -> None:
            super().__init__(inputs)
            self.size, self.smooth = inputs["size"], inputs["smooth"]
            self.glossy = bool(inputs["glossy"])

        def middle(self, si: Any) -> Any:
            up = mi.Vector3f(0.0, 0.0, dr.mulsign(mi.Float(1.0), si.wi.z))
            return mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z) if self.glossy else up

        def angles(self, si: Any, active: Any) -> Any:
            widest = dr.clip(self.size.eval_1(si, active), 1e-5, 1.0) * (dr.pi / 2)
            fade = dr.clip(self.smooth.eval_1(si, active), 0.0, 1.0) * (dr.pi / 2)
            return widest, fade, dr.minimum(widest + fade, dr.pi / 2)

        def draw(self, si: Any, sample: Any, active: Any) -> Any:
            _, _, reach = self.angles(si, active)
            cone = mi.warp.square_to_uniform_cone(sample, dr.cos(reach))
            return mi.Frame3f(self.middle(si)).to_world(cone)

        def measure(self, si: Any, wo: Any, active: Any) -> Any:
            widest, fade, reach = self.angles(si, active)
            # the narrowest cones are narrower than an arc cosine resolves
            angle = 2.0 * dr.safe_asin(0.5 * dr.norm(self.middle(si) - wo))
            soft = 1.0 - (angle - widest) / dr.maximum(fade, 1e-9)
            intensity = dr.select(angle < widest, 1.0, dr.select(angle < widest + fade, soft, 0.0))
            inside = (angle <= reach) & (si.wi.z * wo.z > 0.0)
            density = dr.select(inside, 0.25 / (dr.pi * dr.square(dr.sin(0.5 * reach))), 0.0)
            return density * intensity, density

    register_closure(mi, "bent", Bent)
    register_closure(mi, "blender_translucent", Translucent)
    register_closure(mi, "blender_toon", Toon)
