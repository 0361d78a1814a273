# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated geometry that refers to freed data: Blender evaluates it again before anything reads it.

A socket of geometry nodes names a material, an object or a collection. Where that is deleted, replaced by another one
(``user_remap``) or loaded anew with its library, Blender exchanges it in the nodes and does not evaluate the objects
that they make: their evaluated geometry and its instances still refer to the freed copy, and reading them ends the
process (Blender 5.0 and earlier; plain Blender too, ``depsgraph.object_instances`` alone). Blender does report the node
tree. A handler compares what it names with what it named before, and tags the objects with geometry nodes. Blender
evaluates them after its handlers, in the same update and before its views, and calls no handler again.
"""

from __future__ import annotations

from typing import Any

import bpy

NAMED = ("MATERIAL", "OBJECT", "COLLECTION")
"""Types of sockets whose data stay in evaluated geometry."""
_named: dict[tuple[Any, ...], dict[int, tuple[int, ...]]] = {}
"""What each node tree named in the last evaluation of a depsgraph, by their session numbers."""
_tagged: set[tuple[Any, ...]] = set()
"""Depsgraphs whose objects were tagged after the latest evaluation."""


def is_evaluated_again(depsgraph: Any) -> bool:
    """True if evaluated data may refer to freed data until Blender's handlers end; other handlers must not read it."""
    return _key(depsgraph) in _tagged


def _key(depsgraph: Any) -> tuple[Any, ...]:
    return depsgraph.scene.session_uid, depsgraph.view_layer.name, depsgraph.mode


@bpy.app.handlers.persistent
def _evaluated(_scene: Any, depsgraph: Any) -> None:
    """Blender has evaluated an edit or a frame."""
    key = _key(depsgraph)
    _tagged.discard(key)
    if not depsgraph.id_type_updated("NODETREE"):
        return
    before, changed = _named.setdefault(key, {}), False
    for update in depsgraph.updates:
        if isinstance(update.id, bpy.types.GeometryNodeTree):
            tree = update.id.original
            named = _named_by(tree)
            changed |= before.get(tree.session_uid) != named
            before[tree.session_uid] = named
    if changed and _tag(depsgraph):
        _tagged.add(key)


def _named_by(tree: Any) -> tuple[int, ...]:
    """Session numbers of the data that the nodes of a tree name, 0 for none, in their order."""
    found = []
    for node in tree.nodes:
        found += [getattr(node, kind.lower()) for kind in NAMED if hasattr(node, kind.lower())]
        found += [socket.default_value for socket in node.inputs if socket.type in NAMED]
    return tuple(0 if data is None else data.session_uid for data in found)


def _tag(depsgraph: Any) -> bool:
    """Tag the objects with geometry nodes that have not been evaluated now; True if there is one."""
    fresh = {
        update.id.original.session_uid
        for update in depsgraph.updates
        if isinstance(update.id, bpy.types.Object) and update.is_updated_geometry
    }
    made = [
        each.original
        for each in depsgraph.ids
        if isinstance(each, bpy.types.Object)
        and each.original.session_uid not in fresh
        and any(modifier.type == "NODES" for modifier in each.original.modifiers)
    ]
    for each in made:
        each.update_tag(refresh={"DATA"})
    return bool(made)


def _lists() -> tuple[Any, Any]:
    return bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post


def register() -> None:
    """Start watching; the handler comes before those that read."""
    for handlers in _lists():
        handlers.insert(0, _evaluated)


def unregister() -> None:
    """Stop watching."""
    for handlers in _lists():
        handlers.remove(_evaluated)
    _named.clear()
    _tagged.clear()
