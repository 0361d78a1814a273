# SPDX-License-Identifier: GPL-3.0-or-later
"""Render settings, and the plan: which effects are simulated, why, and the error without them."""

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from .parts import wrapped

ENGINE = "SPECTRAL"
LEFT_OUT = ("off", "none")
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
        layout.prop(settings, "samples")
        layout.prop(context.scene.spectral.viewport, "samples")
        layout.prop(settings, "seed")
        layout.prop(settings, "transport")


class SPECTRAL_PT_render_plan(_RenderPanel, bpy.types.Panel):
    """Which effects the renderer will simulate, and why"""

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
    """An effect or its value as a person writes it."""
    return WORDS.get(identifier) or identifier.replace("_", " ").capitalize()


def _draw_decision(box: UILayout, context: Context, line: PropertyGroup) -> None:
    """One decision: what, why, and the other choices."""
    head = box.split(factor=0.5)
    head.label(text=words(line.name), icon="USER" if line.is_artists else "DOT")
    value = head.row(align=True)
    value.alignment = "RIGHT"
    if line.is_artists:
        value.label(text=words(line.value))
        value.operator("spectral.plan_release", text="", icon="X").effect = line.name
    elif line.is_overridable and "|" in line.choices:
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
    text = f"{line.reason}; without it {line.cost}" if line.cost else line.reason
    wrapped(reason, context, f"{text[:1].upper()}{text[1:]}.", indent=60.0)
    wrapped(reason, context, _figures(line), indent=60.0)


def _figures(line: PropertyGroup) -> str:
    """Error of leaving an effect out, and its share of the time."""
    error = "error not known" if line.error < 0 else f"ΔE {line.error:.2g} without it ({line.how})"
    return f"{error}, {line.time_share:.0%} of the time"


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_PT_render_sampling, SPECTRAL_PT_render_plan))
