# SPDX-License-Identifier: GPL-3.0-or-later
"""Add settings to the sweep, run it in the background, open its page, apply a point, keyframe a path of points."""

import math

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty
from bpy.types import Context, Event

from spectral_core.errors import InvalidInputError, counted

from ..editing.board.pointed import paths_under_pointer
from ..editing.sweep import live as editing
from ..editing.sweep.points import keyframe_path, set_point
from ..editing.sweep.run import estimate
from .common import UNDOABLE, reporting, require_index, require_kept, with_menu_entry

SWEPT_TYPES = frozenset({"FLOAT", "INT", "BOOLEAN", "ENUM"})
"""Types of properties that a sweep varies: numbers, switches, lists."""


class SPECTRAL_OT_sweep_add(bpy.types.Operator):
    """Sweep this setting: render the scene at many of its values"""

    bl_idname = "spectral.sweep_add"
    bl_label = "Add to Sweep"
    bl_options = UNDOABLE
    target: StringProperty(
        name="Data Path", description='As Copy Full Data Path gives it: bpy.data.lights["Key"].energy'
    )

    @reporting
    def execute(self, context: Context) -> None:
        require_kept(context.scene, "sweep")
        entry = editing.add(context.scene, self.target)
        low, high = (
            f"{math.degrees(each):.4g}°" if entry.is_angle else f"{each:g}" for each in (entry.low, entry.high)
        )
        over = f"over {entry.choices}" if entry.choices else f"from {low} to {high}"
        self.report({"INFO"}, f"{entry.label} is swept {over}")


class SPECTRAL_OT_sweep_remove(bpy.types.Operator):
    """Do not sweep this setting any more"""

    bl_idname = "spectral.sweep_remove"
    bl_label = "Remove from Sweep"
    bl_options = UNDOABLE
    index: IntProperty(min=0)

    @reporting
    def execute(self, context: Context) -> None:
        require_kept(context.scene, "sweep")
        parameters = context.scene.spectral.sweep.parameters
        parameters.remove(require_index("parameter", self.index, len(parameters)))


class SPECTRAL_OT_sweep_estimate(bpy.types.Operator):
    """Estimate the time of the sweep"""

    bl_idname = "spectral.sweep_estimate"
    bl_label = "Estimate"
    bl_options: set[str] = set()

    @reporting
    def execute(self, context: Context) -> None:
        text = estimate(context.scene)
        context.scene.spectral.sweep.status = text
        self.report({"INFO"}, text)


class SPECTRAL_OT_sweep_run(bpy.types.Operator):
    """Render the missing points of the sweep in the background; Blender stays responsive"""

    bl_idname = "spectral.sweep_run"
    bl_label = "Run Sweep"
    bl_options: set[str] = set()
    pending: BoolProperty(
        name="Only Added Points",
        options={"SKIP_SAVE"},
        description="Render only the points that the page added; the settings of the panel have no effect",
    )

    @reporting
    def execute(self, context: Context) -> None:
        if self.pending:
            editing.resume(context.scene)
        else:
            editing.start(context.scene)
        if bpy.app.background:
            editing.wait(context.scene)
            return
        editing.watch()


class SPECTRAL_OT_sweep_cancel(bpy.types.Operator):
    """End the run; rendered points stay, and the next run continues with the others"""

    bl_idname = "spectral.sweep_cancel"
    bl_label = "Cancel Sweep"
    bl_options: set[str] = set()

    @reporting
    def execute(self, _context: Context) -> None:
        editing.cancel()


class SPECTRAL_OT_sweep_open(bpy.types.Operator):
    """Explore the sweep in the web browser: plots, pictures, labels; a point picked there can be applied here"""

    bl_idname = "spectral.sweep_open"
    bl_label = "Explore"
    bl_options: set[str] = set()
    browse: BoolProperty(
        name="Open Browser",
        description="Open the page; its address is on the clipboard in any case",
        default=True,
        options={"SKIP_SAVE"},
    )

    @reporting
    def execute(self, context: Context) -> None:
        address = editing.serve(context.scene)
        context.window_manager.clipboard = address
        if self.browse and not bpy.app.background:
            bpy.ops.wm.url_open(url=address)
        self.report({"INFO"}, "the page is served; its address is on the clipboard")


class SPECTRAL_OT_sweep_apply(bpy.types.Operator):
    """Set the scene to the settings in a row of the sweep's table"""

    bl_idname = "spectral.sweep_apply"
    bl_label = "Apply Point"
    bl_options = UNDOABLE
    row: IntProperty(name="Row", min=0, description="Row of the table, from 1; 0 for the row in the panel")

    @reporting
    def execute(self, context: Context) -> None:
        found, row = editing.rows(context.scene), self.row or context.scene.spectral.sweep.point
        if row > len(found):
            raise InvalidInputError(f"there is no row {row}; the table has {len(found)}")
        for text in set_point(context.scene, found[row - 1].parameters):
            self.report({"WARNING"}, text)


class SPECTRAL_OT_sweep_keyframe(bpy.types.Operator):
    """Keyframe a path through rows of the sweep's table, from the present frame on"""

    bl_idname = "spectral.sweep_keyframe"
    bl_label = "Keyframe Path"
    bl_options = UNDOABLE
    rows: StringProperty(name="Rows", default="1, 2, 3", description="Rows of the table, such as 4, 1, 12")
    step: IntProperty(name="Frames Between", description="Frames from one point to the next", default=24, min=1)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    @reporting
    def execute(self, context: Context) -> None:
        found = editing.rows(context.scene)
        words = [word for word in self.rows.replace(",", " ").split() if word]
        if not words or not all(word.isdecimal() and 1 <= int(word) <= len(found) for word in words):
            raise InvalidInputError(f"{self.rows!r} are no rows of the table; expected numbers from 1 to {len(found)}")
        last = keyframe_path(context.scene, [found[int(word) - 1] for word in words], self.step)
        self.report({"INFO"}, f"{counted(len(words), 'point')} keyframed up to frame {last}")


def draw_menu(self: bpy.types.Menu, context: Context) -> None:
    """In the menu of every setting that can be swept: right click, Add to Sweep."""
    for axis, path in paths_under_pointer(context, SWEPT_TYPES):
        added = self.layout.operator("spectral.sweep_add", text=f"Add to Sweep{axis}", icon="GRAPH")
        added.target = path


CLASSES = (
    SPECTRAL_OT_sweep_add, SPECTRAL_OT_sweep_remove, SPECTRAL_OT_sweep_estimate, SPECTRAL_OT_sweep_run,
    SPECTRAL_OT_sweep_cancel, SPECTRAL_OT_sweep_open, SPECTRAL_OT_sweep_apply, SPECTRAL_OT_sweep_keyframe,
)  # fmt: skip
register, unregister = with_menu_entry(CLASSES, draw_menu)
