# SPDX-License-Identifier: GPL-3.0-or-later
"""The light dial without a mouse: reset it, show its picture, write the picture to files."""

from collections.abc import Callable

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, PropertyGroup, Scene
from bpy_extras.io_utils import ExportHelper

from spectral_core.errors import InvalidInputError, RenderCancelled, SpectralError

from ..editing.dial import changes, live
from ..editing.dial.picture import look
from ..editing.dial.saving import Saving
from ..editing.waiting import WaitingForFile
from .common import UNDOABLE, chosen_path, reporting, require_kept


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
        require_kept(context.scene, "light dial")
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


class SPECTRAL_OT_dial_save(WaitingForFile, bpy.types.Operator, ExportHelper):
    """Write the relit picture to a file; with Animation one for each frame, as the selector is keyframed. Esc stops"""

    bl_idname = "spectral.dial_save"
    bl_label = "Save Relit Picture"
    bl_options: set[str] = set()
    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png;*.exr", options={"HIDDEN"})
    animation: BoolProperty(name="Animation", default=False, description="Write all frames, as numbered files")
    check_extension = None

    _saving: Saving | None = None
    _error: Exception | None = None

    def prepare(self, context: Context, *, at_once: bool) -> None:
        scene = context.scene
        frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step) if self.animation else ()
        self._error = None
        self._saving = Saving(scene, chosen_path(self.filepath), frames, at_once=at_once)
        while at_once and not self.is_prepared():
            pass

    def is_prepared(self) -> bool:
        if self._saving is None or self._error is not None:
            return True
        try:
            return self._saving.step()
        except (SpectralError, OSError) as error:
            self._error = error  # `begin` raises it
            return True

    def begin(self, context: Context) -> Callable[[], None]:
        assert self._saving is not None
        if self._error is not None:
            raise self._error
        return self._saving.wait

    def end(self, scene: Scene, answer: None) -> None:
        assert self._saving is not None
        self._saving.finish()
        others = self._saving.total - 1
        saved = f"{self._saving.first} and {others} more" if others else self.filepath
        still = f"; all frames show the scene as it was recorded, but {self._saving.moved}: F12 renders its motion"
        moved = self._saving.moved
        self.report({"WARNING" if moved else "INFO"}, f"saved {saved}{still if moved else ''}")

    def stop(self) -> None:
        super().stop()
        if self._saving is not None:
            self._error = RenderCancelled(f"stopped after {self._saving.saved} of {self._saving.total} pictures")

    def progress_text(self) -> str:
        saving = self._saving
        return "" if saving is None or saving.total < 2 else f"{saving.saved} of {saving.total}"

    def leave(self) -> None:
        if self._saving is not None:
            self._saving.end()


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_dial_reset, SPECTRAL_OT_dial_show, SPECTRAL_OT_dial_check, SPECTRAL_OT_dial_save)
)
