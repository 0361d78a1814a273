# SPDX-License-Identifier: GPL-3.0-or-later
"""Look under a light with one click, and drag the divider of a split view."""

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Event

from spectral_core.errors import InvalidInputError

from ...drawing.covered import covered
from ...drawing.split import is_split
from ...properties.viewport import LOOKS
from ..common import ends_drag, reporting, require_kept

GRIP_PIXELS = 12.0
"""Largest distance of a press from the divider that starts a drag."""


class SPECTRAL_OT_look_under(bpy.types.Operator):
    """Show the scene under this light in Rendered viewports and in renders; click again for the scene as it is"""

    bl_idname = "spectral.look_under"
    bl_label = "Look Under"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(items=LOOKS, name="Look", description="Light to look under")
    name: StringProperty(
        name="Name", options={"SKIP_SAVE"}, description="Name of the palette light, light group or lamp"
    )
    side: EnumProperty(
        items=[("look", "Left", "The whole view, or its left side"), ("other", "Right", "The right side")],
        name="Side",
        description="Side of a split view",
    )

    @reporting
    def execute(self, context: Context) -> set[str]:
        """Set the look. Raises InvalidInputError if the scene is linked."""
        require_kept(context.scene, "look")
        look = getattr(context.scene.spectral.viewport, self.side)
        if self.kind == look.kind and (self.kind == "SCENE" or getattr(look, self.kind.lower()) == self.name):
            look.kind = "SCENE"
            return {"FINISHED"}
        if self.kind != "SCENE":
            setattr(look, self.kind.lower(), self.name)
        look.kind = self.kind
        return {"FINISHED"}


class SPECTRAL_OT_look_split(bpy.types.Operator):
    """Show the scene side by side under the chosen light and another one"""

    bl_idname = "spectral.look_split"
    bl_label = "Split View"
    bl_options = {"REGISTER", "UNDO"}

    @reporting
    def execute(self, context: Context) -> set[str]:
        """Split the view, or make it whole again. Raises InvalidInputError if the scene is linked."""
        require_kept(context.scene, "look")
        settings = context.scene.spectral.viewport
        settings.is_split = not settings.is_split
        if settings.is_split and settings.look.kind == settings.other.kind == "SCENE":
            columns = context.scene.spectral.palette.lights.keys()
            for look, name in zip((settings.look, settings.other), columns, strict=False):
                look.column, look.kind = name, "COLUMN"
            if len(columns) < 2:
                settings.other.lamp, settings.other.kind = "HP1", "LAMP"
        return {"FINISHED"}


class SPECTRAL_OT_look_divide(bpy.types.Operator):
    """Drag the divider of a split view"""

    bl_idname = "spectral.look_divide"
    bl_label = "Drag Divider"
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Only over a split view."""
        return is_split(context.space_data, context.scene)

    def invoke(self, context: Context, event: Event) -> set[str]:
        """Start the drag if the press is near the divider."""
        region, settings = context.region, context.scene.spectral.viewport
        scale = context.preferences.system.ui_scale
        if region.type != "WINDOW" or abs(event.mouse_region_x - settings.divider * region.width) > GRIP_PIXELS * scale:
            return {"PASS_THROUGH"}
        try:
            require_kept(context.scene, "look")
        except InvalidInputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.before, self.scene = settings.divider, context.scene.session_uid
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> set[str]:
        """Follow the mouse until its button is released, or the editor or its scene is another one."""
        if event.type.startswith("TIMER"):  # of an animation that is played, or of a recording
            return {"PASS_THROUGH"}
        settings, region = context.scene.spectral.viewport, context.region
        if context.area is None or region is None or context.scene.session_uid != self.scene:
            return {"FINISHED"}  # a script has closed the editor, or shows another workspace or scene
        if event.type == "MOUSEMOVE":
            known = covered(context.area, region)  # below a sidebar no mouse reaches the divider again
            to = min(max(event.mouse_region_x, known.left), region.width - known.right)
            settings.divider = min(max(to / max(region.width, 1), 0.0), 1.0)
        elif event.type in ("ESC", "RIGHTMOUSE"):
            settings.divider = self.before
            return {"CANCELLED"}
        elif ends_drag(event):
            return {"FINISHED"}
        return {"RUNNING_MODAL"}


CLASSES = (SPECTRAL_OT_look_under, SPECTRAL_OT_look_split, SPECTRAL_OT_look_divide)
_keys: list = []


def register() -> None:
    """Register the operators, and the key map entry of the divider."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    manager = bpy.context.window_manager
    keys = manager.keyconfigs.addon if manager is not None and manager.keyconfigs else None
    if keys is not None:
        keymap = keys.keymaps.new(name="3D View", space_type="VIEW_3D")
        _keys.append((keymap, keymap.keymap_items.new("spectral.look_divide", "LEFTMOUSE", "PRESS", head=True)))


def unregister() -> None:
    """Remove all of them."""
    while _keys:
        keymap, item = _keys.pop()
        keymap.keymap_items.remove(item)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
