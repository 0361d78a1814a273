# SPDX-License-Identifier: GPL-3.0-or-later
"""The palette, in the sidebar of the 3D view and in the scene properties: the same panels in both."""

from collections.abc import Callable

import bpy
from bpy.types import Context, Panel, PropertyGroup, UILayout

from ...editing.palette.bindings import faults
from ...editing.palette.picture import RELIT
from ...editing.palette.solve import NEEDS_BUTTON
from ...properties.palette.cell import LEAST_DELTA_E
from ...properties.render import ENGINE
from ..parts import wrapped
from .details import CONFLICTS_SHOWN, draw_cell, draw_conflict, draw_light, draw_material
from .more import draw_alternatives, draw_paint
from .table import draw_table

STATUS = {
    "solved": ("CHECKMARK", "All targets met"),
    "compromise": ("ERROR", "A compromise"),
    "still_improving": ("TIME", "Can still improve: press Solve"),
    "exact_conflict": ("ERROR", "Exact cells conflict"),
    "invisible": ("ERROR", "A light or material shows nothing"),
    "inaccurate": ("CANCEL", "Not reliable"),
}

FAULT_ICON = {"deleted": "UNLINKED", "renamed": "SORTALPHA", "linked": "LINKED", "unused": "ORPHAN_DATA"}
FAULTS_SHOWN = 3


def draw_palette(layout: UILayout, context: Context) -> None:
    """Draw start, table, status, and actions."""
    palette = context.scene.spectral.palette
    if not len(palette.lights) and not len(palette.materials):
        _draw_welcome(layout, context)
        return
    row = layout.row(align=True)
    row.scale_y = 1.3
    row.operator("spectral.palette_solve", icon="PLAY")
    row.prop(palette, "live", text="", icon="FILE_REFRESH")
    row.prop(palette, "in_viewport", text="", icon="SHADING_RENDERED")
    row.prop(palette, "show_curves", text="", icon="GRAPH")
    row.operator_menu_enum("spectral.palette_preset", "preset", text="", icon="PRESET")
    _draw_status(layout, context, palette)
    draw_table(layout, context, palette)
    _draw_help(layout, context, palette)
    row = layout.row(align=True)
    row.operator("spectral.palette_add", text="Light", icon="ADD").side = "LIGHT"
    row.operator("spectral.palette_add", text="Material", icon="ADD").side = "MATERIAL"
    row = layout.row(align=True)
    row.scale_y = 1.3
    row.enabled = bool(palette.status) and not palette.is_stale
    row.operator("spectral.palette_apply", icon="BRUSH_DATA").create = False  # not that of the last call
    row.prop(palette, "apply_colors", text="", icon="SHADING_SOLID")
    if any(each.material is None for each in palette.materials):
        row = layout.row()
        row.enabled = bool(palette.status) and not palette.is_stale
        row.operator("spectral.palette_apply", text="Apply and Make Materials", icon="MATERIAL").create = True
    if palette.picture:
        told = layout.column()
        told.active = False
        wrapped(told, context, f"Not applied yet. {picture_words(context, palette)}", icon="INFO")
    _draw_faults(layout, context, palette)


def picture_words(context: Context, palette: PropertyGroup) -> str:
    """How views show a solution that is not applied."""
    if palette.picture == RELIT:
        return f"The picture of the light dial shows it. {RELIT}."
    if context.engine != ENGINE:
        return "Rendered views show it with the render engine Spectral."
    return f"Rendered views show it. {palette.picture}."


def _draw_faults(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """Draw rows and columns whose material or light was deleted, renamed or is linked, with a button to mend them."""
    found = faults(palette)
    if not found:
        return
    box = layout.box()
    for fault in found[:FAULTS_SHOWN]:
        wrapped(box, context, fault.text, icon=FAULT_ICON[fault.kind], indent=60.0)
    if len(found) > FAULTS_SHOWN:
        box.label(text=f"and {len(found) - FAULTS_SHOWN} more", icon="BLANK1")
    box.operator("spectral.palette_mend", icon="TOOL_SETTINGS")


def _draw_welcome(layout: UILayout, context: Context) -> None:
    wrapped(
        layout,
        context,
        "State the color that each material should show under each light. The palette finds the spectra.",
    )
    layout.separator()
    layout.label(text="Start from an idea:")
    column = layout.column(align=True)
    column.scale_y = 1.2
    column.operator_enum("spectral.palette_preset", "preset")
    layout.label(text="Or from existing data:")
    layout.operator("spectral.palette_from_scene", icon="SCENE_DATA")
    layout.operator("spectral.palette_import", text="From a File", icon="IMPORT")
    layout.label(text="Or from nothing:")
    row = layout.row(align=True)
    row.operator("spectral.palette_add", text="Light", icon="ADD").side = "LIGHT"
    row.operator("spectral.palette_add", text="Material", icon="ADD").side = "MATERIAL"


def _draw_status(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """Draw the status of the last solve, in as many lines while the next one runs: the table stays where it is."""
    if palette.message:
        column = layout.column()
        column.alert = palette.message != NEEDS_BUTTON
        text = f"{palette.message[:1].upper()}{palette.message[1:]}"
        wrapped(column, context, text, icon="ERROR" if column.alert else "INFO")
        return
    if not palette.status:
        layout.label(text=_next_step(palette), icon="INFO")
        return
    icon, words = STATUS[palette.status]
    if palette.is_stale:
        icon, words = "FILE_REFRESH", "Solving …" if palette.live else "Changed: press Solve"
    told = layout.column(align=True)
    row = told.row()
    is_missed = any(cell.is_missed for material in palette.materials for cell in material.cells)
    row.alert = not palette.is_stale and (palette.status not in ("solved", "still_improving") or is_missed)
    row.label(text=words, icon=icon)
    facts = told.row()  # below: beside them, a narrow sidebar truncates the text
    facts.active = False
    worst = "ΔE < 0.01" if palette.worst_delta_e < LEAST_DELTA_E else f"ΔE ≤ {palette.worst_delta_e:.2f}"
    took = f" · {_duration(palette.milliseconds)}" if palette.milliseconds > 0 else ""
    facts.label(text=f"{worst}{took}", icon="BLANK1")


def _next_step(palette: PropertyGroup) -> str:
    """Tell what an unsolved table needs."""
    if not len(palette.materials):
        return "Select an object and press + Material"
    return "Not solved yet: press Solve" if len(palette.lights) else "Select a lamp and press + Light"


def _draw_help(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """Draw the remedy, below the table, so that the table does not move while colors are dragged.

    While a live table is solved, that of the last solution stays, and its buttons wait: what is below would jump at
    each step of a drag.
    """
    if palette.message or not palette.remedy or (palette.is_stale and not palette.live):
        return
    column = layout.column()
    column.enabled = not palette.is_stale
    for conflict in palette.conflicts[:CONFLICTS_SHOWN]:
        draw_conflict(column.box(), context, palette, conflict)
    if len(palette.conflicts) > CONFLICTS_SHOWN:
        column.label(text=f"and {len(palette.conflicts) - CONFLICTS_SHOWN} more", icon="BLANK1")
    if not len(palette.conflicts):
        hint = column.column()
        hint.active = False
        wrapped(hint, context, palette.remedy)


def _duration(milliseconds: float) -> str:
    return f"{milliseconds:.1f} ms" if milliseconds < 100 else f"{milliseconds / 1000:.1f} s"


def draw_weights(layout: UILayout, context: Context) -> None:
    """Draw weights, and bounds of spectra."""
    palette = context.scene.spectral.palette
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    column.prop(palette, "smoothness")
    column.prop(palette, "brightness")
    column.prop(palette, "level_to")
    column.prop(palette, "scale_lights")
    if palette.light_scale != 1.0:
        wrapped(column, context, f"All lights were brightened {palette.light_scale:.2f} times.", icon="INFO")
    column.prop(palette, "match")
    column.prop(palette, "rounds")
    column = layout.column(align=True)
    column.prop(palette, "grid_start")
    column.prop(palette, "grid_stop")
    column.prop(palette, "grid_samples")
    column = layout.column()
    column.prop(palette, "operator", text="Roughness")
    column.prop(palette, "allow_negative")
    for note in palette.notes.splitlines():
        wrapped(layout, context, note, icon="INFO")


def draw_robustness(layout: UILayout, context: Context) -> None:
    """Draw other observers and other lamps."""
    palette = context.scene.spectral.palette
    hint = layout.column()
    hint.active = False
    wrapped(hint, context, "Matching cells hold for these observers, and under the variants of each lamp.")
    layout.column(align=True).prop(palette, "observers")
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(palette, "robustness", text="Match")
    layout.prop(palette, "robust_weight")


def draw_files(layout: UILayout, _context: Context) -> None:
    """Draw the import and export of palettes, spectra and swatches."""
    row = layout.row(align=True)
    row.label(text="Palette")
    row.operator("spectral.palette_import", text="Import", icon="IMPORT")
    row.operator("spectral.palette_export", text="Export", icon="EXPORT")
    row = layout.row(align=True)
    row.label(text="Spectra")
    row.operator("spectral.spectra_export", text="Export", icon="EXPORT")
    row = layout.row(align=True)
    row.label(text="Swatches")
    row.operator("spectral.swatches_export", text="Export", icon="EXPORT")
    layout.operator("spectral.palette_clear", icon="TRASH")


def _needs_table(context: Context) -> bool:
    palette = context.scene.spectral.palette
    return bool(len(palette.lights) or len(palette.materials))


PARTS = [
    ("cell", "Selected Cell", lambda layout, context: draw_cell(layout, context, context.scene.spectral.palette)),
    ("light", "Selected Light", lambda layout, context: draw_light(layout, context, context.scene.spectral.palette)),
    (
        "material",
        "Selected Material",
        lambda layout, context: draw_material(layout, context, context.scene.spectral.palette),
    ),
    ("weights", "Design", draw_weights),
    ("alternatives", "Alternatives", draw_alternatives),
    ("paint", "Paint and Fluorescence", draw_paint),
    ("robustness", "Other Observers and Lamps", draw_robustness),
    ("files", "Files", draw_files),
]
"""Sub-panels: name, label, draw function. All but the first are closed initially."""


def _drawing(drawn: Callable[[UILayout, Context], None]) -> Callable[[Panel, Context], None]:
    """A panel's draw function; Blender requires exactly two arguments."""

    def draw(self: Panel, context: Context) -> None:
        drawn(self.layout, context)

    return draw


def _panels(place: str, **where: str) -> list[type]:
    """The palette's panel and its sub-panels for one editor of Blender."""
    parent_id = f"SPECTRAL_PT_palette_{place}"

    body = {"bl_label": "Palette", "bl_idname": parent_id, "draw": _drawing(draw_palette), **where}
    parent = type(parent_id, (bpy.types.Panel,), body)
    children = []
    for name, label, drawn in PARTS:
        identifier = f"SPECTRAL_PT_palette_{name}_{place}"

        options = set() if name == "cell" else {"DEFAULT_CLOSED"}
        body = {
            "bl_label": label, "bl_idname": identifier, "bl_parent_id": parent_id, "bl_options": options,
            "draw": _drawing(drawn), "poll": classmethod(lambda cls, context: _needs_table(context)), **where,
        }  # fmt: skip
        children.append(type(identifier, (bpy.types.Panel,), body))
    return [parent, *children]


PANELS = [
    *_panels("view", bl_space_type="VIEW_3D", bl_region_type="UI", bl_category="Spectral"),
    *_panels("scene", bl_space_type="PROPERTIES", bl_region_type="WINDOW", bl_context="scene"),
]

register, unregister = bpy.utils.register_classes_factory(PANELS)
