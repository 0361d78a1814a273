# SPDX-License-Identifier: GPL-3.0-or-later
"""The data-blocks of bindings: their new names, and objects and lights that only bindings still use."""

from __future__ import annotations

import contextlib

import bpy
from bpy.types import ID, PropertyGroup

from spectral_core.errors import InvalidInputError

from ...properties import hooks
from ...properties.hooks import Topic
from .paths import block_at, renamed

GONE_WITH_OBJECTS = (bpy.types.Object, bpy.types.Light, bpy.types.Camera, bpy.types.Mesh, bpy.types.Volume)
"""Data that a deletion in the 3D view leaves in the file as long as a binding refers to them."""


def is_unused(block: ID | None) -> bool:
    """True for an object, and for its data, that only bindings use: it was deleted."""
    if not isinstance(block, GONE_WITH_OBJECTS):
        return False
    own = sum(entry.block == block for scene in bpy.data.scenes for entry in scene.spectral.board.bindings)
    return bool(block.users - bool(block.use_fake_user) <= own)


def follow_names(settings: PropertyGroup) -> bool:
    """Update bindings and orders when their data-blocks are renamed; True if any was.

    A reference keeps a data-block in the file, so that bindings of deleted objects have none.
    """
    changed = False
    for entry in settings.bindings:
        if entry.block is None:
            with contextlib.suppress(InvalidInputError):  # deleted: the row of the binding reports it
                found = block_at(entry.name)[0]
                entry.block = None if is_unused(found) else found
            continue
        if is_unused(entry.block):
            entry.block = None
            continue
        before, now = entry.name, renamed(entry.name, entry.block)
        if now == before:
            continue
        changed, entry.name = True, now
        with hooks.silenced(Topic.BOARD):
            for order in settings.orders:
                order.lower = now if order.lower == before else order.lower
                order.upper = now if order.upper == before else order.upper
    return changed


@bpy.app.handlers.persistent
def _before_save(*_: object) -> None:
    """The file gets the present names, and no deleted object."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            follow_names(scene.spectral.board)


def register() -> None:
    """Start listening to saves."""
    bpy.app.handlers.save_pre.append(_before_save)


def unregister() -> None:
    """Stop listening."""
    bpy.app.handlers.save_pre.remove(_before_save)
