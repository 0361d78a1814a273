# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of the palette: lights as columns, materials as rows, in each cell the wanted and the actual color."""

from bpy.types import Context, PropertyGroup, UILayout

from ...drawing.icons import curve_icon
from ...drawing.text import text_width
from ...properties.palette.cell import MODES
from ...translate.palette.table import palette_of
from ..parts import BUTTON_PIXELS, ICON_PIXELS, column_room, names_in, width_of

MODE_ICON = {identifier: "NONE" if icon == "COLOR" else icon for identifier, _, _, icon, _ in MODES}
LEAST_CELL = 46.0
"""Unscaled pixels below which two colors and a number cannot be distinguished."""


def draw_table(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """Draw the table; a click below a cell's colors selects it for the panels below.

    If the panel is too narrow for all lights, it shows those around the selected light.
    """
    width = width_of(context) - 30.0
    shown = page_of(palette.active_column, len(palette.lights), int(width / LEAST_CELL) - 1)
    if len(shown) < len(palette.lights):
        _draw_pages(layout, shown, len(palette.lights))
    columns = len(shown) + 1
    flow = layout.grid_flow(row_major=True, columns=columns, even_columns=True, even_rows=False, align=False)
    room, of_names = width / columns, column_room(context, columns)
    flow.column().label(text="")
    lights = names_in([light.name for light in palette.lights], of_names, context)
    materials = names_in([material.name for material in palette.materials], of_names, context)
    for column in shown:
        _draw_head(flow, palette.lights[column], lights[column], {"column": column}, room)
    for row, material in enumerate(palette.materials):
        _draw_head(flow, material, materials[row], {"row": row}, room)
        for column in shown:
            selected = (row, column) == (palette.active_row, palette.active_column)
            _draw_cell(flow, context, material.cells[column], (row, column), selected, room)


def page_of(active: int, count: int, fitting: int) -> range:
    """Columns of the page with the selected column, at least one; the last page is as full as the others."""
    fitting = max(fitting, 1)
    first = min(active // fitting * fitting, max(count - fitting, 0))
    return range(first, min(first + fitting, count))


def _draw_pages(layout: UILayout, shown: range, count: int) -> None:
    """Draw the range of shown lights, and buttons for those before and after."""
    row = layout.row(align=True)
    before = row.row(align=True)
    before.enabled = shown.start > 0
    before.operator("spectral.palette_select", text="", icon="TRIA_LEFT").column = max(shown.start - 1, 0)
    title = row.row()
    title.alignment = "CENTER"
    title.label(text=f"Lights {shown.start + 1}–{shown.stop} of {count}")
    after = row.row(align=True)
    after.enabled = shown.stop < count
    after.operator("spectral.palette_select", text="", icon="TRIA_RIGHT").column = min(shown.stop, count - 1)


def icon_scale(room: float) -> float:
    """Size of a curve in a column of ``room`` unscaled pixels, in units of Blender's buttons."""
    return min(3.4, max(1.9, room / 27))


def _draw_head(flow: UILayout, entry: PropertyGroup, name: str, place: dict[str, int], room: float) -> None:
    """Name and curve of a light or material."""
    palette = palette_of(entry)
    head = flow.column(align=True)
    icon = curve_icon(entry.result) or curve_icon(entry.spectral)
    head.template_icon(icon, scale=icon_scale(room))
    row = head.row(align=True)
    row.active = place in ({"row": palette.active_row}, {"column": palette.active_column})
    operator = row.operator("spectral.palette_select", text=name, emboss=False, translate=False)
    for side, index in place.items():
        setattr(operator, side, index)


def _draw_cell(
    flow: UILayout, context: Context, cell: PropertyGroup, place: tuple[int, int], selected: bool, room: float
) -> None:
    column = flow.column(align=True)
    colors = column.row(align=True)
    colors.scale_y = icon_scale(room)  # as high as the curve on its left
    if cell.mode == "FIXED":
        colors.prop(cell, "target", text="")
    elif cell.mode in ("SAME", "CONSTANT", "BLACK") and cell.has_result:
        colors.prop(cell, "wanted", text="")
    if cell.has_result:
        colors.prop(cell, "actual", text="")
    elif cell.mode != "FIXED":
        colors.label(text="")
    below = column.row(align=True)
    below.alert = cell.is_missed
    below.active = not palette_of(cell).is_stale  # the number is that of the last solution
    icon = "LOCKED" if cell.exact and cell.mode == "FIXED" else MODE_ICON[cell.mode]
    text, icon = fitting(cell.error_text, icon, context, room)
    operator = below.operator("spectral.palette_select", text=text, icon=icon, depress=selected)
    operator.row, operator.column = place


def fitting(text: str, icon: str, context: Context, room: float) -> tuple[str, str]:
    """Text and icon of a cell in a column of ``room`` unscaled pixels: without the unit, then without the icon, rather
    than with a number that Blender cuts off.
    """
    short = text.removeprefix("ΔE ")
    for shown, beside in ((text, icon), (short, icon)):
        needed = text_width(shown, context) + BUTTON_PIXELS + (0.0 if beside == "NONE" else ICON_PIXELS)
        if needed <= room:
            return shown, beside
    return short, "NONE"
