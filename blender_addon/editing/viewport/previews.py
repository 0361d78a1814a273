# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews and icons follow the lamp for previews: Blender renders only those of changed data again."""

from __future__ import annotations

from typing import Any

import bpy

from spectral_core.errors import SpectralError

from ...properties.hooks import Topic, ignore, listen
from ...translate.spectra import catalogue


def renew(settings: Any = None) -> None:
    """Have Blender render each preview of a material, light or world again when it next shows it.

    ``settings``: those with a newly chosen lamp, which get a message if no lamp has that name.
    """
    if settings is not None:
        settings.preview_message = _error_of(settings.preview_lamp)
    for blocks in (bpy.data.materials, bpy.data.lights, bpy.data.worlds):
        for block in blocks:
            if block.preview is not None:
                block.update_tag()


def _error_of(lamp: str) -> str:
    """What is wrong with the name of a lamp for previews; empty if nothing is."""
    try:
        if lamp.strip():
            catalogue.named("illuminant", lamp)
    except SpectralError as error:
        text = str(error)
        return f"{text[:1].upper()}{text[1:]}"
    return ""


def register() -> None:
    """Start listening to the lamp for previews."""
    listen(Topic.PREVIEW_LAMP, renew)


def unregister() -> None:
    """Stop listening."""
    ignore(Topic.PREVIEW_LAMP)
