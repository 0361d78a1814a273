# SPDX-License-Identifier: GPL-3.0-or-later
"""A process without Blender for work that follows an edit and that nobody waits for.

A thread of Blender's process would take Python from the main thread again and again, and would delay the renderer of
the views, which has a lower priority than Blender. Where the process cannot be used, the calling thread does the work.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from typing import TYPE_CHECKING, TypeVar

import bpy

from spectral_core.child import ISOLATED
from spectral_core.errors import RenderError

if TYPE_CHECKING:
    from spectral_core.explore.sweep.pool import WorkerPool

Answer = TypeVar("Answer")

NICENESS = 12
"""Added to the process's niceness: the views (8) are drawn before the answer."""
PRELUDE = f"""
import os
os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
if hasattr(os, "nice"):
    os.nice({NICENESS})
"""
"""Code that the process runs first: it uses one processor, and gives way."""


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
        from spectral_core.explore.sweep.pool import WorkerPool
        from spectral_core.render.process.interpreter import find_python

        try:
            return WorkerPool(1, command=[find_python(), *ISOLATED, "-c"], prelude=PRELUDE)
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
            threading.Thread(target=pool.shutdown, kwargs={"wait": False}, daemon=True).start()


APART = Apart()
"""The process of all palettes."""
