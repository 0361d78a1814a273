# SPDX-License-Identifier: GPL-3.0-or-later
"""Record what each light brings, and set the dial: reset, load, picture to a file."""

import contextlib
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from spectral_core.errors import InvalidInputError, RenderCancelled, SpectralError

from .. import jobs
from ..properties import light_dial_live as live
from ..properties.light_dial import storage_of
from ..properties.light_dial_members import Member, members_of, store_members
from .common import UNDOABLE, reporting


def dial_in(context):
    """The light dial of the scene that is being looked at."""
    return context.scene.spectral.dial


@dataclass
class _Recording:
    """A transport render: everything it needs of Blender was read before it starts, so a thread may run it."""

    scene: Any
    storage: Any
    one_per_light: bool
    members: list[Member]
    progress: float = 0.0
    stop: bool = False
    transport: Any = None
    error: Exception | None = None
    thread: threading.Thread | None = field(default=None, repr=False)

    @classmethod
    def of(cls, context):
        """Translate the scene and find what shines in it."""
        from ..translate.scene import translate_scene

        dial, depsgraph = dial_in(context), context.evaluated_depsgraph_get()
        shown = {instance.object.original for instance in depsgraph.object_instances}
        members = members_of(context.scene, shown, dial.one_per_light)
        return cls(translate_scene(depsgraph), storage_of(dial), dial.one_per_light, members)

    def run(self) -> None:
        """Render; an error is kept for whoever waits."""
        from spectral_core.render.relight.transport import record_transport

        try:
            self.transport = record_transport(
                self.scene, self.storage, one_per_light=self.one_per_light, render=jobs.render,
                on_progress=self._note, should_stop=lambda: self.stop,
            )  # fmt: skip
        except Exception as error:
            self.error = error

    def _note(self, progress) -> None:
        self.progress = progress.samples / progress.total


def _keep(context, recording: _Recording) -> None:
    """Write the file, give the dial its bulbs. Bulbs that were there before keep their places."""
    from spectral_core.render.relight.transport_file import write_transport

    if recording.error is not None:
        raise recording.error
    transport, dial = recording.transport, dial_in(context)
    path = live.transport_path(dial)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_transport(path, transport)
    _take(context.scene, transport, recording.members)
    live.remember(context.scene, transport)
    with contextlib.suppress(SpectralError):  # a group of unlike lights needs a lamp first: dial.message says it
        live.show(context.scene)


def _take(scene, transport, members: list[Member]) -> None:
    """Fit the dial to a transport's light groups."""
    dial = scene.spectral.dial
    dial.scene_hash = ""  # no picture yet: the bulbs change one by one
    if tuple(bulb.name for bulb in dial.bulbs) != transport.groups:
        dial.bulbs.clear()
        for group in transport.groups:
            dial.bulbs.add().name = group
        _reset(dial)
    if transport.storage.kind == "dial":
        for bulb in dial.bulbs:
            bulb.lamp = ""
    store_members(dial.bulbs, members)
    _color_bulbs(dial, transport)
    width, height = transport.size
    dial.facts = f"{width}×{height}, {transport.samples} samples, {transport.storage.kind} storage"
    dial.message = ""
    dial.scene_hash = transport.scene_hash


def _color_bulbs(dial, transport) -> None:
    """Each bulb looks as its light does; white where a group's lights differ."""
    import numpy as np

    from spectral_core.color import display_rgb_from_linear, linear_rgb_from_xyz
    from spectral_core.observer import xyz_of

    for bulb, light in zip(dial.bulbs, transport.lights, strict=True):
        linear = np.ones(3) if light is None else np.maximum(linear_rgb_from_xyz(xyz_of(light)), 0.0)
        bulb.color = display_rgb_from_linear(linear / max(float(linear.max()), 1e-9))


def _reset(dial) -> None:
    """Bulbs on their polygon and on, the selector in the middle, the light as recorded."""
    from spectral_core.render.relight.dial import bulbs_on_polygon

    count = len(dial.bulbs)
    places = bulbs_on_polygon(count) if count > 1 else [(0.0, 0.0)]
    for bulb, place in zip(dial.bulbs, places, strict=True):
        bulb.place, bulb.is_on = place, True
    dial.selector = (0.0, 0.0)
    dial.intensity = float(count)


class SPECTRAL_OT_dial_record(bpy.types.Operator):
    """Render what each light brings to the picture, so that the light can be decided later. Esc stops it"""

    bl_idname = "spectral.dial_record"
    bl_label = "Record"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context):
        recording = _Recording.of(context)
        recording.run()
        _keep(context, recording)
        self.report({"INFO"}, f"recorded: {dial_in(context).facts}")

    def invoke(self, context, _event):
        try:
            self._recording = _Recording.of(context)
        except SpectralError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._recording.thread = threading.Thread(target=self._recording.run, daemon=True)
        self._recording.thread.start()
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.1, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._recording.stop = True
        if event.type != "TIMER":
            return {
                "RUNNING_MODAL"
            }  # the scene must not change under the render's feet: its lights are kept at the end
        context.window_manager.progress_update(100 * self._recording.progress)
        if self._recording.thread.is_alive():
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        return self._finish(context)

    def _finish(self, context):
        try:
            _keep(context, self._recording)
        except RenderCancelled:
            self.report({"WARNING"}, "stopped; the dial is as it was")
            return {"CANCELLED"}
        except (SpectralError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        live.redraw()
        return {"FINISHED"}


class SPECTRAL_OT_dial_load(bpy.types.Operator, ImportHelper):
    """Use a transport that was recorded before from this very scene, here or by the command line"""

    bl_idname = "spectral.dial_load"
    bl_label = "Load Transport"
    bl_options = UNDOABLE
    filename_ext = ".exr"
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    @reporting
    def execute(self, context):
        from spectral_core.render.relight.transport_file import read_transport
        from spectral_core.scene import scene_hash

        path = bpy.path.abspath(self.filepath)
        recording, dial = _Recording.of(context), dial_in(context)

        transport = read_transport(Path(path), scene_hash=scene_hash(recording.scene))
        _require_grouping(transport, recording)
        dial.filepath = self.filepath
        _take(context.scene, transport, recording.members)
        live.remember(context.scene, transport)
        live.show(context.scene)


def _require_grouping(transport, recording: _Recording) -> None:
    known = {member.group for member in recording.members}
    strange = [group for group in transport.groups if group not in known]
    if strange:
        raise InvalidInputError(
            f"the file has light groups {', '.join(map(repr, transport.groups))}; this scene has "
            f"{', '.join(map(repr, sorted(known)))}. Was it recorded with One per Light {_other(recording)}?"
        )


def _other(recording: _Recording) -> str:
    return "off" if recording.one_per_light else "on"


class SPECTRAL_OT_dial_reset(bpy.types.Operator):
    """Bulbs back on a regular polygon and on, the selector in the middle: the light as it was recorded"""

    bl_idname = "spectral.dial_reset"
    bl_label = "Reset Dial"
    bl_options = UNDOABLE

    @reporting
    def execute(self, context):
        dial = dial_in(context)
        if not len(dial.bulbs):
            raise InvalidInputError("the dial has no bulbs yet; press Record")
        _reset(dial)


class SPECTRAL_OT_dial_show(bpy.types.Operator):
    """Relight now, and show the picture in an image editor"""

    bl_idname = "spectral.dial_show"
    bl_label = "Show Picture"
    bl_options = set()

    @reporting
    def execute(self, context):
        image = live.show(context.scene)
        screen = context.screen
        editors = [area for area in screen.areas if area.type == "IMAGE_EDITOR"] if screen else []
        for area in editors[:1]:
            area.spaces.active.image = image


class SPECTRAL_OT_dial_save(bpy.types.Operator, ExportHelper):
    """Write the relit picture to a file; with Animation one for each frame, as the selector is keyframed"""

    bl_idname = "spectral.dial_save"
    bl_label = "Save Relit Picture"
    bl_options = set()
    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png;*.exr", options={"HIDDEN"})
    animation: BoolProperty(name="Animation", default=False, description="All frames of the scene, numbered")
    check_extension = None

    @reporting
    def execute(self, context):

        scene, path = context.scene, Path(bpy.path.abspath(self.filepath))
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


def _write_picture(scene, path) -> None:
    """PNG as the scene's view transform shows it, EXR in linear light."""
    image = live.show(scene)
    if path.suffix.lower() == ".exr":
        image.filepath_raw, image.file_format = str(path), "OPEN_EXR"
        image.save()
        return
    from .. import compat

    settings = scene.render.image_settings
    kept = {
        name: getattr(settings, name) for name in ("media_type", "file_format", "color_mode") if hasattr(settings, name)
    }
    try:
        compat.set_image_format(settings, "PNG", color_mode="RGB")
        image.save_render(str(path), scene=scene)
    finally:
        for name, value in kept.items():
            setattr(settings, name, value)


register, unregister = bpy.utils.register_classes_factory(
    (
        SPECTRAL_OT_dial_record,
        SPECTRAL_OT_dial_load,
        SPECTRAL_OT_dial_reset,
        SPECTRAL_OT_dial_show,
        SPECTRAL_OT_dial_save,
    )
)
