# SPDX-License-Identifier: GPL-3.0-or-later
"""What the parameters of a sweep change, looked at in a few places of their ranges.

A parameter that changes nothing, such as the power of a lamp that is hidden, would make all its points equal.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator

from spectral_core.explore.sweep.parameters import Parameter, Space, Value

STARTS = (0.0, 0.63, 1.0)
"""Where the other parameters stand: one of them may switch on what a parameter changes."""
PLACES = (0.0, 1.0, 0.37)
"""Where a parameter stands on its range; whole turns repeat themselves at the ends."""


def without_effect(space: Space, state: Callable[[dict[str, Value]], Hashable]) -> list[Parameter]:
    """The parameters that change nothing, as far as a few places of their ranges tell.

    One that has an effect at the start of the other ranges costs one call beyond that of the start.

    Parameters
    ----------
    space : the parameters.
    state : equal for points that have equal outcomes; it may be slow.
    """
    state_at = remembered(state)

    def has_effect(parameter: Parameter) -> bool:
        for start in STARTS:
            others = {each.name: each.value(start) for each in space.parameters}
            points = ({**others, parameter.name: value} for value in _values(parameter))
            first = state_at(next(points))
            if any(state_at(point) != first for point in points):
                return True
        return False

    return [parameter for parameter in space.parameters if not has_effect(parameter)]


def remembered(state: Callable[[dict[str, Value]], Hashable]) -> Callable[[dict[str, Value]], Hashable]:
    """``state``, called once for each point."""
    known: dict[tuple[Value, ...], Hashable] = {}

    def state_at(values: dict[str, Value]) -> Hashable:
        address = tuple(values.values())
        if address not in known:
            known[address] = state(values)
        return known[address]

    return state_at


def places(space: Space) -> list[dict[str, Value]]:
    """Points that together show what a sweep renders: all parameters at each of ``STARTS``, and each choice.

    At the start of the ranges alone a lamp may be dark, a shader without a share, or an object hidden.
    """
    starts = [{each.name: each.value(start) for each in space.parameters} for start in STARTS]
    chosen = [{**starts[1], each.name: choice} for each in space.parameters for choice in each.choices]
    return [dict(point) for point in dict.fromkeys(tuple(point.items()) for point in starts + chosen)]


def _values(parameter: Parameter) -> Iterator[Value]:
    """Some different values: all of a choice, whose values may differ in one only."""
    if parameter.kind == "choice":
        yield from parameter.choices
    else:
        yield from dict.fromkeys(map(parameter.value, PLACES))
