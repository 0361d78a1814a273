# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes that geometry nodes stored on instances, of each level of instances in each other.

Blender names an instance by a list of numbers, the outermost last. A number is the value of the attribute ``id`` where
points have it, as those of Distribute Points on Faces, and otherwise the index of the instance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

NO_LEVEL = 2**31 - 1
"""Number in place of a level that an instance does not have."""
OWN_PART = {"MESH": "mesh", "VOLUME": "volume", "POINTCLOUD": "pointcloud", "GREASEPENCIL": "grease_pencil"} | (
    dict.fromkeys(("CURVE", "FONT", "CURVES"), "curves")
)
"""The part of an object's geometry that the object shows itself, by its type."""
PARTS = ("mesh", "curves", "pointcloud", "volume", "grease_pencil")
"""Parts of a geometry, each of which is an instance of its own; the instances have one number more beside them."""

NO_COLORS = ("QUATERNION", "FLOAT4X4", "STRING")
"""Types of attributes that Blender does not convert to a color, so that it looks on as if they were not there."""


@dataclass
class Level:
    """The instances of one geometry: points with their attributes, and what each refers to."""

    geometry: Any
    points: Any
    has_parts: bool
    references: Any = ()
    index_of: dict[int, int] = field(default_factory=dict)
    reference_of: Any = None


@dataclass
class InstancePoints:
    """The geometries that were met, by the addresses of their objects and of the instances around them."""

    levels: dict[tuple[int, ...], Level | None] = field(default_factory=dict)

    def value(self, name: str, instance: Any) -> tuple[Any, str]:
        """An attribute of an instance, from the innermost level that has it, None without one; and where it may be
        nevertheless, "" if every level was found.
        """
        if not hasattr(instance.parent, "evaluated_geometry"):
            is_made = any(modifier.type == "NODES" for modifier in instance.parent.modifiers)
            return None, "instances is not read before Blender 5.0" if is_made else ""
        found, complete = self._levels_of(instance)
        for level, index in reversed(found):
            stored = level.points.attributes.get(name)
            if stored is not None and stored.data_type not in NO_COLORS and index < len(stored.data):
                item = stored.data[index]
                for part in ("value", "vector", "color"):
                    if hasattr(item, part):
                        return getattr(item, part), ""
        return None, "" if complete else "instances in each other is not found"

    def _levels_of(self, instance: Any) -> tuple[list[tuple[Level, int]], bool]:
        """Levels around an instance from the outermost on, and its index in each; False if one was not found."""
        numbers = iter([int(k) for k in reversed(list(instance.persistent_id)) if k != NO_LEVEL])
        owner: Any = instance.parent
        found: list[tuple[Level, int]] = []
        key: tuple[int, ...] = (owner.as_pointer(),)
        if owner.type == "EMPTY":
            member = next(numbers, -1)
            owner, key = _member(owner.instance_collection, member), (*key, member)
        level = self._level(key, owner)
        while level is not None:
            if level.has_parts and next(numbers, None) is None:
                return found, True
            number = next(numbers, None)
            if number is None:
                return found, True
            index = level.index_of.get(number)
            if index is None:
                return found, False
            found.append((level, index))
            place = int(level.reference_of[index])
            inner, key = level.references[place], (*key, place)
            if isinstance(inner, bpy.types.Collection):
                member = next(numbers, -1)
                inner, key = _member(inner, member), (*key, member)
            level = self._level(key, inner)
        return found, True

    def _level(self, key: tuple[int, ...], owner: Any) -> Level | None:
        if key not in self.levels:
            self.levels[key] = None if owner is None else _read(owner)
        return self.levels[key]


def _read(owner: Any) -> Level | None:
    """The instances of an object's geometry, or of a geometry; None without any."""
    is_object = isinstance(owner, bpy.types.Object)
    if is_object and not hasattr(owner, "evaluated_geometry"):
        return None  # before Blender 5.0
    geometry = owner.evaluated_geometry() if is_object else owner
    points = None if geometry is None else geometry.instances_pointcloud()
    if points is None:
        return None
    own = OWN_PART.get(owner.type) if is_object else None
    has_parts = any(getattr(geometry, part, None) is not None for part in PARTS if part != own)
    count = len(points.points)
    numbers = _integers(points, "id", count)
    index_of: dict[int, int] = {}
    for index, number in enumerate(range(count) if numbers is None else numbers.tolist()):
        index_of.setdefault(number, index)  # Blender gives later ones of the same number another, random one
    return Level(
        geometry,
        points,
        has_parts,
        geometry.instance_references(),
        index_of,
        _integers(points, ".reference_index", count).tolist(),
    )


def _integers(points: Any, name: str, count: int) -> Any:
    stored = points.attributes.get(name)
    if stored is None:
        return None
    values = np.empty(count, np.int32)
    stored.data.foreach_get("value", values)
    return values


def _member(collection: Any, number: int) -> Any:
    """The object of a collection that a number names: it counts those that are rendered."""
    if collection is None:
        return None
    shown = [each for each in collection.all_objects if not each.hide_render]
    return shown[number] if 0 <= number < len(shown) else None
