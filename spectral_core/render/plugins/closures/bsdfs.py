# SPDX-License-Identifier: GPL-3.0-or-later
"""``closures``: the sum of weighted BSDFs, as Blender's shader trees are; ``tinted_null``: Blender's Transparent."""

from __future__ import annotations

from typing import Any

from spectral_core.render.plugins.closures.subsurface import DIVES


def register(mi: Any, dr: Any) -> None:
    """Define and register the BSDFs for the active variant."""

    class Closures(mi.BSDF):
        """``Σ weight_k · bsdf_k``; weights are numbers per place (``weight_0``, …; 1 where absent).

        One child is drawn by its weight. A sharp direction (mirror, glass, straight through) is charged to the child
        that gave it; any other is weighed against all children. ``tables``: cursor and number of rows of each child;
        a child with a cursor stands for as many as its tables have rows, which a loop in the kernel goes through.
        """

        def __init__(self, properties: Any) -> None:
            super().__init__(properties)
            count = int(properties["count"])
            self.children = [properties[f"bsdf_{k}"] for k in range(count)]
            self.weights = [properties[f"weight_{k}"] for k in range(count)]
            self.tables: list[tuple[Any, int]] = [(None, 1)] * count
            self.m_components = [child.flags(k) for child in self.children for k in range(child.component_count())]
            flags = 0
            for child in self.children:
                flags |= child.flags()
            self.m_flags = flags

        def amount(self, k: int, si: Any, active: Any) -> Any:
            return dr.maximum(self.weights[k].eval_1(si, active), 0.0)

        def over_rows(self, k: int, state: tuple[Any, ...], body: Any, active: Any) -> tuple[Any, ...]:
            """``state`` after ``body(*state)`` for each row of a child, or once."""
            cursor, rows = self.tables[k]
            if cursor is None:
                return body(*state)
            count = dr.opaque(mi.UInt32, rows)

            def step(row: Any, *inner: Any) -> tuple[Any, ...]:
                cursor.row = row
                after = body(*inner)
                cursor.row = 0
                return (row + 1, *after)

            start = (mi.UInt32(0), *state)
            return dr.while_loop(start, lambda row, *_: mi.Bool(active) & (row < count), step)[1:]

        def total(self, si: Any, active: Any) -> Any:
            """Sum of all weights."""
            result = mi.Float(0.0)
            for k in range(len(self.children)):
                (result,) = self.over_rows(
                    k, (result,), lambda so_far, k=k: (so_far + self.amount(k, si, active),), active
                )
            return result

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            total = self.total(si, active)
            scale = dr.select(total > 0.0, dr.rcp(total), 0.0)
            mark = dr.minimum(sample1, 1.0 - 1e-6) * total
            drawn, value, below = dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0), mi.Float(0.0)
            for k, child in enumerate(self.children):
                cursor = self.tables[k][0]

                def choose(row: Any, chosen: Any, amount: Any, start: Any, below: Any, k: int = k) -> tuple[Any, ...]:
                    mine = self.amount(k, si, active)
                    here = (mark >= below) & (mark < below + mine)
                    chosen, amount = dr.select(here, row, chosen), dr.select(here, mine, amount)
                    return row + 1, chosen, amount, dr.select(here, below, start), below + mine

                state = (mi.UInt32(0), mi.UInt32(0), mi.Float(0.0), mi.Float(0.0), below)
                _, chosen, amount, start, below = self.over_rows(k, state, choose, active)
                mine = mi.Bool(active) & (amount > 0.0)
                place = dr.clip((mark - start) / dr.maximum(amount, 1e-12), 0.0, 1.0 - 1e-6)
                if cursor is not None:
                    cursor.row = chosen
                candidate, weight = child.sample(ctx, si, place, sample2, mine)
                if cursor is not None:
                    cursor.row = 0
                dives = (candidate.sampled_type & DIVES) != 0
                candidate.pdf *= dr.select(dives, total, amount * scale)
                drawn = dr.select(mine, candidate, drawn)
                value = dr.select(mine, weight * dr.select(dives, 1.0, total), value)
            sharp = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta) | mi.has_flag(
                drawn.sampled_type, mi.BSDFFlags.Null
            )
            sharp |= (drawn.sampled_type & DIVES) != 0
            blunt = dr.select(sharp, mi.Bool(False), mi.Bool(True))
            spread = active & blunt & (drawn.pdf > 0.0)
            every, density = self.weighed(ctx, si, drawn.wo, spread, scale)
            drawn.pdf = dr.select(spread, density, drawn.pdf)
            value = dr.select(spread, every / dr.maximum(density, 1e-20), value)
            return drawn, dr.select(active & (drawn.pdf > 0.0), value, 0.0)

        def weighed(self, ctx: Any, si: Any, wo: Any, active: Any, scale: Any) -> Any:
            """Sum over all children, and the density of drawing ``wo``; ``scale``: 1 over the sum of weights."""
            value, density = mi.Spectrum(0.0), mi.Float(0.0)
            for k, child in enumerate(self.children):
                if not child.flags() & ctx.type_mask:
                    continue  # a child of other lobes than those that are asked for

                def add(value: Any, density: Any, k: int = k, child: Any = child) -> tuple[Any, Any]:
                    amount = self.amount(k, si, active)
                    child_value, child_density = child.eval_pdf(ctx, si, wo, active)
                    return value + amount * child_value, density + amount * scale * child_density

                value, density = self.over_rows(k, (value, density), add, active)
            return value, density

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            total = self.total(si, active)
            return self.weighed(ctx, si, wo, active, dr.select(total > 0.0, dr.rcp(total), 0.0))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            passed = mi.Spectrum(0.0)
            for k, child in enumerate(self.children):
                if not mi.has_flag(child.flags(), mi.BSDFFlags.Null):
                    continue

                def add(passed: Any, k: int = k, child: Any = child) -> tuple[Any]:
                    return (passed + self.amount(k, si, active) * child.eval_null_transmission(si, active),)

                (passed,) = self.over_rows(k, (passed,), add, active)
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
