# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a sweep, applied to the scene or keyframed as a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
from bpy.types import Scene

from spectral_core.errors import InvalidInputError
from spectral_core.explore.sweep.ledger import Row

from ... import compat
from ..board.paths import Number
from .settings import follow_palette, swept_setting


def set_point(scene: Scene, values: Mapping[str, Any]) -> list[str]:
    """Set the swept settings of the file to a point's values; returns a text for each that takes another value."""
    swept = {entry.label: entry for entry in scene.spectral.sweep.parameters}
    missing = [name for name in values if name not in swept]
    if missing:
        raise InvalidInputError(f"the scene does not sweep {missing[0]!r} any more; add it again to apply this point")
    settings = [(swept_setting(swept[name]), value) for name, value in values.items()]
    for setting, value in settings:
        setting.checked(value)
    for setting, value in settings:
        setting.write(value)
    layer = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    with bpy.context.temp_override(scene=scene, view_layer=layer):
        follow_palette(setting.path for setting, _ in settings)
    layer.update()
    refused = []
    for setting, value in settings:
        try:
            setting.require_taken(layer.depsgraph, value)
        except InvalidInputError as error:
            refused.append(str(error))
        else:
            if _has_keyframes(setting.place):
                refused.append(f"{setting.path} has keyframes, which replace {value!r} at the next frame; remove them")
    return refused


def _has_keyframes(place: Number) -> bool:
    """True if the action of a property's data-block has a curve for it."""
    block, owner = place.owner.id_data, place.owner
    animation = getattr(block, "animation_data", None)
    if animation is None or animation.action is None:
        return False
    name = f'["{bpy.utils.escape_identifier(place.name)}"]' if place.is_custom else place.name
    path = name if owner == block else f"{owner.path_from_id()}{'' if place.is_custom else '.'}{name}"
    index = 0 if place.index is None else place.index
    return any(curves.find(path, index=index) is not None for curves in compat.curves_of(animation))


def keyframe_path(scene: Scene, chosen: list[Row], step: int) -> int:
    """Keyframe the settings through rows, ``step`` frames apart from the present frame; returns the last frame.

    Raises InvalidInputError, before any keyframe is inserted, if one of the settings cannot be animated.
    """
    frame = scene.frame_current
    settings = {entry.label: swept_setting(entry) for entry in scene.spectral.sweep.parameters}
    missing = [name for row in chosen for name in row.parameters if name not in settings]
    if missing:
        raise InvalidInputError(f"the scene does not sweep {missing[0]!r} any more; add it again to keyframe it")
    for name in chosen[0].parameters:
        settings[name].require_animatable()
    for place, row in reversed(list(enumerate(chosen))):  # so that the scene is left at its present frame
        for name, value in row.parameters.items():
            settings[name].write(value)
            settings[name].keyframe(frame + place * step)
    return frame + (len(chosen) - 1) * step
