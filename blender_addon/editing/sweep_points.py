# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a sweep, applied to the scene or keyframed as a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bpy.types import Scene

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.ledger import Row

from .board.paths import number_at


def set_point(scene: Scene, values: Mapping[str, Any]) -> None:
    """Set the swept numbers of the file to a point's values."""
    by_label = {entry.label: entry.name for entry in scene.spectral.sweep.parameters}
    missing = [name for name in values if name not in by_label]
    if missing:
        raise InvalidInputError(f"the scene does not sweep {missing[0]!r} any more; add it again to apply this point")
    numbers = [(number_at(by_label[name]), value) for name, value in values.items()]
    for number, value in numbers:
        number.write(float(value))


def keyframe_path(scene: Scene, chosen: list[Row], step: int) -> int:
    """Keyframe the swept numbers through rows, ``step`` frames apart from the present frame; returns the last frame."""
    frame = scene.frame_current
    paths = {entry.label: number_at(entry.name) for entry in scene.spectral.sweep.parameters}
    for place, row in enumerate(chosen):
        for name, value in row.parameters.items():
            number = paths[name]
            number.write(float(value))
            path = f'["{number.name}"]' if number.is_custom else number.name
            number.owner.keyframe_insert(path, index=-1 if number.index is None else number.index,
                                         frame=frame + place * step)  # fmt: skip
    return frame + (len(chosen) - 1) * step
