# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of a light for a receiver: by strength, distance and cosines, with the exact probability of each item.

The weight of an item is an upper bound of its irradiance without occlusion. A choice inverts the running sum of the
weights, so that stratified numbers stay stratified over the lamps (Shirley et al. 1996, with the clusters of Conty and
Kulla 2018 above ``EXACT`` items).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from spectral_core.render.lights.hierarchy import FAR_SUN, Hierarchy
from spectral_core.render.lights.stretch import Stretch
from spectral_core.render.plugins.numbers import table

LEAST_COSINE = 0.02
"""Least share for an item below a receiver's horizon, because bumps may face it."""
LEAST_ALONG = 0.05
"""Least share for an item that does not illuminate the nearest point of a segment: it may illuminate another."""


@dataclass
class Receiver:
    """A point that receives light: ``place``, the side that counts (``normal``), and ``both_sides``, True if light from
    behind counts too. ``floats``: True in a medium, where the normal does not count; None without media. ``stretch``:
    segment in the medium that light is sampled along; None for ``place`` alone.
    """

    place: Any
    normal: Any
    both_sides: Any
    floats: Any = None
    stretch: Stretch | None = None
    kinds: Any = None
    """Types of rays along which it scatters light (bits of ``Rays``); None if all lights may illuminate it."""
    unlit: Any = None
    """Bits of the linked lights that do not illuminate it; None without linking."""


def receiver_of(path: Any, tables: Any) -> Receiver:
    """The place that a ray comes from."""
    import drjit as dr

    floats = None if tables.media is None else dr.squared_norm(path.before.n) == 0.0
    rules = {"kinds": path.before_kinds, "unlit": tables.unlit_by(path.before_shape)}
    return Receiver(path.before.p, path.before.n, path.before_both, floats, **rules)


@dataclass
class Chosen:
    """An item and its probability, 0 if no item can illuminate the receiver. With a ``stretch``: its ``center`` and
    ``radius``; ``far``: True if it is infinitely far away.
    """

    item: Any
    probability: Any
    center: Any = None
    radius: Any = None
    far: Any = None
    sample: Any = None
    """Random numbers for a point of the item, if the choice has left them."""


class Choice:
    """Draws one of ``count`` items; with one item there is nothing to draw."""

    def __init__(
        self, mitsuba: Any, hierarchy: Hierarchy, rules: Any = None, usual: Any = None, *, has_axes: bool = False
    ) -> None:
        """``rules``: (items, 2) types of rays that an item does not illuminate, and its bit among linked lights.
        ``usual``: center and radius (4,) whose distance far items get, None if distance does not change their weight.
        ``has_axes``: True if a later edit may direct the light of an item.
        """
        import drjit

        mi, rows = mitsuba, hierarchy.rows
        self._mi = mi
        self.count = len(hierarchy.row_of_item)
        self.levels = hierarchy.levels
        flat, whole = partial(table, mi.Float), partial(table, mi.UInt32)
        self._places = flat(np.concatenate([rows.centers, rows.radii[:, None]], axis=1))
        self._strengths = flat(rows.strengths)
        self._has_far = bool(np.any(rows.radii < 0))
        # numbers that kernels read: a lamp that moves needs no new kernel
        self._usual = None if usual is None else [drjit.opaque(mi.Float, float(number)) for number in usual]
        self._has_axes = has_axes or bool(np.any(rows.axes != 0))
        if self._has_axes:
            # the sign of the smallest share encodes a light with two sides
            least = np.where(rows.two_sided, -1.0 - rows.least, rows.least)
            self._axes = flat(np.concatenate([rows.axes, rows.offsets[:, None]], axis=1))
            self._least = flat(least)
        self._row_of_item, self._item_of_row = whole(hierarchy.row_of_item), whole(np.maximum(hierarchy.item_of_row, 0))
        self._first, self._children = whole(hierarchy.first), whole(hierarchy.count)
        self._parent = whole(hierarchy.parent + 1)
        self._rules = None
        if rules is not None and np.any(rules):
            # a cluster may hold lights that illuminate the receiver, so it has no rules
            of_row = np.where(hierarchy.item_of_row[:, None] >= 0, rules[np.maximum(hierarchy.item_of_row, 0)], 0)
            self._rules = whole(of_row)
        self._top_first = drjit.opaque(mi.UInt32, hierarchy.top[0])
        self._top_count = drjit.opaque(mi.UInt32, hierarchy.top[1])

    def weight(self, row: Any, to: Receiver, active: Any) -> Any:
        """Bound of the irradiance at a receiver from an item or a cluster."""
        import drjit as dr

        mi = self._mi
        place = dr.gather(mi.Vector4f, self._places, row, active)
        strength = dr.gather(mi.Float, self._strengths, row, active)
        away, radius = mi.Vector3f(place.x, place.y, place.z) - mi.Vector3f(to.place), place.w
        squared = dr.squared_norm(away)
        inverse = dr.rsqrt(dr.maximum(squared, 1e-30))
        direction = away * inverse
        # sine of the angle by which the item's extent may change its direction, and a bound of that angle
        slack = 1.5708 * radius * inverse
        spread = dr.rcp(dr.maximum(dr.maximum(squared, radius * radius), 1e-30))
        if self._has_far:
            is_far = radius < 0.0
            direction = dr.select(is_far, mi.Vector3f(place.x, place.y, place.z), direction)
            slack = dr.select(is_far, dr.select(radius == FAR_SUN, 0.0, 1.0), slack)
            spread = dr.select(is_far, self._spread_of_far(to), spread)
        cosine = dr.dot(direction, to.normal)
        cosine = dr.select(to.both_sides, dr.abs(cosine), cosine)
        faces = dr.clip(cosine + slack, LEAST_COSINE, 1.0)
        if to.floats is not None:
            faces = dr.select(to.floats, 1.0, faces)
        if to.stretch is not None:
            view = to.stretch.seen_from(mi.Point3f(place.x, place.y, place.z), dr.maximum(radius, 0.0))
            given = dr.select(radius < 0.0, self._fluence_of_far(to.stretch), view.fluence)
            spread = dr.select(to.floats, given, spread)
            if self._has_axes:
                nearest = dr.clip(view.foot, 0.0, to.stretch.length) * to.stretch.direction
                away = mi.Vector3f(place.x, place.y, place.z) - mi.Vector3f(to.stretch.origin) - nearest
                inverse = dr.rsqrt(dr.maximum(dr.squared_norm(away), 1e-30))
                near = to.floats & (radius >= 0.0)
                direction = dr.select(near, away * inverse, direction)
                slack = dr.select(near, 1.5708 * radius * inverse, slack)
        amount = strength * spread * faces
        if self._has_axes:
            axis = dr.gather(mi.Vector4f, self._axes, row, active)
            least = dr.gather(mi.Float, self._least, row, active)
            along = -(axis.x * direction.x + axis.y * direction.y + axis.z * direction.z)
            steep = dr.sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z)
            along = dr.select(least < 0.0, dr.abs(along), along)
            least = dr.select(least < 0.0, -1.0 - least, least)
            if to.stretch is not None:
                least = dr.select(to.floats, dr.maximum(least, LEAST_ALONG), least)
            amount *= dr.clip(axis.w + along + steep * slack, least, 1.0)
        if self._rules is not None and to.kinds is not None:
            amount = dr.select(self._is_ruled_out(row, to, active), 0.0, amount)
        return dr.select(active, amount, 0.0)

    def _spread_of_far(self, to: Receiver) -> Any:
        """Factor of distance for suns and the environment at a receiver."""
        import drjit as dr

        if self._usual is None:
            return self._mi.Float(1.0)
        x, y, z, radius = self._usual
        squared = dr.squared_norm(self._mi.Vector3f(x, y, z) - self._mi.Vector3f(to.place))
        return dr.rcp(dr.maximum(dr.maximum(squared, radius * radius), 1e-30))

    def _fluence_of_far(self, stretch: Stretch) -> Any:
        """The same, integrated along a segment."""
        if self._usual is None:
            return stretch.length
        x, y, z, radius = self._usual
        return stretch.seen_from(self._mi.Point3f(x, y, z), radius).fluence

    def _is_ruled_out(self, row: Any, to: Receiver, active: Any) -> Any:
        """True for a light that is hidden from all that a receiver scatters, or linked to others only."""
        import drjit as dr

        rule = dr.gather(self._mi.Vector2u, self._rules, row, active)
        hidden = (rule.x != 0) & ((rule.x & to.kinds) == to.kinds)
        return hidden if to.unlit is None else hidden | ((rule.y & to.unlit) != 0)

    def place(self, item: Any, active: Any) -> tuple[Any, Any]:
        """Center of an item and its radius, below 0 if it is infinitely far away."""
        import drjit as dr

        mi = self._mi
        place = dr.gather(mi.Vector4f, self._places, dr.gather(mi.UInt32, self._row_of_item, item, active), active)
        return mi.Point3f(place.x, place.y, place.z), place.w

    def draw(self, to: Receiver, sample: Any, active: Any) -> tuple[Any, Any, Any]:
        """An item, its probability, 0 if no item can illuminate the receiver, and the rest of the sample."""
        import drjit as dr

        mi = self._mi
        if self.count == 1:
            return mi.UInt32(0), dr.select(active, mi.Float(1.0), 0.0), sample
        first, count = mi.UInt32(self._top_first), mi.UInt32(self._top_count)
        sample, probability = mi.Float(sample), dr.select(active, mi.Float(1.0), 0.0)
        choosing = mi.Bool(active)
        row = mi.UInt32(0)
        for level in range(self.levels):
            chosen, share, rest = self._among((first, first + count), to, sample, choosing)
            probability = dr.select(choosing, probability * share, probability)
            row = dr.select(choosing, chosen, row)
            sample = dr.select(choosing, rest, sample)
            if level + 1 < self.levels:
                count = dr.gather(mi.UInt32, self._children, row, choosing)
                first = dr.gather(mi.UInt32, self._first, row, choosing)
                choosing &= (count > 0) & (probability > 0.0)
        return dr.gather(mi.UInt32, self._item_of_row, row, active), probability, sample

    def _among(self, rows: tuple[Any, Any], to: Receiver, sample: Any, active: Any) -> tuple[Any, Any, Any]:
        """One of neighboring rows, its share of their weights, and the rest of the sample."""
        import drjit as dr

        mi = self._mi
        first, end = rows
        total = self._sum(rows, to, active)
        wanted = sample * total

        def body(row: Any, chosen: Any, below: Any, weight: Any, at: Any) -> Any:
            own = self.weight(row, to, row < end)
            # the last row with a weight is taken where rounding leaves the wanted sum beyond all of them
            taken = own > 0.0
            chosen, weight = dr.select(taken, row, chosen), dr.select(taken, own, weight)
            at = dr.select(taken, below, at)
            return row + 1, chosen, below + own, weight, at

        zero = mi.Float(0.0)
        _, chosen, _, weight, at = dr.while_loop(
            (mi.UInt32(first), mi.UInt32(first), zero, zero, zero),
            lambda row, chosen, below, weight, at: active & (row < end) & (below <= wanted),
            body,
            labels=("row", "chosen", "below", "weight", "at"),
        )
        lit = active & (weight > 0.0)
        share = dr.select(lit, weight / dr.maximum(total, 1e-37), 0.0)
        rest = dr.clip((wanted - at) / dr.maximum(weight, 1e-37), 0.0, 1.0 - 2.0**-24)
        return chosen, share, dr.select(lit, rest, 0.0)

    def _sum(self, rows: tuple[Any, Any], to: Receiver, active: Any) -> Any:
        import drjit as dr

        mi = self._mi
        first, end = rows
        _, total = dr.while_loop(
            (mi.UInt32(first), mi.Float(0.0)),
            lambda row, total: active & (row < end),
            lambda row, total: (row + 1, total + self.weight(row, to, row < end)),
            labels=("row", "total"),
        )
        return total

    def probability(self, item: Any, to: Receiver, active: Any) -> Any:
        """Probability that ``draw`` returns an item."""
        import drjit as dr

        mi = self._mi
        if self.count == 1:
            return dr.select(active, mi.Float(1.0), 0.0)
        row = dr.gather(mi.UInt32, self._row_of_item, item, active)
        result, climbing = dr.select(active, mi.Float(1.0), 0.0), mi.Bool(active)
        for _ in range(self.levels):
            parent = dr.gather(mi.UInt32, self._parent, row, climbing)  # counted from 1, 0 for none
            inside, above = parent > 0, dr.maximum(parent, 1) - 1
            first = dr.select(inside, dr.gather(mi.UInt32, self._first, above, climbing & inside), self._top_first)
            count = dr.select(inside, dr.gather(mi.UInt32, self._children, above, climbing & inside), self._top_count)
            total = self._sum((first, first + count), to, climbing)
            share = self.weight(row, to, climbing) / dr.maximum(total, 1e-37)
            result = dr.select(climbing, result * share, result)
            climbing &= inside
            row = dr.select(climbing, above, row)
        return result
