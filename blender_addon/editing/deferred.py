# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that follows an edit: at once without a window, else by a timer, so that dragging stays smooth.

Dragging a slider changes a property many times per second. A timer collects the changes and handles them together.
During a render nothing is written, because the render reads the same data.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy

from .pauses import pause

RENDER_SECONDS = 0.5
"""Time between two checks whether a render has ended."""
CONTINUE_SECONDS = 0.01
"""Time between two parts of ``finish``, in which Blender handles the artist's input."""


def open_scene(session_uid: int) -> bpy.types.Scene | None:
    """The scene with this session number; None if it was deleted, or if its file is not open any more."""
    return next((each for each in bpy.data.scenes if each.session_uid == session_uid), None)


class Deferred:
    """Handles edits of a scene later, when the artist pauses.

    Parameters
    ----------
    follow
        Called with the scene shortly after an edit; edits in the meantime are answered together.
    finish
        Called with the scene once no further edit came for ``rest_seconds``; None if ``follow`` does everything. It
        may return False to be called again soon, with the rest of its work.
    delay_seconds
        Time from an edit to ``follow``.
    rest_seconds
        Time without an edit until ``finish``.
    """

    def __init__(
        self,
        follow: Callable[[bpy.types.Scene], None],
        finish: Callable[[bpy.types.Scene], bool | None] | None = None,
        *,
        delay_seconds: float,
        rest_seconds: float = 0.0,
    ) -> None:
        self._follow, self._finish = follow, finish
        self._delay, self._rest = delay_seconds, rest_seconds
        self._timer = self.tick  # Blender identifies a timer by its object, and a bound method is a new one each time
        self._edited: set[int] = set()
        self._unfinished: set[int] = set()

    def request(self, scene: bpy.types.Scene) -> None:
        """Handle an edit of ``scene``: now without a window, else after the delay."""
        if bpy.app.background:
            self._follow(scene)
            if self._finish is not None:
                while self._finish(scene) is False:
                    pass
            return
        # A pending edit is not delayed again, so that results appear during a drag. An opened file ends the timers.
        if not self._edited or not bpy.app.timers.is_registered(self._timer):
            self._unregister()
            bpy.app.timers.register(self._timer, first_interval=self._delay)
        self._edited.add(scene.session_uid)

    def is_pending(self, scene: bpy.types.Scene) -> bool:
        """True if an edit of ``scene`` waits to be handled or finished."""
        return scene.session_uid in self._edited | self._unfinished

    def tick(self) -> float | None:
        """Handle pending edits first; after a pause, finish their scenes. Blender's timer calls this."""
        if bpy.app.is_job_running("RENDER"):
            return RENDER_SECONDS
        with pause(of_timer=True):
            return self._handle()

    def _handle(self) -> float | None:
        if self._edited:
            for scene in _taken(self._edited):
                self._follow(scene)
                if self._finish is not None:
                    self._unfinished.add(scene.session_uid)
            return self._rest if self._unfinished else None
        for scene in _taken(self._unfinished):
            if self._finish is not None and self._finish(scene) is False:
                self._unfinished.add(scene.session_uid)
        return CONTINUE_SECONDS if self._unfinished else None

    def flush(self, scene: bpy.types.Scene) -> None:
        """Handle a pending edit of ``scene`` now. Called before Blender draws the edit, it saves a redraw."""
        if scene.session_uid not in self._edited or bpy.app.is_job_running("RENDER"):
            return
        self._edited.discard(scene.session_uid)
        self._unregister()
        if self._finish is not None:
            self._unfinished.add(scene.session_uid)
        if self._edited or self._unfinished:
            bpy.app.timers.register(self._timer, first_interval=self._delay if self._edited else self._rest)
        self._follow(scene)

    def cancel(self) -> None:
        """Drop all pending edits."""
        self._edited.clear()
        self._unfinished.clear()
        self._unregister()

    def _unregister(self) -> None:
        if bpy.app.timers.is_registered(self._timer):
            bpy.app.timers.unregister(self._timer)


def _taken(waiting: set[int]) -> list[bpy.types.Scene]:
    """Pending scenes that still exist; the set is emptied. The session's number does not change with the name."""
    scenes = [scene for scene in bpy.data.scenes if scene.session_uid in waiting]
    waiting.clear()
    return scenes


def redraw(*area_types: str) -> None:
    """Repaint every area of these types, in every window."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in area_types:
                area.tag_redraw()
