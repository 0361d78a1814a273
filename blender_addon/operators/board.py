# SPDX-License-Identifier: GPL-3.0-or-later
"""Start and stop the mixing board, learn faders, keep bounds in order, save the motion."""

import bpy
from bpy.props import IntProperty, StringProperty
from bpy.types import Context, Event, Operator, PropertyGroup
from bpy_extras.io_utils import ExportHelper

from spectral_core.errors import InvalidInputError

from ..editing.board import live
from ..editing.board.paths import number_at
from ..editing.board.pointed import paths_under_pointer
from .common import UNDOABLE, chosen_path, reporting, require_index, require_kept, with_menu_entry


def board_shown(context: Context) -> PropertyGroup:
    """The mixing board of the scene in the window, to read it."""
    return context.scene.spectral.board


def board_in(context: Context) -> PropertyGroup:
    """The mixing board of the scene in the window, to change it. Raises InvalidInputError if the scene is linked."""
    require_kept(context.scene, "mixing board")
    return board_shown(context)


def _require_running() -> live.Session:
    running = live.session()
    if running is None:
        raise InvalidInputError("the mixing board does not run; press Start Board")
    return running


def _started(operator: Operator, context: Context) -> tuple[live.Session, str]:
    """The board, just started, and the reasons why devices did not open, which the panel shows too."""
    running, missing = live.start(context.scene)
    board = board_shown(context)
    board.status = "; ".join(filter(None, (*missing, board.status)))  # a binding that is invalid is there already
    for text in missing:
        operator.report({"WARNING"}, text)
    return running, "; ".join(missing)


class SPECTRAL_OT_board_start(bpy.types.Operator):
    """Listen to the faders"""

    bl_idname = "spectral.board_start"
    bl_label = "Start Board"
    bl_options: set[str] = set()

    @reporting
    def execute(self, context: Context) -> set[str]:
        running, _ = _started(self, context)
        if not running.links:
            live.stop()
            self.report({"WARNING"}, "no board was found, so nothing was started")
            return {"CANCELLED"}
        if running.osc_port is not None:
            self.report({"INFO"}, f"listening for OSC on port {running.osc_port}")
        return {"FINISHED"}


class SPECTRAL_OT_board_stop(bpy.types.Operator):
    """Stop listening to the faders; all their moves are one undo step"""

    bl_idname = "spectral.board_stop"
    bl_label = "Stop Board"
    bl_options = UNDOABLE

    @reporting
    def execute(self, _context: Context) -> None:
        _require_running()
        live.stop()


class SPECTRAL_OT_board_poll(bpy.types.Operator):
    """Apply the moves of the faders, once; a timer does so while there is a window"""

    bl_idname = "spectral.board_poll"
    bl_label = "Read Faders"
    bl_options: set[str] = set()

    @reporting
    def execute(self, _context: Context) -> None:
        _require_running()
        live.tick()


class SPECTRAL_OT_board_learn(bpy.types.Operator):
    """Bind this number to the next fader that is moved"""

    bl_idname = "spectral.board_learn"
    bl_label = "Learn Fader"
    bl_options: set[str] = set()
    target: StringProperty(
        name="Data Path", description='As Copy Full Data Path gives it: bpy.data.lights["Key"].energy'
    )

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return (
            self.execute(context) or {"FINISHED"}
            if self.target
            else context.window_manager.invoke_props_dialog(self, width=500)
        )

    @reporting
    def execute(self, context: Context) -> None:
        number_at(self.target)
        running, reasons = live.session(), ""
        if running is None:
            board_in(context)  # refuses a linked scene
            running, reasons = _started(self, context)
        if not running.links:
            live.stop()
            raise InvalidInputError(f"no board was found: {reasons or 'MIDI and OSC are off; switch one of them on'}")
        running.board.learn(self.target)
        self.report({"INFO"}, "move a fader")


class SPECTRAL_OT_board_unbind(bpy.types.Operator):
    """Remove the binding"""

    bl_idname = "spectral.board_unbind"
    bl_label = "Unbind"
    bl_options = UNDOABLE
    index: IntProperty(min=0)

    @reporting
    def execute(self, context: Context) -> None:
        settings = board_in(context)
        settings.bindings.remove(require_index("binding", self.index, len(settings.bindings)))
        live.rebind(context.scene)


class SPECTRAL_OT_board_order(bpy.types.Operator):
    """Keep the second number at or above the first: each fader stops at the other"""

    bl_idname = "spectral.board_order"
    bl_label = "Keep in Order"
    bl_options = UNDOABLE
    lower: StringProperty(
        name="Lower",
        description="Number that stays at or below the other",
        search=lambda self, context, typed: _targets(context, typed),
    )
    upper: StringProperty(
        name="Upper",
        description="Number that stays at or above the other",
        search=lambda self, context, typed: _targets(context, typed),
    )

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self, width=500)

    @reporting
    def execute(self, context: Context) -> None:
        board = board_in(context)
        if number_at(self.lower) == number_at(self.upper):
            raise InvalidInputError("a number cannot bound itself; name two")
        order = board.orders.add()
        order.lower, order.upper = self.lower, self.upper


class SPECTRAL_OT_board_disorder(bpy.types.Operator):
    """Remove this order, so that the two numbers are independent again"""

    bl_idname = "spectral.board_disorder"
    bl_label = "Remove Order"
    bl_options = UNDOABLE
    index: IntProperty(min=0)

    @reporting
    def execute(self, context: Context) -> None:
        orders = board_in(context).orders
        orders.remove(require_index("order", self.index, len(orders)))
        live.rebind(context.scene)


def _targets(context: Context, typed: str) -> list[str]:
    return [entry.name for entry in board_shown(context).bindings if typed.lower() in entry.name.lower()]


class SPECTRAL_OT_board_motion(bpy.types.Operator, ExportHelper):
    """Save the motion of the faders since the start, and show the correlation of their velocities (Eq. 6.2)"""

    bl_idname = "spectral.board_motion"
    bl_label = "Save Motion"
    bl_options: set[str] = set()
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.explore.board import simultaneity

        recorded = live.recording()
        recorded.save(chosen_path(self.filepath))
        rows = [" ".join(f"{value:+.2f}" for value in row) for row in simultaneity(recorded)]
        board_shown(context).simultaneity = "\n".join(rows)


def draw_menu(self: bpy.types.Menu, context: Context) -> None:
    """In the menu of every number: right click, Learn Fader."""
    for number, (axis, path) in enumerate(paths_under_pointer(context)):
        if number == 0:
            self.layout.separator()
        learn = self.layout.operator("spectral.board_learn", text=f"Learn Fader{axis}", icon="ARROW_LEFTRIGHT")
        learn.target = path


CLASSES = (
    SPECTRAL_OT_board_start, SPECTRAL_OT_board_stop, SPECTRAL_OT_board_poll, SPECTRAL_OT_board_learn,
    SPECTRAL_OT_board_unbind, SPECTRAL_OT_board_order, SPECTRAL_OT_board_disorder, SPECTRAL_OT_board_motion,
)  # fmt: skip
register, unregister = with_menu_entry(CLASSES, draw_menu)
