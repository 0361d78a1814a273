# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows, columns and cells of the palette."""

from collections.abc import Callable

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy.types import ID, Context, PropertyGroup, bpy_prop_collection

from spectral_core.errors import InvalidInputError

from ...editing.palette import live, picture, possible
from ...properties.palette.cell import ASKED
from ...translate.palette import from_scene, table
from ..common import UNDOABLE, palette_in, palette_shown, reporting, require_index

SIDES = [("LIGHT", "Light", "A column", 0), ("MATERIAL", "Material", "A row", 1)]
DIRECTIONS = [("BACK", "Back", "Left or up", 0), ("FORTH", "Forward", "Right or down", 1)]
LISTS = [
    ("PRIMARIES", "Lamps to mix from", "The light is mixed from these", 0),
    ("VARIANTS", "Lamp variants", "Matches should hold under these too", 1),
]


class SPECTRAL_OT_palette_add(bpy.types.Operator):
    """Add a light (column) or a material (row) to the palette"""

    bl_idname = "spectral.palette_add"
    bl_label = "Add to Palette"
    bl_options = UNDOABLE
    side: EnumProperty(name="Add", items=SIDES, description="What is added")
    name: StringProperty(
        name="Name",
        options={"SKIP_SAVE"},
        description="Name of the new column or row. Empty: the name of the selected lamp or material, or a number",
    )

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        picked = _picked(context, self.side)
        with table.paused():
            if self.side == "LIGHT":
                from_scene.add_light(palette, picked, self.name or (context.object.name if picked else ""))
                palette.active_column = len(palette.lights) - 1
            else:
                from_scene.add_material(palette, picked, self.name)
                palette.active_row = len(palette.materials) - 1
        live.edited(palette)


def _picked(context: Context, side: str) -> ID | None:
    """Light or material of the active object, unless the palette contains it already."""
    palette, active = palette_in(context), context.object
    if active is None:
        return None
    if side == "LIGHT":
        known = {light.light for light in palette.lights}
        return active.data if active.type == "LIGHT" and active.data not in known else None
    known = {material.material for material in palette.materials}
    return active.active_material if active.active_material not in known else None


class SPECTRAL_OT_palette_remove(bpy.types.Operator):
    """Remove a light (column) or a material (row) from the palette"""

    bl_idname = "spectral.palette_remove"
    bl_label = "Remove from Palette"
    bl_options = UNDOABLE
    side: EnumProperty(name="Remove", items=SIDES, description="What is removed")
    index: IntProperty(
        name="Index", default=-1, min=-1, options={"SKIP_SAVE"}, description="Number from 0; -1 for the selected one"
    )

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        entries, active, remove = _side(palette, self.side)
        index = require_index(self.side.lower(), active if self.index < 0 else self.index, len(entries))
        name = entries[index].name
        lost = remove(palette, index)
        if lost:
            self.report({"WARNING"}, f"these cells referred to {name} and ask for nothing now: {', '.join(lost)}")
        live.edited(palette)
        if not palette.live:
            picture.follow(context.scene)


Remove = Callable[[PropertyGroup, int], list[str]]


def _side(palette: PropertyGroup, side: str) -> tuple[bpy_prop_collection, int, Remove]:
    if side == "LIGHT":
        return palette.lights, palette.active_column, table.remove_light
    return palette.materials, palette.active_row, table.remove_material


class SPECTRAL_OT_palette_move(bpy.types.Operator):
    """Move the selected light (column) or material (row) in the table"""

    bl_idname = "spectral.palette_move"
    bl_label = "Move in Palette"
    bl_options = UNDOABLE
    side: EnumProperty(name="Move", items=SIDES, description="What is moved")
    direction: EnumProperty(name="Direction", items=DIRECTIONS, description="Where it is moved to")

    @reporting
    def execute(self, context: Context) -> set[str]:
        palette = palette_in(context)
        entries, active, _ = _side(palette, self.side)
        to = active + (1 if self.direction == "FORTH" else -1)
        if not 0 <= to < len(entries):
            return {"CANCELLED"}
        if self.side == "LIGHT":
            table.move_light(palette, active, to)
            palette.active_column = to
        else:
            table.move_material(palette, active, to)
            palette.active_row = to
        live.edited(palette)
        return {"FINISHED"}


def _cell_named(palette: PropertyGroup, place: PropertyGroup, what: str) -> str:
    """A tooltip: the cell's material, light and difference, if there is such a cell, and what a click does."""
    if not (0 <= place.row < len(palette.materials) and 0 <= place.column < len(palette.lights)):
        return what
    material, light = palette.materials[place.row], palette.lights[place.column]
    return f"{material.name} under {light.name}: {material.cells[place.column].error_text}. {what}"


class SPECTRAL_OT_palette_select(bpy.types.Operator):
    """Show the target of this cell, its material and its light below the table"""

    bl_idname = "spectral.palette_select"
    bl_label = "Select Cell"
    bl_options = {"INTERNAL"}
    row: IntProperty(min=-1, default=-1, options={"SKIP_SAVE"})
    column: IntProperty(min=-1, default=-1, options={"SKIP_SAVE"})

    @classmethod
    def description(cls, context: Context, properties: PropertyGroup) -> str:
        """Describe the colors of the cell in the tooltip."""
        return _cell_named(palette_shown(context), properties, "Click to edit it below the table")

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_shown(context)
        if self.row >= 0:
            palette.active_row = require_index("material", self.row, len(palette.materials))
        if self.column >= 0:
            palette.active_column = require_index("light", self.column, len(palette.lights))
        possible.follow(context.scene)


class SPECTRAL_OT_palette_refer(bpy.types.Operator):
    """Select or deselect this cell as a reference of the selected cell"""

    bl_idname = "spectral.palette_refer"
    bl_label = "Refer to Cell"
    bl_options = UNDOABLE
    row: IntProperty(min=0)
    column: IntProperty(min=0)

    @classmethod
    def description(cls, context: Context, properties: PropertyGroup) -> str:
        """Name the cell in the tooltip: in a large table its row and column have no room for their names."""
        return _cell_named(palette_shown(context), properties, "Refer to this cell, or no longer")

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        cell = table.active_cell(palette)
        if cell is None or cell.mode not in table.REFERRING:
            raise InvalidInputError("select a cell whose target is Same As, Constant or Distinct first")
        other = (
            require_index("material", self.row, len(palette.materials)),
            require_index("light", self.column, len(palette.lights)),
        )
        chosen = table.references(palette, cell)
        if cell.mode == "SAME":
            chosen = [other]
        elif other in chosen:
            chosen.remove(other)
        else:
            chosen.append(other)
        table.set_references(palette, cell, chosen)
        live.edited(palette)


class SPECTRAL_OT_palette_spread(bpy.types.Operator):
    """Copy target, references, weight and exactness of the selected cell to the others of its row or column, except for
    the cell that it takes its color from
    """

    bl_idname = "spectral.palette_spread"
    bl_label = "Copy Target"
    bl_options = UNDOABLE
    side: EnumProperty(name="To All of the", items=SIDES, description="Cells that get the target")

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        cell = table.active_cell(palette)
        if cell is None:
            raise InvalidInputError("the palette is empty; add a light and a material first")
        here = (palette.active_row, palette.active_column)
        same = 1 if self.side == "LIGHT" else 0
        referred = table.references(palette, cell)
        with table.paused():
            for place, other in table.places(palette):
                is_source = cell.mode in ("SAME", "CONSTANT") and place in referred
                if place != here and place[same] == here[same] and not is_source:
                    for name in ASKED:
                        setattr(other, name, getattr(cell, name))
                    table.set_references(palette, other, _spread(palette, referred, here, place))
                    table.fill_references(other)  # where none of them fits
        live.edited(palette)


def _spread(
    palette: PropertyGroup, referred: list[table.Place], here: table.Place, place: table.Place
) -> list[table.Place]:
    """References of the cell at ``here`` for a copy of it at ``place``.

    A cell of the own row or column becomes that of the row or column of the copy, and all others stay.
    """
    moved = [
        (place[0] if row == here[0] else row, place[1] if column == here[1] else column) for row, column in referred
    ]
    cell = palette.materials[place[0]].cells[place[1]]
    return [other for other in dict.fromkeys(moved) if table.may_refer(palette, cell, other)]


class SPECTRAL_OT_palette_lamp_add(bpy.types.Operator):
    """Add a lamp to the selected light's list"""

    bl_idname = "spectral.palette_lamp_add"
    bl_label = "Add Lamp"
    bl_options = UNDOABLE
    to: EnumProperty(name="List", items=LISTS, description="List of the selected light")
    lamp: StringProperty(name="Lamp", default="D65", description="Name in the catalogue")

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        require_index("light", palette.active_column, len(palette.lights))
        with table.paused():
            entry = table.add_lamp(getattr(palette.lights[palette.active_column], self.to.lower()), self.lamp)
            entry.spectral.source = "CATALOGUE"
            entry.spectral.catalogue_name = self.lamp
        live.edited(palette)


class SPECTRAL_OT_palette_lamp_remove(bpy.types.Operator):
    """Remove a lamp from the selected light's list"""

    bl_idname = "spectral.palette_lamp_remove"
    bl_label = "Remove Lamp"
    bl_options = UNDOABLE
    to: EnumProperty(name="List", items=LISTS, description="List of the selected light")
    index: IntProperty(min=0)

    @reporting
    def execute(self, context: Context) -> None:
        palette = palette_in(context)
        require_index("light", palette.active_column, len(palette.lights))
        lamps = getattr(palette.lights[palette.active_column], self.to.lower())
        lamps.remove(require_index("lamp", self.index, len(lamps)))
        live.edited(palette)


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_palette_add,
        SPECTRAL_OT_palette_remove,
        SPECTRAL_OT_palette_move,
        SPECTRAL_OT_palette_select,
        SPECTRAL_OT_palette_refer,
        SPECTRAL_OT_palette_spread,
        SPECTRAL_OT_palette_lamp_add,
        SPECTRAL_OT_palette_lamp_remove,
    )
)
