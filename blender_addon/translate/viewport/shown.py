# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that one 3D view shows: those of its local view, of its own collections, and of its visible types."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

SWITCHES = {
    "MESH": "mesh", "CURVE": "curve", "SURFACE": "surf", "META": "meta", "FONT": "font", "CURVES": "curves",
    "POINTCLOUD": "pointcloud", "VOLUME": "volume", "LIGHT": "light",
}  # fmt: skip
"""Names, after ``show_object_viewport_``, of the switches of the popover Object Types Visibility, by type of object."""


def shows_a_part(space: Any) -> bool:
    """True if a view may hide objects that other views show."""
    return _is_local(space) or bool(_hidden_types(space))


def part_shown_by(space: Any) -> tuple[set[str], set[int]] | None:
    """What decides which objects a view shows: hidden types, and the session numbers of the objects in its local view.

    None for a view that shows all. Blender does not report a change of it.
    """
    if not shows_a_part(space):
        return None
    local = bpy.data.objects if _is_local(space) else ()
    return _hidden_types(space), {obj.session_uid for obj in local if obj.visible_in_viewport_get(space)}


def shown_by(space: Any) -> Callable[[Any], bool]:
    """Function that is True for the objects of the depsgraph (``DepsgraphObjectInstance``) that a view shows.

    Copies are as local as their owner, and hidden by their own type, as in Cycles.
    """
    is_local, hidden = _is_local(space), _hidden_types(space)
    if not is_local and not hidden:
        return lambda _instance: True

    def is_shown(instance: Any) -> bool:
        if instance.object.type in hidden:
            return False
        owner = instance.parent if instance.is_instance and instance.parent else instance.object
        return not is_local or bool(owner.original.visible_in_viewport_get(space))

    return is_shown


def _is_local(space: Any) -> bool:
    """True in local view, and for a view with collections of its own."""
    return space.local_view is not None or bool(space.use_local_collections)


def _hidden_types(space: Any) -> set[str]:
    return {kind for kind, name in SWITCHES.items() if not getattr(space, f"show_object_viewport_{name}", True)}
