# SPDX-License-Identifier: GPL-3.0-or-later
"""Below the table: the selected cell, its light and its material."""

from bpy.types import Context, PropertyGroup, UILayout, bpy_prop_collection

from ...properties.palette.cell import BOXED, REFERRING
from ...translate.palette.table import active_cell, may_refer, references
from ..parts import BUTTON_PIXELS, PANEL_PIXELS, draw_curve, draw_source, names_in, width_of, wrapped
from .possible import draw_possible

CONFLICTS_SHOWN = 2
"""Number of conflicts below the table; the others are often resolved with them."""
HINTS = {
    "FIXED": "",
    "FREE": "The palette chooses the color.",
    "SAME": "Looks the same as the chosen cell, which may have any color.",
    "CONSTANT": "Keeps the color it has under the chosen lights.",
    "BLACK": "Shows nothing under this light.",
    "DISTINCT": "Differs from the chosen cells as much as possible. Takes seconds: press Solve.",
    "IGNORE": "Any color. Leaves the most freedom to the other cells.",
}

NAMES_SHARE = 0.36
"""Share of the width of the small table that the names of materials have."""
REFERENCE_TITLES = {"SAME": "Same as:", "CONSTANT": "Constant with:", "DISTINCT": "Distinct from:"}


def _split(layout: UILayout) -> UILayout:
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


def draw_cell(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """The target of the selected cell."""
    cell = active_cell(palette)
    if cell is None:
        layout.label(text="Add a light and a material first")
        return
    material, light = palette.materials[palette.active_row], palette.lights[palette.active_column]
    wrapped(layout, context, f"{material.name} under {light.name}", icon="RESTRICT_COLOR_ON")
    _draw_hidden_conflict(layout, context, palette, (material, light))
    column = _split(layout.column())
    column.prop(cell, "mode", text="Target")
    if HINTS[cell.mode]:
        hint = layout.column()
        hint.active = False
        wrapped(hint, context, HINTS[cell.mode])
    column = _split(layout.column())
    if cell.mode == "FIXED":
        column.prop(cell, "target", text="Wanted")
    if cell.has_result:
        column.prop(cell, "actual", text="Actual")
    if cell.mode in REFERRING:
        _draw_references(layout, context, palette, cell)
    if cell.mode in BOXED:
        column = _split(layout.column())
        column.prop(cell, "use_box")
        if cell.use_box:
            column.prop(cell, "box_low")
            column.prop(cell, "box_high")
    if cell.mode not in ("IGNORE", "FREE") or (cell.mode == "FREE" and cell.use_box):
        column = _split(layout.column())
        if cell.mode != "DISTINCT":
            column.prop(cell, "exact", text="Exact")
        weight = column.row()
        weight.enabled = not cell.exact or cell.mode == "DISTINCT"
        weight.prop(cell, "weight")
    draw_possible(layout, context, palette)
    row = layout.row(align=True)
    row.label(text="Copy to")
    row.operator("spectral.palette_spread", text="Column").side = "LIGHT"
    row.operator("spectral.palette_spread", text="Row").side = "MATERIAL"


def draw_conflict(box: UILayout, context: Context, palette: PropertyGroup, conflict: PropertyGroup) -> None:
    """Draw a cell that misses its target, and a button that relaxes the cell that conflicts with it."""
    rows = {material.uid: row for row, material in enumerate(palette.materials)}
    columns = {light.uid: column for column, light in enumerate(palette.lights)}
    line = box.row()
    wrapped(line.column(), context, conflict.text, icon="INFO", indent=90.0)
    if conflict.light_uid in columns and conflict.material_uid in rows:
        show = line.operator("spectral.palette_select", text="", icon="VIEWZOOM", emboss=False)
        show.row, show.column = rows[conflict.material_uid], columns[conflict.light_uid]
    if conflict.relief_light_uid in columns and conflict.relief_material_uid in rows:
        row, column = rows[conflict.relief_material_uid], columns[conflict.relief_light_uid]
        name = f"Ignore {palette.materials[row].name}, {palette.lights[column].name}"
        relieve = box.operator("spectral.palette_relieve", text=name)
        relieve.row, relieve.column = row, column


def _draw_hidden_conflict(
    layout: UILayout, context: Context, palette: PropertyGroup, entries: tuple[PropertyGroup, PropertyGroup]
) -> None:
    """Draw the conflict of this cell if it is not among those below the table."""
    uids = entries[0].uid, entries[1].uid
    hidden = list(palette.conflicts)[CONFLICTS_SHOWN:] if palette.live or not palette.is_stale else ()
    for conflict in hidden:
        if (conflict.material_uid, conflict.light_uid) == uids:
            box = layout.box()
            box.enabled = not palette.is_stale
            draw_conflict(box, context, palette, conflict)
            return


def _draw_references(layout: UILayout, context: Context, palette: PropertyGroup, cell: PropertyGroup) -> None:
    """Draw the names of the cells that this one refers to, and a small copy of the table to choose them."""
    chosen = references(palette, cell)
    box = layout.box()
    named = ", ".join(f"{palette.materials[row].name} under {palette.lights[column].name}" for row, column in chosen)
    wrapped(box, context, f"{REFERENCE_TITLES[cell.mode]} {named}", indent=60.0)
    room = width_of(context) - PANEL_PIXELS - BUTTON_PIXELS
    split = box.split(factor=NAMES_SHARE, align=True)
    names, count = split.column(align=True), len(palette.lights)
    flow = split.grid_flow(row_major=True, columns=count, even_columns=True, align=True)
    names.label(text="")
    for name in names_in([light.name for light in palette.lights], (1 - NAMES_SHARE) * room / count, context):
        flow.label(text=name, translate=False)
    known = names_in([material.name for material in palette.materials], NAMES_SHARE * room, context)
    for row, name in enumerate(known):
        names.label(text=name, translate=False)
        for column in range(count):
            if not may_refer(palette, cell, (row, column)):
                flow.label(text="")
                continue
            on = (row, column) in chosen
            operator = flow.operator(
                "spectral.palette_refer", text="", icon="CHECKMARK" if on else "BLANK1", depress=on
            )
            operator.row, operator.column = row, column


def draw_light(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """The selected light."""
    if palette.active_column >= len(palette.lights):
        return
    light = palette.lights[palette.active_column]
    _draw_entry_head(layout, palette, light, "LIGHT")
    layout.label(text="Starts from:" if light.design == "DESIGNED" else "Measured spectrum:")
    draw_source(layout, light.spectral)
    _draw_message(layout, context, light.spectral)
    column = _split(layout.column())
    column.prop(light, "intensity")
    if light.design == "DESIGNED":
        column.prop(light, "keeps_luminance")
        column.prop(light, "looks_white")
        column.prop(light, "use_primaries")
        if light.use_primaries:
            _draw_lamps(layout, context, light.primaries, "PRIMARIES", "Lamps to mix from")
    else:
        _draw_lamps(layout, context, light.variants, "VARIANTS", "Matches should hold under these too")
    column = _split(layout.column(align=True))
    column.prop(light, "light", text="Apply to")
    column.prop(light, "world", text="or World")
    if len(light.result.samples):
        draw_curve(layout, context, light.result)


def draw_material(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """The selected material."""
    if palette.active_row >= len(palette.materials):
        return
    material = palette.materials[palette.active_row]
    _draw_entry_head(layout, palette, material, "MATERIAL")
    if material.design == "MEASURED":
        draw_source(layout, material.spectral)
        _draw_message(layout, context, material.spectral)
    _split(layout.column()).prop(material, "material", text="Apply to")
    if len(material.result.samples):
        draw_curve(layout, context, material.result)


def _draw_entry_head(layout: UILayout, palette: PropertyGroup, entry: PropertyGroup, side: str) -> None:
    """Name, position in the table, measured or designed."""
    row = layout.row(align=True)
    row.prop(entry, "name", text="")
    for direction, icon in (
        ("BACK", "TRIA_LEFT" if side == "LIGHT" else "TRIA_UP"),
        ("FORTH", "TRIA_RIGHT" if side == "LIGHT" else "TRIA_DOWN"),
    ):
        operator = row.operator("spectral.palette_move", text="", icon=icon)
        operator.side, operator.direction = side, direction
    row.operator("spectral.palette_remove", text="", icon="TRASH").side = side
    layout.row(align=True).prop(entry, "design", expand=True)


def _draw_message(layout: UILayout, context: Context, spectral: PropertyGroup) -> None:
    if spectral.message:
        column = layout.column()
        column.alert = True
        wrapped(column, context, spectral.message, icon="ERROR")


def _draw_lamps(layout: UILayout, context: Context, lamps: bpy_prop_collection, which: str, title: str) -> None:
    box = layout.box()
    head = box.row(align=True)
    head.label(text=title)
    head.operator("spectral.palette_lamp_add", text="", icon="ADD").to = which
    for index, lamp in enumerate(lamps):
        row = box.row(align=True)
        row.prop(lamp.spectral, "catalogue_name", text="")
        if which == "PRIMARIES":
            row.label(text=f"× {lamp.amount:.2f}")
        operator = row.operator("spectral.palette_lamp_remove", text="", icon="REMOVE")
        operator.to, operator.index = which, index
        _draw_message(box, context, lamp.spectral)
