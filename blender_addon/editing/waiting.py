# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators whose work takes longer than a moment: a thread does it, and the artist goes on, or stops it with Esc."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import bpy
from bpy.types import Context, Event, Scene

from spectral_core.errors import InvalidInputError, RenderCancelled, SpectralError

from .deferred import open_scene
from .pauses import pause, paused_seconds
from .turn import Turn

LOOK_AGAIN_S = 0.1
"""Time between two looks whether the work of an operator is done."""
LONG_PAUSE_S = 0.03
"""Pauses of a round of Blender's events after which the next look begins no work."""
_waiting: list[Waiting] = []
"""Operators that wait at present, for the end of the extension: Blender ends them without a call."""


def clear_status(context: Context) -> None:
    """Show Blender's own hints in the status bar again; a file that is loaded may keep the workspace."""
    if context.workspace is not None:
        context.workspace.status_text_set(None)


def clear_every_status() -> None:
    """Show Blender's own hints in the status bars of all workspaces: a window may have changed to another one.

    An operator that still works in another window sets its text again with its next progress.
    """
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(None)


def is_waiting(scene: Scene, kind: type) -> bool:
    """True while an operator of this kind works for a scene."""
    return any(isinstance(each, kind) and each._scene == scene.session_uid for each in _waiting)


def end_all() -> None:
    """End every operator that waits, because the extension is disabled: nobody takes the answers."""
    for operator in list(_waiting):
        operator.abandon()


class Waiting:
    """Base of operators whose work takes longer than a moment: in a window a thread does it, and the artist goes on.

    Without a window, and for scripts that call them, the work is done at once. Esc stops them.
    """

    can_be_left = False
    """True if after Esc nobody waits for the end of the work: it writes nothing."""
    stopped_text = "stopped; nothing has changed"
    result_of = ""
    """What the answer is stored in, such as the palette: it is dropped if another operator for it has begun since."""
    _turn: Turn | None = None
    stopping: threading.Event
    """Set after Esc. Work on a thread reads this, and not the operator, which Blender may have freed."""
    _thread: threading.Thread | None = None
    _timer: Any = None
    _scene: int
    _answers: list[Any]
    _began: float
    _shown: str

    def prepare(self, context: Context, *, at_once: bool) -> None:
        """Start what ``begin`` needs, and wait for it if ``at_once``. May raise SpectralError."""

    def is_prepared(self) -> bool:
        """True as soon as ``begin`` can be called."""
        return True

    def begin(self, context: Context) -> Callable[[], Any]:
        """Read what the work needs from Blender, and return the work, which reads nothing. May raise SpectralError."""
        raise NotImplementedError

    def end(self, scene: Scene, answer: Any) -> None:
        """Store the answer. May raise SpectralError."""
        raise NotImplementedError

    def failed(self, scene: Scene) -> None:
        """Take back what ``begin`` has changed."""

    def _begin(self, context: Context) -> Callable[[], Any]:
        self._turn = None  # of a run before
        work = self.begin(context)
        self._turn = Turn(context.scene, self.result_of)
        return work

    def stop(self) -> None:
        """End early. Called by Esc, and when Blender ends the operator."""
        self.stopping.set()

    @property
    def is_stopped(self) -> bool:
        """True after Esc."""
        return self.stopping.is_set()

    def progress_text(self) -> str:
        """Text on the progress for the status bar, "" while there is none."""
        return ""

    def leave(self) -> None:
        """Give back what ``prepare`` has taken; called at the end, whatever the end is."""

    @contextmanager
    def _leaving_on_failure(self) -> Iterator[None]:
        try:
            yield
        except BaseException:  # what `prepare` has taken would be missing until Blender ends
            self.leave()
            raise

    def execute(self, context: Context) -> set[str]:
        """Do the work now."""
        self.stopping = threading.Event()
        try:
            with self._leaving_on_failure():
                self.prepare(context, at_once=True)
                work = self._begin(context)
        except (SpectralError, OSError) as error:
            return self.refused(error)
        return self._ended(context.scene, _answer_of(work))

    def invoke(self, context: Context, _event: Event) -> set[str]:
        """Start the work on a thread."""
        return self.start(context)

    def start(self, context: Context) -> set[str]:
        """Start the work on a thread as soon as it is prepared."""
        self._answers, self._scene = [], context.scene.session_uid
        self._began, self._shown, self.stopping = time.monotonic(), "", threading.Event()
        try:
            with pause(), self._leaving_on_failure():
                self.prepare(context, at_once=False)
                if self.is_prepared():
                    self._begin_on_thread(context)
        except (SpectralError, OSError) as error:
            return self.refused(error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(LOOK_AGAIN_S, window=context.window)
        manager.modal_handler_add(self)
        _waiting.append(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def _tell(self, context: Context) -> None:
        """Show the progress in the status bar, or the time so far."""
        seconds = int(time.monotonic() - self._began)
        progress = self.progress_text() or (f"{seconds} s" if seconds else "")
        label = self.bl_label  # type: ignore[attr-defined]
        text = f"{label} … {progress + '; ' if progress else ''}{'stopping' if self.is_stopped else 'Esc stops it'}"
        if text != self._shown and context.workspace is not None:
            self._shown = text
            context.workspace.status_text_set(text)

    def _begin_on_thread(self, context: Context) -> None:
        work, answers = self._begin(context), self._answers
        self._thread = threading.Thread(target=lambda: answers.append(_answer_of(work)), daemon=True)
        self._thread.start()

    def modal(self, context: Context, event: Event) -> set[str]:
        """Begin when all is prepared, and store the answer when the thread has it; stop after Esc."""
        if event.type == "ESC" and event.value == "PRESS":
            self.stop()
            self._tell(context)
            return {"RUNNING_MODAL"}
        # Blender may hand on several of its timer's events at once; what they start would be one long pause.
        if event.type != "TIMER" or paused_seconds() >= LONG_PAUSE_S:
            return {"PASS_THROUGH"}
        with pause():
            try:
                found = self._look(context)
                if found == {"PASS_THROUGH"}:
                    self._tell(context)
                return found
            except BaseException:
                if self._timer is not None:
                    self._stop(context)
                    self.leave()
                raise

    def _stop(self, context: Context) -> None:
        """Stop looking for the answer."""
        context.window_manager.event_timer_remove(self._timer)
        self._timer = None
        self._forget()
        clear_status(context)
        clear_every_status()

    def _forget(self) -> None:
        if self in _waiting:
            _waiting.remove(self)

    def abandon(self) -> None:
        """End without an answer: Blender frees the operators of a class that is removed, and calls nothing of them."""
        self.stop()
        self._forget()
        if self._timer is not None:
            bpy.context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        clear_every_status()
        self.leave()

    def _look(self, context: Context) -> set[str]:
        if not self.is_prepared():
            return {"PASS_THROUGH"}
        scene = open_scene(self._scene)
        if self._thread is None:
            try:
                if self.is_stopped:
                    raise RenderCancelled(self.stopped_text)
                if scene != context.scene:
                    raise InvalidInputError(
                        "the window shows another scene now; press the button again in the first one"
                    )
                self._begin_on_thread(context)
            except (SpectralError, OSError) as error:
                self._answers.append(error)
        is_left = self.is_stopped and self.can_be_left
        if self._thread is not None and self._thread.is_alive() and not is_left:
            return {"PASS_THROUGH"}
        self._stop(context)
        if scene is None:
            self.leave()
            return {"CANCELLED"}  # deleted in the meantime
        found = self._ended(scene, RenderCancelled(self.stopped_text) if is_left else self._answers[0])
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        return found

    def cancel(self, context: Context) -> None:
        """Blender ends the operator: another file is loaded, or the window closed. Nobody takes the answer.

        Blender calls this, too, if its dialog or file browser is closed before it has begun.
        """
        if self not in _waiting:
            return
        self.stop()
        self._forget()
        clear_status(context)
        self.leave()

    def _ended(self, scene: Scene, answer: Any) -> set[str]:
        self.leave()
        if self._turn is not None and self._turn.is_overtaken:
            return {"CANCELLED"}  # no message and no undo step: that of the later operator holds the changes of both
        if not isinstance(answer, Exception):
            try:
                self.end(scene, answer)
                return {"FINISHED"}
            except (SpectralError, OSError) as error:
                answer = error
        self.failed(scene)
        if not isinstance(answer, (SpectralError, OSError)):
            raise answer
        return self.refused(answer)

    def refused(self, error: Exception) -> set[str]:
        """Report an error, or a stop."""
        kind = "WARNING" if isinstance(error, RenderCancelled) else "ERROR"
        self.report({kind}, str(error))  # type: ignore[attr-defined]
        return {"CANCELLED"}


class WaitingForFile(Waiting):
    """A Waiting operator whose file the artist chooses in the file browser; put it before the browser's helper."""

    options: Any

    def invoke(self, context: Context, event: Event) -> set[str]:
        """Open the file browser."""
        return super(Waiting, self).invoke(context, event)  # type: ignore[misc]

    def execute(self, context: Context) -> set[str]:
        """Work on a thread after the file browser; now for a script, and after a change in Adjust Last Operation."""
        is_first = self.options.is_invoke and not self.options.is_repeat
        return self.start(context) if is_first else super().execute(context)


def _answer_of(work: Callable[[], Any]) -> Any:
    """The answer, or the error in its place, which a thread cannot pass on."""
    try:
        return work()
    except Exception as error:  # noqa: BLE001 - the caller raises it
        return error
