# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial's settings for the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bpy.types import PropertyGroup

from spectral_core.errors import counted

from ..properties.dial import STORAGE

if TYPE_CHECKING:
    from spectral_core.render.relight.storage import Storage


def storage_of(dial: PropertyGroup) -> Storage:
    """The Storage of ``dial``: its identifiers are the core's names in capitals."""
    from spectral_core.render.relight.storages import storage_named

    name: str = dial.storage
    return storage_named(name.lower())


def storage_name(storage: Storage) -> str:
    """Display name of a storage; of one that the panel does not offer, its type and the number of its channels."""
    from spectral_core.render.relight.storages import storage_named

    for identifier, name, *_ in STORAGE:
        if storage_named(identifier.lower()).channel_names() == storage.channel_names():
            return str(name)
    return f"{storage.kind}, {counted(storage.channel_count, 'channel')}"
