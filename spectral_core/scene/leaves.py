# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of mixes and sums: their closures, the closures' weights, and everything that they hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from spectral_core.scene.paint import ImageTexture, MixedPaint, Scalar, SpectralImage
from spectral_core.scene.shading.program import Computed, Program
from spectral_core.scene.surface import AddSurface, Closure, MixSurface, Surface


@dataclass(frozen=True, slots=True)
class Weight:
    """A product of factors and of complements of factors: ``Π value`` or ``Π (1 - value)``."""

    factors: tuple[tuple[Scalar, bool], ...] = ()

    def times(self, value: Scalar, *, complement: bool = False) -> Weight:
        """This weight times ``value`` or ``1 - value``."""
        return Weight((*self.factors, (value, complement)))

    @property
    def constant(self) -> float:
        """Product of the factors that are plain numbers, each held within [0, 1]."""
        product = 1.0
        for value, complement in self.factors:
            if isinstance(value, (int, float)):
                held = min(max(float(value), 0.0), 1.0)
                product *= 1 - held if complement else held
        return product

    @property
    def varying(self) -> tuple[tuple[Scalar, bool], ...]:
        """The factors that are not plain numbers."""
        return tuple(item for item in self.factors if not isinstance(item[0], (int, float)))


def weighted_leaves(surface: Surface | None, weight: Weight = Weight()) -> Iterator[tuple[Weight, Closure]]:
    """The closures that a surface is mixed and added from, with their weights; those of weight 0 are left out."""
    stack: list[tuple[Weight, Surface | None]] = [(weight, surface)]
    while stack:  # no recursion: a tree may be thousands of mixes deep
        amount, item = stack.pop()
        if item is None or amount.constant == 0:
            continue
        if isinstance(item, MixSurface):
            stack.append((amount.times(item.factor), item.second))
            stack.append((amount.times(item.factor, complement=True), item.first))
        elif isinstance(item, AddSurface):
            stack += [(amount, item.second), (amount, item.first)]
        else:
            yield amount, item


def leaves(surface: Surface | None) -> Iterator[Closure]:
    """Every closure in a surface's mixes and sums, also those of weight 0."""
    stack = [surface]
    while stack:
        item = stack.pop()
        if isinstance(item, (MixSurface, AddSurface)):
            stack += [item.second, item.first]
        elif item is not None:
            yield item


def map_leaves(surface: Surface, change: Callable[[Closure], Surface]) -> Surface:
    """The surface with every closure changed; the same object where nothing changes."""
    if isinstance(surface, (MixSurface, AddSurface)):
        first, second = map_leaves(surface.first, change), map_leaves(surface.second, change)
        same = first is surface.first and second is surface.second
        return surface if same else replace(surface, first=first, second=second)
    return change(surface)


def values_of(surface: Surface | None) -> Iterator[Any]:
    """Every color, number and normal in a surface, factors of mixes included."""
    stack: list[Surface | None] = [surface]
    while stack:
        item = stack.pop()
        if isinstance(item, (MixSurface, AddSurface)):
            stack += [item.second, item.first]
            if isinstance(item, MixSurface):
                yield item.factor
        elif item is not None:
            yield from (getattr(item, name) for name in type(item).__slots__)


def programs_of(surface: Surface | None) -> Iterator[Program]:
    """Every program in a surface."""
    yield from (value.program for value in simple_values_of(surface) if isinstance(value, Computed))


def mesh_inputs_of(surface: Surface | None) -> frozenset[str]:
    """Inputs that a surface reads from its mesh: ``"uv"`` for its images, and those of its programs."""
    images = any(isinstance(value, (ImageTexture, SpectralImage)) for value in simple_values_of(surface))
    return frozenset(name for program in programs_of(surface) for name in program.inputs) | (
        {"uv"} if images else set()
    )


def simple_values_of(surface: Surface | None) -> Iterator[Any]:
    """``values_of`` with each mixed paint divided into its parts."""
    stack = list(values_of(surface))
    while stack:
        value = stack.pop()
        if isinstance(value, MixedPaint):
            stack += [value.factor, value.first, value.second]
        else:
            yield value
