# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows, columns and cells of the palette table: adding, removing, finding, and the references of a cell.

Cells refer to each other by permanent numbers, so that moving or renaming a row or column keeps the references.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

from bpy.types import PropertyGroup, bpy_prop_collection

from spectral_core.errors import InvalidInputError

from ...properties import hooks
from ...properties.palette.cell import REFERRING

Place = tuple[int, int]


def paused() -> AbstractContextManager[None]:
    """A context in which a change starts no solve, for code that sets many properties and then solves once."""
    return hooks.silenced(hooks.Topic.PALETTE)


def palette_of(holder: PropertyGroup) -> PropertyGroup:
    """The palette of a scene, or of anything that the palette contains."""
    return holder.id_data.spectral.palette


def places(palette: PropertyGroup) -> Iterator[tuple[Place, PropertyGroup]]:
    """Every cell with its (row, column)."""
    for row, material in enumerate(palette.materials):
        for column, cell in enumerate(material.cells):
            yield (row, column), cell


def place_of(palette: PropertyGroup, cell: PropertyGroup) -> Place:
    """(row, column) of a cell."""
    return next(place for place, each in places(palette) if each == cell)


def unique(name: str, taken: set[str]) -> str:
    """``name``, with a number if it is taken."""
    number, tried = 1, name
    while tried in taken:
        number += 1
        tried = f"{name} {number}"
    return tried


def _next_uid(palette: PropertyGroup) -> int:
    palette.next_uid += 1
    return palette.next_uid - 1


def add_light(palette: PropertyGroup, name: str = "Light") -> PropertyGroup:
    """A new column at the right; its cells have no request."""
    with paused():
        light = palette.lights.add()
        light.name = unique(name, {each.name for each in palette.lights[:-1]})
        light.uid = _next_uid(palette)
        light.spectral.kind = light.result.kind = "ILLUMINANT"
        light.spectral.source = "CATALOGUE"
        light.spectral.catalogue_name = "D65"
        for material in palette.materials:
            material.cells.add().mode = "IGNORE"
    return light


def add_material(palette: PropertyGroup, name: str = "Material") -> PropertyGroup:
    """A new row at the bottom; its cells have no request."""
    with paused():
        material = palette.materials.add()
        material.name = unique(name, {each.name for each in palette.materials[:-1]})
        material.uid = _next_uid(palette)
        material.spectral.kind = material.result.kind = "REFLECTANCE"
        for _ in palette.lights:
            material.cells.add().mode = "IGNORE"
    return material


def add_lamp(lamps: bpy_prop_collection, name: str) -> PropertyGroup:
    """A new entry of a light's primaries or variants, without a spectrum."""
    lamp = lamps.add()
    lamp.name = name
    lamp.spectral.kind = "ILLUMINANT"
    return lamp


def remove_light(palette: PropertyGroup, column: int) -> list[str]:
    """Remove a column; cells that referred to it no longer do. Returns the names of those without a request now."""
    uid = palette.lights[column].uid
    with paused():
        palette.lights.remove(column)
        for material in palette.materials:
            material.cells.remove(column)
        lost = _forget(palette, lambda reference: reference.light_uid == uid)
        clamp_active(palette)
    return lost


def remove_material(palette: PropertyGroup, row: int) -> list[str]:
    """Remove a row; cells that referred to it no longer do. Returns the names of those without a request now."""
    uid = palette.materials[row].uid
    with paused():
        palette.materials.remove(row)
        lost = _forget(palette, lambda reference: reference.material_uid == uid)
        clamp_active(palette)
    return lost


def _forget(palette: PropertyGroup, gone: Callable[[PropertyGroup], bool]) -> list[str]:
    lost = []
    for (row, column), cell in places(palette):
        for index in reversed(range(len(cell.others))):
            if gone(cell.others[index]):
                cell.others.remove(index)
        if cell.mode in REFERRING and not len(cell.others):
            cell.mode = "IGNORE"
            lost.append(f"{palette.materials[row].name} under {palette.lights[column].name}")
    return lost


def move_light(palette: PropertyGroup, column: int, to: int) -> None:
    """Move a column with its cells."""
    with paused():
        palette.lights.move(column, to)
        for material in palette.materials:
            material.cells.move(column, to)


def move_material(palette: PropertyGroup, row: int, to: int) -> None:
    """Move a row."""
    with paused():
        palette.materials.move(row, to)


def clear(palette: PropertyGroup) -> None:
    """An empty table."""
    with paused():
        palette.lights.clear()
        palette.materials.clear()
        palette.conflicts.clear()
        palette.alternatives.clear()
        palette.status = palette.remedy = palette.message = palette.notes = palette.possible.words = ""
        palette.light_scale, palette.is_stale, palette.is_unfinished, palette.is_alternative = 1.0, False, False, False
        palette.use_tints = False
        clamp_active(palette)


def clamp_active(palette: PropertyGroup) -> None:
    """Keep the selected cell inside the table."""
    palette.active_row = max(0, min(palette.active_row, len(palette.materials) - 1))
    palette.active_column = max(0, min(palette.active_column, len(palette.lights) - 1))


def active_cell(palette: PropertyGroup) -> PropertyGroup | None:
    """The selected cell, None for an empty table."""
    if palette.active_row < len(palette.materials) and palette.active_column < len(palette.lights):
        return palette.materials[palette.active_row].cells[palette.active_column]
    return None


def references(palette: PropertyGroup, cell: PropertyGroup) -> list[Place]:
    """(row, column) of the cells that ``cell`` refers to."""
    rows = {material.uid: row for row, material in enumerate(palette.materials)}
    columns = {light.uid: column for column, light in enumerate(palette.lights)}
    return [
        (rows[each.material_uid], columns[each.light_uid])
        for each in cell.others
        if each.material_uid in rows and each.light_uid in columns
    ]


def may_refer(palette: PropertyGroup, cell: PropertyGroup, other: Place) -> bool:
    """True if a cell of this mode may refer to the cell at ``other``."""
    here = place_of(palette, cell)
    return other != here and (cell.mode != "CONSTANT" or other[0] == here[0])


def set_references(palette: PropertyGroup, cell: PropertyGroup, others: list[Place]) -> None:
    """Let ``cell`` refer to these cells only. Raises InvalidInputError for a cell that it cannot refer to."""
    for row, column in others:
        if not may_refer(palette, cell, (row, column)):
            raise InvalidInputError(
                f"a cell of mode {cell.mode} cannot refer to cell ({row}, {column}); a constant cell refers to its own "
                "row, and no cell to itself"
            )
    cell.others.clear()
    for row, column in others:
        reference = cell.others.add()
        reference.material_uid = palette.materials[row].uid
        reference.light_uid = palette.lights[column].uid


def fill_references(cell: PropertyGroup) -> None:
    """The usual reference of a newly chosen mode: the row above, the other lights, or the rest of the column."""
    if cell.mode not in REFERRING:
        return
    palette = palette_of(cell)
    row, column = place_of(palette, cell)
    kept = [other for other in references(palette, cell) if may_refer(palette, cell, other)]
    column_mates = [(other, column) for other in range(len(palette.materials)) if other != row]
    if cell.mode == "SAME":
        wanted = kept[:1] or column_mates[:1]
    elif cell.mode == "CONSTANT":
        wanted = kept or [(row, other) for other in range(len(palette.lights)) if other != column][:1]
    else:
        wanted = kept or column_mates
    set_references(palette, cell, wanted)
