# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoise pictures on a thread of low priority, one after the other, while their renderer goes on."""

from __future__ import annotations

import contextlib
import os
import queue
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spectral_core.child import memory_bytes
from spectral_core.errors import SpectralError
from spectral_core.render.denoise import Guides, Pixels, Quality, denoise

NICENESS = 15
"""Of the thread, and of the threads of the filter, which inherit it."""


@dataclass(frozen=True, slots=True, eq=False)
class Denoised:
    """The answer to one picture: its ``subject`` as given, the denoised ``pixels``, the ``seconds`` of the filter, and
    ``why`` it failed, "" without an error; the pixels are then those that were given.
    """

    subject: Any
    pixels: Pixels
    seconds: float
    why: str


class DenoiseThread:
    """A thread that starts with its first picture and ends with the process.

    ``post``: called on that thread with each answer.
    """

    def __init__(self, post: Callable[[Denoised], None]) -> None:
        self._post = post
        self._inbox: queue.SimpleQueue[tuple[Any, Pixels, Guides | None, Quality]] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self.memory = 0
        """Bytes by which this process has grown for the filter."""

    def start(self, subject: Any, pixels: Pixels, guides: Guides | None, quality: Quality) -> None:
        """Denoise ``pixels`` (height, width, 4), which nobody may change any more."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, daemon=True)
            self._thread.start()
        self._inbox.put((subject, pixels, guides, quality))

    def _run(self) -> None:
        _give_way()
        while True:
            subject, pixels, guides, quality = self._inbox.get()
            start, before, made, why = time.perf_counter(), memory_bytes(), pixels, ""
            try:
                made = denoise(np.where(np.isfinite(pixels), pixels, np.float32(0.0)), guides, quality=quality)
            except Exception as error:  # noqa: BLE001 - the picture is shown with its noise, and the view says why
                if not isinstance(error, SpectralError):
                    traceback.print_exc()
                why = str(error) or type(error).__name__
            self.memory = max(self.memory, memory_bytes() - before)
            self._post(Denoised(subject, made, time.perf_counter() - start, why))


def _give_way() -> None:
    """Lower the priority of this thread, where a system has one for each thread."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
