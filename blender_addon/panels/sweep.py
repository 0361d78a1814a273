# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Sweep" in the sidebar of the 3D view."""

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from ..editing.sweep import live as editing
from .parts import wrapped


class SPECTRAL_PT_sweep(bpy.types.Panel):
    """Render the scene at many settings and explore the pictures"""

    bl_label = "Sweep"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Spectral"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        sweep, layout = context.scene.spectral.sweep, self.layout
        if not len(sweep.parameters):
            wrapped(layout, context, "Right-click any setting and choose Add to Sweep.", icon="INFO")
            return
        for number, entry in enumerate(sweep.parameters):
            _draw_parameter(layout, number, entry)
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        for name in ("budget", "design", "percentage", "samples", "workers", "folder"):
            column.prop(sweep, name)
        _draw_run(layout, context)
        _draw_outcome(layout, sweep)


def _draw_parameter(layout: UILayout, number: int, entry: PropertyGroup) -> None:
    box = layout.box()
    row = box.row()
    row.prop(entry, "label", text="", icon="GRAPH")
    row.operator("spectral.sweep_remove", text="", icon="X", emboss=False).index = number
    if entry.choices:
        box.prop(entry, "choices", text="")
        return
    row = box.row(align=True)
    of_angle = "_angle" if entry.is_angle else ""
    row.prop(entry, f"low{of_angle}")
    row.prop(entry, f"high{of_angle}")
    row = box.row(align=True)
    row.prop(entry, "scale", expand=True)
    row.prop(entry, "whole", text="", icon="LINENUMBERS_ON")


def _draw_run(layout: UILayout, context: Context) -> None:
    """The run of this file, which may be that of another scene, and the status of this scene's sweep."""
    row = layout.row(align=True)
    row.scale_y = 1.3
    sweep, swept = context.scene.spectral.sweep, editing.scene_of_run() or context.scene
    run = swept.spectral.sweep
    progress = f"{run.done} of {run.total}"
    if editing.running() is None:
        row.operator("spectral.sweep_run", icon="PLAY")
        row.operator("spectral.sweep_estimate", text="", icon="TIME")
    else:
        whose = "" if swept == context.scene else f"{swept.name}: "
        row.progress(factor=run.done / max(run.total, 1), text=f"{whose}{progress}")
        row.operator("spectral.sweep_cancel", text="", icon="X")
    if sweep.status and sweep.status != progress:
        wrapped(layout, context, sweep.status, icon="INFO")


def _draw_outcome(layout: UILayout, sweep: PropertyGroup) -> None:
    layout.operator("spectral.sweep_open", icon="WORLD")
    row = layout.row(align=True)
    row.prop(sweep, "point")
    row.operator("spectral.sweep_apply", icon="CHECKMARK").row = 0
    layout.operator("spectral.sweep_keyframe", icon="KEYFRAME")


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_PT_sweep,))
