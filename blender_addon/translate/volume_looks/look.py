# SPDX-License-Identifier: GPL-3.0-or-later
"""How a Volume is sampled and lit, by the one declaration ``VOLUME_FIELDS``, as the core states it."""

from typing import Any

import bpy

from ...properties.volume import VOLUME_FIELDS


def look_of(settings: bpy.types.PropertyGroup) -> dict[str, Any]:
    """Arguments of VolumeObject besides the data and their transfer function."""
    return {core: getattr(settings, field.name) for field in VOLUME_FIELDS.values() for core in field.core}
