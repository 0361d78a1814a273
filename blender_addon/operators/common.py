# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that several operators share."""

import functools
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
from bpy.types import Context, Event, Operator, PropertyGroup, Scene

from spectral_core.errors import InvalidInputError, SpectralError

from .. import compat
from ..editing.deferred import open_scene
from ..editing.pauses import pause, paused_seconds
from ..translate.spectra.stored import library_of

Execute = Callable[[Any, Context], set[str] | None]
"""``execute`` of an operator; returns None if it finished."""
UNDOABLE = {"REGISTER", "UNDO"}
LOOK_AGAIN_S = 0.1
"""Time between two looks whether the work of an operator is done."""
LONG_PAUSE_S = 0.03
"""Pauses of a round of Blender's events after which the next look begins no work."""


def reporting(execute: Execute) -> Callable[[Any, Context], set[str]]:
    """Report an error of this project as one line to the artist, and cancel the operator."""

    @functools.wraps(execute)
    def reported(self: Operator, context: Context) -> set[str]:
        try:
            return execute(self, context) or {"FINISHED"}
        except (SpectralError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return reported


def with_menu_entry(
    classes: Sequence[type], draw_menu: Callable[[Any, Context], None]
) -> tuple[Callable[[], None], Callable[[], None]]:
    """``register`` and ``unregister`` of operators with an entry in the context menu of every control."""
    register_classes, unregister_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        register_classes()
        bpy.types.UI_MT_button_context_menu.append(draw_menu)

    def unregister() -> None:
        bpy.types.UI_MT_button_context_menu.remove(draw_menu)
        unregister_classes()

    return register, unregister


def palette_shown(context: Context) -> PropertyGroup:
    """The palette of the scene in the window, to read it."""
    return context.scene.spectral.palette


def palette_in(context: Context) -> PropertyGroup:
    """The palette of the scene in the window, to change it. Raises InvalidInputError if the scene is linked."""
    scene = context.scene
    if not compat.is_editable(scene):
        source = bpy.path.basename(library_of(scene).filepath)
        raise InvalidInputError(
            f"scene {scene.name!r} is linked from {source}, and Blender does not keep changes of its palette; open "
            f"{source}, or press New Scene ▸ Full Copy and work in the copy"
        )
    return palette_shown(context)


def require_index(what: str, index: int, count: int) -> int:
    """``index`` if 0 <= index < count; else raises InvalidInputError."""
    if not 0 <= index < count:
        raise InvalidInputError(f"there is no {what} {index}; there are {count}, counted from 0")
    return index


def add_or_remove(rows: Any, index: int, what: str) -> None:
    """Add a row to a collection if ``index`` is -1, else remove that row. Raises InvalidInputError for an invalid
    index.
    """
    if index < 0:
        rows.add()
    else:
        rows.remove(require_index(what, index, len(rows)))


def chosen_path(filepath: str) -> Path:
    """The path argument of an operator. Raises InvalidInputError if it is empty, or beside a .blend without a place."""
    if not filepath.strip():
        raise InvalidInputError("no file is chosen; give its path as filepath=…")
    if filepath.startswith("//") and not bpy.data.filepath:
        raise InvalidInputError(
            f"{filepath} is beside the .blend file, which was never saved; save it first, or give a full path"
        )
    return Path(bpy.path.abspath(filepath)).absolute()  # Blender itself cannot write to a path of the current folder


def clear_status(context: Context) -> None:
    """Show Blender's own hints in the status bar again; a file that is loaded may keep the workspace."""
    if context.workspace is not None:
        context.workspace.status_text_set(None)


class Waiting:
    """Base of operators whose work takes longer than a moment: in a window a thread does it, and the artist goes on.

    Without a window, and for scripts that call them, the work is done at once.
    """

    _thread: threading.Thread | None = None
    _timer: Any = None
    _scene: int
    _answers: list[Any]

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

    def leave(self) -> None:
        """Give back what ``prepare`` has taken; called at the end, whatever the end is."""

    def execute(self, context: Context) -> set[str]:
        """Do the work now."""
        try:
            self.prepare(context, at_once=True)
            work = self.begin(context)
        except (SpectralError, OSError) as error:
            self.leave()
            return self.refused(error)
        except BaseException:
            self.leave()
            raise
        return self._ended(context.scene, _answer_of(work))

    def invoke(self, context: Context, _event: Event) -> set[str]:
        """Start the work on a thread."""
        return self.start(context)

    def start(self, context: Context) -> set[str]:
        """Start the work on a thread as soon as it is prepared."""
        self._answers, self._scene = [], context.scene.session_uid
        try:
            with pause():
                self.prepare(context, at_once=False)
                if self.is_prepared():
                    self._begin_on_thread(context)
        except (SpectralError, OSError) as error:
            self.leave()
            return self.refused(error)
        except BaseException:
            self.leave()
            raise
        manager = context.window_manager
        self._timer = manager.event_timer_add(LOOK_AGAIN_S, window=context.window)
        manager.modal_handler_add(self)
        context.workspace.status_text_set(f"{self.bl_label} …")  # type: ignore[attr-defined]
        return {"RUNNING_MODAL"}

    def _begin_on_thread(self, context: Context) -> None:
        work, answers = self.begin(context), self._answers
        self._thread = threading.Thread(target=lambda: answers.append(_answer_of(work)), daemon=True)
        self._thread.start()

    def modal(self, context: Context, event: Event) -> set[str]:
        """Begin when all is prepared, and store the answer when the thread has it."""
        # Blender may hand on several of its timer's events at once; what they start would be one long pause.
        if event.type != "TIMER" or paused_seconds() >= LONG_PAUSE_S:
            return {"PASS_THROUGH"}
        with pause():
            try:
                return self._look(context)
            except BaseException:  # what `prepare` has taken would be missing until Blender ends
                if self._timer is not None:
                    self._stop(context)
                    self.leave()
                raise

    def _stop(self, context: Context) -> None:
        """Stop looking for the answer."""
        context.window_manager.event_timer_remove(self._timer)
        self._timer = None
        clear_status(context)

    def _look(self, context: Context) -> set[str]:
        if not self.is_prepared():
            return {"PASS_THROUGH"}
        scene = open_scene(self._scene)
        if self._thread is None:
            try:
                if scene != context.scene:
                    raise InvalidInputError(
                        "the window shows another scene now; press the button again in the first one"
                    )
                self._begin_on_thread(context)
            except (SpectralError, OSError) as error:
                self._answers.append(error)
        if self._thread is not None and self._thread.is_alive():
            return {"PASS_THROUGH"}
        self._stop(context)
        if scene is None:
            self.leave()
            return {"CANCELLED"}  # deleted in the meantime
        found = self._ended(scene, self._answers[0])
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        return found

    def cancel(self, context: Context) -> None:
        """Blender ends the operator: another file is loaded, or the window closed. Nobody takes the answer."""
        clear_status(context)
        self.leave()

    def _ended(self, scene: Scene, answer: Any) -> set[str]:
        self.leave()
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
        """Report an error."""
        self.report({"ERROR"}, str(error))  # type: ignore[attr-defined]
        return {"CANCELLED"}


class WaitingForFile(Waiting):
    """A Waiting operator whose file the artist chooses in the file browser; put it before the browser's helper."""

    options: Any

    def invoke(self, context: Context, event: Event) -> set[str]:
        """Open the file browser."""
        return super(Waiting, self).invoke(context, event)  # type: ignore[misc]

    def execute(self, context: Context) -> set[str]:
        """Work on a thread after the file browser, now for a script."""
        return self.start(context) if self.options.is_invoke else super().execute(context)


def _answer_of(work: Callable[[], Any]) -> Any:
    """The answer, or the error in its place, which a thread cannot pass on."""
    try:
        return work()
    except Exception as error:  # noqa: BLE001 - the caller raises it
        return error
