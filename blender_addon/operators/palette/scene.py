# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette from the lights and materials of the scene."""

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.types import Context

from spectral_core.errors import InvalidInputError, counted

from ...translate.palette import from_scene, table
from ..common import UNDOABLE, palette_in
from .solve import Solving

MOST = 15
"""Most rows and columns to add; larger tables are hard to read."""


class SPECTRAL_OT_palette_from_scene(Solving, bpy.types.Operator):
    """Lights and materials of the scene as a table to begin with."""

    bl_idname = "spectral.palette_from_scene"
    bl_label = "From This Scene"
    bl_description = (
        "Begin with the lights and materials of this scene. Each material keeps its color under the first light; "
        "lights without a spectrum count as daylight"
    )
    bl_options = UNDOABLE

    def change(self, context: Context) -> None:
        objects = context.view_layer.objects
        lights: dict[bpy.types.Light, str] = {}
        for each in objects:
            if each.type == "LIGHT":
                lights.setdefault(each.data, each.name)
        materials = _unique(slot.material for each in objects for slot in each.material_slots)
        if not lights or not materials:
            raise InvalidInputError(
                f"this scene has {counted(len(lights), 'light')} and {counted(len(materials), 'material')}; a "
                "palette needs one of each"
            )
        for block in [*list(lights)[:MOST], *materials[:MOST]]:
            from_scene.begun_with(block)  # raises before anything is changed
        palette = palette_in(context)
        table.clear(palette)
        with table.paused():
            for lamp, name in list(lights.items())[:MOST]:
                from_scene.add_light(palette, lamp, name)
            for material in materials[:MOST]:
                from_scene.add_material(palette, material)
        left = max(len(lights) - MOST, 0) + max(len(materials) - MOST, 0)
        if left:
            self.report(
                {"WARNING"},
                f"{counted(left, 'light or material is', 'lights or materials are')} omitted; the table holds "
                f"{MOST} of each",
            )


def _unique(found: Iterable[Any]) -> list[Any]:
    return list(dict.fromkeys(each for each in found if each is not None))


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_palette_from_scene,))
