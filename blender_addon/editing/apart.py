# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes without Blender: one for work that follows an edit and that nobody waits for, others for that of buttons.

A thread of Blender's process would take Python from the main thread again and again, would delay the renderer of the
views, which has a lower priority than Blender, and could not be stopped. Where no process can be used, the calling
thread does the work.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, wait
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import bpy

from spectral_core.child import ISOLATED
from spectral_core.errors import RenderCancelled, RenderError

if TYPE_CHECKING:
    from spectral_core.explore.sweep.pool.executor import WorkerPool

Answer = TypeVar("Answer")

NICENESS = 12
"""Added to the process's niceness: the views (8) are drawn before the answer."""
STOP_SECONDS = 0.05
"""Time between two looks whether the work of a button was stopped."""


def _prelude(niceness: int) -> str:
    """Code that a process runs first: it uses one processor, and gives way."""
    return f"""
import os
os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
if hasattr(os, "nice"):
    os.nice({niceness})
"""


def _started(niceness: int) -> WorkerPool:
    """A process, which starts with its first work. Raises RenderError if there is no Python for it."""
    from spectral_core.explore.sweep.pool.executor import WorkerPool
    from spectral_core.render.process.interpreter import find_python

    return WorkerPool(1, command=[find_python(), *ISOLATED, "-c"], prelude=_prelude(niceness))


def _end(pool: WorkerPool) -> None:
    """End a process, and what it computes, on a thread: that waits for the end."""
    threading.Thread(target=pool.shutdown, kwargs={"wait": False}, daemon=True).start()


class Apart:
    """The process. It starts with the first call, and keeps its libraries loaded until ``end``."""

    def __init__(self) -> None:
        self._pool: WorkerPool | None = None
        self._lock = threading.Lock()
        self._has_failed = False

    def call(self, work: Callable[[], Answer]) -> Answer:
        """The result of ``work``, a partial call of a function of ``spectral_core``; threads call this, and wait.

        The errors of ``work`` are raised. Without a window it is called directly.
        """
        if bpy.app.background or (answer := self._submitted(work)) is None:
            return work()
        try:
            return answer.result()
        except (RenderError, CancelledError):  # it does not start, was killed, or is ended with the extension
            return work()

    def _submitted(self, work: Callable[[], Answer]) -> Future[Answer] | None:
        with self._lock:
            if self._pool is None and not self._has_failed:
                self._pool = self._started()
            return None if self._pool is None else self._pool.submit(work)

    def _started(self) -> WorkerPool | None:
        try:
            return _started(NICENESS)
        except RenderError as error:
            print(f"Spectral Scene: palettes are finished in Blender's process: {error}")
            self._has_failed = True
            return None

    def process_ids(self) -> list[int]:
        """Process id of the process, if it runs."""
        return [] if self._pool is None else self._pool.process_ids()

    def end(self) -> None:
        """End the process, and what it computes; the next call starts another."""
        with self._lock:
            pool, self._pool = self._pool, None
        if pool is not None:
            _end(pool)


class Stoppable:
    """Processes for the work of buttons, which ends when the artist stops it: one for each work at a time.

    One of them is kept with its libraries for the next work.
    """

    def __init__(self) -> None:
        self._idle: list[WorkerPool] = []
        self._busy: list[WorkerPool] = []
        self._lock = threading.Lock()

    def call(self, work: Callable[[], Answer], stopping: threading.Event) -> Answer:
        """The result of ``work``, a partial call of a function of ``spectral_core``; threads call this, and wait.

        The errors of ``work`` are raised. Without a window, and on the main thread, it is called directly. Raises
        RenderCancelled soon after ``stopping`` is set; then the process ends.
        """
        is_script = bpy.app.background or threading.current_thread() is threading.main_thread()
        pool = None if is_script else self._taken()
        if pool is None:
            return work()
        answer = pool.submit(work)
        while not answer.done() and not stopping.is_set():
            wait([answer], STOP_SECONDS)
        self._give_back(pool, is_done=answer.done())
        if stopping.is_set():
            raise RenderCancelled("stopped")
        try:
            return answer.result()
        except (RenderError, CancelledError):  # it does not start, or was killed
            return work()

    def _taken(self) -> WorkerPool | None:
        with self._lock:
            try:
                pool = self._idle.pop() if self._idle else _started(0)
            except RenderError:
                return None
            self._busy.append(pool)
            return pool

    def _give_back(self, pool: WorkerPool, *, is_done: bool) -> None:
        with self._lock:
            if pool in self._busy:  # else `end` has ended it
                self._busy.remove(pool)
                if is_done and not self._idle:
                    self._idle.append(pool)
                else:
                    _end(pool)

    def process_ids(self) -> list[int]:
        """Process ids of those that run."""
        return [each for pool in (*self._idle, *self._busy) for each in pool.process_ids()]

    def end(self) -> None:
        """End the processes, and what they compute."""
        with self._lock:
            pools = [*self._idle, *self._busy]
            self._idle, self._busy = [], []
        for pool in pools:
            _end(pool)


APART = Apart()
"""The process of all palettes."""
STOPPABLE = Stoppable()
"""The processes of Solve, Alternatives and Find Recipe."""


def stoppable(stopping: threading.Event) -> Callable[[Callable[[], Any]], Any]:
    """``STOPPABLE.call`` for the work of an operator that sets this event when the artist stops it."""
    return partial(STOPPABLE.call, stopping=stopping)
