# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of shader nodes of which Blender reports the nodes alone.

Blender reports an edited node of a material together with the material. It reports a link that a script mutes as an
edit of the node tree inside the material, and does not name the material. Blender 5.0 and earlier do not report such a
link of a lamp at all.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import Any, NamedTuple

import bpy


class Edit(NamedTuple):
    """One update of a depsgraph, read once: an edited material lists all of its objects and meshes.

    ``block``: evaluated data. ``kind``: Blender's name of its type. ``uid``: its session number.
    """

    block: Any
    kind: str
    uid: int
    is_geometry: bool
    is_transform: bool
    is_shading: bool

    @property
    def is_only_shading(self) -> bool:
        """True if neither the shape nor the place has changed."""
        return self.is_shading and not (self.is_geometry or self.is_transform)


def with_owners(updates: Iterable[Any]) -> list[Edit]:
    """The updates of a depsgraph, and one for each material, world or lamp of which only the nodes are reported."""
    edits = [_edit(update) for update in updates]
    trees = {edit.uid for edit in edits if edit.kind == "ShaderNodeTree" and edit.block.is_embedded_data}
    if not trees:
        return edits
    named = {edit.uid for edit in edits}
    for block in chain(bpy.data.materials, bpy.data.worlds, bpy.data.lights):
        tree = block.node_tree
        if tree is not None and tree.session_uid in trees and block.session_uid not in named:
            edits.append(Edit(block, block.bl_rna.identifier, block.session_uid, False, False, True))
    return edits


def _edit(update: Any) -> Edit:
    block = update.id
    return Edit(
        block, block.bl_rna.identifier, block.original.session_uid, update.is_updated_geometry,
        update.is_updated_transform, update.is_updated_shading,
    )  # fmt: skip


def muted_links_of(lamp: Any) -> tuple[bool, ...]:
    """Which links between the nodes of a lamp are muted; empty without nodes. ``lamp``: the data of its object."""
    return () if lamp.node_tree is None else tuple(link.is_muted for link in lamp.node_tree.links)
