# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial's settings for the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bpy.types import PropertyGroup

if TYPE_CHECKING:
    from spectral_core.render.relight.storage import Storage


def storage_of(dial: PropertyGroup) -> Storage:
    """The Storage of ``dial``: its identifiers are the core's names in capitals."""
    from spectral_core.render.relight.storages import storage_named

    name: str = dial.storage
    return storage_named(name.lower())
