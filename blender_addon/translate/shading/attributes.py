# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom properties and settings for Attribute nodes: of an object, of its instancer, of the view layer."""

from __future__ import annotations

from typing import Any

import numpy as np

PREFIX = "object_attribute:"
NOTHING = (0.0, 0.0, 0.0, 1.0)
"""Blender's value of a missing attribute."""


def view_layer_attribute(depsgraph: Any, name: str) -> tuple[float, ...]:
    """Value (r, g, b, alpha) of a view layer's attribute; without one, that of the scene or the world."""
    scene = depsgraph.scene
    return _first((depsgraph.view_layer, scene, scene.world), name)


def object_attributes(obj: Any, instance: Any, reads: frozenset[str]) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """The attributes of an object that its materials read, by their names in programs."""
    found = []
    for read in sorted(reads):
        if not read.startswith(PREFIX):
            continue
        kind, _, name = read[len(PREFIX) :].partition(":")
        owners = [obj.original, getattr(obj.original, "data", None)]
        if kind == "INSTANCER" and instance.is_instance and instance.parent is not None:
            owners = [instance.parent.original, getattr(instance.parent.original, "data", None), *owners]
        found.append((read, _first(owners, name)))
    return tuple(found)


def _first(owners: Any, name: str) -> tuple[float, ...]:
    for owner in owners:
        if owner is None or not name:
            continue
        value = owner.get(name)
        if value is None:
            try:
                value = owner.path_resolve(name)
            except (ValueError, AttributeError, TypeError):
                continue
        numbers = _numbers(value)
        if numbers is not None:
            return numbers
    return NOTHING


def _numbers(value: Any) -> tuple[float, ...] | None:
    """A property as (r, g, b, alpha); None if it is no number."""
    if isinstance(value, (bool, int, float)):
        flat = np.full(3, float(value))
    else:
        try:
            flat = np.asarray(list(value), dtype=np.float64).ravel()
        except (TypeError, ValueError):
            return None
    if not 1 <= flat.size <= 4 or not np.isfinite(flat).all():
        return None
    padded = np.array(NOTHING)
    padded[: flat.size] = flat
    return tuple(float(part) for part in padded)
