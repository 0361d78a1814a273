# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of shader nodes of which Blender reports the nodes alone.

Blender reports an edited node of a material together with the material. It reports a link that a script mutes as an
edit of the node tree inside the material, and does not name the material. Blender 5.0 and earlier do not report such a
link of a lamp at all.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from types import SimpleNamespace
from typing import Any

import bpy


def with_owners(updates: Iterable[Any]) -> list[Any]:
    """The updates of a depsgraph, and one for each material, world or lamp of which only the nodes are reported."""
    listed = list(updates)
    trees = {
        update.id.original.session_uid
        for update in listed
        if update.id.bl_rna.identifier == "ShaderNodeTree" and update.id.is_embedded_data
    }
    if not trees:
        return listed
    named = {update.id.original.session_uid for update in listed}
    for block in chain(bpy.data.materials, bpy.data.worlds, bpy.data.lights):
        tree = block.node_tree
        if tree is not None and tree.session_uid in trees and block.session_uid not in named:
            listed.append(
                SimpleNamespace(
                    id=block, is_updated_shading=True, is_updated_geometry=False, is_updated_transform=False
                )
            )
    return listed


def muted_links_of(lamp: Any) -> tuple[bool, ...]:
    """Which links between the nodes of a lamp are muted; empty without nodes. ``lamp``: the data of its object."""
    return () if lamp.node_tree is None else tuple(link.is_muted for link in lamp.node_tree.links)
