# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Recipe" in the sidebar of the 3D view."""

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from .parts import share_of, wrapped

MOST_SHARE = 0.55
"""Largest share of the width that the switches may have beside their numbers; else the numbers are below."""


QUALITIES = (("use_cri", ("cri",)), ("use_fidelity", ("fidelity",)), ("use_gamut", ("gamut_low", "gamut_high")))
"""Switches of requirements of a lamp, and their numbers."""


class SPECTRAL_PT_recipe(bpy.types.Panel):
    """A recipe for a spectrum that can be made: LEDs, paints, inks or filters"""

    bl_label = "Recipe"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Spectral"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        recipe, layout = context.scene.spectral.recipe, self.layout
        layout.prop(recipe, "kind", text="")
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        if recipe.kind in ("LAMP", "PAINTS"):
            column.row().prop(recipe, "library", expand=True)
        if recipe.reads_file:
            column.prop(recipe, "filepath")
        column.prop(recipe, "most", text="Most Channels" if recipe.kind == "LAMP" else "Most Parts")
        if recipe.kind == "LAMP":
            _draw_lamp(column, layout, context, recipe)
        else:
            _draw_material(column, context, recipe)
        row = layout.row()
        row.scale_y = 1.3
        row.operator("spectral.recipe_find", icon="PLAY")
        _draw_outcome(layout, context, recipe)


def _draw_lamp(column: UILayout, layout: UILayout, context: Context, recipe: PropertyGroup) -> None:
    column.prop(recipe, "cct", text="CCT (K)")  # a longer label is cut off
    column.prop(recipe, "duv")
    share = share_of(context, [recipe.bl_rna.properties[switch].name for switch, _ in QUALITIES])
    for switch, values in QUALITIES:
        is_beside = share <= MOST_SHARE
        row = layout.split(factor=max(share, 0.42), align=True) if is_beside else layout.column(align=True)
        row.prop(recipe, switch)
        numbers = row.row(align=True)
        numbers.enabled = getattr(recipe, switch)
        for value in values:
            numbers.prop(recipe, value)


def _draw_material(column: UILayout, context: Context, recipe: PropertyGroup) -> None:
    column.prop(recipe, "wanted")
    if recipe.wanted == "NAMED":
        column.prop(recipe, "surface")
    else:
        palette = context.scene.spectral.palette
        row = column.row()
        row.active = False
        known = palette.active_row < len(palette.materials)
        name = palette.materials[palette.active_row].name if known else "The palette is empty"
        row.label(text=name, icon="MATERIAL", translate=False)
    if recipe.kind == "PAINTS":
        column.prop(recipe, "grams")
    if recipe.kind == "INKS":
        column.prop(recipe, "dot_gain")


def _draw_outcome(layout: UILayout, context: Context, recipe: PropertyGroup) -> None:
    if not recipe.text or recipe.found_kind != recipe.kind:
        return
    box = layout.box()
    if not recipe.met:
        wrapped(
            box, context, "Not all requirements can be reached; this is the nearest recipe.", icon="ERROR", indent=60.0
        )
    for line in recipe.text.splitlines():
        name, _, amount = line.partition("  ")
        if amount.strip():
            row = box.row()
            row.scale_y = 0.8
            row.label(text=name.strip(), translate=False)
            number = row.row()
            number.alignment = "RIGHT"
            number.label(text=amount.strip())
        else:
            wrapped(box, context, line, indent=60.0)
    row = layout.row(align=True)
    row.operator("spectral.recipe_copy", icon="COPYDOWN")
    row.operator("spectral.recipe_give", icon="CHECKMARK")


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_PT_recipe,))
