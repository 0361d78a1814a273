# SPDX-License-Identifier: GPL-3.0-or-later
"""A transport render of a Blender scene: its input, and the lights that must be rendered again."""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

import bpy
from bpy.types import Context, Scene

from spectral_core.errors import InvalidInputError, RenderCancelled, SpectralError

from ... import jobs
from ...translate.dial import storage_of
from ...translate.view_transform import view_transform_of
from . import changes, live
from .members import Member, members_of

if TYPE_CHECKING:
    from spectral_core.render import Progress
    from spectral_core.render.relight.transport import Transport
    from spectral_core.render.relight.view_transform import ViewTransform
    from spectral_core.scene import Scene as SpectralScene


@dataclass
class Recording:
    """A transport render. It reads all data from Blender before it starts, so that a thread can run it."""

    scene: Any
    storage: Any
    one_per_light: bool
    members: list[Member]
    parts: dict[str, str]
    view: ViewTransform | None
    fingerprint: Any
    kept: Any = None
    """The earlier transport if only ``again`` is recorded; None for a complete recording."""
    again: tuple[str, ...] | None = None
    progress: float = 0.0
    stop: bool = False
    transport: Any = None
    error: Exception | None = None
    thread: threading.Thread | None = field(default=None, repr=False)

    @classmethod
    def of(cls, context: Context, *, only_changed: bool = False) -> Recording:
        """Translate the scene and find its lights and emissive objects, and those that have changed."""
        from spectral_core.render.relight.groups import fingerprint

        dial, scene = context.scene.spectral.dial, _as_rendered(context)
        names = {each.name for each in (*scene.lights, *scene.instances)}
        shown = [each for each in bpy.data.objects if each.name_full in names]
        members = members_of(context.scene, shown, dial.one_per_light)
        parts, view = changes.parts_of(context.scene), view_transform_of(context.scene)
        now = fingerprint(scene, one_per_light=dial.one_per_light)
        kept, again = _kept(context.scene, now) if only_changed else (None, None)
        return cls(scene, storage_of(dial), dial.one_per_light, members, parts, view, now, kept, again)

    def run(self) -> None:
        """Render; an error is stored for the waiting thread."""
        from spectral_core.render.relight.dial import MOST_BULBS
        from spectral_core.render.relight.transport import record_transport

        try:
            self.transport = record_transport(
                self.scene, self.storage, one_per_light=self.one_per_light, most_groups=MOST_BULBS, view=self.view,
                kept=self.kept, again=self.again, render=jobs.render,
                on_progress=self._note, should_stop=lambda: self.stop,
            )  # fmt: skip
        except Exception as error:
            self.error = error

    @property
    def told(self) -> str:
        """Message about a recording that does not cover everything."""
        if self.again is None:
            return ""
        names = ", ".join(name or "ungrouped" for name in self.again)
        return f"; only {names} rendered anew" if names else "; no light had changed, so nothing was rendered"

    @property
    def is_running(self) -> bool:
        """True if the render is under way."""
        return self.thread is not None and self.thread.is_alive()

    def _note(self, progress: Progress) -> None:
        self.progress = progress.samples / progress.total


def _as_rendered(context: Context) -> SpectralScene:
    """Translate the scene for F12, which the viewport may not show: a render that stops after translation."""
    caught: list[Any] = []

    def catch(scene: SpectralScene) -> NoReturn:
        caught.append(scene)
        raise RenderCancelled("only the scene was requested")

    render = context.scene.render
    engine, render.engine = render.engine, "SPECTRAL"
    try:
        with jobs.request(jobs.RenderRequest(translated=catch)):
            bpy.ops.render.render(scene=context.scene.name)
    except RuntimeError as error:
        raise InvalidInputError(str(error).strip().removeprefix("Error: ")) from error
    finally:
        render.engine = engine
    if not caught:
        raise InvalidInputError("Blender did not start the render; is there a camera?")
    return caught[0]


def _kept(scene: Scene, now: Any) -> tuple[Transport | None, tuple[str, ...] | None]:
    """The present recording and its changed groups; None for both if all must be recorded."""
    from spectral_core.render.relight.groups import Fingerprint, changed_groups

    dial = scene.spectral.dial
    try:
        before = json.loads(dial.recorded_groups or "null")
        again = changed_groups(Fingerprint(before["rest"], before["groups"]), now)
        kept = live.live_mix(scene).transport
    except (ValueError, KeyError, TypeError, SpectralError, OSError):  # of an earlier version, or deleted
        return None, None
    if again is None or kept.storage.channel_names() != storage_of(dial).channel_names():
        return None, None
    return kept, again


def remember_recorded(scene: Scene, recording: Recording) -> None:
    """Store the hashes of the recording's inputs, to find later changes."""
    changes.remember_parts(scene, recording.parts)
    found = recording.fingerprint
    scene.spectral.dial.recorded_groups = json.dumps({"rest": found.rest, "groups": found.groups})
