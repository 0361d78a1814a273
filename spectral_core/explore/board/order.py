# SPDX-License-Identifier: GPL-3.0-or-later
"""Targets with a fixed order: each stops at its neighbors, in chains and trees."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from spectral_core.errors import InvalidInputError


@dataclass(frozen=True, slots=True)
class Order:
    """``pairs``: (lower, upper) each; without a circle."""

    pairs: tuple[tuple[str, str], ...] = ()

    def with_pair(self, lower: str, upper: str) -> Order:
        """The order with one more pair. Raises InvalidInputError if it would run in a circle."""
        if lower == upper:
            raise InvalidInputError(f"{lower!r} cannot bound itself; name a lower and an upper target")
        if lower in self._reached(upper, upwards=True):
            raise InvalidInputError(f"{upper!r} is kept below {lower!r} already; remove that order first")
        return Order((*(pair for pair in self.pairs if pair != (lower, upper)), (lower, upper)))

    def held(self, wanted: Mapping[str, float], read: Callable[[str], float | None]) -> dict[str, float]:
        """Limited values of targets. Targets that do not move limit the others; of two that move, the upper one has
        precedence. ``read`` returns the present value of a target that does not move, None if it limits nothing.
        """
        result: dict[str, float] = {}
        # From the top down, so that each finds its upper neighbors settled.
        for target in sorted(wanted, key=lambda name: len(self._reached(name, upwards=True) & set(wanted))):
            value = wanted[target]
            floors = [read(name) for name in self._reached(target, upwards=False) - set(wanted)]
            ceilings = [result[name] if name in wanted else read(name) for name in self._reached(target, upwards=True)]
            least = max([value, *(floor for floor in floors if floor is not None)])
            result[target] = min([least, *(ceiling for ceiling in ceilings if ceiling is not None)])
        return result

    def _reached(self, target: str, *, upwards: bool) -> set[str]:
        """All targets above (or below) one, through any number of pairs."""
        found: set[str] = set()
        pending = [target]
        while pending:
            here = pending.pop()
            nearby = [high if upwards else low for low, high in self.pairs if here == (low if upwards else high)]
            pending += [name for name in nearby if name not in found]
            found.update(nearby)
        return found
