# SPDX-License-Identifier: GPL-3.0-or-later
"""Record the contribution of each light to the picture, or load a recording; the dial gets its bulbs."""

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy.types import Context, Event, Scene
from bpy_extras.io_utils import ExportHelper, ImportHelper

from spectral_core.errors import InvalidInputError, RenderCancelled, SpectralError, counted

from ..drawing.clock import clock
from ..editing.deferred import open_scene
from ..editing.dial import changes, kept_mix, live
from ..editing.dial.as_rendered import AsRendered
from ..editing.dial.members import Member, color_bulbs, store_members
from ..editing.dial.names import dark_bulbs_besides, match_bulbs
from ..editing.dial.paths import follow_recording, is_temporary, path_for_recording, require_ending, transport_path
from ..editing.dial.recording import Recorded, Recording, recorded_in_file, remember_recorded, told
from ..editing.dial.rendered_parts import scene_state
from ..editing.dial.view_process import TableAhead
from ..editing.waiting import Waiting, WaitingForFile
from ..translate.dial import storage_name
from .common import UNDOABLE, chosen_path
from .dial import reset

if TYPE_CHECKING:
    from spectral_core.render.relight.mix import LiveMix
    from spectral_core.render.relight.transport import Transport


REST_S = 0.3
"""Time without an edit until a scene that was edited while it was translated is translated again."""


def _keep(scene: Scene, recording: Recording, recorded: Recorded) -> str:
    """Create the bulbs, where existing ones stay in place, and keep the transport in memory; returns a note."""
    dial = scene.spectral.dial
    kept_mix.remember(scene, recorded.mix)  # first: whatever fails later, the recording may have taken hours
    dark = dark_bulbs_besides(dial.bulbs, recorded.mix.transport.groups)
    gone = _take(scene, recorded.mix.transport, recording.members)
    remember_recorded(scene, recording)
    _show(scene)
    notes = [f"of {gone} of its lights the objects were deleted meanwhile, so Apply cannot dim them"] if gone else []
    lost = f"lights that Apply made dark have no bulb now ({dark}): to keep them undo, Restore, and record"
    notes += [lost] if dark else []
    if recorded.unsaved is None:
        follow_recording(scene, recorded.path)
    if is_temporary(dial):
        notes.append("it is in a temporary folder, so save the .blend, or keep it with Save Transport")
    return "".join(f"; {note}" for note in notes)


def _show(scene: Scene) -> None:
    """Show a new recording, or none: a group of unlike lights needs a lamp first, as dial.message reports."""
    try:
        live.show(scene)
    except SpectralError:
        live.uncover(scene)  # the picture is that of the earlier recording


def _take(scene: Scene, transport: "Transport", members: list[Member]) -> int:
    """Match the bulbs to a transport's light groups; returns the number of lights that were deleted meanwhile."""
    dial = scene.spectral.dial
    dial.scene_hash = ""  # no picture yet: the bulbs change one by one
    if match_bulbs(dial.bulbs, transport.groups):
        reset(dial)
    dial.keeps_spectra = transport.storage.keeps_spectra
    if not dial.keeps_spectra:
        for bulb in dial.bulbs:
            bulb.lamp = ""
    gone = store_members(dial.bulbs, members)
    color_bulbs(dial.bulbs, transport.lights)
    width, height = transport.size
    dial.facts = f"{width}×{height}, {counted(transport.samples, 'sample')}, {storage_name(transport.storage)}"
    dial.message = ""
    dial.scene_hash = transport.scene_hash
    return gone


_under_way: set[int] = set()
"""Session numbers of the scenes that are translated or recorded."""
recording_progress: dict[int, float] = {}
"""Finished share of each recording that runs in a window, by the scene's session number; for the panel."""


class _Translating(Waiting):
    """Base of operators that need the scene as F12 renders it."""

    _asked: AsRendered | None = None
    _uid = 0
    _recording: Recording | None = None
    _table: TableAhead | None = None
    _shares: changes.Shares | None = None
    _error: Exception | None = None
    _state: str | None = None
    """Settings of the scene as it was translated, or after the last edit since."""
    _set_at: float | None = None
    """Time of the last edit of these settings since the scene was translated."""

    def prepare(self, context: Context, *, at_once: bool) -> None:
        if context.scene.session_uid in _under_way:
            raise InvalidInputError("this scene is being recorded; wait for the end, or stop it with Esc")
        self._state, self._set_at = scene_state(context.scene), None
        self._asked = AsRendered(context, at_once=at_once)
        self._uid = context.scene.session_uid
        _under_way.add(self._uid)
        self._table = None if at_once else TableAhead(context.scene)

    def is_prepared(self) -> bool:
        if self._recording is not None or self._asked is None:
            return True
        if self._table is not None and not self.is_stopped and not self._table.is_ready():
            return False
        if self._asked.is_running or self._waits_for_rest():
            return False
        self._shares = self._shares or changes.Shares()
        with contextlib.suppress(SpectralError):  # the recording reads the parts again, and reports it
            return bpy.context.scene.session_uid != self._uid or self._shares.read(bpy.context.scene)
        return True

    def _waits_for_rest(self) -> bool:
        """True if the scene was edited since it was translated; it is translated again when the artist rests.

        Otherwise a recording of the earlier scene would be kept with the lights and the state of the present one.
        """
        if self._asked is None or self.is_stopped or bpy.context.scene.session_uid != self._uid:
            return False
        if not self._asked.has_scene:
            return False  # `read` raises the reason
        before, self._state = self._state, scene_state(bpy.context.scene)
        if before not in (None, self._state):
            self._set_at = time.monotonic()
        times = [edited_at for edited_at in (self._asked.edited_at, self._set_at) if edited_at is not None]
        if times and time.monotonic() - max(times) > REST_S:
            self._shares, self._set_at = None, None
            try:
                self._asked = AsRendered(bpy.context, at_once=False)
            except InvalidInputError as error:  # such as a deleted camera; `begin` raises it
                self._asked, self._error = None, error
        return bool(times)

    def read(self, context: Context, *, only_changed: bool = False) -> Recording:
        """The scene, with what else a recording needs from Blender."""
        if self._error is not None:
            raise self._error
        assert self._asked is not None
        parts = None if self._shares is None else self._shares.parts
        self._recording = Recording.of(context, self._asked.take(), only_changed=only_changed, parts=parts)
        return self._recording

    def modal(self, context: Context, event: Event) -> set[str]:
        scene = open_scene(self._uid)
        if self._recording is not None and scene is not None:  # a save may have given the .blend another name
            self._recording.path = transport_path(scene.spectral.dial)
        return super().modal(context, event)

    def leave(self) -> None:
        if self._asked is not None:
            self._asked.leave()
        if self._table is not None:
            self._table.end()
        _under_way.discard(self._uid)


class SPECTRAL_OT_dial_record(_Translating, bpy.types.Operator):
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

    def begin(self, context: Context) -> Callable[[], Recorded]:
        recording = self.read(context, only_changed=self.only_changed)
        recording.path = path_for_recording(context.scene, _under_way)
        return lambda: recorded_in_file(recording)

    def end(self, scene: Scene, answer: Recorded) -> None:
        assert self._recording is not None
        note = _keep(scene, self._recording, answer)
        changes.LIVE.request(scene)  # later: it translates the scene once more
        live.redraw_dial()
        facts = f"recorded: {scene.spectral.dial.facts}{self._recording.told}{note}{told(answer.mix.transport.notes)}"
        self.report({"WARNING" if note else "INFO"}, facts)
        if answer.unsaved is not None:  # it is recorded, and an undo takes that back
            text = "The recording is in memory: write it elsewhere with Save Transport"
            self.report({"ERROR"}, f"{answer.unsaved}. {text}")

    def refused(self, error: Exception) -> set[str]:
        if not isinstance(error, RenderCancelled):
            return super().refused(error)
        self.report({"WARNING"}, "stopped; the dial is unchanged")
        return {"CANCELLED"}

    def stop(self) -> None:
        super().stop()
        if self._recording is not None:
            self._recording.stop = True

    def progress_text(self) -> str:
        progress = 0.0 if self._recording is None else round(self._recording.progress, 2)
        left = None if self._recording is None else self._recording.left_s
        return f"{100 * progress:.0f} %" + ("" if left is None else f", about {clock(left, digits=0)} left")

    def modal(self, context: Context, event: Event) -> set[str]:
        done = super().modal(context, event)
        if event.type == "TIMER" and done == {"PASS_THROUGH"}:
            progress = 0.0 if self._recording is None else round(self._recording.progress, 2)
            if progress != recording_progress.get(self._uid):
                recording_progress[self._uid] = progress
                live.redraw_dial()
        return done

    def leave(self) -> None:
        super().leave()
        recording_progress.pop(self._uid, None)


class SPECTRAL_OT_dial_keep(WaitingForFile, bpy.types.Operator, ExportHelper):
    """Write the recorded transport to a file of your choice, which the dial then uses"""

    bl_idname = "spectral.dial_keep"
    bl_label = "Save Transport"
    bl_options = UNDOABLE
    filename_ext = ".exr"
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    def begin(self, context: Context) -> Callable[[], "LiveMix"]:
        path = require_ending(chosen_path(self.filepath))
        mix = kept_mix.live_mix(context.scene)
        return lambda: _written(path, mix)

    def end(self, scene: Scene, answer: "LiveMix") -> None:
        scene.spectral.dial.filepath = self.filepath
        kept_mix.remember(scene, answer)
        self.report({"INFO"}, f"saved {self.filepath}")


def _written(path: Path, mix: "LiveMix") -> "LiveMix":
    """Write the transport, and return a mix of it without lamps."""
    from spectral_core.render.relight.transport_file import write_transport

    write_transport(path, mix.transport)
    return kept_mix.mix_of(mix.transport)


class SPECTRAL_OT_dial_load(_Translating, WaitingForFile, bpy.types.Operator, ImportHelper):
    """Load a transport that was recorded earlier from this scene, here or by the command line"""

    bl_idname = "spectral.dial_load"
    bl_label = "Load Transport"
    bl_options = UNDOABLE
    filename_ext = ".exr"
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    def prepare(self, context: Context, *, at_once: bool) -> None:
        chosen_path(self.filepath)
        super().prepare(context, at_once=at_once)

    def begin(self, context: Context) -> Callable[[], "LiveMix"]:
        recording, path = self.read(context), chosen_path(self.filepath)
        return lambda: _read(path, recording)

    def end(self, scene: Scene, answer: "LiveMix") -> None:
        assert self._recording is not None
        scene.spectral.dial.filepath = self.filepath
        _take(scene, answer.transport, self._recording.members)
        kept_mix.remember(scene, answer)
        remember_recorded(scene, self._recording)
        _show(scene)


def _read(path: Path, recording: Recording) -> "LiveMix":
    """The transport of a file, if it is of this scene."""
    from spectral_core.render.relight.transport_file import read_transport
    from spectral_core.scene import scene_hash

    transport = read_transport(path, scene_hash=scene_hash(recording.scene))
    recording.require_grouping(transport)
    recording.identify()
    return kept_mix.mix_of(transport)


register, unregister = bpy.utils.register_classes_factory(
    (SPECTRAL_OT_dial_record, SPECTRAL_OT_dial_keep, SPECTRAL_OT_dial_load)
)
