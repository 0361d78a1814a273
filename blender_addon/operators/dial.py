# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial without a mouse: reset it, show its picture, write the picture to files."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, PropertyGroup, Scene
from bpy_extras.io_utils import ExportHelper

from spectral_core.errors import InvalidInputError
from spectral_core.files.whole import whole_file

from .. import compat
from ..editing.dial import changes, live
from ..editing.dial.picture import look
from .common import UNDOABLE, chosen_path, reporting


def dial_in(context: Context) -> PropertyGroup:
    """The light dial of the scene in the window."""
    return context.scene.spectral.dial


def reset(dial: PropertyGroup) -> None:
    """Reset the dial: bulbs on their polygon and switched on, the selector at the center, the light as recorded."""
    from spectral_core.render.relight.dial import bulbs_on_polygon

    count = len(dial.bulbs)
    places = bulbs_on_polygon(count) if count > 1 else [(0.0, 0.0)]
    for bulb, place in zip(dial.bulbs, places, strict=True):
        bulb.place, bulb.is_on = place, True
    dial.selector = (0.0, 0.0)
    dial.intensity = float(count)


class SPECTRAL_OT_dial_reset(bpy.types.Operator):
    """Reset the dial: bulbs on a regular polygon and switched on, the selector at the center, the light as recorded"""

    bl_idname = "spectral.dial_reset"
    bl_label = "Reset Dial"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context: Context) -> None:
        dial = dial_in(context)
        if not len(dial.bulbs):
            raise InvalidInputError("the dial has no bulbs yet; press Record")
        reset(dial)


class SPECTRAL_OT_dial_show(bpy.types.Operator):
    """Relight now, and show the picture: in an image editor, or over the camera view"""

    bl_idname = "spectral.dial_show"
    bl_label = "Show Picture"
    bl_options: set[str] = set()

    @reporting
    def execute(self, context: Context) -> None:
        image = live.show(context.scene)
        if not look(context, image) and context.screen:
            self.report({"INFO"}, "this workspace has neither a 3D view nor an image editor to show the picture in")


class SPECTRAL_OT_dial_check(bpy.types.Operator):
    """Compare the scene with the recording, and list the changes since"""

    bl_idname = "spectral.dial_check"
    bl_label = "Compare"
    bl_options: set[str] = set()

    @reporting
    def execute(self, context: Context) -> None:
        if not dial_in(context).scene_hash:
            raise InvalidInputError("no transport is recorded yet; press Record")
        found = changes.compare(context.scene)
        self.report({"WARNING" if found else "INFO"}, found or "the scene is unchanged since the recording")


class SPECTRAL_OT_dial_save(bpy.types.Operator, ExportHelper):
    """Write the relit picture to a file; with Animation one for each frame, as the selector is keyframed"""

    bl_idname = "spectral.dial_save"
    bl_label = "Save Relit Picture"
    bl_options: set[str] = set()
    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png;*.exr", options={"HIDDEN"})
    animation: BoolProperty(name="Animation", default=False, description="All frames of the scene, numbered")
    check_extension = None

    @reporting
    def execute(self, context: Context) -> None:

        scene, path = context.scene, chosen_path(self.filepath)
        if path.suffix.lower() not in (".png", ".exr"):
            raise InvalidInputError(f"{path.name} is neither .png nor .exr")
        if not self.animation:
            _write_picture(scene, path)
            return
        before = scene.frame_current
        try:
            for frame in range(scene.frame_start, scene.frame_end + 1, scene.frame_step):
                scene.frame_set(frame)
                _write_picture(scene, path.with_name(f"{path.stem}{frame:04d}{path.suffix}"))
        finally:
            scene.frame_set(before)


def _write_picture(scene: Scene, path: Path) -> None:
    """PNG with the scene's view transform, EXR in linear light."""
    image = live.show(scene)
    if path.suffix.lower() == ".exr":
        with whole_file(path) as unfinished:
            image.file_format = "OPEN_EXR"
            image.save(filepath=str(unfinished), save_copy=True)
        return
    with compat.image_format(scene.render, "PNG", color_mode="RGB"), whole_file(path) as unfinished:
        image.save_render(str(unfinished), scene=scene)


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_dial_reset, SPECTRAL_OT_dial_show, SPECTRAL_OT_dial_check, SPECTRAL_OT_dial_save)
)
