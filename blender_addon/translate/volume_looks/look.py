# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling and lighting of a Volume, by the declaration ``VOLUME_FIELDS``, for the core."""

from typing import Any

import bpy

from ...properties.volume import VOLUME_FIELDS


def look_of(settings: bpy.types.PropertyGroup) -> dict[str, Any]:
    """Arguments of VolumeObject other than the data and their transfer function."""
    return {core: getattr(settings, field.name) for field in VOLUME_FIELDS.values() for core in field.core}
