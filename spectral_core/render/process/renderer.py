# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering in a separate process: a crash there becomes an error here, and the artist's session survives."""

from __future__ import annotations

import atexit
import contextlib
import queue
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core import child
from spectral_core.child.ending import Log, ended
from spectral_core.errors import RenderError
from spectral_core.render.cost.asked import is_asked
from spectral_core.render.cost.curve import CostCurve
from spectral_core.render.plan.effects import EffectPlan, plan_from_data
from spectral_core.render.process.interpreter import find_python
from spectral_core.render.process.messages import receive, send
from spectral_core.render.process.outcomes import as_error, cancelled, require_wanted
from spectral_core.render.result import Progress, RenderResult
from spectral_core.render.trace.wavelengths import Bands
from spectral_core.scene import Scene, require_scene
from spectral_core.spectra.spectrum import Spectrum

CANCEL_GRACE_S = 0.4
"""Time limit for a cancelled render to answer before its process is ended."""
START_LIMIT_S = 180.0
"""Time limit for the start of a process: a second or two, on a machine with many other programs a minute."""
_POLL_S = 0.02


class RenderProcess:
    """A render process that is restarted after a crash.

    The process starts with the first render, serves the next ones, and is restarted after a crash. Use one object from
    any thread; renders wait for each other. ``close`` or the end of a ``with`` block ends the process. ``niceness``:
    added to that of this process, so that an interface goes on while both want all processors.
    """

    def __init__(self, python: str | None = None, *, niceness: int = 0) -> None:
        self._python, self._niceness = python, niceness
        self._lock = threading.Lock()
        self._worker: Worker | None = None
        atexit.register(self.close)

    def render(
        self,
        scene: Scene,
        *,
        on_progress: Callable[[Progress], None] | None = None,
        should_stop: Callable[[], bool] | None = None,
        bands: Bands | None = None,
        groups: bool | tuple[str, ...] = False,
        sampling_lights: Sequence[Spectrum] | None = None,
    ) -> RenderResult:
        """Like ``render_scene``, in the process.

        A cancel is answered within CANCEL_GRACE_S: by the process, or by ending it. Raises RenderError if the process
        crashed or Mitsuba failed, InvalidInputError for a scene that cannot be rendered.
        """
        require_scene(scene)
        is_asked(scene.settings)
        plan = plan_from_data(scene)  # a wrong override raises before a process starts
        options = {"bands": bands, "groups": groups, "sampling_lights": sampling_lights}
        with self._lock:
            worker = self._running()
            try:
                worker.post(("render", (scene, options)))
                return self._follow(worker, (scene, plan), on_progress, should_stop)
            except BaseException:
                # after any error here, an answer may still be pending: the next render gets a new process
                if not worker.idle:
                    self._end()
                raise

    def plan(
        self, scene: Scene, tolerance: float | None = None, *, should_stop: Callable[[], bool] | None = None
    ) -> EffectPlan:
        """``plan_effects`` with its pilot, in the process. Raises the same errors, and those of ``call``."""
        plan_from_data(scene, tolerance)
        plan: EffectPlan = self.call("plan", scene, tolerance, should_stop=should_stop)
        return plan

    def cost_curve(self, scene: Scene, *, should_stop: Callable[[], bool] | None = None) -> CostCurve:
        """``cost_curve`` in the process. Raises the same errors, and those of ``call``."""
        plan_from_data(scene)
        curve: CostCurve = self.call("cost", scene, should_stop=should_stop)
        return curve

    def call(self, name: str, *arguments: Any, should_stop: Callable[[], bool] | None = None) -> Any:
        """Answer of one of the worker's ``CALLS``.

        Raises RenderError if the process crashed, RenderCancelled if ``should_stop`` was true, which ends the process.
        """
        with self._lock:
            require_wanted(should_stop)
            worker = self._running()
            try:
                worker.post(("call", (name, arguments)))
                while (message := worker.next_message(_POLL_S)) is None:
                    require_wanted(should_stop)
                worker.idle = True
                kind, content = message
                if kind == "error":
                    raise as_error(*content)
                return content
            except BaseException:
                if not worker.idle:
                    self._end()
                raise

    def _running(self) -> Worker:
        if self._worker is None or not self._worker.alive:
            self._end()
            self._worker = Worker(self._python or find_python(), niceness=self._niceness)
        return self._worker

    def _follow(
        self,
        worker: Worker,
        what: tuple[Scene, EffectPlan],
        on_progress: Callable[[Progress], None] | None,
        should_stop: Callable[[], bool] | None,
    ) -> RenderResult:
        latest = Progress(np.zeros((*what[0].film.size[::-1], 4), np.float32), 0, what[0].film.samples, 0.0)
        deadline: float | None = None
        while True:
            message = worker.next_message(_POLL_S)
            if message is not None:
                kind, content = message
                if kind == "done":
                    worker.idle = True
                    return content
                if kind == "error":
                    worker.idle = True
                    raise as_error(*content)
                if kind == "progress":
                    latest = content
                    if on_progress is not None:
                        on_progress(content)
            if deadline is None and should_stop is not None and should_stop():
                deadline = time.monotonic() + CANCEL_GRACE_S
                worker.post(("stop", None))
            if deadline is not None and time.monotonic() > deadline:
                self._end()
                return cancelled(*what, latest)

    @property
    def is_busy(self) -> bool:
        """True while it renders, plans or measures for another caller."""
        return self._lock.locked()

    @property
    def process_id(self) -> int | None:
        """Process id of the worker; None if it does not run."""
        return self._worker.process.pid if self._worker is not None and self._worker.alive else None

    def close(self) -> None:
        """End the process; the next render starts another."""
        self._end()
        atexit.unregister(self.close)

    def _end(self) -> None:
        if self._worker is not None:
            self._worker.end()
            self._worker = None

    def __enter__(self) -> RenderProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class ProcessEnded(RenderError):
    """A render process has ended: it crashed, or something killed it."""


@dataclass(frozen=True)
class _Unreadable:
    """In place of a message: the error with which reading it ended, such as MemoryError."""

    error: Exception


class Worker:
    """One process that runs ``module``, with its log and its messages; ``niceness`` is added to that of this process.

    Raises RenderError if it cannot be started or does not answer, ProcessEnded if it ends before that.
    """

    def __init__(self, python: str, module: str = "spectral_core.render.process.worker", *, niceness: int = 0) -> None:
        self.idle = True
        self._is_ended = False
        self._log = Log()
        flags = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        if niceness:
            flags |= getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)  # Windows
        try:
            self.process = subprocess.Popen(
                child.command(python, module, str(niceness)),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log.file,
                env=child.environment(),
                creationflags=flags,
            )
        except OSError as error:
            self._log.close()
            raise RenderError(f"the render process cannot be started with {python!r}: {error}") from error
        self._messages: queue.SimpleQueue[Any] = queue.SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()
        try:
            if self.next_message(START_LIMIT_S) is None:
                raise RenderError(
                    f"the render process did not answer within {START_LIMIT_S:g} s{self._log.last_words()}"
                )
        except BaseException:  # also of Ctrl-C
            self.end()
            raise

    @property
    def alive(self) -> bool:
        """True if the process still runs."""
        return self.process.poll() is None

    def _read(self) -> None:
        assert self.process.stdout is not None
        try:
            while True:
                self._messages.put(receive(self.process.stdout))  # type: ignore[arg-type]
        except (EOFError, OSError, ValueError):
            self._messages.put(None)
        except Exception as error:  # noqa: BLE001 - the thread that waits for the message raises it
            self._messages.put(_Unreadable(error))

    def post(self, message: Any) -> None:
        """Send a message; a dead process raises RenderError."""
        assert self.process.stdin is not None
        self.idle = False
        try:
            send(self.process.stdin, message)  # type: ignore[arg-type]
        except OSError:
            raise self._death() from None
        except ValueError:
            if not self._is_ended:  # otherwise the pipe is closed
                raise
            raise self._death() from None

    def next_message(self, wait_s: float) -> Any:
        """The next message, None after ``wait_s``; a dead process or an unreadable message raises RenderError."""
        try:
            message = self._messages.get(timeout=wait_s)
        except queue.Empty:
            return None
        if message is None:
            raise self._death()
        if isinstance(message, _Unreadable):
            what = f"{type(message.error).__name__}: {message.error}".rstrip(": ")
            raise RenderError(
                f"the answer of the render process could not be read ({what}); rendering again starts a new one"
            ) from message.error
        return message

    def _death(self) -> ProcessEnded:
        if self._is_ended:
            return ProcessEnded("the render process was closed before it answered; rendering again starts a new one")
        code, how = ended(self.process)
        hint = "; it may have run out of memory" if code == -9 else ""
        return ProcessEnded(
            f"the render process {how}{hint}. Nothing else is lost; rendering again starts a new one."
            f"{self._log.last_words()}"
        )

    def end(self) -> None:
        """End the process and collect it. A thread that waits for a message gets ProcessEnded."""
        self._is_ended = True
        if self.alive:
            self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):  # the remaining output has no reader
                    stream.close()
        self._log.close()
