# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent dyes of the selected material."""

import bpy
from bpy.props import IntProperty
from bpy.types import Context

from spectral_core.errors import InvalidInputError

from ...editing.palette import live
from ..common import UNDOABLE, palette_in, reporting


class SPECTRAL_OT_palette_dye(bpy.types.Operator):
    """Let the selected material hold a fluorescent dye, or take one away"""

    bl_idname = "spectral.palette_dye"
    bl_label = "Add Dye"
    bl_options = UNDOABLE
    index: IntProperty(name="Remove", default=-1, description="The dye to take away; -1 adds one")

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        if palette.active_row >= len(palette.materials):
            raise InvalidInputError("no material is selected; add one to the table first")
        material = palette.materials[palette.active_row]
        if material.design != "DESIGNED":
            raise InvalidInputError(
                f"{material.name!r} is measured, so no dye can be designed into it; set it to Designed"
            )
        if self.index < 0:
            material.dyes.add()
        elif self.index < len(material.dyes):
            material.dyes.remove(self.index)
        else:
            raise InvalidInputError(f"there is no dye {self.index}; there are {len(material.dyes)}, counted from 0")
        live.edited(palette)


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_palette_dye,))
