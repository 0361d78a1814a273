# SPDX-License-Identifier: GPL-3.0-or-later
"""A palette from the lights and materials of the scene."""

from collections.abc import Iterable
from typing import Any

import bpy
from bpy.types import Context, PropertyGroup

from spectral_core.errors import InvalidInputError
from spectral_core.spectra.color import display_rgb_from_linear

from ..translate.palette import table
from ..translate.spectra.stored import carried_spectrum, store_spectrum
from .common import UNDOABLE, palette_in
from .palette_solve import Solving

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
        lights = _unique(each.data for each in objects if each.type == "LIGHT")
        materials = _unique(slot.material for each in objects for slot in each.material_slots)
        if not lights or not materials:
            raise InvalidInputError(
                f"this scene has {len(lights)} lights and {len(materials)} materials; a palette needs one of each"
            )
        palette = palette_in(context)
        table.clear(palette)
        with table.paused():
            for lamp in lights[:MOST]:
                _add_light(palette, lamp)
            for material in materials[:MOST]:
                _add_material(palette, material)
        left = max(len(lights) - MOST, 0) + max(len(materials) - MOST, 0)
        if left:
            self.report({"WARNING"}, f"{left} lights or materials are omitted; the table holds {MOST} of each")


def _unique(found: Iterable[Any]) -> list[Any]:
    return list(dict.fromkeys(each for each in found if each is not None))


def _add_light(palette: PropertyGroup, lamp: PropertyGroup) -> None:
    """Measured, with the spectrum of the light; daylight without one."""
    column = table.add_light(palette, lamp.name)
    column.light = lamp
    if lamp.spectral.source == "CATALOGUE":
        column.spectral.catalogue_name = lamp.spectral.catalogue_name
    elif lamp.spectral.source != "NONE":
        store_spectrum(column.spectral, carried_spectrum(lamp))


def _add_material(palette: PropertyGroup, material: PropertyGroup) -> None:
    """Measured if the material has a measured spectrum, else designed."""
    row = table.add_material(palette, material.name)
    row.material = material
    if material.spectral.source in ("CATALOGUE", "FILE"):
        row.design = "MEASURED"
        store_spectrum(row.spectral, carried_spectrum(material))
        return
    row.cells[0].mode = "FIXED"
    row.cells[0].target = display_rgb_from_linear(main_color(material))


def main_color(material: PropertyGroup) -> tuple[float, float, float]:
    """Linear RGB of the first color socket of a material's surface; of its viewport color without one."""
    tree = material.node_tree
    for node in tree.nodes if tree is not None else ():
        for name in ("Base Color", "Color"):
            socket = node.inputs.get(name)
            if node.type.startswith("BSDF") and socket is not None and socket.type == "RGBA":
                return tuple(socket.default_value[:3])
    return tuple(material.diffuse_color[:3])


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_OT_palette_from_scene,))
