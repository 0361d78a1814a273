# SPDX-License-Identifier: GPL-3.0-or-later
"""A Spectral Texture node follows its file: Blender's own views show its picture under D65."""

from __future__ import annotations

from typing import Any

import bpy

from spectral_core.errors import SpectralError

from ..properties import hooks
from ..properties.hooks import Topic
from ..translate.shading.texture import preview_pixels, texture_of


def refresh(node: Any) -> None:
    """Read the node's file and show its picture; on failure ``message`` gives the reason and the picture is removed."""
    shown = next((inner for inner in node.node_tree.nodes if inner.bl_idname == "ShaderNodeTexImage"), None)
    try:
        pixels = preview_pixels(texture_of(node))
    except SpectralError as error:
        node.message = str(error)
        if shown is not None:
            shown.image = None
        return
    node.message = ""
    if shown is None:
        return
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(f"{node.name} under D65", width, height)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    shown.image, shown.interpolation, shown.extension = image, node.interpolation, node.extension


def register() -> None:
    """Start listening to the node."""
    hooks.listen(Topic.SPECTRAL_TEXTURE, refresh)


def unregister() -> None:
    """Stop listening."""
    hooks.ignore(Topic.SPECTRAL_TEXTURE)
