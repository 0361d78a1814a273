# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of mixes and sums: their closures, the closures' weights, and all of their values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

from spectral_core.scene.paint import WHOLE, ImageTexture, MixedPaint, Paint, Scalar, SpectralImage, Weight
from spectral_core.scene.shading.program import Computed, OnRaised, Program
from spectral_core.scene.surface import (
    AddSurface,
    Closure,
    Emission,
    Holdout,
    MixSurface,
    Principled,
    SumSurface,
    Surface,
)

INNER = (MixSurface, AddSurface, SumSurface)
"""Surfaces of other surfaces."""


def weighted_leaves(surface: Surface | None, weight: Weight = WHOLE) -> Iterator[tuple[Weight, Closure]]:
    """The closures of a surface's mixes and sums, with their weights; those of weight 0 are omitted."""
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
        elif isinstance(item, SumSurface):
            stack += [(amount.joined(part), inner) for part, inner in reversed(item.parts)]
        else:
            yield amount, item


def has_holes(scene: Any) -> bool:
    """True if a picture of a ``Scene`` may have uncovered pixels: a transparent film, or holdouts."""
    if scene.film.transparent or any(instance.is_holdout for instance in scene.instances):
        return True
    return any(isinstance(leaf, Holdout) for material in scene.materials for leaf in leaves(material.surface))


def leaves(surface: Surface | None) -> Iterator[Closure]:
    """Every closure in a surface's mixes and sums, also those of weight 0."""
    stack = [surface]
    while stack:
        item = stack.pop()
        if isinstance(item, INNER):
            stack += reversed(parts_of(item))
        elif item is not None:
            yield item


def parts_of(surface: MixSurface | AddSurface | SumSurface) -> list[Surface]:
    """The surfaces that a mix or sum consists of."""
    if isinstance(surface, SumSurface):
        return [inner for _, inner in surface.parts]
    return [surface.first, surface.second]


def emissions_of(surface: Surface | None) -> Iterator[tuple[Paint, Scalar]]:
    """Color and strength of each closure of a surface that emits light; a strength of 0 is omitted."""
    for leaf in leaves(surface):
        if isinstance(leaf, Emission):
            color, strength = leaf.color, leaf.strength
        elif isinstance(leaf, Principled):
            color, strength = leaf.emission_color, leaf.emission_strength
        else:
            continue
        if not (isinstance(strength, (int, float)) and strength == 0):
            yield color, strength


def largest_sum(surface: Surface | None, value: Callable[[Closure], float]) -> float:
    """Largest ``value`` of a surface's closures, which is at least 0; those of a sum add up, in a mix one counts."""
    known: dict[int, float] = {}
    stack = [] if surface is None else [surface]
    while stack:  # no recursion: a tree may be thousands of mixes deep
        item = stack[-1]
        parts = parts_of(item) if isinstance(item, INNER) else []
        if waiting := [inner for inner in parts if id(inner) not in known]:
            stack += waiting
            continue
        if id(stack.pop()) in known:
            continue
        values = [known[id(inner)] for inner in parts]
        if isinstance(item, SumSurface):  # a flat tree of mixes and sums
            weights = (abs(weight.constant) for weight, _ in item.parts)
            known[id(item)] = max(sum(w * v for w, v in zip(weights, values, strict=True)), *values, 0.0)
        elif isinstance(item, INNER):
            known[id(item)] = sum(values) if isinstance(item, AddSurface) else max(values)
        else:
            known[id(item)] = value(item)
    return 0.0 if surface is None else known[id(surface)]


def map_leaves(surface: Surface, change: Callable[[Closure], Surface]) -> Surface:
    """The surface with every closure changed, one that occurs more than once in the same way; the same object if
    nothing changes.
    """
    changed: dict[int, Surface] = {}
    stack = [surface]
    while stack:  # no recursion: a tree may be thousands of mixes deep
        item = stack[-1]
        if isinstance(item, INNER):
            waiting = [inner for inner in parts_of(item) if id(inner) not in changed]
            if waiting:
                stack += reversed(waiting)
                continue
        if id(item) not in changed:
            changed[id(item)] = _joined(item, changed) if isinstance(item, INNER) else change(item)
        stack.pop()
    return changed[id(surface)]


def _joined(surface: MixSurface | AddSurface | SumSurface, changed: dict[int, Surface]) -> Surface:
    """A mix or sum of changed surfaces."""
    if all(changed[id(inner)] is inner for inner in parts_of(surface)):
        return surface
    if isinstance(surface, SumSurface):
        return SumSurface(tuple((weight, changed[id(inner)]) for weight, inner in surface.parts))
    return replace(surface, first=changed[id(surface.first)], second=changed[id(surface.second)])


def values_of(surface: Surface | None) -> Iterator[Any]:
    """Every color, number and normal in a surface, factors of mixes included."""
    stack: list[Surface | None] = [surface]
    while stack:
        item = stack.pop()
        if isinstance(item, INNER):
            stack += reversed(parts_of(item))
            if isinstance(item, MixSurface):
                yield item.factor
            elif isinstance(item, SumSurface):
                factors = (value for weight, _ in item.parts for value, _ in weight.varying)
                yield from {id(value): value for value in factors}.values()  # a deep mix has each of them often
        elif item is not None:
            yield from (getattr(item, name) for name in type(item).__slots__)


def programs_of(surface: Surface | None) -> Iterator[Program]:
    """Every program in a surface."""
    yield from (value.program for value in simple_values_of(surface) if isinstance(value, Computed))


def mesh_inputs_of(surface: Surface | None) -> frozenset[str]:
    """Inputs that a surface reads from its mesh: ``"uv"`` for its images, and those of its programs."""
    return inputs_of(values_of(surface))


def inputs_of(values: Iterable[Any]) -> frozenset[str]:
    """Inputs that colors and numbers read from a mesh: ``"uv"`` for images, and those of programs."""
    simple = list(_parts(values))
    images = any(isinstance(value, (ImageTexture, SpectralImage)) for value in simple)
    names = (name for value in simple if isinstance(value, Computed) for name in value.program.inputs)
    return frozenset(names) | ({"uv"} if images else set())


def operations_of(values: Iterable[Any]) -> frozenset[str]:
    """Names of the operations in the programs of colors and numbers."""
    computed = (value for value in _parts(values) if isinstance(value, Computed))
    return frozenset(each.operation for value in computed for each in value.program.instructions)


def simple_values_of(surface: Surface | None) -> Iterator[Any]:
    """``values_of`` with each mixed paint divided into its parts."""
    return _parts(values_of(surface))


def _parts(values: Iterable[Any]) -> Iterator[Any]:
    stack = list(values)
    while stack:
        value = stack.pop()
        if isinstance(value, MixedPaint):
            stack += [value.factor, value.first, value.second]
            continue
        if isinstance(value, OnRaised):
            stack.append(value.surface)
        yield value
