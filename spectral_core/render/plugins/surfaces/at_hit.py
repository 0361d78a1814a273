# SPDX-License-Identifier: GPL-3.0-or-later
"""The BSDF at a hit: Cycles' sum of weighted closures, over the rows of ``SurfaceTables``.

One leaf is drawn by its weight. A discrete direction (mirror, glass, straight through) belongs to the leaf that drew
it; any other is evaluated for all leaves of the material.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from spectral_core.render.plugins.closures.facets.upright import mark_drawn
from spectral_core.render.plugins.closures.lobe import OWN
from spectral_core.render.plugins.closures.subsurface import DIVES
from spectral_core.render.plugins.surfaces.kinds import ClosureKind, computed_inputs
from spectral_core.render.plugins.surfaces.table import FACTOR, SurfaceTables
from spectral_core.render.plugins.terminator import faded

MOST_KEPT = 6
"""Most closures of a material whose weights are computed once for a hit."""


class SurfaceAt:
    """The surface at a hit, with the interface of Mitsuba's BSDFs."""

    def __init__(self, tables: SurfaceTables, si: Any) -> None:
        self.tables, self.mi, self.dr = tables, tables.mi, tables.dr
        mi, dr = self.mi, self.dr
        number = dr.reinterpret_array(mi.UInt32, si.shape)
        self.material = dr.gather(mi.UInt32, tables.material_of_shape, number, number < tables.shape_count)
        self.is_one = tables.most_leaves <= 1
        self._inputs: Any = None
        self._first: Any = None
        """First leaf of the hit's material, and the weights of its leaves, once they were computed."""
        self._weights: tuple[Any, ...] = ()

    def compute(self, si: Any, active: Any) -> None:
        """Run the programs of the hit's closure once, for a direction that is drawn and for one that is asked for.

        Where materials have several closures, these are the programs of their weights; each use of a closure runs its
        own.
        """
        mi, dr, tables = self.mi, self.dr, self.tables
        if self.is_one:
            leaf, _, there = self._leaves(active)
            row = dr.gather(mi.UInt32, tables.leaf_row, leaf, there)
            kind = dr.gather(mi.UInt32, tables.leaf_kind, leaf, there)
            self._inputs = computed_inputs(tables.kinds, tables.buffers, (kind, row), si, there)
        elif tables.most_factors and tables.most_leaves <= MOST_KEPT:
            leaves = self._leaves(active)

            def add(leaf: Any, *kept: Any) -> tuple[Any, ...]:
                mine = self._read_weight(leaf, si, leaves[2])
                return tuple(dr.select(leaf == leaves[0] + k, mine, old) for k, old in enumerate(kept))

            none = tuple(mi.Float(0.0) for _ in range(tables.most_leaves))
            self._weights, self._first = self._over_leaves(none, add, leaves), leaves[0]

    def flags(self) -> Any:
        """Mitsuba's flags of the material."""
        return self.dr.gather(self.mi.UInt32, self.tables.material_flags, self.material)

    def _leaves(self, active: Any) -> tuple[Any, Any, Any]:
        """First leaf, the one after the last, and True if there is any."""
        mi, dr = self.mi, self.dr
        first = dr.gather(mi.UInt32, self.tables.first_leaf, self.material, active)
        count = dr.gather(mi.UInt32, self.tables.leaf_count, self.material, active)
        return first, first + count, mi.Bool(active) & (count > 0)

    def weight(self, leaf: Any, si: Any, active: Any) -> Any:
        """Weight of a leaf."""
        if self._first is None:
            return self._read_weight(leaf, si, active)
        found = self.mi.Float(0.0)
        for k, kept in enumerate(self._weights):
            found = self.dr.select(active & (leaf == self._first + k), kept, found)
        return found

    def _read_weight(self, leaf: Any, si: Any, active: Any) -> Any:
        mi, dr, tables = self.mi, self.dr, self.tables
        result = dr.gather(mi.Float, tables.leaf_constant, leaf, active)
        if tables.most_factors == 0:
            return result
        place = dr.gather(mi.UInt32, tables.leaf_factor, leaf, active)
        end = place + FACTOR * dr.gather(mi.UInt32, tables.leaf_factors, leaf, active)

        def body(place: Any, result: Any) -> tuple[Any, Any]:
            there = active & (place < end)
            tables.factor.read(tables.buffers, place, si, there)
            factor = dr.clip(tables.factor.value, 0.0, 1.0)
            tables.factor.value = None
            is_rest = dr.gather(mi.Float, tables.buffers.numbers, place + 1, there) > 0.5
            factor = dr.select(is_rest, 1.0 - factor, factor)
            return place + FACTOR, dr.select(there, result * factor, result)

        if tables.most_factors == 1:
            return body(place, result)[1]
        return dr.while_loop((place, result), lambda place, _: active & (place < end), body)[1]

    def _by_kind(self, leaf: Any, call: Callable[..., Any], si: Any, rest: tuple[Any, ...], active: Any) -> Any:
        """``call(closure, si, rest, active)`` with the closure of a leaf and its inputs."""
        mi, dr, tables = self.mi, self.dr, self.tables
        row = dr.gather(mi.UInt32, tables.leaf_row, leaf, active)

        def target(kind: ClosureKind) -> Callable[..., Any]:
            def run(row: Any, si: Any, rest: tuple[Any, ...], computed: tuple[Any, ...], active: Any) -> Any:
                found = call(kind.prepare(tables.buffers, row, si, active, computed), si, rest, active)
                kind.clear()
                return found

            return run

        targets = [target(kind) for kind in tables.kinds]
        if len(targets) == 1:
            return targets[0](row, si, rest, self._inputs or (), active)
        kind = dr.gather(mi.UInt32, tables.leaf_kind, leaf, active)
        computed = self._inputs
        if computed is None:
            computed = computed_inputs(tables.kinds, tables.buffers, (kind, row), si, active)
        return dr.switch(kind, targets, row, si, rest, computed, active, label="closure")

    def _over_leaves(self, state: tuple[Any, ...], body: Callable[..., Any], leaves: tuple[Any, Any, Any]) -> Any:
        """``state`` after ``body(leaf, *state)`` for each leaf."""
        first, end, active = leaves

        def step(leaf: Any, *state: Any) -> tuple[Any, ...]:
            return (leaf + 1, *body(leaf, *state))

        return self.dr.while_loop((first, *state), lambda leaf, *_: active & (leaf < end), step)[1:]

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
        """Value · cosine and density of a direction."""
        value, density = self._evaluated(ctx, si, wo, active)
        scene = self.tables.buffers.scene
        return (value * faded(scene, si, wo, active) if scene.shifts else value), density

    def _evaluated(self, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        dr = self.dr
        leaves = self._leaves(active)
        if self.is_one:
            leaf, _, active = leaves
            value, density = self._measured(leaf, ctx, si, wo, active)
            amount = self.weight(leaf, si, active)
            return dr.select(active, amount * value, 0.0), dr.select(active & (amount > 0.0), density, 0.0)
        total = self._total(si, leaves)
        return self._weighed(ctx, si, wo, dr.select(total > 0.0, dr.rcp(total), 0.0), (*leaves, None))

    def _measured(self, leaf: Any, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        def call(closure: Any, si: Any, rest: tuple[Any, ...], active: Any) -> tuple[Any, Any]:
            if not closure.flags() & ctx.type_mask:  # for lobes that are not requested
                return self.mi.Spectrum(0.0), self.mi.Float(0.0)
            value, density = closure.eval_pdf(ctx, si, rest[0], active)
            return self.mi.Spectrum(value), self.mi.Float(density)

        value, density = self._by_kind(leaf, call, si, (wo,), active)
        return value, density

    def _total(self, si: Any, leaves: tuple[Any, Any, Any]) -> Any:
        """Sum of all weights."""
        active = leaves[2]

        def add(leaf: Any, total: Any) -> tuple[Any]:
            return (total + self.weight(leaf, si, active),)

        return self._over_leaves((self.mi.Float(0.0),), add, leaves)[0]

    def _weighed(self, ctx: Any, si: Any, wo: Any, scale: Any, leaves: tuple[Any, ...]) -> tuple[Any, Any]:
        """Sum over all leaves, and the density of drawing ``wo``; ``scale``: 1 over the sum of weights.

        ``leaves``: the first, the one after the last, True where there are any, and the leaf that has drawn ``wo``.
        """
        mi, active, drawn = self.mi, leaves[2], leaves[3]

        def add(leaf: Any, value: Any, density: Any) -> tuple[Any, Any]:
            amount = self.weight(leaf, si, active)
            place = si if drawn is None else mark_drawn(mi, self.dr, si, leaf == drawn)
            mine, own = self._measured(leaf, ctx, place, wo, active)
            return value + amount * mine, density + amount * scale * own

        value, density = self._over_leaves((mi.Spectrum(0.0), mi.Float(0.0)), add, leaves[:3])
        return value, density

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
        """A drawn direction, and its value over the density."""
        bs, value = self._sampled(ctx, si, sample1, sample2, active)
        scene = self.tables.buffers.scene
        if scene.shifts:
            own = (bs.sampled_type & DIVES) != 0
            value *= self.dr.select(own, 1.0, faded(scene, si, bs.wo, active))
        return bs, value

    def _sampled(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> tuple[Any, Any]:
        mi, dr = self.mi, self.dr
        leaves = self._leaves(active)
        if self.is_one:
            leaf, _, active = leaves
            amount = self.weight(leaf, si, active)
            bs, value = self._drawn(leaf, ctx, si, (sample1, sample2), active)
            dives = (bs.sampled_type & DIVES) != 0
            bs.pdf *= dr.select(dives, amount, 1.0)
            return bs, dr.select(active, value * dr.select(dives, 1.0, amount), 0.0)
        total = self._total(si, leaves)
        scale = dr.select(total > 0.0, dr.rcp(total), 0.0)
        chosen, amount, place = self._chosen(si, dr.minimum(sample1, 1.0 - 1e-6) * total, leaves)
        mine = leaves[2] & (amount > 0.0)
        drawn, value = self._drawn(chosen, ctx, si, (place, sample2), mine)
        dives = (drawn.sampled_type & DIVES) != 0
        drawn.pdf = dr.select(mine, drawn.pdf * dr.select(dives, total, amount * scale), 0.0)
        value = dr.select(mine, value * dr.select(dives, 1.0, total), 0.0)
        flag = drawn.sampled_type
        sharp = mi.has_flag(flag, mi.BSDFFlags.Delta) | mi.has_flag(flag, mi.BSDFFlags.Null) | dives
        sharp |= (flag & OWN) != 0
        spread = mine & ~sharp & (drawn.pdf > 0.0)
        first, end, _ = leaves
        every, density = self._weighed(ctx, si, drawn.wo, scale, (first, end, spread, chosen))
        drawn.pdf = dr.select(spread, density, drawn.pdf)
        value = dr.select(spread, every / dr.maximum(density, 1e-20), value)
        return drawn, dr.select(mine & (drawn.pdf > 0.0), value, 0.0)

    def _chosen(self, si: Any, mark: Any, leaves: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
        """The leaf at ``mark`` in the running sum of weights, its weight, and the position within its part, in [0,
        1).
        """
        mi, dr = self.mi, self.dr
        active = leaves[2]

        def step(leaf: Any, chosen: Any, amount: Any, start: Any, below: Any) -> tuple[Any, ...]:
            mine = self.weight(leaf, si, active)
            here = (mark >= below) & (mark < below + mine)
            chosen, amount = dr.select(here, leaf, chosen), dr.select(here, mine, amount)
            return chosen, amount, dr.select(here, below, start), below + mine

        state = (mi.UInt32(leaves[0]), mi.Float(0.0), mi.Float(0.0), mi.Float(0.0))
        chosen, amount, start, _ = self._over_leaves(state, step, leaves)
        return chosen, amount, dr.clip((mark - start) / dr.maximum(amount, 1e-12), 0.0, 1.0 - 1e-6)

    def _drawn(self, leaf: Any, ctx: Any, si: Any, samples: tuple[Any, Any], active: Any) -> tuple[Any, Any]:
        def call(closure: Any, si: Any, rest: tuple[Any, ...], active: Any) -> tuple[Any, Any]:
            bs, value = closure.sample(ctx, si, *rest, active)
            return bs, self.mi.Spectrum(value)

        bs, value = self._by_kind(leaf, call, si, samples, active)
        return bs, value

    def normal_below(self, si: Any, active: Any) -> Any:
        """Normal about which light from below the surface leaves, of any length."""
        leaves = self._leaves(active)

        def add(leaf: Any, total: Any) -> tuple[Any]:
            def call(closure: Any, si: Any, rest: tuple[Any, ...], active: Any) -> Any:
                return closure.normal_below(si, active)

            return (total + self.weight(leaf, si, leaves[2]) * self._by_kind(leaf, call, si, (), leaves[2]),)

        return self._over_leaves((self.mi.Vector3f(0.0),), add, leaves)[0]

    def of_drawn(self, name: str, si: Any, sample1: Any, active: Any) -> Any:
        """Result of a method ``name`` of the closure that was drawn with ``sample1``."""
        leaf, _, active = leaves = self._leaves(active)
        if not self.is_one:
            mark = self.dr.minimum(sample1, 1.0 - 1e-6) * self._total(si, leaves)
            leaf, _, _ = self._chosen(si, mark, leaves)

        def call(closure: Any, si: Any, rest: tuple[Any, ...], active: Any) -> Any:
            return getattr(closure, name)(si, active)

        return self._by_kind(leaf, call, si, (), active)

    def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
        """Share of light that passes straight through."""
        mi = self.mi
        if not any(self._passes(kind) for kind in self.tables.kinds):
            return mi.Spectrum(0.0)
        leaves = self._leaves(active)
        if self.is_one:
            return self._passed(leaves[0], si, leaves[2])

        def add(leaf: Any, passed: Any) -> tuple[Any]:
            return (passed + self._passed(leaf, si, leaves[2]),)

        return self._over_leaves((mi.Spectrum(0.0),), add, leaves)[0]

    def _passes(self, kind: ClosureKind) -> bool:
        return bool(kind.flags & int(self.mi.BSDFFlags.Null))

    def _passed(self, leaf: Any, si: Any, active: Any) -> Any:
        """Transmission of one leaf, times its weight."""
        mi, dr, tables = self.mi, self.dr, self.tables
        kind = dr.gather(mi.UInt32, tables.leaf_kind, leaf, active)
        row = dr.gather(mi.UInt32, tables.leaf_row, leaf, active)
        result, any_passes = mi.Spectrum(0.0), mi.Bool(False)
        for number, of in enumerate(tables.kinds):
            if self._passes(of):
                mine = active & (kind == number)
                clear = of.prepare(tables.buffers, row, si, mine).eval_null_transmission(si, mine)
                of.clear()
                result, any_passes = dr.select(mine, clear, result), any_passes | mine
        return dr.select(any_passes, result * self.weight(leaf, si, any_passes), 0.0)
