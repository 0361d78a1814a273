# SPDX-License-Identifier: GPL-3.0-or-later
"""Run work on a thread: the interface waits for it for a moment; the answer of longer work comes later."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.types import Scene

from .deferred import RENDER_SECONDS, open_scene
from .pauses import pause, paused_seconds

PATIENCE_SECONDS = 0.045
"""Wait for an answer that then appears without another redraw, which takes longer than most answers. The interface must
not stop for 0.1 s, the views wait for their pictures within the same time, and on a machine whose processors are all at
work a wait ends later than it should.
"""
POLL_SECONDS = 0.02


@dataclass
class _Running:
    answer: Future[Any]
    done: Callable[[Scene, Any], None]
    then: Callable[[Scene], None] | None = None
    """Called after the answer, because something has changed since its question."""


class Behind:
    """One thread, with at most one work for each scene. ``name``: of the thread."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._threads: list[ThreadPoolExecutor] = []
        self.running: dict[int, _Running] = {}
        """By session number of the scene."""
        self._is_collecting = False
        self._timer = self.collect  # Blender identifies a timer by its object

    def is_busy(self, scene: Scene, then: Callable[[Scene], None]) -> bool:
        """True if work for this scene is under way; ``then`` is called with the scene after its answer."""
        if scene.session_uid not in self.running:
            return False
        self.running[scene.session_uid].then = then
        return True

    def drop(self, scene: Scene) -> None:
        """Ignore the answer for a scene that has not arrived yet."""
        self.running.pop(scene.session_uid, None)

    def run(
        self,
        scene: Scene,
        work: Callable[[], Any],
        done: Callable[[Scene, Any], None],
        *,
        patience_seconds: float = PATIENCE_SECONDS,
    ) -> None:
        """Call ``done`` with the scene and the result of ``work``: now if it is fast or nobody waits, else later.

        ``work`` reads nothing from Blender and raises nothing. ``patience_seconds``: time to wait for it.
        """
        if bpy.app.background:
            done(scene, work())
            return
        if not self._threads:
            self._threads.append(ThreadPoolExecutor(1, thread_name_prefix=self._name))
        answer = self._threads[0].submit(work)
        if not self._is_collecting:  # otherwise the timer that collects answers runs and comes back soon
            with pause():
                wait([answer], max(0.0, patience_seconds - paused_seconds()))
        if answer.done():
            done(scene, answer.result())
            return
        self.running[scene.session_uid] = _Running(answer, done)
        if not bpy.app.timers.is_registered(self._timer):
            bpy.app.timers.register(self._timer, first_interval=POLL_SECONDS)

    def collect(self) -> float | None:
        """Hand on the answers that have arrived. Blender's timer calls this."""
        if bpy.app.is_job_running("RENDER"):
            return RENDER_SECONDS  # nothing is written while a render reads
        for uid in [uid for uid, each in self.running.items() if each.answer.done()]:
            found = self.running.pop(uid)
            scene = open_scene(uid)
            if scene is None:
                continue  # deleted in the meantime
            try:
                found.done(scene, found.answer.result())
                self._is_collecting = True
                if found.then is not None:
                    found.then(scene)
            except Exception:  # noqa: BLE001 - Blender would end the timer, and other scenes would wait without end
                traceback.print_exc()
            finally:
                self._is_collecting = False
        return POLL_SECONDS if self.running else None

    def stop(self) -> None:
        """Wait for no answer any more."""
        self.running.clear()
        if bpy.app.timers.is_registered(self._timer):
            bpy.app.timers.unregister(self._timer)
        while self._threads:
            self._threads.pop().shutdown(wait=False, cancel_futures=True)
