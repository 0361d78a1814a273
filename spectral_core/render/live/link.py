# SPDX-License-Identifier: GPL-3.0-or-later
"""The session's side of the live render process: sends scenes as changes, receives pictures, recovers from crashes."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from spectral_core.render.live.area import PixelArea, clean, delete_left
from spectral_core.render.live.in_place.changes import difference
from spectral_core.render.live.messages import AreaName, Shown
from spectral_core.render.live.running import Limits, inform, reason, send_pending
from spectral_core.render.live.view import ViewRequest
from spectral_core.render.process.interpreter import find_python
from spectral_core.render.process.renderer import ProcessEnded, Worker
from spectral_core.scene import Scene

MODULE = "spectral_core.render.live.server"
NICENESS = 8
"""Added to the process's niceness, so that pictures that are refined delay neither Blender's drawing nor a solver."""
COARSEST = 1 << 16
"""Distance of two pixels that any picture keeps."""


@dataclass
class _View:
    request: ViewRequest
    area: PixelArea
    on_news: Callable[[], None]
    shown: Shown | None = None
    is_paused: bool = False
    trouble: str = ""


class LiveLink:
    """The scenes and views of one session, and the process that renders them. Safe to use from any thread.

    The process starts with the first view. If it crashes, a new process receives every scene and view; until then
    ``trouble`` says so. ``close`` ends it.
    """

    def __init__(self, python: str | None = None) -> None:
        self._python = python
        self._lock = threading.RLock()
        self._news = threading.Condition(self._lock)
        self._worker: Worker | None = None
        self._outbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._scenes: dict[str, Scene] = {}
        self._views: dict[str, _View] = {}
        self._generation = 0
        self._limits = Limits()
        self._is_starting = self._is_closed = False
        self.restarts = 0
        """Number of restarts after a crash or excessive memory."""
        self.sent_scenes = 0
        """Number of scenes that were sent completely; all others were sent as changes."""

    def show(self, stage: str, scene: Scene) -> frozenset[str]:
        """Set the scene of a stage. Returns the fields of the scene that differ from the previous one."""
        with self._lock:
            old = self._scenes.get(stage)
            if old is scene:
                return frozenset()
            if old is None:
                self._scenes[stage] = scene
                self._post_scene(stage)
                return frozenset(("scene",))
            change = difference(old, scene)
            self._scenes[stage] = scene  # the next translation keeps its parts, which are then not compared
            if not change.is_empty:
                self._post(("change", (stage, change)))
            return frozenset((*change.items, *change.singles))

    def look(self, view: str, request: ViewRequest, on_news: Callable[[], None]) -> int:
        """Request a picture; returns its generation. ``on_news``: called from another thread after each picture."""
        with self._lock:
            self._generation += 1
            request = replace(request, generation=self._generation)
            pixels = (request.width + 8) * (request.height + 8)
            kept = self._views.get(view)
            if kept is None:
                self._views[view] = _View(request, PixelArea.make(pixels), on_news)
            elif kept.area.pixels < pixels:
                self._views[view] = _View(request, PixelArea.make(pixels), on_news, kept.shown, kept.is_paused)
                kept.area.remove()
            else:
                kept.request, kept.on_news, kept.trouble = request, on_news, ""
            if self._worker is None:
                self._start()
            else:
                self._post_view(view)
            return self._generation

    def pause(self, view: str, *, is_paused: bool) -> None:
        """Trace a view no further, and keep its picture, until it is resumed. A view without a request has no pause."""
        with self._lock:
            kept = self._views.get(view)
            if kept is not None and kept.is_paused is not is_paused:
                kept.is_paused = is_paused
                self._post(("pause", (view, is_paused)))

    def latest(self, view: str) -> Shown | None:
        """The latest picture of a view, for any of its requests."""
        with self._lock:
            return self._views[view].shown if view in self._views else None

    def trouble(self, view: str) -> str:
        """The reason why a view shows nothing new, "" if there is none."""
        with self._lock:
            return self._views[view].trouble if view in self._views else ""

    def wait(self, view: str, generation: int, seconds: float, level: int = COARSEST) -> bool:
        """Wait for a picture of ``generation`` or later whose pixels are at most ``level`` apart, or for trouble;
        False after the time limit.
        """
        end = time.monotonic() + seconds
        with self._news:
            while True:
                kept = self._views.get(view)
                if kept is None:
                    return False
                frame = None if kept.shown is None else kept.shown.frame
                if frame is not None and frame.generation >= generation and frame.level <= level:
                    return True
                left = end - time.monotonic()
                if left <= 0 or kept.trouble or self._is_closed:
                    return False
                self._news.wait(left)

    def close_view(self, view: str) -> None:
        """Stop tracing a view."""
        with self._lock:
            kept = self._views.pop(view, None)
            if kept is not None:
                kept.area.remove()
                self._post(("close", view))

    def drop(self, stage: str) -> None:
        """Remove a stage and its views."""
        with self._lock:
            self._scenes.pop(stage, None)
            for name in [name for name, kept in self._views.items() if kept.request.stage == stage]:
                self.close_view(name)
            self._post(("drop", stage))

    @property
    def process_id(self) -> int | None:
        """Process id of the renderer; None if it does not run."""
        with self._lock:
            return None if self._worker is None or not self._worker.alive else self._worker.process.pid

    def close(self) -> None:
        """End the process and delete all files."""
        with self._news:
            self._is_closed = True
            for kept in self._views.values():
                kept.area.remove()
            self._views.clear()
            worker, self._worker = self._worker, None
            self._news.notify_all()
        if worker is not None:
            worker.end()
            delete_left()

    def _post_scene(self, stage: str) -> None:
        self.sent_scenes += self._worker is not None
        self._post(("scene", (stage, self._scenes[stage])))

    def _post_view(self, name: str) -> None:
        kept = self._views[name]
        if kept.is_paused:
            self._post(("pause", (name, True)))
        self._post(("view", (name, kept.request, AreaName(kept.area.path, kept.area.pixels))))

    def _post(self, message: Any) -> None:
        if self._worker is not None:
            self._outbox.put(message)

    def _start(self) -> None:
        """Start a process on a thread: the session does not wait for it."""
        if not self._is_starting and not self._is_closed:
            self._is_starting = True
            try:
                threading.Thread(target=self._run, daemon=True).start()
            except RuntimeError as error:  # the system has no thread left
                self._not_started(error)

    def _not_started(self, error: Exception) -> None:
        """Say why no process could be started; another one would not start either, before the next change."""
        self._is_starting = False
        self._say(reason(error, "The render process could not be started; the next change tries again"))

    def _run(self) -> None:
        """Start a process, send everything to it, and read its messages until it ends."""
        try:
            clean()
            worker = Worker(self._python or find_python(), MODULE, niceness=NICENESS)
        except ProcessEnded as error:
            self._is_starting = False
            self._after_crash(None, str(error))
            return
        except Exception as error:  # noqa: BLE001 - the views say it, and the next change tries again
            self._not_started(error)
            return
        outbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
        with self._lock:
            self._is_starting = False
            if self._is_closed:
                worker.end()
                return
            self._limits.begin()
            self._worker, self._outbox = worker, outbox
            for name in self._views:  # before the scenes: those of paused views are not loaded
                self._post_view(name)
            for stage in self._scenes:
                self._post_scene(stage)
        after_crash = partial(self._after_crash, worker)
        try:
            threading.Thread(target=send_pending, args=(worker, outbox, after_crash), daemon=True).start()
            while worker is self._worker:
                message = worker.next_message(1.0)
                if message is not None:
                    self._hear(worker, *message)
        except Exception as error:  # noqa: BLE001 - the views say it
            if worker is self._worker:  # else it was ended from here, and its log is closed
                after_crash(reason(error, "the answers of the render process could not be read"))
        finally:
            outbox.put(None)

    def _hear(self, worker: Worker, kind: str, content: Any) -> None:
        if kind == "lost":  # a change could not be made to the scene of this stage
            with self._lock:
                if worker is self._worker and content in self._scenes:
                    self._post_scene(content)
            return
        kept = self._views.get(content.view)
        # without the lock: Blender's main thread would wait for the copy, and for a processor to make it
        pixels = kept.area.read(content.place) if kept is not None and kind == "frame" else None
        with self._news:
            if kept is None or worker is not self._worker or self._views.get(content.view) is not kept:
                return
            if kind == "frame":
                if pixels is None:  # another picture is there by now
                    return
                is_first = kept.shown is None or kept.shown.frame.generation < content.generation
                first = time.monotonic() if is_first or kept.shown is None else kept.shown.first
                kept.shown = Shown(pixels, content, first)
                if content.generation >= kept.request.generation:
                    kept.trouble = ""
                if content.is_done:
                    self._limits.finish()
            elif content.generation >= kept.request.generation:  # trouble; it is told anew to each request
                kept.trouble = content.message
            told = kept.on_news
            self._news.notify_all()
            too_large = kind == "frame" and self._limits.is_too_large(content.memory - content.denoiser_memory)
        inform(told)
        if too_large:
            self._replace(worker)

    def _replace(self, worker: Worker) -> None:
        """Start a new process in place of one that uses too much memory."""
        with self._lock:
            if worker is not self._worker:
                return
            self._worker = None
            self.restarts += 1
            self._start()
        worker.end()  # without the lock: the system needs a while to free its memory

    def _after_crash(self, worker: Worker | None, text: str) -> None:
        """Start another process, up to a limit; ``worker``: None if it ended before it could answer."""
        with self._news:
            if worker is not self._worker or self._is_closed:
                return
            self._worker = None
            restarts, words = self._limits.crash(text, has_answered=worker is not None)
            self._say(words)
            if restarts:
                self.restarts += 1
                self._start()
        if worker is not None:
            worker.end()

    def _say(self, text: str) -> None:
        """Report trouble to every view."""
        with self._news:
            views = list(self._views.values())
            for kept in views:
                kept.trouble = text
            self._news.notify_all()
        for kept in views:
            inform(kept.on_news)
