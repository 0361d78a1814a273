# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a sweep, applied to the scene or keyframed as a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bpy.types import Scene

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.ledger import Row

from .sweep_settings import setting_at


def set_point(scene: Scene, values: Mapping[str, Any]) -> None:
    """Set the swept settings of the file to a point's values."""
    by_label = {entry.label: entry.name for entry in scene.spectral.sweep.parameters}
    missing = [name for name in values if name not in by_label]
    if missing:
        raise InvalidInputError(f"the scene does not sweep {missing[0]!r} any more; add it again to apply this point")
    settings = [(setting_at(by_label[name]), value) for name, value in values.items()]
    for setting, value in settings:
        setting.checked(value)
    for setting, value in settings:
        setting.write(value)


def keyframe_path(scene: Scene, chosen: list[Row], step: int) -> int:
    """Keyframe the settings through rows, ``step`` frames apart from the present frame; returns the last frame."""
    frame = scene.frame_current
    settings = {entry.label: setting_at(entry.name) for entry in scene.spectral.sweep.parameters}
    missing = [name for row in chosen for name in row.parameters if name not in settings]
    if missing:
        raise InvalidInputError(f"the scene does not sweep {missing[0]!r} any more; add it again to keyframe it")
    for place, row in enumerate(chosen):
        for name, value in row.parameters.items():
            settings[name].write(value)
            settings[name].keyframe(frame + place * step)
    return frame + (len(chosen) - 1) * step
