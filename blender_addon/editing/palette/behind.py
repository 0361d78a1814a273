# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves on a thread: the interface waits for a moment, and continues without the answer of a longer one."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.types import Scene

from ..deferred import RENDER_SECONDS

PATIENCE_SECONDS = 0.05
"""Wait for an answer that then appears without another redraw; the interface must not stop for 0.1 s."""
POLL_SECONDS = 0.02


@dataclass
class _Running:
    answer: Future[Any]
    done: Callable[[Scene, Any], None]
    then: Callable[[Scene], None] | None = None
    """Called after the answer, because something has changed since its question."""


_threads: list[ThreadPoolExecutor] = []
_running: dict[int, _Running] = {}
"""By scene; a scene has one solve at a time."""


def is_busy(scene: Scene, then: Callable[[Scene], None]) -> bool:
    """True if a solve of this scene is under way; ``then`` is called with the scene after its answer."""
    if scene.session_uid not in _running:
        return False
    _running[scene.session_uid].then = then
    return True


def run(scene: Scene, work: Callable[[], Any], done: Callable[[Scene, Any], None]) -> None:
    """Call ``done`` with the scene and the result of ``work``: now if it is fast or nobody waits, else by a timer."""
    if bpy.app.background:
        done(scene, work())
        return
    if not _threads:
        _threads.append(ThreadPoolExecutor(1, thread_name_prefix="palette"))
    answer = _threads[0].submit(work)
    wait([answer], PATIENCE_SECONDS)
    if answer.done():
        done(scene, answer.result())
        return
    _running[scene.session_uid] = _Running(answer, done)
    if not bpy.app.timers.is_registered(collect):
        bpy.app.timers.register(collect, first_interval=POLL_SECONDS)


def collect() -> float | None:
    """Hand on the answers that have arrived. Blender's timer calls this."""
    if bpy.app.is_job_running("RENDER"):
        return RENDER_SECONDS  # nothing is written while a render reads
    for uid in [uid for uid, each in _running.items() if each.answer.done()]:
        found = _running.pop(uid)
        scene = next((each for each in bpy.data.scenes if each.session_uid == uid), None)
        if scene is None:
            continue  # deleted in the meantime
        found.done(scene, found.answer.result())
        if found.then is not None:
            found.then(scene)
    return POLL_SECONDS if _running else None


def stop() -> None:
    """Wait for no answer any more."""
    _running.clear()
    if bpy.app.timers.is_registered(collect):
        bpy.app.timers.unregister(collect)
    while _threads:
        _threads.pop().shutdown(wait=False, cancel_futures=True)
