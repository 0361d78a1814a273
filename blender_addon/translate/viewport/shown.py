# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that one 3D view shows: those of its local view, of its own collections, and of its visible types.

A view without collections of its own does not show those that the eye in the outliner hides.
"""

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


def part_shown_by(space: Any, view_layer: Any) -> tuple[set[str], set[int], set[str]] | None:
    """What decides which objects a view shows: hidden types, the session numbers of the objects in its local view, and
    the names of hidden collections.

    None for a view that shows all. Blender does not report a change of the types and of the local view.
    """
    types, collections = _hidden_types(space), _hidden_collections(space, view_layer)
    if not (types or collections or _is_local(space)):
        return None
    local = bpy.data.objects if _is_local(space) else ()
    return types, {obj.session_uid for obj in local if obj.visible_in_viewport_get(space)}, collections


def shown_by(space: Any, view_layer: Any) -> Callable[[Any], bool]:
    """Function that is True for the objects of the depsgraph (``DepsgraphObjectInstance``) that a view shows.

    Copies are as local as their owner, hidden with its collection, and hidden by their own type, as in Cycles.
    """
    types, is_local = _hidden_types(space), _is_local(space)
    hidden: set[int] = set() if is_local or not _hidden_collections(space, view_layer) else _hidden_objects(view_layer)
    if not (types or is_local or hidden):
        return lambda _instance: True

    def is_shown(instance: Any) -> bool:
        if instance.object.type in types:
            return False
        if is_local:  # a copy has the visibility of its owner, but for the owner's type
            return bool(instance.object.visible_in_viewport_get(space))
        owner = instance.parent if instance.is_instance else instance.object
        return owner.original.session_uid not in hidden

    return is_shown


def _is_local(space: Any) -> bool:
    """True in local view, and for a view with collections of its own."""
    return space.local_view is not None or bool(space.use_local_collections)


def _hidden_collections(space: Any, view_layer: Any) -> set[str]:
    """Names of the collections that the eye in the outliner hides; their objects stay in the depsgraph.

    A view with collections of its own has other eyes.
    """
    if space.use_local_collections:
        return set()
    found, left = set(), [view_layer.layer_collection]
    while left:
        each = left.pop()
        left += each.children
        if each.hide_viewport:
            found.add(each.name)
    return found


def _hidden_objects(view_layer: Any) -> set[int]:
    """Session numbers of the objects that are in hidden collections alone. A hidden collection hides those in it."""
    hidden: set[int] = set()
    shown: set[int] = set()
    left = [(view_layer.layer_collection, False)]
    while left:
        each, is_hidden = left.pop()
        is_hidden = is_hidden or each.hide_viewport
        left += [(child, is_hidden) for child in each.children]
        if not each.exclude:
            (hidden if is_hidden else shown).update(obj.session_uid for obj in each.collection.objects)
    return hidden - shown


def _hidden_types(space: Any) -> set[str]:
    return {kind for kind, name in SWITCHES.items() if not getattr(space, f"show_object_viewport_{name}", True)}
