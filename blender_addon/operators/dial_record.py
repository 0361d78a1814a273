# SPDX-License-Identifier: GPL-3.0-or-later
"""Record the contribution of each light to the picture, or load a recording; the dial gets its bulbs."""

import contextlib
import threading
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, Event, PropertyGroup, Scene
from bpy_extras.io_utils import ExportHelper, ImportHelper

from spectral_core.errors import FileWriteError, InvalidInputError, RenderCancelled, SpectralError

from ..editing.dial import changes, live
from ..editing.dial.members import Member, store_members
from ..editing.dial.recording import Recording, remember_recorded
from .common import UNDOABLE, chosen_path, reporting
from .dial import dial_in, reset

if TYPE_CHECKING:
    from spectral_core.render.relight.transport import Transport


def _keep(context: Context, recording: Recording) -> str:
    """Write the file, and create the bulbs; returns a note for the artist. Existing bulbs keep their coordinates.

    A recording that could not be written stays in memory for Save Transport, because it may have taken hours.
    """
    from spectral_core.render.relight.transport_file import write_transport

    if recording.error is not None:
        raise recording.error
    transport, dial = recording.transport, dial_in(context)
    path, unsaved = live.transport_path(dial), None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_transport(path, transport, only_over_transports=True)  # the path may come from a downloaded .blend
    except (SpectralError, OSError) as error:
        unsaved = error
    _take(context.scene, transport, recording.members)
    live.remember(context.scene, transport)
    remember_recorded(context.scene, recording)
    with contextlib.suppress(SpectralError):  # a group of unlike lights needs a lamp first: dial.message reports it
        live.show(context.scene)
    if unsaved is not None:
        raise FileWriteError(f"{unsaved}. The recording is in memory: write it elsewhere with Save Transport")
    if not dial.filepath and not bpy.data.filepath:
        return "; it is in a temporary folder, so keep it with Save Transport, or save the .blend before recording"
    return ""


def _take(scene: Scene, transport: "Transport", members: list[Member]) -> None:
    """Match the bulbs to a transport's light groups."""
    dial = scene.spectral.dial
    dial.scene_hash = ""  # no picture yet: the bulbs change one by one
    if tuple(bulb.name for bulb in dial.bulbs) != transport.groups:
        dial.bulbs.clear()
        for group in transport.groups:
            dial.bulbs.add().name = group
        reset(dial)
    dial.keeps_spectra = transport.storage.keeps_spectra
    if not dial.keeps_spectra:
        for bulb in dial.bulbs:
            bulb.lamp = ""
    store_members(dial.bulbs, members)
    _color_bulbs(dial, transport)
    width, height = transport.size
    dial.facts = f"{width}×{height}, {transport.samples} samples, {transport.storage.kind} storage"
    dial.message = ""
    dial.scene_hash = transport.scene_hash


def _color_bulbs(dial: PropertyGroup, transport: "Transport") -> None:
    """Give each bulb the color of its light; white if the lights of a group differ."""
    import numpy as np

    from spectral_core.spectra.color import display_rgb_from_linear, linear_rgb_from_xyz
    from spectral_core.spectra.observer import xyz_of

    for bulb, light in zip(dial.bulbs, transport.lights, strict=True):
        linear = np.ones(3) if light is None else np.maximum(linear_rgb_from_xyz(xyz_of(light)), 0.0)
        bulb.color = display_rgb_from_linear(linear / max(float(linear.max()), 1e-9))


class SPECTRAL_OT_dial_record(bpy.types.Operator):
    """Render the contribution of each light, so that lights can be mixed later without rendering. Esc stops it"""

    bl_idname = "spectral.dial_record"
    bl_label = "Record"
    bl_options = UNDOABLE

    only_changed: BoolProperty(
        name="Only What Changed",
        description="Render the lights that were changed or added since the recording, and keep the others. Where "
        "anything else has changed, such as an object or a material, all lights are rendered",
        options={"SKIP_SAVE"},
    )

    @reporting
    def execute(self, context: Context) -> None:
        recording = Recording.of(context, only_changed=self.only_changed)
        recording.run()
        note = _keep(context, recording)
        self.report({"WARNING" if note else "INFO"}, f"recorded: {dial_in(context).facts}{recording.told}{note}")

    def invoke(self, context: Context, _event: Event) -> set[str]:
        try:
            self._recording = Recording.of(context, only_changed=self.only_changed)
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

    def modal(self, context: Context, event: Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            self._recording.stop = True
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}  # the artist may continue to work; the dial shows the edits afterward
        context.window_manager.progress_update(100 * self._recording.progress)
        if self._recording.is_running:
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        return self._finish(context)

    def _finish(self, context: Context) -> set[str]:
        try:
            note = _keep(context, self._recording)
        except RenderCancelled:
            self.report({"WARNING"}, "stopped; the dial is unchanged")
            return {"CANCELLED"}
        except (SpectralError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        changes.compare(context.scene)
        live.redraw_dial()
        if note or self._recording.told:
            self.report({"WARNING" if note else "INFO"}, f"recorded{self._recording.told}{note}")
        return {"FINISHED"}


class SPECTRAL_OT_dial_keep(bpy.types.Operator, ExportHelper):
    """Write the recorded transport to a file of your choice, which the dial then uses"""

    bl_idname = "spectral.dial_keep"
    bl_label = "Save Transport"
    bl_options = UNDOABLE
    filename_ext = ".exr"
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.render.relight.transport_file import write_transport

        transport = live.live_mix(context.scene).transport
        write_transport(chosen_path(self.filepath), transport)
        dial_in(context).filepath = self.filepath
        live.remember(context.scene, transport)
        self.report({"INFO"}, f"saved {self.filepath}")


class SPECTRAL_OT_dial_load(bpy.types.Operator, ImportHelper):
    """Load a transport that was recorded earlier from this scene, here or by the command line"""

    bl_idname = "spectral.dial_load"
    bl_label = "Load Transport"
    bl_options = UNDOABLE
    filename_ext = ".exr"
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    @reporting
    def execute(self, context: Context) -> None:
        from spectral_core.render.relight.transport_file import read_transport
        from spectral_core.scene import scene_hash

        path = chosen_path(self.filepath)
        recording, dial = Recording.of(context), dial_in(context)

        transport = read_transport(path, scene_hash=scene_hash(recording.scene))
        _require_grouping(transport, recording)
        dial.filepath = self.filepath
        _take(context.scene, transport, recording.members)
        live.remember(context.scene, transport)
        remember_recorded(context.scene, recording)
        live.show(context.scene)


def _require_grouping(transport: "Transport", recording: Recording) -> None:
    known = {member.group for member in recording.members}
    strange = [group for group in transport.groups if group not in known]
    if strange:
        raise InvalidInputError(
            f"the file has light groups {', '.join(map(repr, transport.groups))}; this scene has "
            f"{', '.join(map(repr, sorted(known)))}. Was it recorded with One per Light {_other(recording)}?"
        )


def _other(recording: Recording) -> str:
    return "off" if recording.one_per_light else "on"


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_dial_record, SPECTRAL_OT_dial_keep, SPECTRAL_OT_dial_load)
)
