# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility of objects, lamps and worlds to rays, and light linking, from Blender's settings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from spectral_core.scene import Rays

FLAGS = {
    "visible_camera": Rays.CAMERA, "visible_diffuse": Rays.DIFFUSE, "visible_glossy": Rays.GLOSSY,
    "visible_transmission": Rays.TRANSMISSION, "visible_volume_scatter": Rays.VOLUME, "visible_shadow": Rays.SHADOW,
}  # fmt: skip
WORLD_FLAGS = {
    "camera": Rays.CAMERA, "diffuse": Rays.DIFFUSE, "glossy": Rays.GLOSSY, "transmission": Rays.TRANSMISSION,
    "scatter": Rays.VOLUME,
}  # fmt: skip


def cycles_settings(owner: Any, name: str, fallback: Any) -> Any:
    """A setting of Cycles in ``owner.cycles``; ``fallback`` if this Blender has no Cycles."""
    return getattr(getattr(owner, "cycles", None), name, fallback)


def terminator_cosine(obj: Any) -> float:
    """Cosine below which light starts from the rounded surface of an object (Cycles' Geometry Offset)."""
    name = "shadow_terminator_geometry_offset"
    return float(min(max(getattr(obj, name, cycles_settings(obj, name, 0.1)), 0.0), 1.0))


def hidden_from(obj: Any) -> Rays:
    """Types of rays that an object's ray visibility switches off."""
    return _bits(obj, FLAGS)


def world_hidden_from(world: Any) -> Rays:
    """Types of rays that a world's ray visibility switches off."""
    return _bits(getattr(world, "cycles_visibility", None), WORLD_FLAGS)


def _bits(owner: Any, flags: dict[str, Rays]) -> Rays:
    bits = Rays.NONE
    for name, kind in flags.items():
        if not getattr(owner, name, True):
            bits |= kind
    return bits


class Linking:
    """Light and shadow linking of the lamps of a scene: illuminated objects, and occluders."""

    def __init__(self) -> None:
        self._receivers: dict[str, tuple[set[Any], set[Any]]] = {}
        self._blockers: dict[str, tuple[set[Any], set[Any]]] = {}

    @property
    def is_used(self) -> bool:
        """True if any lamp is linked to some objects only."""
        return bool(self._receivers or self._blockers)

    def add(self, light: str, lamp_object: Any) -> None:
        """Read the collections of a lamp object's linking."""
        linking = getattr(lamp_object, "light_linking", None)
        for name, table in (("receiver_collection", self._receivers), ("blocker_collection", self._blockers)):
            collection = getattr(linking, name, None)
            if collection is not None:
                table[light] = _members(collection)

    def unlit_by(self, obj: Any) -> tuple[str, ...]:
        """Names of the lights that do not illuminate an object (an original one)."""
        return _outside(self._receivers.items(), obj)

    def clear_for(self, obj: Any) -> tuple[str, ...]:
        """Names of the lights for which an object casts no shadow."""
        return _outside(self._blockers.items(), obj)


def _members(collection: Any) -> tuple[set[Any], set[Any]]:
    """Session numbers of the objects that a linking collection includes, and of those that it excludes."""
    included: set[Any] = set()
    excluded: set[Any] = set()
    for obj, entry in zip(collection.objects, collection.collection_objects, strict=False):
        side = excluded if entry.light_linking.link_state == "EXCLUDE" else included
        side.add(obj.original.session_uid)
    for child, entry in zip(collection.children, collection.collection_children, strict=False):
        side = excluded if entry.light_linking.link_state == "EXCLUDE" else included
        side.update(obj.original.session_uid for obj in child.all_objects)
    return included, excluded


def _outside(linked: Iterable[tuple[str, tuple[set[Any], set[Any]]]], obj: Any) -> tuple[str, ...]:
    number = obj.original.session_uid
    return tuple(
        light for light, (included, excluded) in linked if number in excluded or (included and number not in included)
    )
