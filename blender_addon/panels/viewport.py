# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of the look, and the header of a 3D view in Rendered mode."""

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from .. import jobs
from ..properties.render import ENGINE
from .parts import BUTTON_PIXELS, PANEL_PIXELS, names_in, width_of, wrapped

ONE_LIGHT = ("COLUMN", "LAMP")
"""Looks with one light, to which an observer can be adapted."""
HIDDEN = "Rendered mode shows the light: press the right ball at the top."


class SPECTRAL_PT_look(bpy.types.Panel):
    """Look at the scene under one light or two, in Rendered viewports and in renders"""

    bl_label = "Look Under"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Spectral"

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Only for this engine."""
        return context.engine == ENGINE

    def draw(self, context: Context) -> None:
        """Draw one look, or two for a split view."""
        settings, layout = context.scene.spectral.viewport, self.layout
        layout.operator("spectral.look_split", icon="MOD_MIRROR", depress=settings.is_split)
        if settings.is_split:
            layout.label(text="Left")
        draw_look(layout, context, settings.look, "look")
        if settings.is_split:
            layout.label(text="Right")
            draw_look(layout, context, settings.other, "other")
            layout.prop(settings, "divider", slider=True)
        if _is_hidden(context, settings):
            hint = layout.column()
            hint.active = False
            wrapped(hint, context, HIDDEN, icon="INFO")
        layout.separator()
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(settings, "samples", text="Samples")
        column.prop(settings, "denoise")
        if settings.denoise and (missing := jobs.missing_denoiser()):
            wrapped(column, context, missing)
        column.prop(settings, "preview_lamp")
        if settings.preview_message:
            told = column.column()
            told.alert = True
            wrapped(told, context, settings.preview_message, icon="ERROR")


def _is_hidden(context: Context, settings: PropertyGroup) -> bool:
    """True if a light was chosen, and the mode of this 3D view does not show it."""
    is_chosen = settings.is_split or settings.look.kind != "SCENE"
    return is_chosen and context.space_data.type == "VIEW_3D" and context.space_data.shading.type != "RENDERED"


def draw_look(layout: UILayout, context: Context, look: PropertyGroup, side: str) -> None:
    """Draw a look: one button for the scene's own light and for each light of the palette, and further options."""
    column = layout.column(align=True)
    grid = column.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    plain = grid.operator("spectral.look_under", text="As It Is", depress=look.kind == "SCENE")
    plain.kind, plain.side = "SCENE", side
    lights = context.scene.spectral.palette.lights.keys()
    room = (width_of(context) - PANEL_PIXELS) / 2 - BUTTON_PIXELS
    for light, name in zip(lights, names_in(lights, room, context), strict=True):
        is_on = look.kind == "COLUMN" and look.column == light
        button = grid.operator("spectral.look_under", text=name, depress=is_on, translate=False)
        button.kind, button.name, button.side = "COLUMN", light, side
    column.prop(look, "kind", text="")
    if look.kind == "LAMP":
        column.prop(look, "lamp", text="")
    elif look.kind == "GROUP":
        column.prop_search(look, "group", context.view_layer, "lightgroups", text="")
    elif look.kind == "COLUMN":
        column.prop_search(look, "column", context.scene.spectral.palette, "lights", text="")
    row = column.row(align=True)
    row.prop(look, "exposure")
    adapts = row.row(align=True)
    adapts.enabled = look.kind in ONE_LIGHT  # it would do nothing, and the artist would not know why
    adapts.prop(look, "adapts", text="", icon="HIDE_OFF")


def draw_header(header: bpy.types.Header, context: Context) -> None:
    """Draw Pause, if this engine renders the view."""
    if context.engine != ENGINE or context.space_data.shading.type != "RENDERED":
        return
    settings = context.scene.spectral.viewport
    header.layout.prop(settings, "is_paused", text="", icon="PLAY" if settings.is_paused else "PAUSE")


def register() -> None:
    """Add the panel, and the button in the header of 3D views."""
    bpy.utils.register_class(SPECTRAL_PT_look)
    bpy.types.VIEW3D_HT_header.append(draw_header)


def unregister() -> None:
    """Remove them."""
    bpy.types.VIEW3D_HT_header.remove(draw_header)
    bpy.utils.unregister_class(SPECTRAL_PT_look)
