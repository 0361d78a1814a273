# SPDX-License-Identifier: GPL-3.0-or-later
"""Render settings, and the plan: simulated effects, reasons, and the error without each."""

from collections.abc import Sequence

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from spectral_core.errors import counted

from .. import jobs
from ..drawing.text import text_width
from ..editing.waiting import is_waiting
from ..operators.render import SPECTRAL_OT_cost
from .parts import BUTTON_PIXELS, CLIP_PIXELS, ICON_PIXELS, column_room, wrapped
from .shared import ENGINE

LEFT_OUT = ("off", "none", "0")
BOX_PIXELS = 10.0
"""Unscaled pixels of the margins of a box in a panel."""
WORDS = {"rgb": "RGB", "uv": "UV", "on": "On", "off": "Off", "none": "None"}


class _RenderPanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES


class SPECTRAL_PT_render_sampling(_RenderPanel, bpy.types.Panel):
    """Samples and transport"""

    bl_label = "Sampling"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.spectral.render
        layout.prop(settings, "goal")
        if settings.goal == "ERROR":
            layout.prop(settings, "target_error")
        elif settings.goal == "TIME":
            layout.prop(settings, "time_budget")
        else:
            layout.prop(settings, "samples")
        layout.prop(context.scene.spectral.viewport, "samples", text="Viewport")
        layout.prop(settings, "seed")
        layout.prop(settings, "transport")
        layout.prop(settings, "denoise")
        if settings.denoise and (missing := jobs.missing_denoiser()):
            wrapped(layout.column(), context, missing)
        _draw_outcome(layout.column(), context)


class SPECTRAL_PT_render_cost(_RenderPanel, bpy.types.Panel):
    """Error against time, measured on some of the picture's pixels"""

    bl_label = "Cost"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout, settings = self.layout, context.scene.spectral.render
        layout.operator("spectral.cost", icon="FCURVE")
        if is_waiting(context.scene, SPECTRAL_OT_cost):
            wrapped(layout, context, "Measuring…; Esc stops it", icon="TIME")
            return
        if not len(settings.cost):
            hint = layout.column()
            hint.active = False
            wrapped(hint, context, "Renders parts of the picture and predicts error and time for other settings.")
        if settings.cost_summary:
            wrapped(layout, context, settings.cost_summary)
            wrapped(layout, context, "Noise and bias are in ΔE2000.")
        axis = ""
        for point in settings.cost:
            if point.axis != axis:
                axis = point.axis
                box = layout.box().column(align=True)
                _cost_row(box, (axis.capitalize(), "Time", "Noise", "Bias"))
            cells = (point.name, _duration(point.seconds), f"{point.delta_e:.2g}", f"{point.bias:.2g}")
            row = _cost_row(box, cells)
            row.active = point.is_measured


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _cost_row(layout: UILayout, cells: tuple[str, ...]) -> UILayout:
    row = layout.row(align=True)
    for cell in cells:
        row.label(text=cell)
    return row


def _draw_outcome(layout: UILayout, context: Context) -> None:
    """Prediction and outcome of the last render."""
    result = next((entry.result for entry in reversed(jobs.records) if entry.result is not None), None)
    if result is not None and result.denoised:
        done = layout.column()
        done.active = False
        wrapped(done, context, f"The last render was denoised by {result.denoised}.")
    if result is None or result.outcome is None or result.prediction is None:
        return
    said, found = result.prediction, result.outcome
    for title, item in (("Predicted", said), ("Reached", found)):
        row = layout.split(factor=0.4)
        row.active = False
        row.label(text=title)
        least = "at least " if item.rare is not None else ""
        row.label(
            text=f"{least}ΔE {item.delta_e:.2g}, {item.seconds:.1f} s, {counted(item.samples, 'sample', form='.0f')}"
        )
    if found.rare is not None:
        wrapped(layout.column(), context, found.rare.text)


class SPECTRAL_PT_render_plan(_RenderPanel, bpy.types.Panel):
    """Effects that the renderer will simulate, with reasons"""

    bl_label = "Plan"

    def draw(self, context: Context) -> None:
        layout, settings = self.layout, context.scene.spectral.render
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(settings, "tolerance")
        column.operator("spectral.plan", icon="VIEWZOOM")
        if not len(settings.plan):
            hint = layout.column()
            hint.active = False
            wrapped(
                hint,
                context,
                "The renderer simulates only the effects that the scene needs. Press the button to list them.",
            )
        simulated = [line for line in settings.plan if line.value not in LEFT_OUT]
        omitted = [line for line in settings.plan if line.value in LEFT_OUT]
        for title, lines in (("Simulated", simulated), ("Left out", omitted)):
            if lines:
                box = layout.box()
                head = box.split(factor=0.5)
                head.label(text=title, icon="RADIOBUT_ON" if lines is simulated else "RADIOBUT_OFF")
                if lines is omitted:
                    given = head.row()
                    given.alignment = "RIGHT"
                    given.label(text=f"all ΔE {settings.plan_accepted:.2g} at most")
                for line in lines:
                    _draw_decision(box, context, line)


def words(identifier: str) -> str:
    """Display name of an effect or of its value."""
    return WORDS.get(identifier) or identifier.replace("_", " ").capitalize()


def _name_share(context: Context, name: str, beside: Sequence[str]) -> float | None:
    """Share of the width of a box that a name with its icon needs beside buttons; None if there is no room for both,
    and Blender would cut off the name.
    """
    room = column_room(context, 1) - BOX_PIXELS
    needed = ICON_PIXELS + text_width(name, context) + BUTTON_PIXELS
    buttons = ICON_PIXELS + sum(text_width(text, context) + CLIP_PIXELS for text in beside)
    return needed / room if needed + buttons <= room else None


def _draw_decision(box: UILayout, context: Context, line: PropertyGroup) -> None:
    """Draw one decision: value, reason, and the other choices."""
    is_chosen_here = "|" in line.choices and line.is_overridable and not line.is_artists
    texts = [words(each) for each in (line.choices.split("|") if is_chosen_here else [line.value])]
    share = _name_share(context, words(line.name), texts)
    head = box.row() if share is None else box.split(factor=max(share, 0.5))
    head.label(text=words(line.name), icon="USER" if line.is_artists else "DOT")
    value = (box if share is None else head).row(align=True)
    value.alignment = "RIGHT"
    if line.is_artists:
        value.label(text=words(line.value))
        value.operator("spectral.plan_release", text="", icon="X").effect = line.name
    elif is_chosen_here:
        for choice in line.choices.split("|"):
            override = value.operator("spectral.plan_override", text=words(choice), depress=choice == line.value)
            override.effect, override.value = line.name, choice
    else:
        value.label(text=words(line.value))
        if line.is_overridable and not line.choices:
            override = value.operator("spectral.plan_override", text="", icon="GREASEPENCIL")
            override.effect, override.value = line.name, line.value
    reason = box.column()
    reason.active = False
    text = f"{line.reason}; without it: {line.cost}" if line.cost else line.reason
    wrapped(reason, context, f"{text[:1].upper()}{text[1:]}.", indent=60.0)
    wrapped(reason, context, _figures(line), indent=60.0)


def _figures(line: PropertyGroup) -> str:
    """Error of omitting an effect, and its share of the time, which one that is left out does not take."""
    is_left_out, share = line.value in LEFT_OUT, f"{100 * line.time_share:.0f} % of the time"
    if "ΔE" in line.cost:  # said above
        return f"It would take {share}." if is_left_out else f"It takes {share}."
    error = "Error not known" if line.error < 0 else f"ΔE {line.error:.2g} without it ({line.how})"
    return f"{error}; it would take {share}." if is_left_out else f"{error}, {share}."


class _PassesPanel(_RenderPanel):
    bl_context = "view_layer"
    bl_parent_id = "VIEWLAYER_PT_layer_passes"

    def column(self, heading: str = "") -> UILayout:
        """Draw a column of check boxes."""
        layout = self.layout  # type: ignore[attr-defined]
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout.column(heading=heading, align=True)


class SPECTRAL_PT_passes_data(_PassesPanel, bpy.types.Panel):
    """Passes of data at the first hit, and facts of the render"""

    bl_label = "Data Passes"

    def draw(self, context: Context) -> None:
        layer, cycles = context.view_layer, getattr(context.view_layer, "cycles", None)
        column = self.column("Include")
        for name in (
            "combined", "z", "mist", "position", "normal", "uv", "object_index", "material_index",
        ):  # fmt: skip
            column.prop(layer, f"use_pass_{name}")
        if hasattr(layer, "use_pass_grease_pencil"):  # from 5.0 on
            column.prop(layer, "use_pass_grease_pencil", text="Grease Pencil")
        if cycles is not None:
            column.prop(cycles, "denoising_store_passes", text="Denoising Data")
            column.prop(cycles, "pass_debug_sample_count", text="Sample Count")
        self.column().prop(layer, "pass_alpha_threshold")


class SPECTRAL_PT_passes_light(_PassesPanel, bpy.types.Panel):
    """Shares of the light of the picture"""

    bl_label = "Light Passes"

    def draw(self, context: Context) -> None:
        layer = context.view_layer
        for lobe in ("diffuse", "glossy", "transmission"):
            column = self.column(lobe.title())
            for what in ("direct", "indirect", "color"):
                column.prop(layer, f"use_pass_{lobe}_{what}", text=what.title())
        cycles = getattr(layer, "cycles", None)
        if cycles is not None:
            column = self.column("Volume")
            column.prop(cycles, "use_pass_volume_direct", text="Direct")
            column.prop(cycles, "use_pass_volume_indirect", text="Indirect")
        column = self.column("Other")
        column.prop(layer, "use_pass_emit", text="Emission")
        column.prop(layer, "use_pass_environment")


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_PT_render_sampling,
        SPECTRAL_PT_render_cost,
        SPECTRAL_PT_render_plan,
        SPECTRAL_PT_passes_data,
        SPECTRAL_PT_passes_light,
    )
)
