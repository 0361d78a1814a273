# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews and icons follow the lamp for previews: Blender renders only those of changed data again."""

from __future__ import annotations

from typing import Any

import bpy

from ...properties.hooks import Topic, ignore, listen


def renew(_properties: Any = None) -> None:
    """Have Blender render each preview of a material, light or world again when it next shows it."""
    for blocks in (bpy.data.materials, bpy.data.lights, bpy.data.worlds):
        for block in blocks:
            if block.preview is not None:
                block.update_tag()


def register() -> None:
    """Start listening to the lamp for previews."""
    listen(Topic.PREVIEW_LAMP, renew)


def unregister() -> None:
    """Stop listening."""
    ignore(Topic.PREVIEW_LAMP)
