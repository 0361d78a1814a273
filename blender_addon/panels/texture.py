# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Spectral Texture" in the sidebar of the 3D view."""

import bpy
from bpy.types import Context, PropertyGroup, UILayout

from ..editing import texture_job
from ..translate.texture.costs import given_contrast, realism_words
from .parts import draw_source, wrapped


class SPECTRAL_PT_texture(bpy.types.Panel):
    """Two pictures in one surface: the second appears when the light changes"""

    bl_label = "Spectral Texture"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Spectral"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        design, layout = context.scene.spectral.texture, self.layout
        layout.prop(design, "kind", text="")
        _draw_picture(layout, design, "first", "Under the first light" if design.kind == "TWO" else "The picture")
        if design.kind == "TWO":
            _draw_picture(layout, design, "second", "Under the second light")
        _draw_lights(layout, context, design)
        if design.kind == "ONE":
            _draw_wanted_colors(layout, design)
        else:
            _draw_mapping(layout, design)
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(design, "folder")
        _draw_run(layout, context, design)
        _draw_outcome(layout, context, design)


def _draw_picture(layout: UILayout, design: PropertyGroup, name: str, label: str) -> None:
    column = layout.column(align=True)
    column.label(text=label, icon="IMAGE_DATA")
    column.template_ID(design, name, open="image.open")
    image = getattr(design, name)
    if image is not None:
        row = column.row()
        row.active = False
        row.label(text=f"{image.size[0]} × {image.size[1]} texels")


def _draw_lights(layout: UILayout, context: Context, design: PropertyGroup) -> None:
    box = layout.box()
    box.label(text="Lights", icon="LIGHT")
    if design.kind == "TWO":
        box.row(align=True).prop(design, "lights", expand=True)
    if design.kind == "TWO" and design.lights == "DESIGNED":
        column = box.column(align=True)
        column.prop(design, "daylight_share", slider=True)
        column.prop(design, "led_width_nm", slider=True)
        for line in realism_words(design.daylight_share, design.led_width_nm):
            wrapped(box, context, line, indent=60.0)
        return
    for number in (1, 2):
        holder = getattr(design, f"light_{number}").spectral
        box.label(text="The picture is seen under:" if number == 1 else "And then under:")
        draw_source(box, holder)
        if holder.message:
            wrapped(box, context, holder.message, icon="ERROR", indent=60.0)
    if design.kind == "TWO":
        wrapped(box, context, given_contrast(design), icon="INFO", indent=60.0)


def _draw_mapping(layout: UILayout, design: PropertyGroup) -> None:
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    column.prop(design, "mapping", text="If Impossible")
    column.prop(design, "floor")
    row = column.row()
    row.enabled = design.mapping == "least_delta_e"
    row.prop(design, "slope")
    column.prop(design, "spectra")
    column.prop(design, "importance", text="1st over 2nd")


def _draw_wanted_colors(layout: UILayout, design: PropertyGroup) -> None:
    box = layout.box()
    head = box.row(align=True)
    head.label(text="Wanted colors: this color → looks like")
    head.operator("spectral.texture_wanted_color", text="", icon="ADD").index = -1
    for index, wanted in enumerate(design.wanted_colors):
        row = box.row(align=True)
        row.prop(wanted, "color", text="")
        row.label(text="", icon="FORWARD")
        row.prop(wanted, "wanted", text="")
        row.operator("spectral.texture_wanted_color", text="", icon="X").index = index
        if wanted.outcome:
            row = box.split(factor=0.62, align=True)
            row.label(text=wanted.outcome)
            row.prop(wanted, "reached", text="")


def _draw_run(layout: UILayout, context: Context, design: PropertyGroup) -> None:
    row = layout.row(align=True)
    row.scale_y = 1.3
    if texture_job.running():  # of this scene, or of another scene of the file
        designed = texture_job.scene_of_job() or context.scene
        job, whose = designed.spectral.texture, "" if designed == context.scene else f"{designed.name}: "
        row.progress(factor=job.progress, text=f"{whose}{job.status}")
        row.operator("spectral.texture_cancel", text="", icon="X")
        return
    row.operator("spectral.texture_design", icon="PLAY")
    if design.status:
        column = layout.column()
        column.alert = design.failed
        wrapped(column, context, design.status, icon="ERROR" if design.failed else "INFO")


def _draw_outcome(layout: UILayout, context: Context, design: PropertyGroup) -> None:
    if not design.texture_file or texture_job.scene_of_job() == context.scene:
        return
    row = layout.row()
    row.scale_y = 1.2
    row.operator("spectral.texture_material", icon="MATERIAL")
    column = layout.column(align=True)
    column.label(text="Lamps that get the lights:", icon="LIGHT")
    column.prop(design, "lamp_1", text="")
    column.prop(design, "lamp_2", text="")
    column.operator("spectral.texture_lights", icon="LIGHT")
    box = layout.box()
    for line in design.report.splitlines():
        wrapped(box, context, line, indent=60.0)
    lost = [image for image in (design.lost_1, design.lost_2) if image is not None and image.preview is not None]
    if lost:
        box.label(text="Lost at each texel; white is ΔE 10:")
        row = box.row()
        for image in lost:
            row.template_icon(image.preview.icon_id, scale=5.0)


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_PT_texture,))
