# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of mixes and sums that read a shader more than once: each shader once, with the sum of its weights."""

from __future__ import annotations

from dataclasses import dataclass, field

from spectral_core.scene import AddSurface, Holdout, MixSurface, SumSurface, Surface, Weight

from ..fields import Value, scalar_of
from ..reader import Reader

DEEPEST = 50
"""Mixes inside each other that are kept as such: a scene is sent to the renderer by recursion."""
WHOLE_HOLDOUT = 1e-5
"""Difference from 1 of the weights of Holdouts that make a surface a whole one."""
Way = tuple[Weight, Value]
"""A weight, and the same as a result of the program."""


@dataclass
class Sums:
    """The mixes and sums of one surface. ``shares``: their factors, by the ``id`` of the mix."""

    reader: Reader
    shares: dict[int, Value] = field(default_factory=dict)

    def mixed(self, share: Value, first: Surface, second: Surface) -> Surface:
        """A mix of two surfaces; one of equal parts is that part."""
        if first is second:
            return first
        made = MixSurface(scalar_of(share), first, second)
        self.shares[id(made)] = share
        return made

    def held_out(self, surface: Surface) -> Surface:
        """``surface``, of which the camera sees a hole alone where the weights of its Holdouts amount to 1.

        There Cycles ends a path of the camera before all other closures, which only a sum adds to such Holdouts; all
        other rays meet these closures.
        """
        order, _, _ = _order(surface, surface)
        if not any(isinstance(item, Holdout) for item in order) or not any(isinstance(i, AddSurface) for i in order):
            return surface
        weights: dict[int, Value] = {}
        for item in order:
            if isinstance(item, (MixSurface, AddSurface)):
                ends = weights[id(item.first)], weights[id(item.second)]
                weights[id(item)] = (
                    self.reader.emit("mix_number", self.shares[id(item)], *ends)
                    if isinstance(item, MixSurface)
                    else self.reader.emit("math", *ends, 0.0, settings=("ADD",))
                )
            else:
                weights[id(item)] = self.reader.literal(float(isinstance(item, Holdout)))
        is_whole = self.reader.emit("math", weights[id(surface)], 1.0, WHOLE_HOLDOUT, settings=("COMPARE",))
        if is_whole.constant is not None and not is_whole.constant[0]:
            return surface
        seen = self.reader.point("ray:Is Camera Ray", 1)
        hole = self.reader.emit("math", is_whole, seen, 0.0, settings=("MULTIPLY",))
        return self.mixed(hole, surface, Holdout())

    def settled(self, surface: Surface, black: Surface) -> Surface:
        """``surface`` itself, or a flat sum if it is deep, or if shaders occur in it more than once, as in Cycles.

        ``black``: the surface of unlinked sockets, which may occur more than once.
        """
        order, depths, repeats = _order(surface, black)
        if not repeats and depths[id(surface)] <= DEEPEST:
            return surface
        most = self._most(order)[id(surface)]
        ways: dict[int, Way] = {id(surface): (Weight(), self.reader.literal(1.0))}

        def give(item: Surface, way: Way) -> None:
            ways[id(item)] = self._added(ways[id(item)], way, most) if id(item) in ways else way

        for item in reversed(order):
            if isinstance(item, MixSurface):
                for part, is_rest in ((item.first, True), (item.second, False)):
                    give(part, self._times(ways[id(item)], item, is_rest=is_rest))
            elif isinstance(item, AddSurface):
                for part in (item.first, item.second):
                    give(part, ways[id(item)])
        parts = ((ways[id(item)][0], item) for item in order if not isinstance(item, (MixSurface, AddSurface)))
        return SumSurface(tuple(parts))

    def _most(self, order: list[Surface]) -> dict[int, float]:
        """Largest sum of the weights of all shaders in each surface."""
        most: dict[int, float] = {}
        for item in order:
            if isinstance(item, MixSurface):
                most[id(item)] = max(most[id(item.first)], most[id(item.second)])
            elif isinstance(item, AddSurface):
                most[id(item)] = most[id(item.first)] + most[id(item.second)]
            else:
                most[id(item)] = 1.0
        return most

    def _times(self, way: Way, mix: MixSurface, *, is_rest: bool) -> Way:
        weight, value = way
        product = self.reader.emit("math", value, self.shares[id(mix)], 0.0, settings=("MULTIPLY",))
        if is_rest:  # not by 1 - share, which is the same step at a half alone
            product = self.reader.emit("math", value, product, 0.0, settings=("SUBTRACT",))
        return weight.times(mix.factor, complement=is_rest), product

    def _added(self, one: Way, other: Way, most: float) -> Way:
        """The sum of two weights, which is at most ``most``; a varying one is a factor up to 1 on its bound."""
        (first, first_value), (second, second_value) = one, other
        value = self.reader.emit("math", first_value, second_value, 0.0, settings=("ADD",))
        bound = first.constant + second.constant
        if first.varying == second.varying or bound == 0:
            return Weight(first.varying, bound), value
        bound = min(bound, most)
        share = self.reader.emit("math", value, 1.0 / bound, 0.0, settings=("MULTIPLY",))
        return Weight(constant=bound).times(scalar_of(share)), value


def _order(surface: Surface, black: Surface) -> tuple[list[Surface], dict[int, int], bool]:
    """The parts of a surface, each once and after its own parts; how deep each is; True if one occurs twice."""
    order: list[Surface] = []
    depths: dict[int, int] = {}
    waiting: set[int] = set()
    repeats, stack = False, [surface]
    while stack:
        item = stack[-1]
        parts = [item.first, item.second] if isinstance(item, (MixSurface, AddSurface)) else []
        if id(item) not in depths and id(item) not in waiting:
            waiting.add(id(item))
            stack += reversed(parts)
            if parts:
                continue
        stack.pop()
        if id(item) in depths:
            repeats = repeats or item is not black
            continue
        depths[id(item)] = 1 + max((depths[id(part)] for part in parts), default=0)
        order.append(item)
    return order, depths, repeats
