# SPDX-License-Identifier: GPL-3.0-or-later
"""Fluorescent dyes of the selected material of the palette, and of the active material of the scene."""

import bpy
from bpy.props import IntProperty
from bpy.types import Context

from spectral_core.errors import InvalidInputError

from ...editing.palette import live
from ...properties.spectrum import tag
from ...translate.spectra.stored import require_editable
from ..common import UNDOABLE, add_or_remove, palette_in, reporting
from ..spectrum import carrier


class SPECTRAL_OT_palette_dye(bpy.types.Operator):
    """Add a fluorescent dye to the selected material, or remove one"""

    bl_idname = "spectral.palette_dye"
    bl_label = "Add Dye"
    bl_options = UNDOABLE
    index: IntProperty(name="Remove", default=-1, description="The dye to remove; -1 adds one")

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        if palette.active_row >= len(palette.materials):
            raise InvalidInputError("no material is selected; add one to the table first")
        material = palette.materials[palette.active_row]
        if material.design != "DESIGNED" and self.index < 0:
            raise InvalidInputError(
                f"{material.name!r} is measured, so no dye can be designed into it; set it to Designed"
            )
        add_or_remove(material.dyes, self.index, "dye")
        live.edited(palette)


class SPECTRAL_OT_material_dye(bpy.types.Operator):
    """Add a fluorescent dye to the active material, or remove one"""

    bl_idname = "spectral.material_dye"
    bl_label = "Add Dye"
    bl_options = UNDOABLE
    index: IntProperty(name="Remove", default=-1, description="The dye to remove; -1 adds one")

    @reporting
    def execute(self, context: Context) -> None:
        material = carrier(context, "MATERIAL")
        if material is None:
            raise InvalidInputError("there is no active material to hold a dye; select an object with one")
        require_editable(material)
        add_or_remove(material.spectral.dyes, self.index, "dye")
        tag(material.spectral)


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_palette_dye, SPECTRAL_OT_material_dye))
