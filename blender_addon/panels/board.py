# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Mixing Board" in the sidebar of the 3D view."""

import re

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from spectral_core.errors import InvalidInputError, counted

from ..editing.board import live
from ..editing.board.followed import is_unused
from ..editing.board.paths import block_at, number_at, place_in
from .parts import wrapped


class SPECTRAL_PT_board(bpy.types.Panel):
    """Faders that change numbers of the file"""

    bl_label = "Mixing Board"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Spectral"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        settings, layout, running = context.scene.spectral.board, self.layout, live.session()
        row = layout.row()
        row.scale_y = 1.3
        if running is None:
            row.operator("spectral.board_start", icon="PLAY")
            _draw_connection(layout, settings)
        else:
            row.operator("spectral.board_stop", icon="PAUSE", depress=True)
            layout.label(text=_facts(running), icon="LINKED")
        if settings.status:
            wrapped(layout, context, settings.status, icon="INFO")
        if running is not None and running.board.learning:
            wrapped(layout, context, f"Move a fader for {shown_name(running.board.learning)}", icon="ARROW_LEFTRIGHT")
        else:
            layout.operator("spectral.board_learn", icon="ARROW_LEFTRIGHT").target = ""
        _draw_bindings(layout, context, settings)
        if not len(settings.bindings):
            wrapped(layout, context, "Right-click any number, choose Learn Fader, and move a fader.", icon="INFO")
        layout.operator("spectral.board_order", icon="SORT_ASC")
        layout.operator("spectral.board_motion", icon="FILE_TICK")
        for line in settings.simultaneity.splitlines():
            layout.label(text=line)


def _facts(running: live.Session) -> str:
    osc = "" if running.osc_port is None else f"OSC on port {running.osc_port}"
    midi = "MIDI" if any(hasattr(link, "pump") for link in running.links) else ""
    return ", ".join(filter(None, (midi, osc, counted(running.board.received, "message"))))


def _draw_connection(layout: UILayout, settings: PropertyGroup) -> None:
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    column.prop(settings, "use_midi")
    if settings.use_midi:
        column.prop(settings, "midi_port")
    column.prop(settings, "use_osc")
    if settings.use_osc:
        column.prop(settings, "osc_host")
        column.prop(settings, "osc_port")
        column.prop(settings, "feedback_host")
        if settings.feedback_host:
            column.prop(settings, "feedback_port")


def _draw_bindings(layout: UILayout, context: Context, settings: PropertyGroup) -> None:
    for number, entry in enumerate(settings.bindings):
        box = layout.box()
        row = box.row()
        wrapped(row.column(), context, shown_name(entry.name), indent=90.0)
        row.operator("spectral.board_unbind", text="", icon="X", emboss=False).index = number
        if fault := _fault(entry.name):
            _draw_warning(box, context, f"Its fader has no effect: {fault}")
        column = box.column(align=True)
        row = column.row(align=True)
        row.prop(entry, "control", text="")
        row.prop(entry, "pick_up", text="", icon="SNAP_ON" if entry.pick_up else "SNAP_OFF")
        row = column.row(align=True)
        row.prop(entry, "low")
        row.prop(entry, "high")
    for number, order in enumerate(settings.orders):
        row = layout.row()
        wrapped(
            row.column(),
            context,
            f"{shown_name(order.lower)} ≤ {shown_name(order.upper)}",
            icon="SORT_ASC",
            indent=70.0,
        )
        row.operator("spectral.board_disorder", text="", icon="X", emboss=False).index = number
        if fault := _fault(order.lower) or _fault(order.upper):
            _draw_warning(layout, context, f"This order has no effect: {fault}")


def _draw_warning(layout: UILayout, context: Context, text: str) -> None:
    column = layout.column()
    column.alert = True
    wrapped(column, context, text, icon="ERROR", indent=60.0)


def _fault(target: str) -> str:
    """The reason why a number cannot be moved, such as a deleted light; "" if it can."""
    try:
        number_at(target)
        block, _ = block_at(target)
    except InvalidInputError as error:
        return str(error)
    return f"no scene uses {block.name!r} any more" if is_unused(block) else ""


def shown_name(path: str) -> str:
    """A number by the name of its data-block and its path: ``Key: energy`` for ``bpy.data.lights["Key"].energy``.

    An input of a node by the names that the artist sees: ``Paint: Principled BSDF, Roughness``.
    """
    try:
        block, rest = block_at(path)
        place = place_in(block, rest)
    except InvalidInputError:
        place = None
    if place is not None and isinstance(place.owner, bpy.types.NodeSocket):
        node = place.owner.node
        component = "" if place.index is None else f" [{place.index}]"
        return f"{block.name}: {node.label or node.name}, {place.owner.name}{component}"
    found = re.match(r'bpy\.data\.\w+\["(.*?)"(?:, "[^"]*")?\]\.?(.*)', path)
    return f"{found[1]}: {found[2]}" if found else path.removeprefix("bpy.data.")


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_PT_board,))
