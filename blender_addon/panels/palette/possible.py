# SPDX-License-Identifier: GPL-3.0-or-later
"""In "Selected Cell": the possible colors of the cell, the nearest one to its target, and the conflicting cells."""

from bpy.types import Context, PropertyGroup, UILayout

from ...drawing.icons import picture_icon
from ...editing.palette.possible import picture_of
from ..parts import wrapped


def draw_possible(layout: UILayout, context: Context, palette: PropertyGroup) -> None:
    """Draw the button, and the answer if it belongs to the selected cell."""
    box = layout.box()
    row = box.row(align=True)
    row.operator("spectral.palette_possible", icon="QUESTION")
    row.prop(palette, "possible_follows", text="", icon="FILE_REFRESH")
    answer = palette.possible
    if not answer.words or not _is_of_selected(palette, answer):
        return
    picture = picture_of(palette.id_data)
    row = box.row()
    if picture is not None:
        row.template_icon(picture_icon(picture), scale=5.0)
    column = row.column()
    column.prop(answer, "asked", text="Wanted")
    if not answer.reachable:
        column.prop(answer, "nearest", text="Nearest")
        column.operator("spectral.palette_take_nearest", icon="EYEDROPPER")
    for line in answer.words.splitlines():
        wrapped(box, context, line, indent=60.0)
    if picture is not None:
        hint = box.column()
        hint.active = False
        wrapped(hint, context, "Bright: possible at this lightness. Ring: target. Dot: nearest.", indent=60.0)


def _is_of_selected(palette: PropertyGroup, answer: PropertyGroup) -> bool:
    return (
        palette.materials[palette.active_row].uid == answer.material_uid
        and palette.lights[palette.active_column].uid == answer.light_uid
    )
