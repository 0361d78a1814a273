# SPDX-License-Identifier: GPL-3.0-or-later
"""Persistent worker processes as a ``concurrent.futures`` executor that survives their crashes.

The standard library's process pool loses every task when one process dies. Here only the task of the dead process
fails, with ``WorkerDied``, and a new process takes its place. A worker whose driver dies finishes and commits its
point, then ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from typing import Any

from spectral_core import child
from spectral_core.child.ending import Log, ended
from spectral_core.errors import RenderError
from spectral_core.render.process.messages import receive, send

MARKER = b"\x00spectral-sweep-worker\x00"
"""First line of a worker; earlier output, such as Blender's greeting, is skipped."""
PYTHON = (sys.executable, *child.ISOLATED, "-c")
"""Start of the command line of a plain worker."""
BOOTSTRAP = (
    f"import json, os, sys; sys.path[:] = json.loads(os.environ['{child.PATH_VARIABLE}']); "
    "from spectral_core.explore.sweep.pool.worker import main; main()"
)
START_LIMIT_S = 120.0
MAX_STARTS = 10
KILLED_FROM_OUTSIDE = (9, 15)
"""SIGKILL and SIGTERM: of a user, a scheduler or a system without memory."""


class WorkerDied(RenderError):
    """The process of a worker ended during a task. ``signal``: of the kill, 0 if it ended by itself."""

    def __init__(self, message: str, signal: int = 0) -> None:
        super().__init__(message)
        self.signal = signal


class WorkerPool(Executor):
    """Worker processes that keep loaded data between tasks.

    Parameters
    ----------
    workers : how many processes.
    command : command line of a worker, to which the bootstrap code is appended; this Python by default.
    threads : processor threads of each worker; None leaves it to the libraries.
    prelude : code that a worker runs first, before it takes over this process' module path.
    """

    def __init__(
        self, workers: int, *, command: Sequence[str] | None = None, threads: int | None = None, prelude: str = ""
    ) -> None:
        self._command = [*(command or PYTHON), f"{prelude}\n{BOOTSTRAP}"]
        self._threads = threads
        self._tasks: deque[_Task] = deque()
        self._wake = threading.Condition()
        self._closed = False
        self._abandoned = False
        self.workers = max(1, int(workers))
        self._slots = [threading.Thread(target=self._serve, args=(i,), daemon=True) for i in range(self.workers)]
        self._processes: list[_Process | None] = [None] * self.workers
        for slot in self._slots:
            slot.start()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """Run a function on any worker. The option ``avoid`` names a worker (by index) that should not take it."""
        avoid = options.pop("avoid", None)
        future: Future[Any] = Future()
        with self._wake:
            if self._closed:
                raise RuntimeError("the workers are shut down")
            self._tasks.append(_Task(future, (function, arguments, options), avoid if self.workers > 1 else None))
            self._wake.notify_all()
        return future

    def process_ids(self) -> list[int]:
        """Process ids of the workers that run."""
        return [each.process.pid for each in self._processes if each is not None and each.ready and each.alive]

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers: after their tasks, or at once where ``wait`` is False."""
        with self._wake:
            self._closed = True
            self._abandoned = self._abandoned or not wait
            if cancel_futures or not wait:
                for task in self._tasks:
                    task.future.cancel()
                self._tasks.clear()
            self._wake.notify_all()
            processes = [each for each in self._processes if each is not None] if not wait else []
        for process in processes:
            process.end()
        for slot in self._slots:
            slot.join()

    def _serve(self, index: int) -> None:
        """Thread of one worker: tasks one after the other, a new process after a death."""
        while True:
            task = self._next_task(index)
            if task is None:
                break
            if not task.future.set_running_or_notify_cancel():
                continue
            try:
                process = self._running(index)
                task.future.worker = index  # type: ignore[attr-defined]
                succeeded, answer = process.call(task.call)
            except BaseException as error:
                task.future.set_exception(error)
                continue
            if succeeded:
                task.future.set_result(answer)
            else:
                task.future.set_exception(answer)
        ended, self._processes[index] = self._processes[index], None
        if ended is not None:
            ended.end()

    def _next_task(self, index: int) -> _Task | None:
        with self._wake:
            while True:
                for task in self._tasks:
                    if task.avoid != index:
                        self._tasks.remove(task)
                        return task
                if self._closed and not self._tasks:
                    return None
                self._wake.wait(0.5 if self._closed else None)

    def _running(self, index: int) -> _Process:
        process = self._processes[index]
        if process is not None and process.alive:
            return process
        if process is not None:
            process.end()
        return self._started(index)

    def _started(self, index: int) -> _Process:
        """A new process; if it is killed from outside while it starts, it had no task and is started again."""
        for _ in range(MAX_STARTS - 1):
            try:
                return self._started_once(index)
            except WorkerDied as death:
                if death.signal not in KILLED_FROM_OUTSIDE or self._closed:
                    raise
        return self._started_once(index)

    def _started_once(self, index: int) -> _Process:
        """A process that is ready. It is in the list before that, so that ``shutdown`` can end it while it starts."""
        with self._wake:
            if self._abandoned:
                raise WorkerDied("the workers were shut down before the point began")
            process = self._processes[index] = _Process(self._command, self._threads)
        process.await_ready()
        return process


class _Task:
    __slots__ = ("avoid", "call", "future")

    def __init__(self, future: Future[Any], call: tuple[Any, ...], avoid: int | None) -> None:
        self.future, self.call, self.avoid = future, call, avoid


class _Process:
    """One worker process and its pipes."""

    def __init__(self, command: Sequence[str], threads: int | None) -> None:
        self._log = Log()
        self._ending = threading.Lock()
        # Swept functions may be in folders that only this process searches, such as beside a script. These folders come
        # last, so that no file in them hides a library.
        paths = [*child.trusted_path(), *(os.path.abspath(entry) for entry in sys.path)]  # noqa: PTH100
        environment = child.environment() | {child.PATH_VARIABLE: json.dumps(list(dict.fromkeys(paths)))}
        if threads is not None:
            environment |= {
                name: str(threads) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
            }
            environment["SPECTRAL_SCENE_THREADS"] = str(threads)
        try:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log.file, env=environment,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0), start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            self._log.close()
            raise RenderError(f"a worker cannot be started with {command[0]!r}: {error}") from error
        self.ready = False
        """True after its first line; tasks can be sent then."""

    def await_ready(self) -> None:
        """Wait for the first line of the process; it is ended if the line does not come."""
        try:
            self._await_marker()
            self.ready = True
        except BaseException:
            self.end()
            raise

    def _await_marker(self) -> None:
        stream, seen, late = self.process.stdout, b"", threading.Event()
        assert stream is not None

        def too_late() -> None:
            late.set()
            self.process.kill()

        timer = threading.Timer(START_LIMIT_S, too_late)
        timer.start()
        try:
            while not seen.endswith(MARKER):
                byte = b""
                with contextlib.suppress(ValueError):  # another thread has ended the process and closed its pipes
                    byte = stream.read(1)
                if not byte:
                    death = self._death("before it was ready")
                    if late.is_set():  # no kill from outside, after which it is started again
                        raise WorkerDied(f"a worker was not ready within {START_LIMIT_S:g} s{self._log.last_words()}")
                    raise death
                seen = (seen + byte)[-len(MARKER) :]
        finally:
            timer.cancel()

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    def call(self, task: tuple[Any, ...]) -> tuple[bool, Any]:
        """Send a task and wait for its answer; raises WorkerDied if the process ended."""
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            send(self.process.stdin, task)  # type: ignore[arg-type]
            return receive(self.process.stdout)  # type: ignore[arg-type]
        except (EOFError, OSError):
            raise self._death("during a point") from None
        except ValueError:
            if not (self.process.stdin.closed or self.process.stdout.closed):
                raise  # of the task itself
            raise self._death("during a point") from None  # another thread has ended the process

    def _death(self, when: str) -> WorkerDied:
        code, how = ended(self.process)
        self._kill_group()
        return WorkerDied(f"a worker {how} {when}{self._log.last_words()}", max(0, -code))

    def _kill_group(self) -> None:
        """End programs that the process has started, which would compute on for a point that nobody awaits.

        Windows has no such groups.
        """
        if hasattr(os, "killpg"):
            with contextlib.suppress(OSError):  # none is left
                os.killpg(self.process.pid, signal.SIGKILL)  # the process began a session of its own

    def end(self) -> None:
        """End the process and collect its status; two threads may call it."""
        with self._ending:
            self._end()

    def _end(self) -> None:
        if self.alive:
            self._kill_group()
            self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError, ValueError):  # ValueError: another thread closed it
                    stream.close()
        self._log.close()
