# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of materials that reach or leave the value at which they have no effect.

The renderer loads no lobe that has no effect: a coat of weight 0, an alpha of 1. The first such number that an edit
raises needs a load; from then on the same number of all materials is held just off that value, by an amount that no
picture shows, and its edits are made in place. One that an edit lowers to that value is held, too. When the scene is
loaded for another reason, those are no longer held that no material uses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from spectral_core.scene import Color, Diffuse, Material, Principled, Scene, leaves, map_leaves
from spectral_core.scene.surface import Closure

OFF = 1e-6
"""Distance of a held number from the value without effect."""
_ZERO, _ONE = {0.0: OFF}, {1.0: 1.0 - OFF}
_WHITE = {"white": Color(np.full(3, 1.0 - OFF))}
HELD: dict[type, dict[str, dict[Any, Any]]] = {
    Principled: {
        "alpha": _ONE, "metallic": _ZERO, "transmission": _ZERO, "coat_weight": _ZERO, "diffuse_roughness": _ZERO,
        "sheen_weight": _ZERO, "subsurface_weight": _ZERO,
        "specular_tint": _WHITE, "coat_tint": _WHITE,
    },
    Diffuse: {"roughness": _ZERO},
}  # fmt: skip
"""By class and field, what is held in place of a value without effect."""

Number = tuple[str, str, str]
"""A number: class, field and the name of its material, "" for all materials."""


class Opened:
    """The numbers that are held off the value without effect."""

    def __init__(self) -> None:
        self._open: frozenset[Number] = frozenset()
        self._last: dict[str, tuple[Material, Material, frozenset[Number]]] = {}
        """By name the last material, what was shown for it, and what was open then."""
        self.has_grown = False
        """True if the last edit has raised or lowered a number that was not held."""

    def of(self, scene: Scene) -> Scene:
        """``scene`` with its numbers held; those that an edit has raised or lowered are held from now on."""
        opened = self._open
        for material in scene.materials:
            if material.name in self._last and self._last[material.name][0] is not material:
                opened |= _crossed(self._last[material.name][0], material, opened)
        self.has_grown = opened != self._open
        self._open = opened
        return self._held(scene)

    def renewed(self, scene: Scene) -> Scene:
        """``scene`` when it is loaded for another reason: what no material uses is no longer held."""
        used = {
            _numbers(leaf, field, "")[1]
            for material in scene.materials
            for leaf in leaves(material.surface)
            for field, held in HELD.get(type(leaf), {}).items()
            if _key(getattr(leaf, field)) not in held
        }
        self._open &= used
        return self._held(scene)

    def _held(self, scene: Scene) -> Scene:
        kept: dict[str, tuple[Material, Material, frozenset[Number]]] = {}
        for material in scene.materials:
            before = self._last.get(material.name)
            if before is not None and before[0] is material and before[2] == self._open:
                kept[material.name] = before
                continue
            made = material if not self._open or material.surface is None else _with(material, self._open)
            kept[material.name] = material, made, self._open
        self._last = kept
        shown = tuple(kept[material.name][1] for material in scene.materials)
        same = all(made is material for made, material in zip(shown, scene.materials, strict=True))
        return scene if same else replace(scene, materials=shown)


def _crossed(old: Material, new: Material, opened: frozenset[Number]) -> set[Number]:
    """Numbers that have an effect in one of two versions of a material, and are not open; none if these versions differ
    in their closures.
    """
    before, after = list(leaves(old.surface)), list(leaves(new.surface))
    if list(map(type, before)) != list(map(type, after)):
        return set()
    found = set()
    for first, second in zip(before, after, strict=True):
        for field, held in HELD.get(type(first), {}).items():
            was, now = _key(getattr(first, field)), _key(getattr(second, field))
            if was == now or was is None or now is None or not {was, now} & held.keys():
                continue
            own, of_all = _numbers(first, field, new.name)
            if own in opened or of_all in opened:
                continue
            found.add(of_all if was in held else own)
    return found


def _numbers(node: Any, field: str, material: str) -> tuple[Number, Number]:
    """A number of one material, and that of all."""
    kind = type(node).__name__
    return (kind, field, material), (kind, field, "")


def _key(value: Any) -> Any:
    """A number; "white" or "color" for a color; None for anything that varies."""
    if isinstance(value, Color):
        return "white" if np.all(value.linear_rgb == 1) else "color"
    return float(value) if isinstance(value, (int, float)) else None


def _with(material: Material, opened: frozenset[Number]) -> Material:
    """The material with its numbers held."""

    def held_in(leaf: Closure) -> Closure:
        changes = {}
        for field, held in HELD.get(type(leaf), {}).items():
            key = _key(getattr(leaf, field))
            if key in held and not opened.isdisjoint(_numbers(leaf, field, material.name)):
                changes[field] = held[key]
        return replace(leaf, **changes) if changes else leaf

    assert material.surface is not None
    surface = map_leaves(material.surface, held_in)
    return material if surface is material.surface else replace(material, surface=surface)
