# SPDX-License-Identifier: GPL-3.0-or-later
"""The difference between two scenes in a small message: unchanged items are sent as references."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from spectral_core.render.same import equal
from spectral_core.scene import Scene

KINDS = ("meshes", "materials", "instances", "lights", "volumes")
"""Fields of a scene that are tuples of named items."""
SINGLES = ("camera", "film", "world", "settings", "notes")


@dataclass(frozen=True, slots=True, eq=False)
class SceneChange:
    """Change from one scene to the next. ``items``: by type the new items in order, an unchanged one as its index in
    the old scene. ``singles``: single fields that have changed.
    """

    items: dict[str, tuple[Any, ...]]
    singles: dict[str, Any]

    def applied_to(self, scene: Scene) -> Scene:
        """The new scene; unchanged items are the same objects as in ``scene``."""
        changes: dict[str, Any] = dict(self.singles)
        for kind, items in self.items.items():
            old = getattr(scene, kind)
            changes[kind] = tuple(old[item] if isinstance(item, int) else item for item in items)
        return dataclasses.replace(scene, **changes)

    @property
    def is_empty(self) -> bool:
        """True if the two scenes are equal."""
        return not self.items and not self.singles


def difference(old: Scene, new: Scene) -> SceneChange:
    """The change from ``old`` to ``new``."""
    items: dict[str, tuple[Any, ...]] = {}
    for kind in KINDS:
        before, after = getattr(old, kind), getattr(new, kind)
        if before is after:
            continue
        places = {item.name: place for place, item in enumerate(before)}
        change = []
        for item in after:
            place = places.get(item.name)
            is_same = place is not None and equal(before[place], item)
            change.append(place if is_same else item)
        if change != list(range(len(before))):
            items[kind] = tuple(change)
    singles = {name: getattr(new, name) for name in SINGLES if not equal(getattr(old, name), getattr(new, name))}
    return SceneChange(items, singles)
