# SPDX-License-Identifier: GPL-3.0-or-later
"""``closures``: the sum of weighted BSDFs, as Blender's shader trees are; ``tinted_null``: Blender's Transparent."""

from __future__ import annotations

from typing import Any


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDFs for the active variant."""

    class Closures(mi.BSDF):
        """``Σ weight_k · bsdf_k``; weights are numbers per place (``weight_0``, …; 1 where absent).

        One child is drawn by its weight. A sharp direction (mirror, glass, straight through) is charged to the child
        that gave it; any other is weighed against all children.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            count = int(properties["count"])
            self.children = [properties[f"bsdf_{k}"] for k in range(count)]
            self.weights = [properties[f"weight_{k}"] for k in range(count)]
            self.m_components = [child.flags(k) for child in self.children for k in range(child.component_count())]
            flags = 0
            for child in self.children:
                flags |= child.flags()
            self.m_flags = flags

        def amounts(self, si: Any, active: Any) -> list[Any]:
            return [dr.maximum(weight.eval_1(si, active), 0.0) for weight in self.weights]

        def shares(self, amounts: list[Any]) -> list[Any]:
            total = sum(amounts[1:], amounts[0])
            scale = dr.select(total > 0.0, dr.rcp(total), 0.0)
            return [amount * scale for amount in amounts]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            amounts = self.amounts(si, active)
            shares = self.shares(amounts)
            drawn, value = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
            below = mi.Float(0.0)
            last = len(self.children) - 1
            for k, (child, amount, share) in enumerate(zip(self.children, amounts, shares, strict=True)):
                above = below + share
                mine = active & (sample1 >= below) & ((sample1 < above) | (k == last)) & (share > 0.0)
                place = dr.clip((sample1 - below) / dr.maximum(share, 1e-9), 0.0, 1.0 - 1e-6)
                candidate, weight = child.sample(ctx, si, place, sample2, mine)
                candidate.pdf *= share
                drawn = dr.select(mine, candidate, drawn)
                value = dr.select(mine, weight * (amount / dr.maximum(share, 1e-9)), value)
                below = above
            sharp = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta) | mi.has_flag(
                drawn.sampled_type, mi.BSDFFlags.Null
            )
            blunt = dr.select(sharp, mi.Bool(False), mi.Bool(True))
            spread = active & blunt & (drawn.pdf > 0.0)
            total, density = self.eval_pdf(ctx, si, drawn.wo, spread)
            drawn.pdf = dr.select(spread, density, drawn.pdf)
            value = dr.select(spread, total / dr.maximum(density, 1e-20), value)
            return drawn, dr.select(active & (drawn.pdf > 0.0), value, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            amounts = self.amounts(si, active)
            value, density = mi.Spectrum(0.0), mi.Float(0.0)
            for child, amount, share in zip(self.children, amounts, self.shares(amounts), strict=True):
                child_value, child_density = child.eval_pdf(ctx, si, wo, active)
                value += amount * child_value
                density += share * child_density
            return value, density

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            passed = mi.Spectrum(0.0)
            for child, amount in zip(self.children, self.amounts(si, active), strict=True):
                passed += amount * child.eval_null_transmission(si, active)
            return passed

        def to_string(self) -> str:
            return "Closures[" + ", ".join(str(child) for child in self.children) + "]"

    class TintedNull(mi.BSDF):
        """Lets light through unbent, times ``color``."""

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            self.color = properties["color"]
            flag = mi.BSDFFlags.Null | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [int(flag)]
            self.m_flags = int(flag)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta, bs.pdf = -si.wi, mi.Float(1.0), mi.Float(1.0)
            bs.sampled_type = mi.UInt32(int(mi.BSDFFlags.Null))
            return bs, dr.select(active, self.color.eval(si, active), 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Spectrum(0.0), mi.Float(0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return self.color.eval(si, active)

        def to_string(self) -> str:
            return f"TintedNull[{self.color}]"

    mi.register_bsdf("closures", lambda properties: Closures(properties))
    mi.register_bsdf("tinted_null", lambda properties: TintedNull(properties))
