# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel "Light Dial" in the sidebar of the 3D view and of the image editor."""

import bpy
from bpy.types import ID, Context, PropertyGroup, UILayout

from spectral_core.render.relight.memory import stated_peak

from ..editing.dial.live import shares_of
from ..editing.dial.members import group_count
from ..editing.dial.names import name_of
from ..editing.dial.picture import lacks_view_transform
from ..operators.dial_drag import running
from ..operators.dial_record import recording_progress
from ..translate.camera import translate_film
from ..translate.dial import storage_of
from .parts import wrapped

LINEAR_ONLY = "Light adds up, so any mixture is exact. Surfaces do not: after changing one, record again."

WITHOUT_TRANSFORM = (
    "In Solid and Wireframe mode Blender shows the picture without the file's view transform and exposure. "
    "Rendered mode and the image editor show it as F12 does."
)


class SPECTRAL_UL_dial_bulbs(bpy.types.UIList):
    """Bulbs with their share"""

    shares: tuple[float, ...] = ()

    def draw_item(
        self,
        _context: Context,
        layout: UILayout,
        _data: ID,
        item: PropertyGroup,
        _icon: int,
        _active_data: ID,
        _active_name: str,
        index: int,
    ) -> None:
        row = layout.row(align=True)
        row.prop(item, "is_on", text="", icon="OUTLINER_OB_LIGHT" if item.is_on else "LIGHT", emboss=False)
        swatch = row.row()
        swatch.ui_units_x = 0.8
        swatch.prop(item, "color", text="")
        row.label(text=name_of(item), translate=False)
        share = row.row()
        share.alignment = "RIGHT"
        share.active = item.is_on
        share.label(text=f"{100 * self.shares[index]:.1f} %" if index < len(self.shares) else "")


class _DialPanel:
    layout: UILayout
    bl_label = "Light Dial"
    bl_region_type = "UI"
    bl_category = "Spectral"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        dial, layout = context.scene.spectral.dial, self.layout
        if dial.message:
            message = layout.column()
            message.alert = True
            wrapped(message, context, dial.message, icon="ERROR")
        if dial.changes:
            box = layout.box()
            box.alert = True
            wrapped(box, context, f"Changed since the recording: {dial.changes}", icon="ERROR", indent=60.0)
            row = box.row(align=True)
            row.operator("spectral.dial_record", text="Record What Changed", icon="REC").only_changed = True
            row.operator("spectral.dial_check", text="", icon="FILE_REFRESH")
        if len(dial.bulbs):
            _draw_dial(layout, context, dial)
        _draw_recording(layout, context, dial)


def _draw_dial(layout: UILayout, context: Context, dial: PropertyGroup) -> None:
    """Draw the controls that move the dial, show its picture, and apply it."""
    row = layout.row(align=True)
    row.scale_y = 1.3
    if context.window.as_pointer() in running:
        row.operator("spectral.dial_stop", icon="PAUSE", depress=True)
    else:
        row.operator("spectral.dial_play", icon="PLAY")
    row.prop(dial, "show", text="", icon="HIDE_OFF" if dial.show else "HIDE_ON")
    row.prop(dial, "over_camera", text="", icon="VIEW_CAMERA")
    row.operator("spectral.dial_show", text="", icon="IMAGE_DATA")
    row.operator("spectral.dial_reset", text="", icon="LOOP_BACK")
    if lacks_view_transform(context):
        hint = layout.column()
        hint.active = False
        wrapped(hint, context, WITHOUT_TRANSFORM, icon="INFO")
    shares = shares_of(dial)
    if not shares.any():
        warning = layout.column()
        warning.alert = True
        wrapped(warning, context, "All bulbs are off: nothing is lit", icon="ERROR")
    SPECTRAL_UL_dial_bulbs.shares = tuple(shares)
    layout.template_list("SPECTRAL_UL_dial_bulbs", "", dial, "bulbs", dial, "active", rows=3)
    column = layout.column()
    column.use_property_split = True
    column.prop(dial, "selector")
    column.prop(dial, "intensity")
    bulb = dial.bulbs[min(dial.active, len(dial.bulbs) - 1)]
    plain = layout.column()
    plain.use_property_split = True
    plain.use_property_decorate = False
    plain.label(text=name_of(bulb), icon="OUTLINER_OB_LIGHT" if bulb.is_on else "LIGHT", translate=False)
    plain.prop(bulb, "place")
    lamp = plain.row()
    lamp.enabled = dial.keeps_spectra
    lamp.prop(bulb, "lamp")
    row = layout.row(align=True)
    row.scale_y = 1.2
    row.operator("spectral.dial_apply", icon="CHECKMARK").restore = False
    row.operator("spectral.dial_apply", text="", icon="RECOVER_LAST").restore = True
    layout.operator("spectral.dial_bake", icon="LIGHT")
    layout.operator("spectral.dial_save", icon="FILE_TICK")


def _draw_recording(layout: UILayout, context: Context, dial: PropertyGroup) -> None:
    """Settings of a recording, with its memory and error before it is rendered."""
    box = layout.box()
    column = box.column()
    column.use_property_split = True
    column.use_property_decorate = False
    column.prop(dial, "storage")
    column.prop(dial, "one_per_light")
    column.prop(dial, "filepath")
    hint = box.column()
    hint.active = False
    scene = context.scene
    film = translate_film(scene, scene.spectral.render.samples, 0)
    stated = stated_peak(storage_of(dial), *film.size, group_count(context.view_layer, dial.one_per_light))
    wrapped(hint, context, f"Keeps {stated}.", indent=60.0)
    row = box.row(align=True)
    row.scale_y = 1.3
    progress = recording_progress.get(scene.session_uid)
    if progress is not None:
        row.progress(factor=progress, text=f"Recording {100 * progress:.0f} %; Esc stops it")
        return
    row.operator("spectral.dial_record", text="Record Again" if len(dial.bulbs) else "Record", icon="REC")
    row.operator("spectral.dial_load", text="", icon="FILE_FOLDER")
    if len(dial.bulbs):
        row.operator("spectral.dial_keep", text="", icon="FILE_TICK")
        row.operator("spectral.dial_check", text="", icon="FILE_REFRESH")
    if dial.facts:
        facts = box.column()
        facts.active = False
        wrapped(facts, context, f"Recorded: {dial.facts}", indent=60.0)
    note = box.column()
    note.active = False
    wrapped(note, context, LINEAR_ONLY, indent=60.0)


class SPECTRAL_PT_dial_view(_DialPanel, bpy.types.Panel):
    """The light dial beside the 3D view"""

    bl_space_type = "VIEW_3D"


class SPECTRAL_PT_dial_image(_DialPanel, bpy.types.Panel):
    """The light dial beside the picture"""

    bl_space_type = "IMAGE_EDITOR"


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_UL_dial_bulbs, SPECTRAL_PT_dial_view, SPECTRAL_PT_dial_image)
)
