# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling and lighting of a Volume, by the declaration ``VOLUME_FIELDS``, for the core."""

from typing import Any

import bpy

from ...properties.volume import VOLUME_FIELDS
from ..context import finite


def look_of(settings: bpy.types.PropertyGroup) -> dict[str, Any]:
    """Arguments of VolumeObject other than the data and their transfer function. Raises InvalidInputError for NaN."""
    finite(settings, "quality_db", f"of volume {settings.id_data.name!r}")
    return {core: getattr(settings, field.name) for field in VOLUME_FIELDS.values() for core in field.core}
