# SPDX-License-Identifier: GPL-3.0-or-later
"""How a session runs its live render process: what is sent to it, and when another one takes its place."""

from __future__ import annotations

import queue
import time
import traceback
from collections.abc import Callable
from typing import Any

from spectral_core.errors import RenderError, SpectralError
from spectral_core.render.process.renderer import Worker

MOST_CRASHES, CRASH_SPAN_S = 3, 30.0
"""After so many crashes in this time, and no finished picture since them, only the next change restarts the process."""
MEMORY_GROWTH, MEMORY_ALLOWANCE = 3.0, 1e9
"""Factor on the memory after the first picture, and bytes: a process that exceeds both is replaced."""


class Limits:
    """The crashes of the processes of a link, and the memory of the present one."""

    def __init__(self) -> None:
        self._crashes: list[float] = []
        self._first_memory = 0

    def begin(self) -> None:
        """Note that another process has started."""
        self._first_memory = 0

    def finish(self) -> None:
        """Note that a picture is finished: crashes before it no longer count."""
        self._crashes.clear()

    def is_too_large(self, memory: int) -> bool:
        """True if a process with ``memory`` bytes is replaced."""
        self._first_memory = self._first_memory or memory
        return memory > MEMORY_GROWTH * self._first_memory + MEMORY_ALLOWANCE

    def crash(self, text: str, *, has_answered: bool) -> tuple[bool, str]:
        """Count a crash: True if another process is started at once, and the text for the views."""
        now = time.monotonic()
        self._crashes = [moment for moment in self._crashes if now - moment < CRASH_SPAN_S] + [now]
        restarts = len(self._crashes) <= MOST_CRASHES
        ending = "It is started again." if restarts else "It is tried again after the next change."
        has_more = not restarts and not has_answered and "\n" in text
        words = f" Its last words: {text.splitlines()[-1]}." if has_more else ""
        return restarts, f"{text.splitlines()[0].split('. Nothing')[0]}.{words} {ending}"


def send_pending(worker: Worker, outbox: queue.SimpleQueue[Any], on_failure: Callable[[str], None]) -> None:
    """Send messages until one is None. It has a thread: a process that compiles does not read, and nobody must wait.

    ``on_failure``: called if a message cannot be sent to a process that runs.
    """
    while (message := outbox.get()) is not None:
        try:
            worker.post(message)
        except Exception as error:  # noqa: BLE001 - the views say it
            if worker.alive and not isinstance(error, RenderError):  # else the thread that reads notices it, too
                on_failure(reason(error, f"the message {message[0]!r} could not be sent to the render process"))
                return


def reason(error: Exception, what: str) -> str:
    """The text of an error for a view. One that nobody foresaw is printed, and named after ``what`` has failed."""
    if isinstance(error, SpectralError):
        return str(error)
    traceback.print_exception(error)
    return f"{what} ({type(error).__name__}: {error})"


def inform(listener: Callable[[], None]) -> None:
    """Call a listener of a view; its error must not end the thread that reads messages."""
    try:
        listener()
    except Exception:  # noqa: BLE001 - printed, and the view is drawn after its next event
        traceback.print_exc()
